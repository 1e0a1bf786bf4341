/* Facets in a point's frame: for bound.c and bound_look.c. */
#ifndef PSR_DPOINT_BOUND_SEEN_H
#define PSR_DPOINT_BOUND_SEEN_H

#include "bound.h"

struct bound_seen {
	double corner[3][3], side[3][3], per_side[3]; /* side i is from corner i to the next; 1 / its square, or 0 */
	double normal[3], per_normal;                 /* likewise; 0 for slivers */
	double low[3], high[3];
};

/* The least and greatest height of the quadric over a box. */
void bound_rise(double w[2], const struct bound_view *view, const double low[2], const double high[2]);

/* Whether the facet's box and another one are further apart than `far` along an axis. */
int bound_is_apart(const struct bound_seen *seen, const double low[3], const double high[3], double far);

/* The square of a place's distance from the facet. */
double bound_distance2(const struct bound_seen *seen, const double p[3]);

#endif

/* Facets in a point's frame: for bound.c and bound_look.c. */
#ifndef PSR_DPOINT_BOUND_SEEN_H
#define PSR_DPOINT_BOUND_SEEN_H

#include "bound.h"

/* Two numbers, which the compiler has a register for on any machine that has some. */
typedef double bound_pair __attribute__((vector_size(16)));
typedef int64_t bound_pair_if __attribute__((vector_size(16))); /* of a comparison: -1 or 0 */

/* A box: x and y of the low corner, its z and that of the high one, x and y of the high one; the high one's with the
 * other sign, so that of two boxes that meet all numbers of one are at most those of the other, turned. */
struct bound_box {
	bound_pair side[3];
};

static inline void bound_box_set(struct bound_box *box, const double low[3], const double high[3])
{
	box->side[0] = (bound_pair){ low[0], low[1] };
	box->side[1] = (bound_pair){ low[2], -high[2] };
	box->side[2] = (bound_pair){ -high[0], -high[1] };
}

/* What boxes that are no further than `far` from one along each axis have at most. */
static inline void bound_box_reach(struct bound_box *reach, const double low[3], const double high[3], double far)
{
	reach->side[0] = (bound_pair){ high[0] + far, high[1] + far };
	reach->side[1] = (bound_pair){ high[2] + far, far - low[2] };
	reach->side[2] = (bound_pair){ far - low[0], far - low[1] };
}

static inline int bound_is_apart(const struct bound_box *box, const struct bound_box *reach)
{
	const bound_pair_if is_near = (box->side[0] <= reach->side[0]) & (box->side[1] <= reach->side[1]) &
	                              (box->side[2] <= reach->side[2]);

	return (is_near[0] & is_near[1]) == 0;
}

struct bound_seen {
	struct bound_box box;
	/* Planes through the sides, across the facet, which places beyond are below, and the facet's own, whose normal is of
	 * unit length: x, y, z, and what makes sums 0 on them. All is below those of slivers. */
	bound_pair plane[2][4];
	double corner[3][3], side[3][3], per_side[3]; /* side i is from corner i to the next; 1 / its square, or 0 */
};

/* The least and greatest height of the quadric over a box. */
void bound_rise(double w[2], const struct bound_view *view, const double low[2], const double high[2]);

/* The square of a place's distance from the facet. */
double bound_distance2(const struct bound_seen *seen, const double p[3]);

#endif

/* Whether what is drawn for a point stays near the source surface: a proof, not a sample. */
#ifndef PSR_DPOINT_BOUND_H
#define PSR_DPOINT_BOUND_H

#include "dpoint.h"
#include "facets.h"

/* What packing in a group's box adds to the distance of a drawn place from the surface, inner units. dpoint_pack()
 * moves a candidate's place by half a step of a box of DPOINT_MOST_BOX and 2^-22 of its coordinates on each axis, so by
 * sqrt(3) (0.16 / 4095 / 2 + 2^-22 1.1) = 3.43e-5 in all, and changes nothing else: candidates are as they come from a
 * word. Facets' corners are rounded to floats, 1e-7 in all; arithmetic here is in doubles. Frames compute places in
 * floats, of lengths below 1: some 1e-6. */
#define BOUND_PACKING 3.55e-5

/* A point's frame with the facets around it. Zeros are a view of nothing. */
struct bound_seen;
struct bound_view {
	struct bound_seen *seen;
	uint32_t *list;             /* a stack of numbers of seen facets */
	size_t n_seen, seen_room, n_list, list_room;
	double at[3], axis[3][3], a, b; /* the quadric is w = (a u^2 + b v^2) / 2 */
	double far;                 /* from it, facets are not all here */
	int is_failed;              /* no memory: answers are 0 */
};

/* Collects the facets that are within `far` of the point's quadric over |u| <= extent[0], |v| <= extent[1]. MEMORY; the
 * caller calls bound_view_fini() even then. A view may look again. */
int bound_look(struct bound_view *view, const struct facets *facets, const struct dpoint *point, const float extent[2],
               double far);
void bound_view_fini(struct bound_view *view);

/* Returns 1 only if each place of the quadric over the extents, which are at most those looked at, is within `error` of
 * a facet; error is at most `far`. 0 may be wrong where the greatest distance is within some 3 % of it. Then, unless
 * NULL, place gets u and v of a place that is too far off, or about. */
int bound_holds(struct bound_view *view, const float extent[2], double error, double place[2]);

/* The same answer, sooner where it is 1. */
int bound_likely_holds(struct bound_view *view, const float extent[2], double error);

/* Returns a distance that bound_holds() is 1 for, and is not for half of it; or `least`. INFINITY where there are no
 * facets, or no memory. */
double bound_least(struct bound_view *view, const struct facets *facets, const struct dpoint *point,
                   const float extent[2], double least);

#endif

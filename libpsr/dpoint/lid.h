/* A kept rectangle, less the slack, as rays meet it. */
#ifndef PSR_DPOINT_LID_H
#define PSR_DPOINT_LID_H

#include "rectangle.h"

/* Cosine to the surface's normal of the flattest rays from in front that are looked at: they graze it at 20 degrees. */
#define LID_LEAST_COSINE 0.35f

struct lid {
	struct rectangle rectangle;
	float graze; /* that slanted rays may count on (dpoint_graze_by()) */
	float reach; /* how far from the rectangle's place a ray may meet it */
	int is_two_sided;
};

void lid_make(struct lid *lid, const struct dpoint_candidate *candidate, const struct dpoint_cover_options *options);

/* The corners of its plane, for a tree of lids; the cell has nothing else. */
void lid_corners(struct dpoint_cell *cell, const struct lid *lid);

/* Whether it stops each ray to the place p, in its rectangle's frame, whose cosine to `normal` is at least `flattest`:
 * its quadric is so near to the place, leans so little and is so nearly flat there that all of them meet it well within
 * its sides. `behind`: as for lid_stops. */
int lid_stops_all(const struct lid *lid, const float p[3], const float normal[3], float flattest, float behind);

/* Returns 0 only where the ray from direction `from`, of unit length, to a place passes too far aside to meet the lid, or
 * does so further than `behind` after the place. away: the place, less the rectangle's. */
static inline int lid_may_stop(const struct lid *lid, const float away[3], const float from[3], float behind)
{
	const float along = v3f_dot(away, from), away2 = v3f_dot(away, away);

	return away2 - along * along <= lid->reach * lid->reach + 1e-6f * away2 && along <= behind + lid->reach;
}

/* Whether it is in the way of the ray that comes from direction `from` to the place p, in its rectangle's frame, or
 * stops it at most `behind` after the place. */
int lid_stops(const struct lid *lid, const float p[3], const float from[3], float behind);

#endif

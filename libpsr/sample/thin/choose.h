/* Which samples stand for the thin things in a cube of space: of all that may be kept there, the ones that cover most
 * of the places that lack one come first (the greedy algorithm for set cover: Chvatal 1979). */
#ifndef PSR_SAMPLE_THIN_CHOOSE_H
#define PSR_SAMPLE_THIN_CHOOSE_H

#include <stdint.h>
#include "sample/level.h"

/* A hit that may be kept, or a lattice point that may get one. */
struct thin_candidate {
	struct level_ref ref; /* at.patch: SHEET_NONE if there is no hit, */
	struct lattice_point at; /* and then where it would be, */
	float z;                 /* in projection space, */
	uint32_t surface;        /* and of what */
	float position[3];
	uint32_t first, end; /* of what it covers, while it is chosen from */
};

struct thin_candidates {
	struct thin_candidate *candidate;
	uint32_t n, capacity;
};

/* free() list->candidate. MEMORY. */
int thin_candidates_add(struct thin_candidates *list, const struct thin_candidate *candidate);

/* Moves a place to the nearest lattice point of projection q, if that is near enough and the place's face not seen
 * edge-on. MEMORY. */
int thin_candidates_move(struct thin_candidates *list, const struct level *level, const struct surface_spot *spot,
                         unsigned q);

/* Leaves those in the list that are chosen, in their order, and those in front of spot[], of *n, that none covers.
 * radius: cover_is_sheet_near()'s. MEMORY. */
int thin_choose(struct thin_candidates *list, struct surface_spot *spot, size_t *n, double radius);

#endif

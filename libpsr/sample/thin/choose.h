/* Chooses samples for the thin things in a cube of space by greedy set cover (Chvatal 1979): the candidate that covers
 * most uncovered places comes first. */
#ifndef PSR_SAMPLE_THIN_CHOOSE_H
#define PSR_SAMPLE_THIN_CHOOSE_H

#include "sample/project/sheet.h"
#include "sample/visible/places.h"

/* A hit to keep, or a lattice point to add one at. */
struct thin_candidate {
	struct sample_ref ref; /* at.patch: SHEET_NONE if there is no hit, */
	struct lattice_point at; /* at.patch: SHEET_NONE if there is no hit */
	float z;                 /* where the new sample would be */
	uint32_t surface;        /* the surface that it samples */
	float position[3];
	uint32_t first, end; /* of its places, while the search runs */
};

struct thin_candidates {
	struct thin_candidate *candidate;
	uint32_t n, capacity;
};

/* free() list->candidate. MEMORY. */
int thin_candidates_add(struct thin_candidates *list, const struct thin_candidate *candidate);

/* Adds a place moved to the nearest lattice point of projection q, of these sheets, unless that is beyond 0.4 ds or
 * sees the face edge-on. MEMORY. */
int thin_candidates_move(struct thin_candidates *list, const struct sheets *sheets, unsigned q,
                         const struct place *place, double ds);

/* Leaves the chosen candidates in the list, in their order, and the uncovered ones of *n places in front. radius:
 * kept_covers_sheet()'s. MEMORY. */
int thin_choose(struct thin_candidates *list, struct place *place, size_t *n, double radius);

#endif

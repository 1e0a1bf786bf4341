/* Which samples stand for the thin things in a cube of space: of all that may be kept there, the ones that cover most
 * of the places that lack one come first (the greedy algorithm for set cover: Chvatal 1979). */
#ifndef PSR_SAMPLE_THIN_CHOOSE_H
#define PSR_SAMPLE_THIN_CHOOSE_H

#include "sample/project/sheet.h"
#include "sample/visible/places.h"

/* A hit that may be kept, or a lattice point that may get one. */
struct thin_candidate {
	struct sample_ref ref; /* at.patch: SHEET_NONE if there is no hit, */
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

/* Moves a place to the nearest lattice point of projection q, whose sheets these are, if that is within 0.4 ds and the
 * place's face not seen edge-on. MEMORY. */
int thin_candidates_move(struct thin_candidates *list, const struct sheets *sheets, unsigned q,
                         const struct place *place, double ds);

/* Leaves those in the list that are chosen, in their order, and those in front of place[], of *n, that none covers.
 * radius: kept_covers_sheet()'s. MEMORY. */
int thin_choose(struct thin_candidates *list, struct place *place, size_t *n, double radius);

#endif

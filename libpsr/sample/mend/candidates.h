/* What could cover a place of the surface, and what that costs, in samples: a lattice triangle, a single hit, or a
 * sample that is moved to a lattice point. Finding offers changes nothing, so that threads can look for many places at
 * once; taking them is for one place after the other, as what one adds may cover the next. */
#ifndef PSR_SAMPLE_MEND_CANDIDATES_H
#define PSR_SAMPLE_MEND_CANDIDATES_H

#include <stdint.h>
#include "sample/level.h"

#define OFFER_TRIES 10    /* projections, by how well they face a place: of these */
#define OFFER_TRIANGLES 3 /* so many are asked for triangles */

/* Lattice points of one projection; what there costs beside new blocks. */
struct offer {
	unsigned projection;
	float cost;
	struct sheet_ref ref[3];
};

struct offer_snap {
	unsigned projection;
	float cost, z; /* projection space */
	struct lattice_point at;
};

struct offers {
	int n_triangles, n_hits, n_snaps;
	struct offer triangle[OFFER_TRIANGLES]; /* small ones on which the place is; */
	struct offer hit[3 * OFFER_TRIES];      /* ref[0]: within half a pixel; */
	struct offer_snap snap[3 * OFFER_TRIES];
	/* all by how well their projections face the place */
};

/* Whether a place is covered. Any number of threads may ask. */
int offer_is_covered(const struct level *level, const struct surface_spot *spot);

/* Any number of threads may look. */
void offer_find(const struct level *level, const struct surface_spot *spot, struct offers *offers);

/* The same of a place that is not covered; returns 1 of one that is, without offers. */
int offer_look(const struct level *level, const struct surface_spot *spot, struct offers *offers);

/* The same as offer_is_covered() if the level has no new hits since the offers were found. */
int offer_is_superfluous(const struct level *level, const struct surface_spot *spot, const struct offers *offers);

/* Keeps what covers a place at the least cost; *is_left tells that this is above `most`, and nothing was kept.
 * MEMORY. */
int offer_take(struct level *level, const struct surface_spot *spot, const struct offers *offers, float most,
               int *is_left);

/* Counts a place for each patch that could cover it: of those that are not kept yet, the most wanted are opened. */
void offer_ask(struct level *level, const struct offers *offers);

#endif

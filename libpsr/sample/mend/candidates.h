/* Candidates to cover a place, at a cost in samples: a lattice triangle, a single hit, or a sample moved to a lattice
 * point. Finding them changes nothing and runs in threads. Taking them is sequential: one place's samples may cover
 * the next. */
#ifndef PSR_SAMPLE_MEND_CANDIDATES_H
#define PSR_SAMPLE_MEND_CANDIDATES_H

#include "sample/own/keep.h"
#include "sample/visible/places.h"

#define CANDIDATE_TRIES 10    /* projections, by how well they face a place */
#define CANDIDATE_TRIANGLES 3 /* so many are asked for triangles */

/* Lattice points of one projection; their cost beside that of new blocks. */
struct candidate {
	unsigned projection;
	float cost;
	struct sheet_ref ref[3];
};

struct candidate_move {
	unsigned projection;
	float cost, z; /* projection space */
	struct lattice_point at;
};

/* By how well their projections face the place. */
struct candidates {
	int n_triangles, n_hits, n_moves;
	struct candidate triangle[CANDIDATE_TRIANGLES]; /* small ones on which the place is; */
	struct candidate hit[3 * CANDIDATE_TRIES];      /* ref[0]: within half a pixel; */
	struct candidate_move move[3 * CANDIDATE_TRIES];
};

/* Whether a place is covered: it lies in a lattice triangle of kept samples with sides of at most a pixel ([G] 4.3:
 * some of its corners is in whichever pixel is centred there), or within half a pixel of a kept sample. Any number of
 * threads may ask. */
int candidates_cover(const struct keeper *keeper, const struct field *field, const struct place *place);

/* Any number of threads may look. */
void candidates_find(struct candidates *candidates, const struct keeper *keeper, const struct field *field,
                     const struct place *place);

/* The same of a place that is not covered; returns 1 of one that is, without candidates. */
int candidates_look(struct candidates *candidates, const struct keeper *keeper, const struct field *field,
                    const struct place *place);

/* Whether a place is covered by now, if no new hits were added since its candidates were found. */
int candidates_are_superfluous(const struct candidates *candidates, const struct keeper *keeper,
                               const struct place *place);

/* Keeps what covers a place at the least cost; *is_left: that is above `most`, and nothing was kept. MEMORY. */
int candidates_take(const struct candidates *candidates, const struct keeper *keeper, const struct place *place,
                    float most, int *is_left);

/* Counts a place for each patch that could cover it: of those without kept samples, the most wanted are opened. */
void candidates_want(const struct candidates *candidates, const struct keeper *keeper);

#endif

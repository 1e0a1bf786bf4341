/* Candidates to cover a place, at a cost in samples: a lattice triangle, a single hit, or a sample moved to a lattice
 * point. Finding them changes nothing and runs in threads. Taking them is sequential: one place's samples may cover
 * the next. */
#ifndef PSR_SAMPLE_MEND_CANDIDATES_H
#define PSR_SAMPLE_MEND_CANDIDATES_H

#include "sample/own/keep.h"
#include "sample/visible/places.h"

#define CANDIDATE_TRIES 10    /* projections, by how well they face a place */
#define CANDIDATE_TRIANGLES 3 /* only the first so many are searched for triangles */

/* Lattice points of one projection, and their cost without new blocks. */
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

/* In each list, projections that face the place better come first. */
struct candidates {
	int n_triangles, n_hits, n_moves;
	struct candidate triangle[CANDIDATE_TRIANGLES]; /* small ones on which the place is; */
	struct candidate hit[3 * CANDIDATE_TRIES];      /* ref[0]: within half a pixel; */
	struct candidate_move move[3 * CANDIDATE_TRIES];
};

/* Returns whether a place is covered: it lies in a lattice triangle of kept samples with sides of at most a pixel ([G]
 * 4.3: any pixel centred there holds one of the corners), or within half a pixel of a kept sample. Any number of
 * threads may call it. */
int candidates_cover(const struct keeper *keeper, const struct field *field, const struct place *place);

/* Finds the candidates to cover a place. Any number of threads may call it. */
void candidates_find(struct candidates *candidates, const struct keeper *keeper, const struct field *field,
                     const struct place *place);

/* Finds candidates only if the place is not covered. Returns 1 if it is covered, and then has no candidates. */
int candidates_look(struct candidates *candidates, const struct keeper *keeper, const struct field *field,
                    const struct place *place);

/* Returns whether a place is covered by now, if no new hits were added since its candidates were found. */
int candidates_are_superfluous(const struct candidates *candidates, const struct keeper *keeper,
                               const struct place *place);

/* Keeps the samples that cover a place at the least cost. *is_left: the cost is above `most`, and it kept none.
 * MEMORY. */
int candidates_take(const struct candidates *candidates, const struct keeper *keeper, const struct place *place,
                    float most, int *is_left);

/* Counts the place for each patch that could cover it. Of the patches without kept samples the most wanted get
 * opened. */
void candidates_want(const struct candidates *candidates, const struct keeper *keeper);

#endif

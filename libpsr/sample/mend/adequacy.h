/* Measures whether a sampling is adequate ([G] 4.2): how many pixels at the target resolution would miss a sample. */
#ifndef PSR_SAMPLE_MEND_ADEQUACY_H
#define PSR_SAMPLE_MEND_ADEQUACY_H

#include "sample/own/kept.h"
#include "sample/project/sampling.h"
#include "sample/visible/places.h"

#define ADEQUACY_FEW 15000 /* one missing in so many is good enough */

/* A trial is a random place on the surface, with the probability of its projected area, a view that sees it, and a
 * pixel centred there. It is missing when no kept sample that faces the view falls into the pixel at the place's depth
 * or before it. */
struct adequacy {
	uint64_t n_trials, n_missing;
	struct place *place; /* the places that are missing; free() it */
};

/* Makes about n_trials trials, by seed. can_stop: ends early once too many are missing. The same numbers whatever the
 * threads. MEMORY. */
int adequacy_measure(struct adequacy *out, const struct sampling *sampling, const struct kept *kept, uint64_t seed,
                     uint64_t n_trials, int can_stop);

#endif

/* Whether a sampling is adequate ([G] 4.2), measured: what pixels of frames at the target resolution would miss. */
#ifndef PSR_SAMPLE_MEND_ADEQUACY_H
#define PSR_SAMPLE_MEND_ADEQUACY_H

#include "sample/own/kept.h"
#include "sample/project/sampling.h"
#include "sample/visible/places.h"

#define ADEQUACY_FEW 15000 /* one missing in so many is good enough */

/* Pixels are drawn at random: a place on the surface, with the probability of its projected area, a view that sees it,
 * and a grid with a pixel's middle there. Such a pixel is missing when no kept sample that faces the view falls into it
 * at the depth of the place, or before it. Whatever stands before the place, and would cover the pixel in a frame, does
 * not count. */
struct adequacy {
	uint64_t n_trials, n_missing;
	struct place *place; /* the places that are missing; free() it */
};

/* Makes about n_trials trials; other seeds make others. can_stop: fewer where these show already that too many are
 * missing. The same numbers whatever the threads. MEMORY. */
int adequacy_measure(struct adequacy *out, const struct sampling *sampling, const struct kept *kept, uint64_t seed,
                     uint64_t n_trials, int can_stop);

#endif

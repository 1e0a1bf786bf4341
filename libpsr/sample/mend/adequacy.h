/* Whether a sampling is adequate ([G] 4.2), measured: what pixels of frames at the target resolution would miss. */
#ifndef PSR_SAMPLE_MEND_ADEQUACY_H
#define PSR_SAMPLE_MEND_ADEQUACY_H

#include <stddef.h>
#include <stdint.h>
#include "sample/level.h"

/* Pixels are drawn at random: a place on the surface, with the probability of its projected area, a view that sees it,
 * and a grid with a pixel's middle there. Such a pixel is missing when no kept sample that faces the view falls into it
 * at the depth of the place, or before it. What stands before the place, and would cover the pixel in a frame, does not
 * count. */
struct adequacy {
	uint64_t n_trials, n_missing;
	struct surface_spot *spot; /* the places of those that are missing; free() it */
};

/* Makes about n_trials trials; other seeds make others. The same numbers whatever the threads. MEMORY. */
int adequacy_measure(struct adequacy *out, const struct level *level, uint64_t seed, uint64_t n_trials);

/* Measures and adds what is missing, until less than a 15,000th is or it does not get better; *out: of the last round,
 * with another seed, without spots. MEMORY. */
int adequacy_reach(struct adequacy *out, struct level *level);

#endif

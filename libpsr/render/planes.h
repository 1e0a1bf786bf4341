/* Planes beside colour and depth. */
#ifndef PSR_RENDER_PLANES_H
#define PSR_RENDER_PLANES_H

#include "plan.h"

/* Writes row y of the planes normal, id, block, bound, weight and words that the frame has. Before the fill, which
 * changes weights. */
void planes_row(const struct simd *simd, const struct plan *plan, const struct psr_frame *frame, const uint64_t *word,
                const uint16_t *weight, uint32_t y);

/* Pixels x .. x + n - 1 of row y; n is at most STRIP. */
struct planes_part {
	uint32_t x, y, n;
};

/* Writes the samples of the words that are not empty over what planes_row() wrote; `word` is that of the first pixel.
 * Their weight is whole. Leaves the plane of words alone. */
void planes_over(const struct simd *simd, const struct plan *plan, const struct psr_frame *frame, const uint64_t *word,
                 const struct planes_part *part);

/* Gives pixels whose depth the fill moved, which planes_row() has marked, the bound of the frame's report: after the
 * fill, before planes_over(). */
void planes_bound_filled(const struct psr_frame *frame);

#endif

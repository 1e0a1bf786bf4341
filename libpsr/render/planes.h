/* Planes beside colour and depth. */
#ifndef PSR_RENDER_PLANES_H
#define PSR_RENDER_PLANES_H

#include "plan.h"

/* Writes row y of the planes normal, id, block, weight and words that the frame has. Before the fill, which changes
 * weights. */
void planes_row(const struct simd *simd, const struct plan *plan, const struct psr_frame *frame, const uint64_t *word,
                const uint16_t *weight, uint32_t y);

#endif

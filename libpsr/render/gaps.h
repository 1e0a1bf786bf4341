/* Gaps: weights from the levels of the z-buffer, and a guard against pinholes ([G] 4.6, 9.1.2). */
#ifndef PSR_RENDER_GAPS_H
#define PSR_RENDER_GAPS_H

#include "plan.h"

/* Of the whole picture: weights by pixel, and marks by brick. */
struct gaps_map {
	uint16_t *weight;
	uint8_t *bricks;
};

/* Computes the weights of rows y0..y1-1; y0 is a multiple of BRICK, y1 too, or the height. A weight is WEIGHT_ONE * (1
 * - coverage), where cells cover a pixel that is further than them by more than their level's threshold; empty pixels
 * are at infinity. A pinhole has weight 0: a pixel behind, by more than level 1's threshold, at least seven of its
 * eight neighbours, which are one surface (within level 1's threshold of each other, or level 4's where the pixel is
 * empty); so has a pixel of a crack (cracks.h). Sets bricks[i] to whether brick i has a weight below WEIGHT_ONE. */
struct gaps_counts gaps_rows(const struct simd *simd, const struct plan *plan, const struct psr_zstack *stack,
                             uint32_t y0, uint32_t y1, const struct gaps_map *map);

#endif

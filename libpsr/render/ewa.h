/* Octrees as EWA splats ([B] 5.2): the sums of a tile, once all of its words are drawn. */
#ifndef PSR_RENDER_EWA_H
#define PSR_RENDER_EWA_H

#include "warp.h"

/* What a splat covers beyond a leaf's middle: its core and the rounding of its place, in distances of neighbours and in
 * pixels. */
#define EWA_REACH 0.75f
#define EWA_REACH_PIXELS 1.0f

/* Clears the tile's sums, and adds up the splats of its cubes; some of them if the frame is cancelled. */
void ewa_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins, const struct warp_into *into,
              uint32_t tile);

#endif

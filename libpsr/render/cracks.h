/* Cracks between differential points: their quadrics end at slightly different heights, and sights that graze a surface
 * slip through. */
#ifndef PSR_RENDER_CRACKS_H
#define PSR_RENDER_CRACKS_H

#include "plan.h"

/* A crack is one pixel wide, and of at most so many pixels that touch each other. All around is what is nearer by more
 * than level 1's threshold, the nearest of it a differential point, and so far apart in depth at most. Measured:
 * openings that are there are seldom so small, and what is around them seldom so near to each other. */
#define CRACK_MOST 12
#define CRACK_SHORT 4
#define CRACK_APART 12 /* spacings of the model's resolution; half of it if the crack is longer than CRACK_SHORT */

/* Whether a pixel that is in a slit (simd/gaps.h) is in a crack. */
int is_in_crack(const struct plan *plan, const struct psr_zstack *stack, uint32_t x, uint32_t y);

#endif

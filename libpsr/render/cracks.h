/* Cracks between differential points: their quadrics end at slightly different heights, and sights that graze a surface
 * slip through. */
#ifndef PSR_RENDER_CRACKS_H
#define PSR_RENDER_CRACKS_H

#include "plan.h"

/* A crack is one pixel wide, and of at most so many pixels that touch each other. The nearest pixel beside it is of a
 * differential point. All around is what is nearer by more than level 1's threshold, and so far apart in depth at most:
 * what is further behind that pixel is of the crack. A surface goes on across each of its pixels: along a row, a column
 * or a diagonal what is on both sides is nearly as deep. Measured: openings that are there are seldom so small, and of
 * their rims seldom two are so near to each other. Depths are in spacings of the model's resolution. */
#define CRACK_MOST 12
#define CRACK_SHORT 4
#define CRACK_APART 48 /* of a pixel alone; half of it of a few, a quarter if the crack is longer than CRACK_SHORT */
#define CRACK_STEP 6   /* across a pixel */
#define CRACK_STEP_ALONE 10 /* likewise, if it is the only one */

/* Whether a pixel that is in a slit (simd/gaps.h) is in a crack. */
int is_in_crack(const struct plan *plan, const struct psr_zstack *stack, uint32_t x, uint32_t y);

#endif

/* Visibility cones ([G] 6.4). */
#ifndef PSR_SAMPLE_PACK_CONE_H
#define PSR_SAMPLE_PACK_CONE_H

#include <stdint.h>
#include "model/blocks.h"

/* Finds the smallest cap that holds n >= 0 unit normals: its axis, a unit vector, and the cosine of the angle from
 * there to its rim, rounded downwards. The cosine is -1, and the axis without meaning, if no cap smaller than a
 * hemisphere holds them.
 *
 * The renderer leaves out samples whose *stored* normals face away (render/warp.c), and culls a block if every normal
 * of its cap faces away from the eye at every place within its sphere. So a cap holds all stored normals, as they are
 * read back: culling then changes no bit of any frame. It holds the *geometric* normals, too, so that [G] 6.4's
 * statement is true: from inside the cone no sample's surface shows its front. */
void cone_bound(const float (*normal)[3], int n, float axis[3], float *cosine);

/* Finds the cap as model/blocks.h stores it. The axis is so long that its greatest component is 127; the others are
 * rounded, which turns it by up to 0.32 degrees (half a unit in two components of a vector of 127 or more). The cap
 * around that axis still holds the normals; its sine is rounded upwards. So the sine is at most 1/255 + 0.0056 + 0.0014
 * above the smallest cap's: a step, the turn, and 2^-20 of the cosine for roundings. Culling compares sines, since the
 * cosine of a nearly flat block, in steps of 1/255, would be 5 degrees off. */
void cone_pack(const float (*normal)[3], int n, int8_t axis[3], uint8_t *sine);

/* Returns whether the renderer may cull a block by its cone: the test of render/cull.c without its allowance for
 * rounding, so that the renderer culls no more blocks than this test. eye: inner coordinates; if not is_perspective, a
 * unit vector to the viewer. */
int cone_culls(const struct psr_blocks *blocks, uint32_t block, const float eye[3], int is_perspective);

#endif

/* Visibility cones ([G] 6.4). */
#ifndef PSR_SAMPLE_PACK_CONE_H
#define PSR_SAMPLE_PACK_CONE_H

#include <stdint.h>
#include "model/blocks.h"

/* The smallest cap that holds n >= 0 unit normals: its axis, a unit vector, and the cosine of the angle from there to
 * its rim, rounded downwards. The cosine is -1, and the axis of no meaning, if no cap smaller than a hemisphere holds
 * them.
 *
 * The renderer leaves out samples whose *stored* normals face away (render/warp.c), and culls a block if every normal
 * of its cap faces away from the eye at every place within its sphere. So a cap holds all stored normals, as they are
 * read back: culling then changes no bit of any frame. It holds the *geometric* normals, too, so that [G] 6.4's
 * statement is true: from inside the cone the surface at no sample is seen from its front. */
void cone_bound(const float (*normal)[3], int n, float axis[3], float *cosine);

/* The same as model/blocks.h has it: the axis so long that its greatest component is 127 and the others rounded, which
 * turns it by up to 0.32 degrees (half a unit in two components of a vector of 127 or more); around that a cap that
 * still holds the normals, its sine rounded upwards. So the sine is at most 1/255 + 0.0056 + 0.0014 above that of the
 * smallest cap: a step, the turn, and 2^-20 of the cosine for roundings. Culling compares sines, and the cosine of a
 * nearly flat block, in steps of 1/255, would be 5 degrees off. */
void cone_pack(const float (*normal)[3], int n, int8_t axis[3], uint8_t *sine);

/* Whether the renderer may cull a block by its cone: the test of render/cull.c without its allowance for rounding, so
 * that it culls no more than this says. eye: inner coordinates; if not is_perspective, a unit vector to the viewer. */
int cone_culls(const struct psr_blocks *blocks, uint32_t block, const float eye[3], int is_perspective);

#endif

/* Visibility cones ([G] 6.4). */
#ifndef PSR_SAMPLE_PACK_CONE_H
#define PSR_SAMPLE_PACK_CONE_H

#include <stdint.h>
#include "model/blocks.h"

/* The smallest cap that holds n >= 0 unit normals: its axis, a unit vector, and the cosine of the angle from there to
 * its rim, rounded downwards. The cosine is -1, and the axis of no meaning, if no cap smaller than a hemisphere holds
 * them.
 *
 * Which normals a block's cap has to hold depends on what the renderer leaves out: a sample whose *stored* normal,
 * which is the shading normal quantised, faces away (render/warp.c). A block is culled if every normal of the cap faces
 * away from the eye at every place within its sphere. So with all stored normals in the cap, as they are read back, a
 * block is culled only if each of its samples would be left out anyway, and culling changes no bit of any frame. It is
 * not enough to hold the *geometric* normals: at a silhouette the stored normal may still face the eye where the face
 * does not. These are to be held too: then [G] 6.4's own statement is true, that from inside the cone the surface at no
 * sample is seen from its front, whatever is done with shading normals. */
void cone_bound(const float (*normal)[3], int n, float axis[3], float *cosine);

/* The same as psr/model.h has it: the axis so long that its greatest component is 127 and the others rounded, which
 * turns it by up to 0.32 degrees (half a unit in two components of a vector of 127 or more); around that a cap that
 * still holds the normals, its sine rounded upwards. So the sine is at most 1/255 + 0.0056 + 0.0014 above that of the
 * smallest cap: a step, the turn, and 2^-20 of the cosine for roundings. The sine and not the cosine, because the sine
 * is what culling compares: the cosine of a nearly flat block, in steps of 1/255, would be 5 degrees off. */
void cone_pack(const float (*normal)[3], int n, int8_t axis[3], uint8_t *sine);

/* Whether the renderer may leave a block out because of its cone: with the arithmetic of render/cull.c less what that
 * allows for rounding, so that it culls no more than this says. eye: inner coordinates; if not is_perspective, a unit
 * vector to the viewer. */
int cone_culls(const struct psr_blocks *blocks, uint32_t block, const float eye[3], int is_perspective);

#endif

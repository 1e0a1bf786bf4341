/* Visibility cones ([G] 6.4). */
#ifndef PSR_SAMPLE_CONE_H
#define PSR_SAMPLE_CONE_H

#include <stdint.h>
#include "lattice.h"

/* A cap that holds the geometric normals of a block's samples, each on the side that its ray met: a unit axis, and
 * the cosine of the angle to the rim, rounded downwards; -1 where the normals have no mean. Around the mean, so
 * not the smallest cap. */
void cone_bound(const struct ray_scene *scene, const struct lattice_sample sample[PSR_BLOCK_SAMPLES], uint64_t mask,
                float axis[3], float *cosine);

#endif

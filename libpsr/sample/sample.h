/* A sample of a projection in full: what the ray met, as an attribute word. */
#ifndef PSR_SAMPLE_SAMPLE_H
#define PSR_SAMPLE_SAMPLE_H

#include <stdint.h>
#include "lattice.h"
#include "ray.h"

/* Attribute word (psr/model.h) of sample s of a block. Its normal is the interpolated one, on the side that the
 * projection sees, and is bent as far as it must be to face the projection, so that a sample is never shaded as a back
 * in the view that found it. */
uint64_t sample_attr(const struct psr_mesh *mesh, const struct ray_scene *scene, const struct lattice *lattice,
                     uint32_t block, unsigned s);

/* Cosine between the geometric normal of a sample, on the side that was met, and its projection's z; 0..1. */
float sample_cosine(const struct ray_scene *scene, const struct psr_projection *projection,
                    const struct lattice_sample *sample);

/* Inner coordinates. */
void sample_position(const struct lattice *lattice, uint32_t block, unsigned s, float position[3]);

#endif

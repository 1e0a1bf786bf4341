/* Colours of a mesh's surface: factor times vertex colour times bilinear texture, in linear light. */
#ifndef PSR_SAMPLE_TEXTURE_H
#define PSR_SAMPLE_TEXTURE_H

#include <stdint.h>
#include "psr/mesh.h"

/* Linear RGBA of the base colour at barycentric (u, v) of a primitive; each channel in 0..1. */
void texture_base_color(const struct psr_mesh *mesh, uint32_t prim, double u, double v, float rgba[4]);

/* Whether there is nothing at this place: MASK below its cutoff, BLEND below one half. */
int texture_is_absent(const struct psr_mesh *mesh, uint32_t prim, double u, double v);

#endif

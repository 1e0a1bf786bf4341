/* Makes one sample of several: the prefilter of coarse levels. */
#ifndef PSR_SURFACE_BLEND_H
#define PSR_SURFACE_BLEND_H

#include <stdint.h>

/* Blends n >= 1 attribute words (model/blocks.h) into one. Weights are finite, >= 0, and not all 0. Sums are in double
 * and in the order of the arguments.
 *
 * The result is the mean of the unlit words if these have more than half of the weight, else of the others: of base
 * colours in linear light, of metal, of openness to ambient light, and of what is not metal of its reflectance. So
 * the sum of what scatters and what mirrors is kept. The normal is the mean N of the unit normals, or `facing` (unit
 * length) where they cancel out, bent to face it as surface_attr() does.
 *
 * The lobe's squared width is the mean of all, in proportion to what they mirror, widened by the normals' own spread
 * ([Toksvig]: (1 - r) / r, r = |N|; see material_widened()). */
uint64_t blend_attr(const uint64_t *attr, const float *weight, int n, const float facing[3]);

#endif

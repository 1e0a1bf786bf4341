/* Makes one sample of several: the prefilter of coarse levels. */
#ifndef PSR_SURFACE_BLEND_H
#define PSR_SURFACE_BLEND_H

#include <stdint.h>

/* Blends n >= 1 attribute words (model/blocks.h) into one. Weights are finite, >= 0, and not all 0. Sums are in double
 * and in the order of the arguments.
 *
 * The result is the mean of the unlit words if these have more than half of the weight, else of the others. Colours
 * are averaged in linear light. The normal is the mean N of the unit normals, or `facing` (unit length) where they
 * cancel out, bent to face it as surface_attr() does.
 *
 * The lobe matches all lobes in their second moments. One of exponent n spreads the reflected ray with the variance
 * 1/n; the mean of these, in proportion to the reflected light (specular / (n + 2)), is widened by the normals' own
 * spread ([Toksvig]: (1 - r) / r, r = |N|; four times that for the reflected ray). The specular colour keeps the
 * reflected light. */
uint64_t blend_attr(const uint64_t *attr, const float *weight, int n, const float facing[3]);

#endif

/* One sample for several: how the coarse levels are prefiltered. */
#ifndef PSR_SURFACE_BLEND_H
#define PSR_SURFACE_BLEND_H

#include <stdint.h>

/* The attribute word (model/blocks.h) that stands for n >= 1 of them in the given proportion: weights are finite, >= 0,
 * and not all 0. Sums are in double and in the order of the arguments.
 *
 * Where unlit ones have more than half of the weight the result is unlit and the mean of those; else they are left
 * out, and it is the mean of the others. Colours are averaged in linear light. The normal is the mean N of the unit
 * normals, or `facing` (unit length) where they cancel out, bent to face it as surface_attr() does.
 *
 * The lobe stands for those of all, by their second moments: one of exponent n spreads the reflected ray with the
 * variance 1/n, and the mean of these, in proportion to the light that they reflect (specular / (n + 2)), is widened
 * by the normals' own spread ([Toksvig]: (1 - r) / r, r = |N|, of a normal; four times that of the reflected ray). The
 * specular colour is such that as much light is reflected as by all of them together. */
uint64_t blend_attr(const uint64_t *attr, const float *weight, int n, const float facing[3]);

#endif

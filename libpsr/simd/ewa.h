/* Quantised EWA splats ([B] 5.2): leaves of octrees as Gaussians in the picture, mixed where they are one surface.
 *
 * A pixel's word is that of the nearest leaf with the pixel in its mask's core. What is mixed there are the leaves with
 * the pixel in their masks that lie within EWA_SAME edges behind the word. Words are minima, and sums those of integers:
 * leaves may come in any order. */
#ifndef PSR_SIMD_EWA_H
#define PSR_SIMD_EWA_H

#include "ewa_masks.h"

/* How far behind a pixel's word a leaf is of the same surface, in edges of a leaf along the view axis. Leaves are half a
 * diagonal, 0.87 edges, to either side of their surface at most. */
#define EWA_SAME 1.75f

/* Sums over leaves of their weights, and of products with these: normals in camera space, 511 times as long, turned to
 * the eye where they are of both sides; and colours, linear, of 12 bits. */
enum { EWA_WEIGHT, EWA_NORMAL, EWA_COLOR = EWA_NORMAL + 3, EWA_LANES = 8 };
#define EWA_COLOR_ONE 4095
struct ewa_sum {
	_Alignas(32) uint32_t lane[EWA_LANES]; /* normals as int32_t; the last is 0 */
};
/* From this weight on, that of 4,112 leaves at least, the other sums may have overflowed: the pixel shows its word's
 * leaf alone. Weights go on, so whoever calls ewa_sums() sees to it that they do not overflow. */
#define EWA_MOST_WEIGHT (UINT32_C(1) << 20)

/* The same picture's scale of an octree. Rows A of warp_cubes.axis, of which (7.9) of [G] is made: the places in pixels
 * of an inner unit are (A_0 - u A_2) / z' and (A_1 - v A_2) / z'; orthographic: A_0 and A_1. */
struct ewa_view {
	float axis[3][3];
	float square[3][3]; /* A_i . A_k */
	/* A normal n is dual[0] . n times A_0, and so on: a plane is where these three, times (u, v, 1), are proportional to
	 * 1 / z'; orthographic: times (u, v, z), are constant. */
	float dual[3][3];
	float depth; /* of z' an inner unit along the view axis */
};

#endif

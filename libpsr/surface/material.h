/* glTF's materials as attribute words. */
#ifndef PSR_SURFACE_MATERIAL_H
#define PSR_SURFACE_MATERIAL_H

#include <stdint.h>
#include "psr/mesh.h"

#define MATERIAL_DIELECTRIC 0.04 /* F0, what glTF's dielectrics reflect of light from ahead */

/* Factors, textures and colours of a material at one place, linear, in 0..1; emission >= 0. */
struct material_values {
	float base[3];
	float metallic, roughness;
	float specular[3], glossiness; /* of specular-glossiness, instead of these two */
	float emission[3];
	float occlusion;               /* 1 is open */
	double spread;                 /* variance of the normals around there along each axis, radians^2 */
};

/* Sets the values that the factors alone give. */
void material_values_default(struct material_values *values, const struct psr_material *material);

/* An attribute word (model/blocks.h) without its normal: the look of the material, its roughness widened by the spread
 * of normals.
 *
 * A look has one colour for what is scattered and what is mirrored. Specular-glossiness has two: diffuse d and F0 s.
 * Where s is grey, or d black, a look is exact: a dielectric of the F0 s, or a metal of the colour s. Else it is that
 * of these two which is nearer, or a mixture, if both colours differ from grey in the same direction.
 *
 * Emission is added to the base colour, clipped at 1; if it has the greater luminance of the two, the sample is unlit.
 * Else it shows only as far as there is light. Unlit materials have their base colour and nothing else. */
uint64_t material_word(const struct psr_material *material, const struct material_values *values);

/* An attribute word without its normal. */
struct look {
	float base[3];     /* linear, encoded clamped to 0..1 as all that follow */
	float metallic;
	float reflectance; /* F0 of what is not metal; 0 in a look without metal: it only scatters light */
	float open;        /* ambient light that reaches the place */
	float roughness;
	int unlit;         /* the base colour alone is encoded */
};

uint64_t material_encode(const struct look *look);
void material_decode(struct look *look, uint64_t attr); /* material_encode() gives the same bits again */

/* Widens a lobe by the variance of normals along each axis: GGX's width, roughness^2, is the root of twice the variance
 * of its facets' slopes. At most 1. [Toksvig]: normals whose mean has the length r have the variance (1 - r) / r. */
double material_widened(double roughness, double variance);

#endif

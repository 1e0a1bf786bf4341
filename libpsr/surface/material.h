/* glTF's materials as [G] table 5.1 stores them: diffuse, specular, Phong exponent. */
#ifndef PSR_SURFACE_MATERIAL_H
#define PSR_SURFACE_MATERIAL_H

#include <stdint.h>
#include "psr/mesh.h"

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

/* An attribute word (model/blocks.h) without its normal.
 *
 * Metallic-roughness: diffuse = base * (1 - metallic / 2): half of a metal's colour stands for the surroundings that
 * it would mirror. F0 = 0.04 + (base - 0.04) * metallic. Specular-glossiness: F0 = specular; s = max(0, (F0 - 0.04) /
 * 0.96), its excess over a dielectric's, is a metal's: diffuse = base * (1 - the largest channel of s) + s / 2.
 * Roughness is 1 - glossiness. Dielectrics are the same either way; metals differ by 0.02.
 *
 * Roughness r gives the microfacets' Blinn-Phong exponent 2 / r^4 - 2; a fourth of it is the exponent n of the
 * reflected ray's cosine, in 1..2^(255/16), which the spread of normals widens (material_widened). specular = min(1,
 * F0 * (n + 2) / 2): a normalised lobe where diffuse is albedo times N.L.
 *
 * Occlusion multiplies the diffuse colour: a word has no ambient colour of its own. Emission is added to the diffuse
 * colour, clipped at 1; if it has the greater luminance of the two, the sample is unlit. Else it shows only as far as
 * there is light. Unlit materials have their base colour and nothing else. */
uint64_t material_word(const struct psr_material *material, const struct material_values *values);

/* An attribute word without its normal, in linear light. */
struct look {
	float diffuse[3], specular[3]; /* encoded, clamped to 0..1 */
	double exponent;               /* encoded, clamped to 1..2^(255/16) */
	int unlit;                     /* encoded, neither specular nor exponent are */
};

uint64_t material_encode(const struct look *look);
void material_decode(struct look *look, uint64_t attr); /* material_encode() gives the same bits again */

/* Widens a lobe of exponent n > 0, of variance 1/n, by the variance of normals, of which the reflected ray has four
 * times: 1 / (1/n + 4 variance), at least 1. [Toksvig]: normals whose mean has the length r have the variance (1 - r)
 * / r. */
double material_widened(double n, double variance);

/* e in 0..255 of the exponent 2^(e/16) that is nearest in the logarithm. */
unsigned material_exponent_code(double exponent);

#endif

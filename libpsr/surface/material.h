/* glTF's materials as [G] table 5.1 stores them: diffuse, specular, Phong exponent. */
#ifndef PSR_SURFACE_MATERIAL_H
#define PSR_SURFACE_MATERIAL_H

#include <stdint.h>
#include "psr/mesh.h"

/* What the factors, textures and colours of a material come to at one place, linear; in 0..1 but emission (>= 0). */
struct material_values {
	float base[3];
	float metallic, roughness;
	float specular[3], glossiness; /* of specular-glossiness, instead of these two */
	float emission[3];
	float occlusion;               /* 1 is open */
	double spread;                 /* variance of the normals around there along each axis, radians^2 */
};

/* The factors alone. */
void material_values_default(struct material_values *values, const struct psr_material *material);

/* Everything of an attribute word (model/blocks.h) but its normal.
 *
 * Metallic-roughness: diffuse = base * (1 - metallic / 2), since there are no surroundings that a metal could mirror:
 * half of its colour stands for them. F0 = 0.04 + (base - 0.04) * metallic.
 * Specular-glossiness: F0 = specular; what it has beyond that of a dielectric, s = max(0, (F0 - 0.04) / 0.96), is a
 * metal's: diffuse = base * (1 - the largest channel of s) + s / 2. Roughness is 1 - glossiness. So dielectrics are the
 * same described either way, and metals differ by 0.02.
 *
 * Roughness r gives the Blinn-Phong exponent 2 / r^4 - 2 of the microfacets, a fourth of it is the exponent n of the
 * reflected ray's cosine, in 1..2^(255/16); the spread of the normals widens it (material_widened). specular = min(1,
 * F0 * (n + 2) / 2): a normalised lobe where diffuse is albedo times N.L, lower as it is wider.
 *
 * Occlusion: a word has nothing that ambient light alone meets, so the whole diffuse colour is multiplied by it, the
 * highlight not at all. Emission is added to the diffuse colour, clipped at 1; where it has the greater luminance of
 * the two the sample is unlit, in that sum. Where it has the smaller it is seen as far as there is light, right in
 * full light, absent in the dark. Unlit materials shine in their base colour and have nothing else. */
uint64_t material_word(const struct psr_material *material, const struct material_values *values);

/* What an attribute word says but for its normal, in linear light. */
struct look {
	float diffuse[3], specular[3]; /* encoded, clamped to 0..1 */
	double exponent;               /* encoded, clamped to 1..2^(255/16) */
	int unlit;                     /* encoded, neither specular nor exponent are */
};

uint64_t material_encode(const struct look *look);
void material_decode(struct look *look, uint64_t attr); /* encoding that gives the same bits again */

/* The exponent of a lobe of exponent n > 0 (of the reflected ray, which it spreads with the variance 1/n along each
 * axis) where normals spread with the given variance, and so the reflected ray with four times that: 1 / (1/n + 4
 * variance), at least 1. [Toksvig]: the variance of normals whose mean has the length r is (1 - r) / r. */
double material_widened(double n, double variance);

/* e of the exponent 2^(e/16) that is nearest in the logarithm, in 0..255. */
unsigned material_exponent_code(double exponent);

#endif

/* glTF's metallic-roughness as [G] table 5.1 stores it: diffuse, specular, Phong exponent. */
#ifndef PSR_SAMPLE_MATERIAL_H
#define PSR_SAMPLE_MATERIAL_H

#include <stdint.h>
#include "psr/mesh.h"

/* Everything of an attribute word (psr/model.h) but its normal, for linear base colour rgb.
 *
 * diffuse = base * (1 - metallic / 2), since there are no surroundings that a metal could mirror;
 * F0 = 0.04 + (base - 0.04) * metallic. Roughness r gives the Blinn-Phong exponent
 * 2 / r^4 - 2 of the microfacets, and a fourth of it is the exponent n of the reflected ray's cosine, in 1..2^(255/16);
 * specular = min(1, F0 * (n + 2) / 2): a normalised lobe where diffuse is albedo times N.L. Unlit ones shine in their
 * base colour and have neither. */
uint64_t material_attr(const struct psr_material *material, const float rgb[3]);

/* What an attribute word says but for its normal, in linear light. */
struct look {
	float diffuse[3], specular[3]; /* encoded, clamped to 0..1 */
	double exponent;               /* encoded, clamped to 1..2^(255/16) */
	int unlit;                     /* encoded, neither specular nor exponent are */
};

uint64_t material_encode(const struct look *look);
void material_decode(struct look *look, uint64_t attr); /* encoding that gives the same bits again */

/* The exponent of a lobe of exponent n > 0 (of the reflected ray) over normals whose mean has length r, 0..1 ([Toksvig]:
 * a normal spreads with the variance (1 - r) / r, the reflected ray with four times that): 1 / (1/n + 4 (1 - r) / r), at
 * least 1. */
double material_widened(double n, double r);

/* e of the exponent 2^(e/16) that is nearest in the logarithm, in 0..255. */
unsigned material_exponent_code(double exponent);

#endif

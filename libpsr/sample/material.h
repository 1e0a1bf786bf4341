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

/* e of the exponent 2^(e/16) that is nearest in the logarithm, in 0..255. */
unsigned material_exponent_code(double exponent);

#endif

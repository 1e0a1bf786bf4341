#include <math.h>
#include "../base/srgb.h"
#include "material.h"

/* A metal has no diffuse colour: it mirrors its surroundings, and here there are none. Half of its colour stands in for
 * them, or metals would be black but for highlights. */
#define METAL_LOSS 0.5f

unsigned material_exponent_code(double exponent)
{
	double root = sqrt(sqrt(sqrt(sqrt(2.0)))), bound = sqrt(root);
	unsigned code = 0;

	if (!(exponent > 1))
		return 0;
	for (; code < 255 - 16 && exponent >= 2; code += 16)
		exponent /= 2;
	for (; code < 255 && exponent >= bound; code++)
		bound *= root;
	return code;
}

static double exponent_of(double roughness)
{
	double alpha = roughness * roughness, squared = alpha * alpha;
	double exponent = squared > 0 ? (2 / squared - 2) / 4 : INFINITY;
	double most = 65536 / sqrt(sqrt(sqrt(sqrt(2.0)))); /* 2^(255/16) */

	return exponent < 1 ? 1 : exponent > most ? most : exponent;
}

static uint64_t code_565(const float rgb[3])
{
	static const unsigned most[3] = { 31, 63, 31 }, shift[3] = { 0, 5, 11 };
	uint64_t code = 0;

	for (int c = 0; c < 3; c++)
		code |= (uint64_t)((psr_linear_to_srgb(rgb[c]) * most[c] * 2 + 255) / 510) << shift[c];
	return code;
}

static uint64_t code_888(const float rgb[3])
{
	return (uint64_t)psr_linear_to_srgb(rgb[0]) | (uint64_t)psr_linear_to_srgb(rgb[1]) << 8
	       | (uint64_t)psr_linear_to_srgb(rgb[2]) << 16;
}

uint64_t material_attr(const struct psr_material *material, const float rgb[3])
{
	float metallic = material->metallic, diffuse[3], specular[3];
	double exponent = exponent_of((double)material->roughness);

	if (material->unlit)
		return UINT64_C(1) << 15 | code_888(rgb) << 16;
	for (int c = 0; c < 3; c++) {
		float f0 = 0.04f + (rgb[c] - 0.04f) * metallic;
		float lobe = f0 * (float)((exponent + 2) / 2);

		diffuse[c] = rgb[c] * (1 - METAL_LOSS * metallic);
		specular[c] = lobe < 1 ? lobe : 1;
	}
	return code_888(diffuse) << 16 | code_565(specular) << 40 | (uint64_t)material_exponent_code(exponent) << 56;
}

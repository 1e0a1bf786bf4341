#include <math.h>
#include "base/srgb.h"
#include "material.h"
#include "model/blocks.h"

/* A metal mirrors its surroundings, and here there are none. Half of its colour stands for them, or metals would be
 * black but for highlights. */
#define METAL_LOSS 0.5f

#define DIELECTRIC 0.04f /* F0 */

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

uint64_t material_encode(const struct look *look)
{
	if (look->unlit)
		return UINT64_C(1) << 15 | code_888(look->diffuse) << 16;
	return code_888(look->diffuse) << 16 | code_565(look->specular) << 40
	       | (uint64_t)material_exponent_code(look->exponent) << 56;
}

static float part(uint32_t code, int shift, uint32_t most)
{
	return psr_srgb_to_linear[((code >> shift & most) * 255 + most / 2) / most];
}

void material_decode(struct look *look, uint64_t attr)
{
	static const double root[16] = {
		1,
		1.0442737824274138403,
		1.0905077326652576592,
		1.1387886347566916537,
		1.1892071150027210667,
		1.2418578120734840486,
		1.2968395546510096659,
		1.3542555469368927283,
		1.4142135623730950488,
		1.4768261459394993114,
		1.5422108254079408236,
		1.6104903319492543082,
		1.6817928305074290861,
		1.7562521603732994832,
		1.8340080864093424635,
		1.9152065613971472939,
	};
	uint32_t e = PSR_ATTR_EXPONENT(attr), diffuse = PSR_ATTR_DIFFUSE(attr), specular = PSR_ATTR_SPECULAR(attr);

	for (int c = 0; c < 3; c++)
		look->diffuse[c] = part(diffuse, 8 * c, 255);
	look->specular[0] = part(specular, 0, 31);
	look->specular[1] = part(specular, 5, 63);
	look->specular[2] = part(specular, 11, 31);
	look->exponent = root[e & 15] * (double)(1u << (e >> 4));
	look->unlit = (int)PSR_ATTR_UNLIT(attr);
}

double material_widened(double n, double variance)
{
	double widened = n / (1 + 4 * n * variance);

	return widened > 1 ? widened : 1;
}

void material_values_default(struct material_values *values, const struct psr_material *material)
{
	*values = (struct material_values){ .metallic = material->metallic, .roughness = material->roughness,
		                                .glossiness = material->glossiness, .occlusion = 1 };
	for (int c = 0; c < 3; c++) {
		values->base[c] = material->base_color[c];
		values->specular[c] = material->specular[c];
		values->emission[c] = material->emissive[c];
	}
}

/* Diffuse colour and F0. */
static void reflect(const struct psr_material *material, const struct material_values *values, float diffuse[3],
                    float f0[3])
{
	float most = 0;

	for (int c = 0; c < 3; c++) {
		float mirrored = (values->specular[c] - DIELECTRIC) / (1 - DIELECTRIC);

		f0[c] = values->specular[c];
		diffuse[c] = mirrored > 0 ? mirrored * METAL_LOSS : 0;
		most = mirrored > most ? mirrored : most;
	}
	for (int c = 0; c < 3; c++) {
		if (material->is_specular_glossiness) {
			diffuse[c] += values->base[c] * (1 - most);
		} else {
			f0[c] = DIELECTRIC + (values->base[c] - DIELECTRIC) * values->metallic;
			diffuse[c] = values->base[c] * (1 - METAL_LOSS * values->metallic);
		}
		diffuse[c] *= values->occlusion;
	}
}

static float luminance(const float rgb[3])
{
	return 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2];
}

static float at_most_1(float x)
{
	return x < 1 ? x : 1;
}

uint64_t material_word(const struct psr_material *material, const struct material_values *values)
{
	float roughness = material->is_specular_glossiness ? 1 - values->glossiness : values->roughness, f0[3];
	struct look look = { .exponent = material_widened(exponent_of((double)roughness), values->spread),
		                 .unlit = material->unlit };

	if (material->unlit) {
		for (int c = 0; c < 3; c++)
			look.diffuse[c] = values->base[c];
		return material_encode(&look);
	}
	reflect(material, values, look.diffuse, f0);
	look.unlit = luminance(values->emission) > luminance(look.diffuse);
	for (int c = 0; c < 3; c++) {
		look.diffuse[c] = at_most_1(look.diffuse[c] + values->emission[c]);
		look.specular[c] = at_most_1(f0[c] * (float)((look.exponent + 2) / 2));
	}
	return material_encode(&look);
}

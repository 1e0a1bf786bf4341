#include <math.h>
#include <string.h>
#include "base/srgb.h"
#include "material.h"
#include "model/blocks.h"

#define METALLIC 31
#define REFLECTANCE 30
#define SHUT 63
#define ROUGHNESS 255

#define LEAST_REFLECTANCE (1.0f / (REFLECTANCE * REFLECTANCE)) /* of a look that mirrors at all */

static uint64_t code_of(float x, int most)
{
	return x > 0 ? (uint64_t)((x < 1 ? x : 1) * (float)most + 0.5f) : 0;
}

uint64_t material_encode(const struct look *look)
{
	uint64_t word = 0;

	for (int c = 0; c < 3; c++)
		word |= (uint64_t)psr_linear_to_srgb(look->base[c]) << (16 + 8 * c);
	if (look->unlit)
		return word | UINT64_C(1) << 15;
	return word | code_of(look->metallic, METALLIC) << 40 | code_of(sqrtf(look->reflectance), REFLECTANCE) << 45
	       | code_of(1 - look->open, SHUT) << 50 | code_of(look->roughness, ROUGHNESS) << 56;
}

void material_decode(struct look *look, uint64_t attr)
{
	const uint32_t base = PSR_ATTR_BASE(attr);
	const float root = (float)PSR_ATTR_REFLECTANCE(attr) / REFLECTANCE;

	for (int c = 0; c < 3; c++)
		look->base[c] = psr_srgb_to_linear[base >> 8 * c & 255];
	look->metallic = (float)PSR_ATTR_METALLIC(attr) / METALLIC;
	look->reflectance = fminf(root * root, 1);
	look->open = 1 - (float)PSR_ATTR_SHUT(attr) / SHUT;
	look->roughness = (float)PSR_ATTR_ROUGHNESS(attr) / ROUGHNESS;
	look->unlit = (int)PSR_ATTR_UNLIT(attr);
}

double material_widened(double roughness, double variance)
{
	const double width2 = roughness * roughness * roughness * roughness + 2 * variance;

	return width2 < 1 ? sqrt(sqrt(width2)) : 1;
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

/* A look of diffuse colour d and F0 s, but for its roughness. */
struct split {
	float base[3], metallic, reflectance;
};

static float mean_of(const float rgb[3])
{
	return (rgb[0] + rgb[1] + rgb[2]) / 3;
}

static float error_of(const struct split *split, const float d[3], const float s[3])
{
	const float rest = 1 - split->metallic;
	float sum = 0;

	for (int c = 0; c < 3; c++) {
		const float scattered = split->base[c] * rest - d[c];
		const float mirrored = split->reflectance * rest + split->base[c] * split->metallic - s[c];

		sum += scattered * scattered + mirrored * mirrored;
	}
	return sum;
}

/* A look whose diffuse colour is d: that of the base, of which the metal mirrors its part. */
static void split_by(struct split *split, float metallic, const float d[3], const float s[3])
{
	const float rest = 1 - metallic;

	split->metallic = metallic;
	for (int c = 0; c < 3; c++)
		split->base[c] = fminf(d[c] / rest, 1);
	split->reflectance = fminf(fmaxf((mean_of(s) - mean_of(split->base) * metallic) / rest, 0), 1);
}

static void split_colors(struct split *out, const float d[3], const float s[3])
{
	const float d_mean = mean_of(d), s_mean = mean_of(s);
	struct split split = { { s[0], s[1], s[2] }, 1, (float)MATERIAL_DIELECTRIC };
	float along = 0, square = 0;

	split_by(out, 0, d, s);
	for (int c = 0; c < 3; c++) {
		along += (s[c] - s_mean) * (d[c] - d_mean);
		square += (d[c] - d_mean) * (d[c] - d_mean);
	}
	if (error_of(&split, d, s) < error_of(out, d, s))
		*out = split;
	if (along > 0 && square > 0) { /* s - its mean = metallic / (1 - metallic) (d - its mean) */
		split_by(&split, along / (along + square), d, s);
		if (error_of(&split, d, s) < error_of(out, d, s))
			*out = split;
	}
}

static float luminance(const float rgb[3])
{
	return 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2];
}

static void set_colors(struct look *look, const struct psr_material *material, const struct material_values *values)
{
	struct split split = { .metallic = values->metallic, .reflectance = (float)MATERIAL_DIELECTRIC };

	memcpy(split.base, values->base, sizeof split.base);
	if (material->is_specular_glossiness && !material->unlit)
		split_colors(&split, values->base, values->specular);
	memcpy(look->base, split.base, sizeof look->base);
	look->metallic = split.metallic;
	look->reflectance = fmaxf(split.reflectance, LEAST_REFLECTANCE);
}

uint64_t material_word(const struct psr_material *material, const struct material_values *values)
{
	const float roughness = material->is_specular_glossiness ? 1 - values->glossiness : values->roughness;
	struct look look = { .open = values->occlusion, .unlit = material->unlit };

	set_colors(&look, material, values);
	look.roughness = (float)material_widened((double)roughness, values->spread);
	if (!material->unlit) {
		look.unlit = luminance(values->emission) > luminance(look.base);
		for (int c = 0; c < 3; c++)
			look.base[c] += values->emission[c];
	}
	return material_encode(&look);
}

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "base/srgb.h"
#include "model/blocks.h"
#include "surface/material.h"

static const float grey[3] = { 0.5f, 0.5f, 0.5f };

static struct psr_material make(float metallic, float roughness)
{
	struct psr_material material;

	psr_material_default(&material);
	material.metallic = metallic;
	material.roughness = roughness;
	return material;
}

/* The word of a material's factors and a base colour. */
static uint64_t word_of(const struct psr_material *material, const float base[3])
{
	struct material_values values;

	material_values_default(&values, material);
	memcpy(values.base, base, sizeof values.base);
	return material_word(material, &values);
}

static struct look look_of(const struct psr_material *material, const float base[3])
{
	struct look look;

	material_decode(&look, word_of(material, base));
	return look;
}

/* The code of 0.04, which decodes exactly. */
#define FOUR_PERCENT 6

static void a_word_has_the_factors_of_gltf(void **state)
{
	const float gold[3] = { 1, 0.75f, 0.3f };

	(void)state;
	for (int i = 0; i <= 31; i++) {
		struct psr_material material = make((float)i / 31, (float)i / 51);
		uint64_t attr = word_of(&material, gold);

		for (int c = 0; c < 3; c++)
			assert_int_equal(PSR_ATTR_BASE(attr) >> 8 * c & 255, psr_linear_to_srgb(gold[c]));
		assert_int_equal(PSR_ATTR_METALLIC(attr), i);
		assert_int_equal(PSR_ATTR_REFLECTANCE(attr), FOUR_PERCENT);
		assert_int_equal(PSR_ATTR_ROUGHNESS(attr), 5 * i);
		assert_int_equal(PSR_ATTR_SHUT(attr), 0);
		assert_int_equal(PSR_ATTR_UNLIT(attr), 0);
	}
}

static void unlit_is_its_base_color(void **state)
{
	struct psr_material material = make(1, 0.1f);
	uint64_t attr;

	(void)state;
	material.unlit = 1;
	attr = word_of(&material, grey);
	assert_int_equal(PSR_ATTR_UNLIT(attr), 1);
	assert_int_equal(PSR_ATTR_BASE(attr), psr_linear_to_srgb(0.5f) * 0x10101u);
	assert_int_equal(attr >> 40, 0);
}

static void encoding_gives_the_decoded_bits_again(void **state)
{
	(void)state;
	for (uint64_t i = 0; i < 0x10000; i++) { /* every gloss, each roughness and base code in some of them */
		uint64_t attr = i << 40 | (i & 255) << 56 | (i * 0x010305 & 0xffffff) << 16, unlit = attr << 24 >> 24 | 1 << 15;
		struct look look;

		if (PSR_ATTR_REFLECTANCE(attr) == 31) /* counts as 30 */
			continue;
		material_decode(&look, attr);
		assert_true(material_encode(&look) == attr);
		material_decode(&look, unlit);
		assert_true(material_encode(&look) == unlit);
	}
}

/* GGX's slopes have the variance roughness^4 / 2 along each axis; variances of slopes add up. */
static void spread_normals_widen_the_lobe(void **state)
{
	struct psr_material material = make(0, 0.3f);
	struct material_values values;

	(void)state;
	material_values_default(&values, &material);
	for (double v = 0; v < 0.6; v += 0.003) {
		double widened = fmin(1, pow(pow((double)0.3f, 4) + 2 * v, 0.25));

		assert_true(fabs(material_widened((double)0.3f, v) - widened) < 1e-12);
		values.spread = v;
		/* Half a code, and the float on its way there. */
		assert_true(fabs((double)PSR_ATTR_ROUGHNESS(material_word(&material, &values)) - 255 * widened) <= 0.5001);
	}
	assert_true(material_widened(0, 1e9) == 1);
}

/* Of the two descriptions of glTF: a dielectric reflects 0.04 of all colours, a metal its own colour and has no diffuse
 * one. */
static void both_descriptions_of_a_material_agree(void **state)
{
	struct psr_material rough = make(0, 0.4f), shiny = make(1, 0.4f);
	const float gold[3] = { 1, 0.75f, 0.3f }, black[3] = { 0, 0, 0 }, glass[3] = { 0.04f, 0.04f, 0.04f };

	(void)state;
	rough.is_specular_glossiness = 1;
	rough.glossiness = 0.6f;
	memcpy(rough.specular, glass, sizeof glass);
	shiny.metallic = 0;
	assert_true(word_of(&rough, gold) == word_of(&shiny, gold));
	memcpy(rough.specular, gold, sizeof gold);
	shiny.metallic = 1;
	assert_true(word_of(&rough, black) == word_of(&shiny, gold));
}

/* Diffuse and F0 of a mixture of gold and a dielectric of the same colour come back within the steps of the codes:
 * metallic's half step, 1 / 62, moves both by so much, and the base colour is divided by what is not metal. */
static void mixtures_keep_both_of_their_colors(void **state)
{
	const float gold[3] = { 1, 0.75f, 0.3f };

	(void)state;
	for (float m = 0; m <= 0.9f; m += 0.1f) {
		struct psr_material material = make(0, 0);
		float diffuse[3];

		material.is_specular_glossiness = 1;
		for (int c = 0; c < 3; c++) {
			diffuse[c] = gold[c] * (1 - m);
			material.specular[c] = 0.04f * (1 - m) + gold[c] * m;
		}
		const struct look look = look_of(&material, diffuse);
		for (int c = 0; c < 3; c++) {
			const float rest = 1 - look.metallic, f0 = look.reflectance * rest + look.base[c] * look.metallic;

			assert_true(fabsf(look.base[c] * rest - diffuse[c]) < 1.0f / 62 + 0.005f);
			/* a step of reflectance there: 13 / 900 */
			assert_true(fabsf(f0 - material.specular[c]) < 1.0f / 62 + 0.005f + 13.0f / 900);
		}
	}
}

static void a_grey_mirror_keeps_its_diffuse_color(void **state)
{
	struct psr_material material = make(0, 0);
	const float blue[3] = { 0.1f, 0.2f, 0.9f };

	(void)state;
	material.is_specular_glossiness = 1;
	for (int i = 1; i <= 30; i++) {
		const float f0 = (float)(i * i) / 900;

		material.specular[0] = material.specular[1] = material.specular[2] = f0;
		const struct look look = look_of(&material, blue);
		assert_true(look.metallic == 0 && fabsf(look.reflectance - f0) < 1e-6f);
		assert_int_equal(PSR_ATTR_BASE(word_of(&material, blue)) >> 16, psr_linear_to_srgb(0.9f));
	}
	material.specular[0] = material.specular[1] = material.specular[2] = 0; /* still a mirror where light grazes */
	assert_int_equal(PSR_ATTR_REFLECTANCE(word_of(&material, blue)), 1);
}

static void occlusion_darkens_ambient_light_alone(void **state)
{
	struct psr_material material = make(0.5f, 0.5f);
	struct material_values values;
	uint64_t open, shut;

	(void)state;
	material_values_default(&values, &material);
	open = material_word(&material, &values);
	values.occlusion = 0.25f;
	shut = material_word(&material, &values);
	assert_int_equal(PSR_ATTR_SHUT(shut), 47); /* 0.75 of 63 */
	assert_true((open ^ shut) == UINT64_C(47) << 50);
}

static void what_shines_brighter_than_it_reflects_is_unlit(void **state)
{
	struct psr_material material = make(0, 1);
	const float green[3] = { 0, 0.5f, 0 };
	uint64_t attr;

	(void)state;
	material.emissive[0] = 1; /* luminance 0.21 against 0.36 */
	attr = word_of(&material, green);
	assert_int_equal(PSR_ATTR_UNLIT(attr), 0);
	assert_int_equal(PSR_ATTR_BASE(attr), 0xff | (uint32_t)psr_linear_to_srgb(0.5f) << 8);
	material.emissive[1] = 0.25f; /* 0.39 */
	attr = word_of(&material, green);
	assert_int_equal(PSR_ATTR_UNLIT(attr), 1);
	assert_int_equal(PSR_ATTR_BASE(attr), 0xff | (uint32_t)psr_linear_to_srgb(0.75f) << 8);
	material.emissive[1] = 100;
	assert_int_equal(PSR_ATTR_BASE(word_of(&material, green)), 0xffff);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_word_has_the_factors_of_gltf),
		cmocka_unit_test(unlit_is_its_base_color),
		cmocka_unit_test(encoding_gives_the_decoded_bits_again),
		cmocka_unit_test(spread_normals_widen_the_lobe),
		cmocka_unit_test(both_descriptions_of_a_material_agree),
		cmocka_unit_test(mixtures_keep_both_of_their_colors),
		cmocka_unit_test(a_grey_mirror_keeps_its_diffuse_color),
		cmocka_unit_test(occlusion_darkens_ambient_light_alone),
		cmocka_unit_test(what_shines_brighter_than_it_reflects_is_unlit),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

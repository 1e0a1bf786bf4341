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

static void exponent_code_is_the_nearest(void **state)
{
	(void)state;
	for (double n = 1; n < 63000; n *= 1.0037) {
		double exact = 16 * log2(n);

		/* Halfway cases may go either way with the last bit of log2. */
		if (fabs(exact - floor(exact) - 0.5) > 1e-9)
			assert_int_equal(material_exponent_code(n), (int)floor(exact + 0.5));
	}
	assert_int_equal(material_exponent_code(0), 0);
	assert_int_equal(material_exponent_code(NAN), 0);
	assert_int_equal(material_exponent_code(1e30), 255);
	assert_int_equal(material_exponent_code(INFINITY), 255);
}

static void dielectrics_keep_their_color_and_reflect_four_percent(void **state)
{
	struct psr_material rough = make(0, 1);
	uint64_t attr = word_of(&rough, grey);

	(void)state;
	assert_int_equal(PSR_ATTR_DIFFUSE(attr) & 0xff, psr_linear_to_srgb(0.5f));
	assert_int_equal(PSR_ATTR_EXPONENT(attr), 0);
	/* F0 (n + 2) / 2 at n = 1 */
	assert_int_equal(PSR_ATTR_SPECULAR(attr) & 31, (psr_linear_to_srgb(0.06f) * 31 + 127) / 255);
	assert_int_equal(PSR_ATTR_SPECULAR(attr) >> 5 & 63, (psr_linear_to_srgb(0.06f) * 63 + 127) / 255);
	assert_int_equal(PSR_ATTR_UNLIT(attr), 0);
}

static void metals_keep_half_of_their_color_and_have_a_colored_highlight(void **state)
{
	const float gold[3] = { 1, 0.75f, 0.3f };
	struct psr_material metal = make(1, 1);
	uint64_t attr = word_of(&metal, gold);

	(void)state;
	for (int c = 0; c < 3; c++)
		assert_int_equal(PSR_ATTR_DIFFUSE(attr) >> 8 * c & 255, psr_linear_to_srgb(gold[c] / 2));
	assert_true((PSR_ATTR_SPECULAR(attr) & 31) > (PSR_ATTR_SPECULAR(attr) >> 11 & 31));
}

static void smoother_is_sharper(void **state)
{
	unsigned last = 0;

	(void)state;
	for (int i = 100; i >= 0; i--) {
		struct psr_material material = make(0, (float)i / 100);
		unsigned code = PSR_ATTR_EXPONENT(word_of(&material, grey));

		assert_true(code >= last);
		last = code;
	}
	assert_int_equal(last, 255);
}

static void unlit_is_its_base_color(void **state)
{
	struct psr_material material = make(1, 0.1f);
	uint64_t attr;

	(void)state;
	material.unlit = 1;
	attr = word_of(&material, grey);
	assert_int_equal(PSR_ATTR_UNLIT(attr), 1);
	assert_int_equal(PSR_ATTR_DIFFUSE(attr), psr_linear_to_srgb(0.5f) * 0x10101u);
	assert_int_equal(PSR_ATTR_SPECULAR(attr), 0);
}

static void encoding_gives_the_decoded_bits_again(void **state)
{
	(void)state;
	for (uint64_t i = 0; i < 0x10000; i++) { /* every highlight, each exponent and diffuse code in some of them */
		uint64_t attr = i << 40 | (i & 255) << 56 | (i * 0x010305 & 0xffffff) << 16, unlit = attr << 24 >> 24 | 1 << 15;
		struct look look;

		material_decode(&look, attr);
		assert_true(material_encode(&look) == attr);
		assert_true(fabs(look.exponent - exp2((double)(i & 255) / 16)) <= 1e-11 * look.exponent);
		material_decode(&look, unlit);
		assert_true(material_encode(&look) == unlit);
	}
}

/* Gaussians of the variances 1/n and 4 v (of the reflected ray) in a row make one of their sum. */
static void spread_normals_widen_the_lobe_and_lower_it(void **state)
{
	struct psr_material material = make(0, 0.3f);
	struct material_values values;
	double n = (2 / pow((double)0.3f, 4) - 2) / 4;

	(void)state;
	material_values_default(&values, &material);
	for (double v = 0; v < 0.2; v += 0.003) {
		double widened = fmax(1, 1 / (1 / n + 4 * v));
		uint64_t attr;

		assert_true(fabs(material_widened(n, v) - widened) < 1e-12 * n);
		values.spread = v;
		attr = material_word(&material, &values);
		assert_int_equal(PSR_ATTR_EXPONENT(attr), material_exponent_code(widened));
		assert_int_equal(PSR_ATTR_SPECULAR(attr) & 31,
		                 (psr_linear_to_srgb((float)fmin(1, 0.04 * (widened + 2) / 2)) * 31 + 127) / 255);
	}
	assert_true(material_widened(1e4, 1e9) == 1);
}

/* Of the two descriptions of glTF: a dielectric reflects 0.04 of all colours, a metal its own colour and has no diffuse
 * one. */
static void both_descriptions_of_a_material_agree(void **state)
{
	struct psr_material rough = make(0, 0.4f), shiny = make(1, 0.4f);
	const float gold[3] = { 1, 0.75f, 0.3f }, black[3] = { 0, 0, 0 }, glass[3] = { 0.04f, 0.04f, 0.04f };
	struct look metal, mirror;

	(void)state;
	rough.is_specular_glossiness = 1;
	rough.glossiness = 0.6f;
	memcpy(rough.specular, glass, sizeof glass);
	shiny.metallic = 0;
	assert_true(word_of(&rough, gold) == word_of(&shiny, gold));
	memcpy(rough.specular, gold, sizeof gold);
	shiny.metallic = 1;
	material_decode(&metal, word_of(&shiny, gold));
	material_decode(&mirror, word_of(&rough, black));
	assert_true(metal.exponent == mirror.exponent);
	for (int c = 0; c < 3; c++) {
		assert_true(metal.specular[c] == mirror.specular[c]);
		/* Half of 0.04 (1 - gold) / 0.96, and a step of the codes, of 0.0089 at most. */
		assert_true(fabsf(metal.diffuse[c] - mirror.diffuse[c]) <= 0.0208f * (1 - gold[c]) + 0.0089f);
	}
	shiny.is_specular_glossiness = 1;
	shiny.specular[0] = shiny.specular[1] = shiny.specular[2] = 1;
	assert_int_equal(PSR_ATTR_DIFFUSE(word_of(&shiny, gold)), psr_linear_to_srgb(0.5f) * 0x10101u);
}

static void occlusion_darkens_the_diffuse_color_alone(void **state)
{
	struct psr_material material = make(0.5f, 0.5f);
	struct material_values values;
	uint64_t open, shut;

	(void)state;
	material_values_default(&values, &material);
	open = material_word(&material, &values);
	values.occlusion = 0.25f;
	shut = material_word(&material, &values);
	assert_int_equal(PSR_ATTR_DIFFUSE(shut), psr_linear_to_srgb(0.75f * 0.25f) * 0x10101u);
	assert_true(open >> 40 == shut >> 40);
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
	assert_int_equal(PSR_ATTR_DIFFUSE(attr), 0xff | (uint32_t)psr_linear_to_srgb(0.5f) << 8);
	material.emissive[1] = 0.25f; /* 0.39 */
	attr = word_of(&material, green);
	assert_int_equal(PSR_ATTR_UNLIT(attr), 1);
	assert_int_equal(PSR_ATTR_DIFFUSE(attr), 0xff | (uint32_t)psr_linear_to_srgb(0.75f) << 8);
	material.emissive[1] = 100;
	assert_int_equal(PSR_ATTR_DIFFUSE(word_of(&material, green)), 0xffff);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(exponent_code_is_the_nearest),
		cmocka_unit_test(dielectrics_keep_their_color_and_reflect_four_percent),
		cmocka_unit_test(metals_keep_half_of_their_color_and_have_a_colored_highlight),
		cmocka_unit_test(smoother_is_sharper),
		cmocka_unit_test(unlit_is_its_base_color),
		cmocka_unit_test(encoding_gives_the_decoded_bits_again),
		cmocka_unit_test(spread_normals_widen_the_lobe_and_lower_it),
		cmocka_unit_test(both_descriptions_of_a_material_agree),
		cmocka_unit_test(occlusion_darkens_the_diffuse_color_alone),
		cmocka_unit_test(what_shines_brighter_than_it_reflects_is_unlit),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

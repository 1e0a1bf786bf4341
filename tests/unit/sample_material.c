#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "base/srgb.h"
#include "psr/model.h"
#include "sample/material.h"

static const float grey[3] = { 0.5f, 0.5f, 0.5f };

static struct psr_material make(float metallic, float roughness)
{
	struct psr_material material;

	psr_material_default(&material);
	material.metallic = metallic;
	material.roughness = roughness;
	return material;
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
	uint64_t attr = material_attr(&rough, grey);

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
	uint64_t attr = material_attr(&metal, gold);

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
		unsigned code = PSR_ATTR_EXPONENT(material_attr(&material, grey));

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
	attr = material_attr(&material, grey);
	assert_int_equal(PSR_ATTR_UNLIT(attr), 1);
	assert_int_equal(PSR_ATTR_DIFFUSE(attr), psr_linear_to_srgb(0.5f) * 0x10101u);
	assert_int_equal(PSR_ATTR_SPECULAR(attr), 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(exponent_code_is_the_nearest),
		cmocka_unit_test(dielectrics_keep_their_color_and_reflect_four_percent),
		cmocka_unit_test(metals_keep_half_of_their_color_and_have_a_colored_highlight),
		cmocka_unit_test(smoother_is_sharper),
		cmocka_unit_test(unlit_is_its_base_color),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "base/srgb.h"
#include "base/direction.h"
#include "model/blocks.h"
#include "surface/blend.h"
#include "surface/material.h"
#include "meshes.h"

/* An angle that a normal may be off by its quantisation (psr/direction.h), radians. */
#define NORMAL_ERROR 0.0222f

static uint64_t word(uint32_t normal, uint32_t diffuse, uint32_t specular, uint32_t exponent)
{
	return (uint64_t)normal | (uint64_t)diffuse << 16 | (uint64_t)specular << 40 | (uint64_t)exponent << 56;
}

static uint64_t random_word(uint64_t *seed)
{
	return (uint64_t)(meshes_random(seed) * 0x1p32) << 32 | (uint64_t)(meshes_random(seed) * 0x1p32);
}

static uint64_t blend_two(uint64_t a, float weight_a, uint64_t b, float weight_b, const float facing[3])
{
	const uint64_t attr[2] = { a, b };
	const float weight[2] = { weight_a, weight_b };

	return blend_attr(attr, weight, 2, facing);
}

static void equal_words_give_that_word(void **state)
{
	uint64_t seed = 0x9e3779b97f4a7c15;

	(void)state;
	for (int i = 0; i < 20000; i++) {
		uint64_t attr[7], own = random_word(&seed);
		float weight[7];
		int n = 1 + (int)(7 * meshes_random(&seed));

		if (PSR_ATTR_UNLIT(own)) /* which has nothing in the bits of a highlight */
			own &= (UINT64_C(1) << 40) - 1;
		for (int k = 0; k < n; k++) {
			attr[k] = own;
			weight[k] = (float)(meshes_random(&seed) + 1e-3);
		}
		assert_true(blend_attr(attr, weight, n, psr_direction_table()[PSR_ATTR_NORMAL(own)]) == own);
	}
}

static void colors_are_averaged_in_linear_light(void **state)
{
	const float *up = psr_direction_table()[77];
	uint64_t blend = blend_two(word(77, 0x0000ff, 0, 0), 1, word(77, 0xffff00, 0, 0), 3, up);

	(void)state;
	assert_int_equal(PSR_ATTR_DIFFUSE(blend) & 255, psr_linear_to_srgb(0.25f));
	assert_int_equal(PSR_ATTR_DIFFUSE(blend) >> 8 & 255, psr_linear_to_srgb(0.75f));
	assert_int_equal(PSR_ATTR_NORMAL(blend), 77);
}

static void lobes_keep_their_light(void **state)
{
	const float *up = psr_direction_table()[77];
	/* Full peaks, exponents 16 and 2^8: variances 1/16 and 1/256, light 1/18 and 1/258. */
	uint64_t blend = blend_two(word(77, 0, 0xffff, 64), 1, word(77, 0, 0xffff, 128), 1, up);
	double light = 1.0 / 18 + 1.0 / 258, variance = (1.0 / 18 / 16 + 1.0 / 258 / 256) / light;
	unsigned code = material_exponent_code(1 / variance);

	(void)state;
	assert_int_equal(PSR_ATTR_EXPONENT(blend), code);
	assert_int_equal(PSR_ATTR_SPECULAR(blend) & 31,
	                 (psr_linear_to_srgb((float)(light / 2 * (1 / variance + 2))) * 31 + 127) / 255);
	/* What reflects nothing has no say. */
	blend = blend_two(word(77, 0, 0xffff, 64), 1, word(77, 0, 0, 0), 1, up);
	assert_int_equal(PSR_ATTR_EXPONENT(blend), 64);
	assert_int_equal(PSR_ATTR_SPECULAR(blend) & 31, (psr_linear_to_srgb(0.5f) * 31 + 127) / 255);
}

static void spread_normals_widen_the_lobe(void **state)
{
	const float (*table)[3] = psr_direction_table();
	uint64_t seed = 4;

	(void)state;
	for (int i = 0; i < 5000; i++) {
		double angle = 0.7 * meshes_random(&seed), turn = 6.28 * meshes_random(&seed), r;
		float a[3] = { (float)(sin(angle) * cos(turn)), (float)(sin(angle) * sin(turn)), (float)cos(angle) };
		float b[3] = { -a[0], -a[1], a[2] }, facing[3] = { 0, 0, 1 };
		uint32_t e = (uint32_t)(meshes_random(&seed) * 256), na = psr_direction_encode(a), nb = psr_direction_encode(b);
		uint64_t blend = blend_two(word(na, 0, 0x8410, e), 1, word(nb, 0, 0x8410, e), 1, facing);
		double n = exp2(e / 16.0), expected, exact;

		/* |a + b| / 2 of the normals as stored, from the chord between them, which does not cancel. */
		r = 0;
		for (int k = 0; k < 3; k++)
			r += ((double)table[na][k] - (double)table[nb][k]) * ((double)table[na][k] - (double)table[nb][k]);
		r = sqrt(1 - r / 4);
		expected = fmax(1, 1 / (1 / n + 4 * (1 - r) / r));
		exact = 16 * log2(expected);
		/* The table's floats are of unit length to 1e-7, which moves 4 (1 - r) by four times as much. */
		assert_true(fabs((double)PSR_ATTR_EXPONENT(blend) - exact) <= 0.5 + 16 * log2(1 + 4e-7 * n));
		assert_true(PSR_ATTR_EXPONENT(blend) <= e);
		assert_true(table[PSR_ATTR_NORMAL(blend)][2] > cosf(2 * NORMAL_ERROR));
	}
}

static void opposite_normals_give_the_one_asked_for(void **state)
{
	const float up[3] = { 0, 0, 1 }, left[3] = { -1, 0, 0 }, right[3] = { 1, 0, 0 };
	uint32_t a = psr_direction_encode(left), b = psr_direction_encode(right);
	uint64_t blend = blend_two(word(a, 0, 0x8410, 200), 1, word(b, 0, 0x8410, 200), 1, up);

	(void)state;
	assert_true(psr_direction_table()[PSR_ATTR_NORMAL(blend)][2] > 0.999f);
	/* The widest lobe, of the exponent 1: its peak is nearly 3 / 5795 of what it was, too little for five bits. */
	assert_int_equal(PSR_ATTR_EXPONENT(blend), 0);
	assert_int_equal(PSR_ATTR_SPECULAR(blend) & 31, 0);
}

static void every_blend_faces_its_view(void **state)
{
	const float (*table)[3] = psr_direction_table();
	uint64_t seed = 5;

	(void)state;
	for (int i = 0; i < 20000; i++) {
		const float *facing = table[(size_t)(meshes_random(&seed) * PSR_DIRECTIONS)];
		uint64_t blend = blend_two(random_word(&seed), (float)meshes_random(&seed), random_word(&seed), 1, facing);
		const float *normal = table[PSR_ATTR_NORMAL(blend)];

		assert_true(normal[0] * facing[0] + normal[1] * facing[1] + normal[2] * facing[2] > 0);
	}
}

static void unlit_ones_do_not_mix_with_lit_ones(void **state)
{
	const float *up = psr_direction_table()[77];
	uint64_t unlit = word(77, 0x0000ff, 0, 0) | 1 << 15, lit = word(77, 0x00ff00, 0x1234, 99);

	(void)state;
	assert_true(blend_two(unlit, 2, lit, 1, up) == unlit);
	assert_true(blend_two(unlit, 1, lit, 2, up) == lit);
	assert_true(blend_two(unlit, 1, lit, 1, up) == lit);
	assert_true(blend_two(unlit, 1, lit, 0, up) == unlit);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(equal_words_give_that_word),
		cmocka_unit_test(colors_are_averaged_in_linear_light),
		cmocka_unit_test(lobes_keep_their_light),
		cmocka_unit_test(spread_normals_widen_the_lobe),
		cmocka_unit_test(opposite_normals_give_the_one_asked_for),
		cmocka_unit_test(every_blend_faces_its_view),
		cmocka_unit_test(unlit_ones_do_not_mix_with_lit_ones),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

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

/* An angle that a normal may be off by its quantisation (base/direction.h), radians. */
#define NORMAL_ERROR 0.0222f

/* gloss: PSR_ATTR_GLOSS() */
static uint64_t word(uint32_t normal, uint32_t base, uint32_t gloss, uint32_t roughness)
{
	return (uint64_t)normal | (uint64_t)base << 16 | (uint64_t)gloss << 40 | (uint64_t)roughness << 56;
}

#define METAL 31u
#define REFLECTANCE(code) ((uint32_t)(code) << 5)
#define SHUT(code) ((uint32_t)(code) << 10)

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
		else if (PSR_ATTR_METALLIC(own) == 31) /* of which none is dielectric */
			own = (own & ~(UINT64_C(31) << 45)) | UINT64_C(6) << 45;
		else if (PSR_ATTR_REFLECTANCE(own) == 31) /* counts as 30 */
			own ^= UINT64_C(1) << 45;
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
	assert_int_equal(PSR_ATTR_BASE(blend) & 255, psr_linear_to_srgb(0.25f));
	assert_int_equal(PSR_ATTR_BASE(blend) >> 8 & 255, psr_linear_to_srgb(0.75f));
	assert_int_equal(PSR_ATTR_NORMAL(blend), 77);
}

static void scattered_and_mirrored_light_keep_their_sum(void **state)
{
	const float *up = psr_direction_table()[77];
	const uint64_t metal = word(77, 0x4080ff, METAL | REFLECTANCE(6), 99), paint = word(77, 0x204060, REFLECTANCE(12), 99);
	const uint64_t blend = blend_two(metal, 8, paint, 23, up);

	(void)state;
	assert_int_equal(PSR_ATTR_METALLIC(blend), 8);
	assert_int_equal(PSR_ATTR_REFLECTANCE(blend), 12); /* of the paint alone */
	assert_int_equal(PSR_ATTR_ROUGHNESS(blend), 99);
	for (int c = 0; c < 3; c++) {
		const float a = psr_srgb_to_linear[PSR_ATTR_BASE(metal) >> 8 * c & 255];
		const float b = psr_srgb_to_linear[PSR_ATTR_BASE(paint) >> 8 * c & 255];

		assert_int_equal(PSR_ATTR_BASE(blend) >> 8 * c & 255, psr_linear_to_srgb((a * 8 + b * 23) / 31));
	}
	assert_int_equal(PSR_ATTR_SHUT(blend_two(word(77, 0, SHUT(60), 0), 1, word(77, 0, SHUT(20), 0), 3, up)), 30);
}

/* Squared widths, the fourth powers of roughness, count by F0: 0.04 and 0.16 of the whole here. */
static void lobes_have_the_mean_of_their_widths(void **state)
{
	const float *up = psr_direction_table()[77];
	const uint32_t dim = REFLECTANCE(6), bright = REFLECTANCE(12);
	const double expected = pow((0.04 * pow(51 / 255.0, 4) + 0.16 * pow(153 / 255.0, 4)) / 0.2, 0.25);

	(void)state;
	assert_int_equal(PSR_ATTR_ROUGHNESS(blend_two(word(77, 0, dim, 51), 1, word(77, 0, bright, 153), 1, up)),
	                 (int)(expected * 255 + 0.5));
	/* What reflects nothing has no say. */
	assert_int_equal(PSR_ATTR_ROUGHNESS(blend_two(word(77, 0, dim, 51), 1, word(77, 0, 0, 255), 1, up)), 51);
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
		uint32_t rough = (uint32_t)(meshes_random(&seed) * 256);
		uint32_t na = psr_direction_encode(a), nb = psr_direction_encode(b), gloss = REFLECTANCE(6);
		uint64_t blend = blend_two(word(na, 0, gloss, rough), 1, word(nb, 0, gloss, rough), 1, facing);
		double expected;

		/* |a + b| / 2 of the normals as stored, from the chord between them, which does not cancel. */
		r = 0;
		for (int k = 0; k < 3; k++)
			r += ((double)table[na][k] - (double)table[nb][k]) * ((double)table[na][k] - (double)table[nb][k]);
		r = sqrt(1 - r / 4);
		expected = 255 * fmin(1, pow(pow(rough / 255.0, 4) + 2 * (1 - r) / r, 0.25));
		/* Half a code. The table's floats are of unit length to 1e-7, which moves 1 - r as much: by 1e-7^(1/4) at
		 * most, 0.02, where nothing else widens the lobe. */
		assert_true(fabs((double)PSR_ATTR_ROUGHNESS(blend) - expected) <= 0.5001 + 255 * 0.02);
		assert_true(PSR_ATTR_ROUGHNESS(blend) >= rough);
		assert_true(table[PSR_ATTR_NORMAL(blend)][2] > cosf(2 * NORMAL_ERROR));
	}
}

static void opposite_normals_give_the_one_asked_for(void **state)
{
	const float up[3] = { 0, 0, 1 }, left[3] = { -1, 0, 0 }, right[3] = { 1, 0, 0 };
	uint32_t a = psr_direction_encode(left), b = psr_direction_encode(right);
	uint64_t blend = blend_two(word(a, 0, METAL, 20), 1, word(b, 0, METAL, 20), 1, up);

	(void)state;
	assert_true(psr_direction_table()[PSR_ATTR_NORMAL(blend)][2] > 0.999f);
	assert_int_equal(PSR_ATTR_ROUGHNESS(blend), 255);
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
	uint64_t unlit = word(77, 0x0000ff, 0, 0) | 1 << 15, lit = word(77, 0x00ff00, REFLECTANCE(9) | SHUT(20), 99);

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
		cmocka_unit_test(scattered_and_mirrored_light_keep_their_sum),
		cmocka_unit_test(lobes_have_the_mean_of_their_widths),
		cmocka_unit_test(spread_normals_widen_the_lobe),
		cmocka_unit_test(opposite_normals_give_the_one_asked_for),
		cmocka_unit_test(every_blend_faces_its_view),
		cmocka_unit_test(unlit_ones_do_not_mix_with_lit_ones),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

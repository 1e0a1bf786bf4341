/* Metrics of pictures, beside the values of other programs and of hand. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "compare/compare.h"

#define W 64
#define H 48
#define N (W * H)

static const uint32_t size[2] = { W, H };

/* A disc before a gradient. */
static void draw(uint8_t *rgb, int radius)
{
	for (int y = 0; y < H; y++)
		for (int x = 0; x < W; x++) {
			const int in = (x - 32) * (x - 32) + (y - 24) * (y - 24) < radius * radius;
			const uint8_t inside[3] = { 220, 60, 40 }, outside[3] = { (uint8_t)(40 + x), (uint8_t)(50 + y), 90 };

			memcpy(rgb + 3 * (y * W + x), in ? inside : outside, 3);
		}
}

enum { DISC, NOISE, COLOUR, N_KINDS };

static void change(uint8_t *rgb, const uint8_t *from, int kind)
{
	if (kind == DISC)
		draw(rgb, 16);
	for (int i = 0; i < 3 * N && kind != DISC; i++) {
		const int x = i / 3 % W, y = i / 3 / W;

		rgb[i] = kind == NOISE ? (uint8_t)(from[i] + ((x * 7 + y * 13) % 11 - 5) * 3) : from[i / 3 * 3 + (i + 1) % 3];
	}
}

static uint8_t first[3 * N], other[3 * N];

static int set_up(void **state)
{
	(void)state;
	draw(first, 15);
	return 0;
}

/* FLIP of FLIP.h of its authors, version 1.6; SSIM and PSNR of scikit-image with gaussian_weights, sigma 1.5 and
 * use_sample_covariance false. PSNR may differ by the digits they printed, FLIP by a part in 1000 of its least value
 * here, as FLIP.h computes with floats, and SSIM by what rounding means of squares below 2^16 to floats, to 2^-8, is of
 * its constant of (0.03 * 255)^2. */
static void metrics_have_the_values_of_other_programs(void **state)
{
	static const struct {
		double psnr, ssim, flip, off;
	} expected[N_KINDS] = {
		{ 24.002546, 0.871067, 0.0766878, 0.031250 },
		{ 28.589792, 0.497602, 0.0354795, 0.363607 },
		{ 11.213435, 0.612325, 0.5219250, 0.913411 },
	};

	(void)state;
	for (int kind = 0; kind < N_KINDS; kind++) {
		double ssim, flip;

		change(other, first, kind);
		assert_int_equal(compare_ssim(&ssim, other, first, size, NULL), PSR_OK);
		assert_int_equal(compare_flip(&flip, other, first, size, NULL), PSR_OK);
		assert_true(fabs(compare_psnr(other, first, NULL, N) - expected[kind].psnr) < 1e-6);
		assert_true(fabs(ssim - expected[kind].ssim) < 6.7e-5);
		assert_true(fabs(flip - expected[kind].flip) < 3.5e-5);
		assert_true(fabs(compare_off(other, first, N, 10) - expected[kind].off) < 1e-6);
	}
}

static void equal_pictures_differ_by_nothing(void **state)
{
	struct compare_box box;
	static float map[N];
	double ssim, flip;

	(void)state;
	assert_true(isinf(compare_psnr(first, first, NULL, N)));
	assert_true(compare_off(first, first, N, 0) == 0);
	assert_int_equal(compare_ssim(&ssim, first, first, size, NULL), PSR_OK);
	assert_int_equal(compare_flip(&flip, first, first, size, NULL), PSR_OK);
	assert_true(ssim == 1 && flip == 0);
	compare_map_color(map, first, first, N);
	assert_int_equal(compare_worst(&box, map, size, NULL), PSR_OK);
	assert_int_equal(box.width, 0);
}

/* Section 4.1 of the paper: green and blue are the most different colours, and their difference is 1. */
static void flip_of_green_and_blue_is_1(void **state)
{
	double there, back;

	(void)state;
	for (int i = 0; i < N; i++) {
		memcpy(first + 3 * i, (const uint8_t[]){ 0, 255, 0 }, 3);
		memcpy(other + 3 * i, (const uint8_t[]){ 0, 0, 255 }, 3);
	}
	assert_int_equal(compare_flip(&there, first, other, size, NULL), PSR_OK);
	assert_int_equal(compare_flip(&back, other, first, size, NULL), PSR_OK);
	assert_true(fabs(there - 1) < 1e-4); /* floats of the filters */
	assert_true(there == back);
}

static void only_covered_pixels_count_for_psnr(void **state)
{
	static uint8_t covered[N];

	(void)state;
	memset(covered, 1, sizeof covered);
	memcpy(other, first, sizeof other);
	other[3 * 100] ^= 255;
	assert_true(isfinite(compare_psnr(other, first, covered, N)));
	covered[100] = 0;
	assert_true(isinf(compare_psnr(other, first, covered, N)));
}

static void tiny_pictures_can_be_compared(void **state)
{
	static const uint32_t sizes[][2] = { { 1, 1 }, { 2, 1 }, { 1, 7 }, { 10, 3 } };

	(void)state;
	change(other, first, COLOUR);
	for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
		double ssim, flip;

		assert_int_equal(compare_ssim(&ssim, other, first, sizes[i], NULL), PSR_OK);
		assert_int_equal(compare_flip(&flip, other, first, sizes[i], NULL), PSR_OK);
		assert_true(ssim >= -1 && ssim < 1);
		assert_true(flip > 0 && flip <= 1);
	}
}

static void depths_count_where_either_shows_something(void **state)
{
	const float inf = INFINITY, a[4] = { 1, 2, inf, inf }, b[4] = { 1, 5, inf, inf }, c[4] = { 1, 5, 3, inf };
	const float none[4] = { inf, inf, inf, inf };

	(void)state;
	assert_true(compare_depth_rmse(a, a, 4) == 0);
	assert_true(compare_depth_rmse(a, b, 4) == sqrt(9.0 / 2));
	assert_true(compare_depth_rmse(a, c, 4) == sqrt((9.0 + 16) / 3)); /* one is missing; depths are 1 to 5 */
	assert_true(compare_depth_rmse(none, none, 4) == 0);
	assert_true(isinf(compare_depth_rmse(a, none, 4)));
}

static void the_worst_box_is_around_the_worst_pixels(void **state)
{
	static float map[N];
	struct compare_box box;

	(void)state;
	for (int i = 0; i < N; i++)
		map[i] = 0.1f;
	map[10 * W + 5] = map[12 * W + 9] = 100;
	map[11 * W + 20] = 49; /* below half of them */
	map[40 * W + 60] = 99;
	assert_int_equal(compare_worst(&box, map, size, NULL), PSR_OK);
	assert_int_equal(box.x, 5);
	assert_int_equal(box.y, 10);
	assert_int_equal(box.width, 5);
	assert_int_equal(box.height, 3);
	map[40 * W + 60] = INFINITY; /* shown by one picture only: twice the worst of the others */
	assert_int_equal(compare_worst(&box, map, size, NULL), PSR_OK);
	assert_int_equal(box.x, 60);
	assert_int_equal(box.y, 40);
	assert_int_equal(box.width * box.height, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(metrics_have_the_values_of_other_programs, set_up),
		cmocka_unit_test_setup(equal_pictures_differ_by_nothing, set_up),
		cmocka_unit_test_setup(flip_of_green_and_blue_is_1, set_up),
		cmocka_unit_test_setup(only_covered_pixels_count_for_psnr, set_up),
		cmocka_unit_test_setup(tiny_pictures_can_be_compared, set_up),
		cmocka_unit_test(depths_count_where_either_shows_something),
		cmocka_unit_test(the_worst_box_is_around_the_worst_pixels),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

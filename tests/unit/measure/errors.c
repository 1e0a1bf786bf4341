/* How far a frame is from the truth: each figure for a frame that is wrong in one way. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "measure/measure.h"

#define N 12
#define SPACING 0.01

/* A wall at z = 2 that fills columns 2 to 9 and all rows, textured below row 6, and a frame that shows just that. */
static struct {
	uint8_t rgb[N * N][3];
	float coverage[N * N], textured[N * N], depth[N * N], range[N * N][2], normal[N * N][3];
} truth;
static struct {
	uint8_t rgb[N * N][3];
	float depth[N * N];
	int16_t normal[N * N][3];
} drawn;

static const struct psr_source_planes planes = { .rgb = truth.rgb, .coverage = truth.coverage,
	                                             .textured = truth.textured, .depth = truth.depth,
	                                             .range = truth.range, .normal = truth.normal };

static int set_up(void **state)
{
	(void)state;
	for (int i = 0; i < N * N; i++) {
		const int is_wall = i % N >= 2 && i % N <= 9;

		memset(truth.rgb[i], is_wall ? 100 : 200, 3);
		memset(drawn.rgb[i], is_wall ? 100 : 200, 3);
		truth.coverage[i] = (float)is_wall;
		truth.textured[i] = (float)(is_wall && i / N >= 6);
		truth.depth[i] = drawn.depth[i] = is_wall ? 2 : INFINITY;
		truth.range[i][0] = is_wall ? 2 : INFINITY;
		truth.range[i][1] = is_wall ? 2 : -INFINITY;
		for (int k = 0; k < 3; k++) {
			truth.normal[i][k] = (float)(is_wall && k == 2);
			drawn.normal[i][k] = is_wall && k == 2 ? 32767 : 0;
		}
	}
	return 0;
}

static struct psr_errors measure(void)
{
	const struct psr_frame frame = { .width = N, .height = N, .rgb = drawn.rgb[0], .depth = drawn.depth,
		                             .normal = drawn.normal[0] };
	struct psr_errors errors;

	assert_int_equal(psr_errors_measure(&errors, &frame, &planes, SPACING, NULL), PSR_OK);
	return errors;
}

static void the_truth_itself_has_no_errors(void **state)
{
	const struct psr_errors e = measure();

	(void)state;
	assert_int_equal(e.n_covered, 8 * N);
	assert_int_equal(e.n_inside, 6 * N);
	assert_int_equal(e.n_textured, 6 * 4); /* rows 7 to 10: the last has no next one */
	assert_true(isinf(e.psnr) && isinf(e.psnr_inside) && isinf(e.psnr_textured) && isinf(e.psnr_shading));
	assert_true(e.n_holes == 0 && e.n_leaks == 0 && e.n_outline == 0 && e.geometry == 0);
	assert_true(e.depth_rmse == 0 && e.normal_p99 == 0 && fabs(e.ssim - 1) < 1e-6 && e.flip == 0);
}

static void holes_and_leaks_are_pixels_inside_that_show_nothing_or_what_lies_behind(void **state)
{
	struct psr_errors e;

	(void)state;
	drawn.depth[5 * N + 5] = INFINITY;
	drawn.depth[5 * N + 7] = 2 + 3.1f * SPACING;
	drawn.depth[7 * N + 5] = 2 + 2.9f * SPACING; /* the same surface */
	drawn.depth[7 * N + 7] = 1; /* in front: wrong, and no leak */
	drawn.depth[7 * N + 2] = INFINITY; /* at the edge: its outline */
	e = measure();
	assert_int_equal(e.n_holes, 1);
	assert_int_equal(e.n_leaks, 1);
	assert_int_equal(e.n_outline, 2);
	assert_true(e.outline_max == 4); /* from column 5 to column 1 */
}

static void the_squared_error_is_geometry_s_where_the_place_is_wrong(void **state)
{
	struct psr_errors e;

	(void)state;
	memset(drawn.rgb[5 * N + 5], 110, 3); /* a right place: 100 * 3 */
	memset(drawn.rgb[5 * N + 2], 130, 3); /* the edge: 900 * 3 */
	e = measure();
	assert_true(fabs(e.geometry - 0.9) < 1e-12);
	assert_true(fabs(e.psnr - 10 * log10(255.0 * 255 * 8 * N / 1000)) < 1e-9);
	assert_true(fabs(e.psnr_inside - 10 * log10(255.0 * 255 * 6 * N / 100)) < 1e-9);
	assert_true(e.psnr_shading == e.psnr_inside && isinf(e.psnr_textured));
	drawn.depth[5 * N + 5] = 3;
	e = measure();
	assert_true(e.geometry == 1 && isinf(e.psnr_shading));
}

static void depths_count_beyond_the_range_of_the_pixel_s_rays(void **state)
{
	struct psr_errors e;

	(void)state;
	truth.range[5 * N + 5][1] = 2.5f;
	drawn.depth[5 * N + 5] = 2.25f;
	for (int x = 3; x <= 8; x++)
		drawn.depth[8 * N + x] = 2 - 2 * (float)SPACING;
	e = measure();
	assert_true(fabs(e.depth_rmse - sqrt(4.0 * 6 / (6 * N))) < 1e-4);
	assert_true(fabs(e.depth_p999 - 2) < 1e-4);
}

/* One column too wide on the right: outside by one pixel. */
static void outlines_are_as_far_as_the_nearest_pixel_that_looks_so(void **state)
{
	struct psr_errors e;

	(void)state;
	for (int y = 0; y < N; y++)
		drawn.depth[y * N + 10] = 2;
	e = measure();
	assert_int_equal(e.n_outline, N);
	assert_true(fabs(e.outline_mean - 1) < 1e-12 && e.outline_max == 1);
}

static void normals_are_compared_by_angle(void **state)
{
	struct psr_errors e;

	(void)state;
	for (int i = 0; i < N * N; i++)
		if (isfinite(drawn.depth[i]))
			drawn.normal[i][0] = 32767;
	e = measure();
	assert_true(fabs(e.normal_mean - 45) < 1e-6 && fabs(e.normal_p99 - 45) < 1e-6);
}

static void shimmer_is_change_that_the_truth_does_not_have(void **state)
{
	static uint8_t next[N * N][3], own[N * N][3];
	const struct psr_step step = { { drawn.rgb, next },
		                           { truth.rgb, own },
		                           { truth.coverage, truth.coverage } };

	(void)state;
	for (int i = 0; i < N * N; i++)
		for (int c = 0; c < 3; c++)
			next[i][c] = own[i][c] = (uint8_t)(drawn.rgb[i][c] + i % 7);
	assert_true(psr_errors_shimmer(&step, N * N) == 0);
	next[5 * N + 5][0] += 12;
	memset(next[0], 0, 3); /* not covered */
	assert_true(fabs(psr_errors_shimmer(&step, N * N) - sqrt(144.0 / (3 * 8 * N))) < 1e-9);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(the_truth_itself_has_no_errors, set_up),
		cmocka_unit_test_setup(holes_and_leaks_are_pixels_inside_that_show_nothing_or_what_lies_behind, set_up),
		cmocka_unit_test_setup(the_squared_error_is_geometry_s_where_the_place_is_wrong, set_up),
		cmocka_unit_test_setup(depths_count_beyond_the_range_of_the_pixel_s_rays, set_up),
		cmocka_unit_test_setup(outlines_are_as_far_as_the_nearest_pixel_that_looks_so, set_up),
		cmocka_unit_test_setup(normals_are_compared_by_angle, set_up),
		cmocka_unit_test_setup(shimmer_is_change_that_the_truth_does_not_have, set_up),
	};

	return cmocka_run_group_tests_name("errors", tests, NULL, NULL);
}

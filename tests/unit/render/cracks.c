/* Cracks between differential points, on surfaces made by hand: short slits whose rims are near to each other close,
 * and nothing else does. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "render/cracks.h"
#include "render/gaps.h"

#define WIDTH 160 /* two pieces */
#define HEIGHT 64 /* two rows of bricks */
#define SPACING 2.0f /* of the model; pixels are 1, thresholds of level 1 are 3 */
#define NEAR_Z 100.0f

static uint64_t word[WIDTH * HEIGHT];
static uint16_t weight[WIDTH * HEIGHT];

/* A surface at NEAR_Z, of points or of blocks. */
static void lay_surface(void)
{
	for (size_t i = 0; i < WIDTH * HEIGHT; i++)
		word[i] = (uint64_t)psr_bits_from_float(NEAR_Z) << 32 | i % PSR_BLOCK_SAMPLES;
}

static void set_depth(uint32_t x, uint32_t y, float z)
{
	uint64_t *at = &word[y * WIDTH + x];

	*at = z < INFINITY ? (uint64_t)psr_bits_from_float(z) << 32 | (uint32_t)*at : PSR_WORD_EMPTY;
}

/* Returns how many pixels are closed. */
static uint32_t count_closed(int shows_points)
{
	static const struct psr_points *const some = (const struct psr_points *)&some;
	struct warp_points points = { .model = some };
	struct warp_instance warp = { .points = shows_points ? &points : NULL };
	struct plan_instance instance = { .level_spacing = SPACING };
	struct plan plan = { .n_instances = 1, .instance = &instance, .warp = &warp, .has_points = 1 };
	const struct psr_zstack stack = { .width = WIDTH, .height = HEIGHT, .word = word };
	uint8_t bricks[(WIDTH + BRICK - 1) / BRICK * (HEIGHT / BRICK)];
	const struct gaps_map map = { weight, bricks };
	uint32_t n = 0, n_first = 0;

	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		plan.gap_scale[k] = 1;
		plan.gap_offset[k] = 1.5f * (float)(1 << k);
	}
	for (int isa = 0; isa < PSR_N_ISAS; isa++) {
		const struct simd *simd = simd_of((enum psr_isa)isa);
		struct gaps_counts counts = { 0, 0, 0, 0 };

		if (simd == NULL)
			continue;
		n = 0;
		for (uint32_t y = 0; y < HEIGHT; y += BRICK)
			counts.n_pinholes += gaps_rows(simd, &plan, &stack, y, y + BRICK, &map).n_pinholes;
		for (size_t i = 0; i < WIDTH * HEIGHT; i++)
			n += weight[i] == 0;
		for (uint32_t y = 0; y < HEIGHT; y++)
			for (uint32_t x = 0; x < WIDTH; x++)
				if (weight[y * WIDTH + x] == 0)
					assert_true(bricks[y / BRICK * ((WIDTH + BRICK - 1) / BRICK) + x / BRICK]);
		assert_int_equal(counts.n_pinholes, n);
		if (isa == 0)
			n_first = n;
		assert_int_equal(n, n_first);
	}
	return n;
}

/* Opens n pixels from (x, y) on, a step each. */
static void open_slit(uint32_t n, uint32_t x, uint32_t y, int step_x, int step_y, float z)
{
	for (uint32_t i = 0; i < n; i++)
		set_depth(x + i * (uint32_t)step_x, y + i * (uint32_t)step_y, z);
}

static void slits_of_all_directions_close(void **state)
{
	static const int step[4][2] = { { 1, 0 }, { 0, 1 }, { 1, 1 }, { -1, 1 } };
	const float behind[] = { NEAR_Z + 4, 2 * NEAR_Z, INFINITY };

	(void)state;
	for (uint32_t n = 2; n <= CRACK_MOST; n++)
		for (int d = 0; d < 4; d++)
			for (int b = 0; b < 3; b++) {
				/* Across the border of pieces, and of bricks. */
				lay_surface();
				open_slit(n, 128 - n / 2 * (uint32_t)step[d][0], 32 - n / 2 * (uint32_t)step[d][1], step[d][0], step[d][1],
				          behind[b]);
				assert_int_equal(count_closed(1), n);
			}
}

/* Where a slit has weight, the guard against pinholes may close its ends. */
static void what_is_long_or_wide_stays_open(void **state)
{
	(void)state;
	lay_surface();
	open_slit(CRACK_MOST + 1, 60, 20, 1, 0, INFINITY);
	assert_true(count_closed(1) <= 2);
	lay_surface();
	for (uint32_t y = 20; y < 22; y++)
		open_slit(2, 60, y, 1, 0, INFINITY);
	assert_int_equal(count_closed(1), 0);
	lay_surface();
	open_slit(6, 0, 20, 1, 0, INFINITY); /* from the picture's border */
	assert_true(count_closed(1) <= 1);
	lay_surface();
	open_slit(3, 60, 20, 1, 0, NEAR_Z + 2.9f); /* less than the threshold behind */
	assert_int_equal(count_closed(1), 0);
}

static void rims_are_near_to_each_other(void **state)
{
	const struct {
		uint32_t length;
		float apart; /* spacings */
		int closes;
	} cases[] = {
		{ 1, CRACK_APART - 0.1f, 1 }, { 1, CRACK_APART + 0.1f, 0 },
		{ CRACK_SHORT, CRACK_APART / 2 - 0.1f, 1 }, { CRACK_SHORT, CRACK_APART / 2 + 0.1f, 0 },
		{ CRACK_SHORT + 1, CRACK_APART / 4 - 0.1f, 1 }, { CRACK_SHORT + 1, CRACK_APART / 4 + 0.1f, 0 },
	};

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		lay_surface();
		for (uint32_t y = 0; y < 20; y++)
			for (uint32_t x = 0; x < WIDTH; x++)
				set_depth(x, y, NEAR_Z + cases[i].apart * SPACING);
		open_slit(cases[i].length, 60, 20, 1, 0, 2 * NEAR_Z);
		assert_int_equal(count_closed(1), cases[i].closes ? cases[i].length : 0);
	}
}

/* On a ramp of a a column and three times as much a line, what is on both sides of a pixel differs by 2a along the row
 * and by more along all other ways; by 3a with two pixels in a row. All around is apart by 9a at most. */
static void a_surface_goes_on_across_a_crack(void **state)
{
	const struct {
		uint32_t length;
		float step; /* spacings */
		int closes;
	} cases[] = {
		{ 1, CRACK_STEP_ALONE - 0.1f, 1 }, { 1, CRACK_STEP_ALONE + 0.1f, 0 },
		{ 2, CRACK_STEP - 0.1f, 1 }, { 2, CRACK_STEP + 0.1f, 0 },
	};

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		const float a = cases[i].step * SPACING / (float)(cases[i].length + 1);

		for (uint32_t y = 0; y < HEIGHT; y++)
			for (uint32_t x = 0; x < WIDTH; x++)
				set_depth(x, y, NEAR_Z + a * (float)x + 3 * a * (float)y);
		open_slit(cases[i].length, 60, 20, 1, 0, INFINITY);
		assert_int_equal(count_closed(1), cases[i].closes ? cases[i].length : 0);
	}
}

/* What shows through slopes by more than the threshold a pixel, and is no rim. */
static void cracks_before_a_slope_close(void **state)
{
	(void)state;
	for (uint32_t n = 2; n <= CRACK_MOST; n++) {
		lay_surface();
		for (uint32_t i = 0; i < n; i++)
			set_depth(60 + i, 20, 2 * NEAR_Z + 10 * (float)i);
		assert_int_equal(count_closed(1), n);
	}
}

static void blocks_have_no_cracks(void **state)
{
	(void)state;
	lay_surface();
	open_slit(4, 60, 20, 1, 0, 2 * NEAR_Z);
	assert_int_equal(count_closed(1), 4);
	assert_true(count_closed(0) <= 2);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(slits_of_all_directions_close),
		cmocka_unit_test(what_is_long_or_wide_stays_open),
		cmocka_unit_test(rims_are_near_to_each_other),
		cmocka_unit_test(a_surface_goes_on_across_a_crack),
		cmocka_unit_test(cracks_before_a_slope_close),
		cmocka_unit_test(blocks_have_no_cracks),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

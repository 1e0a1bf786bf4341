/* Gaps in vectors against one pixel after the other, on random stacks, for every ISA that the machine has; and the
 * guard against pinholes on surfaces made by hand. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/random.h"
#include "render/gaps.h"

static uint64_t seed;

static uint32_t draw(uint32_t n)
{
	return random_below(&seed, n);
}

/* One unit a pixel at depth 1: thresholds are 3 pixels at level 1, 6 at level 2. */
static struct plan plan_of(int perspective)
{
	struct plan plan = { .perspective = perspective };
	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		const float t = 1.5f * (float)(1 << k);
		plan.gap_scale[k] = perspective ? 1 + t / 256 : 1;
		plan.gap_offset[k] = perspective ? 0 : t;
	}
	return plan;
}

/* ---- one pixel after the other ---- */

/* The square of cell centres in which the centre of a pixel lies begins at cell (i, j), counted with the guard band;
 * the pixel is at (fx, fy) of 2^(k + 1). Positions are in half pixels, so that centres are whole numbers. */
static int32_t square_of(uint32_t pixel, int k, int32_t *fraction)
{
	const int32_t at = 2 * (int32_t)pixel + 1 - (1 << k);
	*fraction = at & ((2 << k) - 1);
	return (at >> (k + 1)) + 1;
}

static int covers(const struct plan *plan, const struct psr_zstack *stack, int k, int32_t i, int32_t j, float z)
{
	const uint32_t width = stack->level[k].width, height = stack->level[k].height;
	if ((uint32_t)i >= width || (uint32_t)j >= height)
		return 0;
	return stack->level[k].z[(size_t)j * width + (size_t)i] * plan->gap_scale[k] + plan->gap_offset[k] < z;
}

static int covers_either(const struct plan *plan, const struct psr_zstack *stack, int k, int32_t i, int32_t j, float z)
{
	return covers(plan, stack, k, i, j, z) || covers(plan, stack, k - 1, 2 * i - 1, 2 * j - 1, z) ||
	       covers(plan, stack, k - 1, 2 * i, 2 * j - 1, z) || covers(plan, stack, k - 1, 2 * i - 1, 2 * j, z) ||
	       covers(plan, stack, k - 1, 2 * i, 2 * j, z);
}

typedef int covers_fn(const struct plan *plan, const struct psr_zstack *stack, int k, int32_t i, int32_t j, float z);

static int32_t coverage(const struct plan *plan, const struct psr_zstack *stack, uint32_t x, uint32_t y, int k, float z,
                        covers_fn *corner)
{
	int32_t fx, fy;
	const int32_t i = square_of(x, k, &fx), j = square_of(y, k, &fy), one = 2 << k;
	const int32_t sum = (corner(plan, stack, k, i, j, z) ? (one - fx) * (one - fy) : 0) +
	                    (corner(plan, stack, k, i + 1, j, z) ? fx * (one - fy) : 0) +
	                    (corner(plan, stack, k, i, j + 1, z) ? (one - fx) * fy : 0) +
	                    (corner(plan, stack, k, i + 1, j + 1, z) ? fx * fy : 0);
	return (int32_t)((int64_t)sum * WEIGHT_ONE / ((int64_t)one * one));
}

static float depth_at(const struct psr_zstack *stack, int64_t x, int64_t y)
{
	if (x < 0 || y < 0 || x >= (int64_t)stack->width || y >= (int64_t)stack->height)
		return INFINITY;
	return psr_float_from_bits((uint32_t)(psr_zstack_row(stack, (uint32_t)y)[x] >> 32));
}

static int is_pinhole(const struct plan *plan, const struct psr_zstack *stack, uint32_t x, uint32_t y)
{
	const float own = depth_at(stack, x, y);
	float nearest = INFINITY, farthest = 0;
	int n = 0;
	for (int v = -1; v <= 1; v++)
		for (int u = -1; u <= 1; u++) {
			const float z = depth_at(stack, (int64_t)x + u, (int64_t)y + v);
			if ((!u && !v) || !(z * plan->gap_scale[1] + plan->gap_offset[1] < own))
				continue;
			n++;
			nearest = z < nearest ? z : nearest;
			farthest = z > farthest ? z : farthest;
		}
	const int alike = own < INFINITY ? 1 : 4;
	return n >= 7 && farthest <= nearest * plan->gap_scale[alike] + plan->gap_offset[alike];
}

/* ---- closing, one pixel after the other ---- */

static int is_in_picture(const struct psr_zstack *stack, int64_t x, int64_t y)
{
	return x >= 0 && y >= 0 && x < (int64_t)stack->width && y < (int64_t)stack->height;
}

static float cell_at(const struct psr_zstack *stack, int k, int64_t i, int64_t j)
{
	if (i < 0 || j < 0 || i >= stack->level[k].width || j >= stack->level[k].height)
		return INFINITY;
	return stack->level[k].z[(size_t)j * stack->level[k].width + (size_t)i];
}

/* What the guard band knows of levels k to 2. */
static float depth_beyond(const struct psr_zstack *stack, int k, int64_t x, int64_t y)
{
	float least = INFINITY;
	for (; k <= 2; k++)
		if (stack->levels >> k & 1)
			least = fminf(least, cell_at(stack, k, (x >> k) + 1, (y >> k) + 1));
	return least;
}

static float least_around(const struct psr_zstack *stack, int k, int64_t x, int64_t y)
{
	float least = INFINITY;
	for (int64_t v = y - k; v <= y + k; v++)
		for (int64_t u = x - k; u <= x + k; u++)
			least = fminf(least, is_in_picture(stack, u, v) ? depth_at(stack, u, v) : depth_beyond(stack, k, u, v));
	return least == INFINITY && !is_in_picture(stack, x, y) ? 0 : least;
}

/* Whether a sample of levels k to 2 is near. */
static int is_near(const struct psr_zstack *stack, uint32_t x, uint32_t y, int k)
{
	for (; k <= 2; k++)
		for (int64_t j = y >> k; (stack->levels >> k & 1) && j <= (y >> k) + 2; j++)
			for (int64_t i = x >> k; i <= (x >> k) + 2; i++)
				if (cell_at(stack, k, i, j) < INFINITY)
					return 1;
	return 0;
}

static int is_closed(const struct plan *plan, const struct psr_zstack *stack, uint32_t x, uint32_t y, int k, float z)
{
	float greatest = 0;
	if (!is_near(stack, x, y, k))
		return 0;
	for (int64_t v = (int64_t)y - k; v <= (int64_t)y + k; v++)
		for (int64_t u = (int64_t)x - k; u <= (int64_t)x + k; u++)
			greatest = fmaxf(greatest, least_around(stack, k, u, v));
	return greatest * plan->gap_scale[k - 1] + plan->gap_offset[k - 1] < z;
}

static int32_t cover_of(const struct plan *plan, const struct psr_zstack *stack, uint32_t x, uint32_t y, int k, float z)
{
	if (plan->gap_method == PSR_GAPS_OPAQUE)
		return covers(plan, stack, k, (int32_t)(x >> k) + 1, (int32_t)(y >> k) + 1, z) ? WEIGHT_ONE : 0;
	if (plan->gap_method == PSR_GAPS_CLOSED && k <= 2)
		return is_closed(plan, stack, x, y, k, z) ? WEIGHT_ONE : 0;
	const int32_t cover = coverage(plan, stack, x, y, k, z, covers);
	const int is_seam = k > 1 && (stack->levels >> (k - 1) & 1) && cover > 0 && cover < WEIGHT_ONE;
	return is_seam ? coverage(plan, stack, x, y, k, z, covers_either) : cover;
}

static uint16_t weight_of(const struct plan *plan, const struct psr_zstack *stack, uint32_t x, uint32_t y,
                          uint32_t *n_pinholes)
{
	const float z = depth_at(stack, x, y);
	int32_t most = 0;
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		/* squares of level 1 act near samples of level 2, too */
		const int is_finer = plan->gap_method == PSR_GAPS_CLOSED && k == 1 && (stack->levels >> 2 & 1);
		if (!(stack->levels >> k & 1) && !is_finer)
			continue;
		const int32_t cover = cover_of(plan, stack, x, y, k, z);
		most = cover > most ? cover : most;
	}
	if (most < WEIGHT_ONE && is_pinhole(plan, stack, x, y)) {
		++*n_pinholes;
		return 0;
	}
	return (uint16_t)(WEIGHT_ONE - most);
}

/* ---- stacks ---- */

static struct psr_zstack stack_make(uint32_t width, uint32_t height, uint32_t levels)
{
	struct psr_zstack stack = { .width = width, .height = height, .gap = 3, .levels = levels };
	const size_t stride = width + stack.gap;
	stack.word = malloc(stride * height * 8);
	for (size_t i = 0; i < stride * height; i++)
		stack.word[i] = i % stride < width ? PSR_WORD_EMPTY : 0; /* between rows lies what no pixel may be taken for */
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		stack.level[k].width = ((width + (1u << k) - 1) >> k) + 2;
		stack.level[k].height = ((height + (1u << k) - 1) >> k) + 2;
		if (!(levels >> k & 1))
			continue;
		const size_t area = (size_t)stack.level[k].width * stack.level[k].height;
		stack.level[k].z = malloc(area * sizeof(float));
		for (size_t i = 0; i < area; i++)
			stack.level[k].z[i] = INFINITY;
	}
	return stack;
}

static void stack_free(struct psr_zstack *stack)
{
	free(stack->word);
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++)
		free(stack->level[k].z);
}

static void set_depth(struct psr_zstack *stack, uint32_t x, uint32_t y, float z)
{
	psr_zstack_row(stack, y)[x] = (uint64_t)psr_bits_from_float(z) << 32 | 1;
}

/* A few surfaces, in pieces of a few pixels' width, with single pixels of others strewn in; cells likewise. */
static void strew(struct psr_zstack *stack, uint32_t strewn)
{
	const uint32_t size = 1 + draw(9);
	for (uint32_t y = 0; y < stack->height; y++)
		for (uint32_t x = 0; x < stack->width; x++) {
			const uint32_t surface = draw(256) < strewn ? draw(4) : (x / (3 * size) + y / (2 * size)) % 4;
			if (surface)
				set_depth(stack, x, y, 90 + 7 * (float)surface + 0.01f * (float)draw(200));
		}
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++)
		if (stack->level[k].z)
			for (size_t i = 0; i < (size_t)stack->level[k].width * stack->level[k].height; i++)
				if (draw(3))
					stack->level[k].z[i] = 80 + 0.01f * (float)draw(3000);
}

static void compare(uint32_t width, uint32_t height, uint32_t levels, uint32_t strewn,
                    enum psr_gap_method method, const struct simd *simd)
{
	struct plan plan = plan_of((int)draw(2));
	struct psr_zstack stack = stack_make(width, height, levels);
	const uint32_t bricks_x = (width + BRICK - 1) / BRICK, bricks_y = (height + BRICK - 1) / BRICK;
	uint16_t *weight = malloc((size_t)width * height * 2);
	uint8_t *bricks = malloc((size_t)bricks_x * bricks_y), *expected = calloc(bricks_x, bricks_y);
	uint32_t n_partial = 0, n_marked = 0, n_pinholes = 0;
	plan.gap_method = method;
	strew(&stack, strewn);
	/* In two parts: rows do not see which call they are of. */
	const uint32_t half = (bricks_y / 2) * BRICK;
	const struct gaps_map map = { weight, bricks };
	struct gaps_counts upper = gaps_rows(simd, &plan, &stack, 0, half, &map);
	struct gaps_counts lower = gaps_rows(simd, &plan, &stack, half, height, &map);
	for (uint32_t y = 0; y < height; y++)
		for (uint32_t x = 0; x < width; x++) {
			const uint16_t w = weight_of(&plan, &stack, x, y, &n_pinholes);
			if (weight[(size_t)y * width + x] != w)
				fail_msg("%ux%u, levels %x, pixel (%u, %u): weight %u should be %u", width, height, levels, x, y,
				         weight[(size_t)y * width + x], w);
			n_partial += w < WEIGHT_ONE && depth_at(&stack, x, y) < INFINITY;
			expected[(y / BRICK) * bricks_x + x / BRICK] |= w < WEIGHT_ONE;
		}
	for (uint32_t i = 0; i < bricks_x * bricks_y; i++)
		n_marked += expected[i];
	assert_memory_equal(bricks, expected, (size_t)bricks_x * bricks_y);
	assert_int_equal(upper.n_partial + lower.n_partial, n_partial);
	assert_int_equal(upper.n_pinholes + lower.n_pinholes, n_pinholes);
	assert_int_equal(upper.n_marked + lower.n_marked, n_marked);
	free(weight);
	free(bricks);
	free(expected);
	stack_free(&stack);
}

static void compare_all(enum psr_gap_method method)
{
	static const uint32_t size[][2] = {
		{ 1, 1 }, { 2, 1 }, { 1, 5 }, { 31, 33 }, { 128, 32 }, { 129, 65 }, { 300, 140 }
	};
	for (int isa = 0; isa < PSR_N_ISAS; isa++) {
		const struct simd *simd = simd_of((enum psr_isa)isa);
		seed = 99;
		for (size_t s = 0; simd && s < sizeof size / sizeof *size; s++) {
			static const uint32_t levels[] = { 0, 2, 6, 0xc, 0x20, 0x8a, 0xfe, 0x80 };
			for (size_t l = 0; l < sizeof levels / sizeof *levels; l++)
				compare(size[s][0], size[s][1], levels[l], l % 2 ? 8 : 128, method, simd);
		}
	}
}

static void weights_are_those_of_single_pixels(void **state)
{
	(void)state;
	compare_all(PSR_GAPS_BILINEAR);
}

static void closed_depths_are_those_of_single_pixels(void **state)
{
	(void)state;
	compare_all(PSR_GAPS_CLOSED);
}

static void opaque_squares_cover_their_own_pixels_whole(void **state)
{
	(void)state;
	compare_all(PSR_GAPS_OPAQUE);
}

/* ---- the guard ---- */

#define SIDE 40

/* Weights of a picture without level buffers. */
static struct gaps_counts weigh(const struct psr_zstack *stack, uint16_t weight[SIDE * SIDE])
{
	const struct plan plan = plan_of(0);
	uint8_t bricks[4];
	return gaps_rows(simd_get(), &plan, stack, 0, SIDE, &(struct gaps_map){ weight, bricks });
}

static struct psr_zstack wall(void)
{
	struct psr_zstack stack = stack_make(SIDE, SIDE, 0);
	for (uint32_t y = 0; y < SIDE; y++)
		for (uint32_t x = 0; x < SIDE; x++)
			set_depth(&stack, x, y, 100);
	return stack;
}

static void empty(struct psr_zstack *stack, uint32_t x, uint32_t y)
{
	psr_zstack_row(stack, y)[x] = PSR_WORD_EMPTY;
}

static void a_pinhole_is_closed_before_background_and_before_a_surface(void **state)
{
	(void)state;
	uint16_t weight[SIDE * SIDE];
	struct psr_zstack stack = wall();
	empty(&stack, 5, 5);
	set_depth(&stack, 32, 20, 104);
	set_depth(&stack, 31, 32, 102); /* within the threshold */
	const struct gaps_counts counts = weigh(&stack, weight);
	assert_int_equal(counts.n_pinholes, 2);
	assert_int_equal(counts.n_partial, 1);
	assert_int_equal(counts.n_marked, 2);
	for (uint32_t i = 0; i < SIDE * SIDE; i++)
		assert_int_equal(weight[i], i == 5 * SIDE + 5 || i == 20 * SIDE + 32 ? 0 : WEIGHT_ONE);
	stack_free(&stack);
}

static void one_of_eight_neighbors_may_be_another_pinhole(void **state)
{
	(void)state;
	uint16_t weight[SIDE * SIDE];
	struct psr_zstack stack = wall();
	empty(&stack, 10, 10);
	empty(&stack, 11, 11);
	assert_int_equal(weigh(&stack, weight).n_pinholes, 2);
	empty(&stack, 12, 12); /* the one in the middle has two */
	assert_int_equal(weigh(&stack, weight).n_pinholes, 2);
	assert_int_equal(weight[11 * SIDE + 11], WEIGHT_ONE);
	stack_free(&stack);
}

static void slits_edges_and_corners_are_left_alone(void **state)
{
	(void)state;
	uint16_t weight[SIDE * SIDE];
	struct psr_zstack stack = wall();
	for (uint32_t x = 10; x < 13; x++) /* three pixels long */
		empty(&stack, x, 20);
	for (uint32_t i = 0; i < SIDE; i++) { /* an edge, and the picture's own */
		empty(&stack, 30, i);
		empty(&stack, 31, i);
		empty(&stack, i, 0);
	}
	empty(&stack, 5, SIDE - 1);
	for (uint32_t y = 4; y < 6; y++) /* a gap of two by two */
		for (uint32_t x = 4; x < 6; x++)
			empty(&stack, x, y);
	struct gaps_counts counts = weigh(&stack, weight);
	assert_int_equal(counts.n_pinholes, 2); /* the ends of the slit */
	assert_int_equal(weight[20 * SIDE + 11], WEIGHT_ONE);
	assert_int_equal(counts.n_marked, 1);
	stack_free(&stack);
}

/* Leaves before the sky, and what is in a crevice: seven are nearer, and at depths of their own. */
static void neighbors_must_be_one_surface(void **state)
{
	(void)state;
	uint16_t weight[SIDE * SIDE];
	struct psr_zstack stack = wall();
	empty(&stack, 5, 5);
	set_depth(&stack, 4, 4, 76.5f); /* level 4 forgives 24 */
	assert_int_equal(weigh(&stack, weight).n_pinholes, 1);
	set_depth(&stack, 4, 4, 75.5f);
	assert_int_equal(weigh(&stack, weight).n_pinholes, 0);
	set_depth(&stack, 5, 5, 110); /* before another surface, level 1 forgives 3 */
	set_depth(&stack, 4, 4, 97.5f);
	assert_int_equal(weigh(&stack, weight).n_pinholes, 1);
	set_depth(&stack, 4, 4, 96.5f);
	assert_int_equal(weigh(&stack, weight).n_pinholes, 0);
	stack_free(&stack);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(weights_are_those_of_single_pixels),
		cmocka_unit_test(closed_depths_are_those_of_single_pixels),
		cmocka_unit_test(opaque_squares_cover_their_own_pixels_whole),
		cmocka_unit_test(a_pinhole_is_closed_before_background_and_before_a_surface),
		cmocka_unit_test(one_of_eight_neighbors_may_be_another_pinhole),
		cmocka_unit_test(slits_edges_and_corners_are_left_alone),
		cmocka_unit_test(neighbors_must_be_one_surface),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}

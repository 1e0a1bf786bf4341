/* Gaps between the samples of a surface, by closed depths: how steep it may be, and where it ends. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include "base/maths.h"
#include "render/gaps.h"

#define STEP 3       /* pixels between samples: blocks of level 2 */
#define THRESHOLD 1.5f /* of level 1 */
#define FIELD 96     /* the picture's side */
#define FIRST 33     /* of the surface's pixels, in both directions, */
#define END 64

static void set_depth(struct psr_zstack *stack, uint32_t x, uint32_t y, float z)
{
	psr_zstack_row(stack, y)[x] = (uint64_t)psr_bits_from_float(z) << 32 | 1;
}

static void add_level(struct psr_zstack *stack, int k)
{
	const uint32_t cells = FIELD / (1u << k) + 2;

	stack->levels |= 1u << k;
	stack->level[k].z = malloc((size_t)cells * cells * sizeof(float));
	stack->level[k].width = stack->level[k].height = cells;
	for (uint32_t i = 0; i < cells * cells; i++)
		stack->level[k].z[i] = INFINITY;
}

static void set_cell(struct psr_zstack *stack, int k, uint32_t x, uint32_t y, float z)
{
	float *cell = &stack->level[k].z[((y >> k) + 1) * stack->level[k].width + (x >> k) + 1];

	*cell = fminf(*cell, z);
}

/* Samples of level 2 every `step` pixels from FIRST to END, z' rising by `slope` a pixel to the right; behind them a
 * wall, as fine as pixels, of blocks of level `wall_level`. */
struct fence {
	float slope, wall;
	uint32_t step;
	int wall_level;
};

static struct psr_zstack make_fence(const struct fence *fence)
{
	struct psr_zstack stack = { .width = FIELD, .height = FIELD };

	stack.word = malloc((size_t)FIELD * FIELD * sizeof *stack.word);
	add_level(&stack, 2);
	if (fence->wall_level)
		add_level(&stack, fence->wall_level);
	for (uint32_t y = 0; y < FIELD; y++)
		for (uint32_t x = 0; x < FIELD; x++) {
			set_depth(&stack, x, y, fence->wall);
			if (fence->wall_level)
				set_cell(&stack, fence->wall_level, x, y, fence->wall);
		}
	for (uint32_t y = FIRST; y < END; y += fence->step)
		for (uint32_t x = FIRST; x < END; x += fence->step) {
			const float z = 100 + fence->slope * (float)x;
			set_depth(&stack, x, y, z);
			set_cell(&stack, 2, x, y, z);
		}
	return stack;
}

static void weigh_fence(uint16_t weight[FIELD * FIELD], const struct fence *fence)
{
	struct plan plan = { .gap_method = PSR_GAPS_CLOSED };
	struct psr_zstack stack = make_fence(fence);
	uint8_t bricks[FIELD / BRICK * (FIELD / BRICK)];

	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		plan.gap_scale[k] = 1;
		plan.gap_offset[k] = THRESHOLD * (float)(1 << k);
	}
	gaps_rows(simd_get(), &plan, &stack, 0, FIELD, &(struct gaps_map){ weight, bricks });
	free(stack.word);
	free(stack.level[1].z);
	free(stack.level[2].z);
}

/* Up to 84 degrees. Samples at the rim have none on one side to take back what the other takes. */
static void a_steep_plane_of_samples_covers_what_is_behind_it_and_not_itself(void **state)
{
	(void)state;
	static uint16_t weight[FIELD * FIELD];
	for (int slope = -10; slope <= 10; slope++) {
		weigh_fence(weight, &(struct fence){ .slope = (float)slope, .wall = 2000, .step = STEP });
		for (uint32_t y = FIRST + STEP; y + STEP < END; y++)
			for (uint32_t x = FIRST + STEP; x + STEP < END; x++) {
				const int is_sample = (x - FIRST) % STEP == 0 && (y - FIRST) % STEP == 0;
				if (weight[y * FIELD + x] != (is_sample ? WEIGHT_ONE : 0))
					fail_msg("slope %d: weight %u at (%u, %u)", slope, weight[y * FIELD + x], x, y);
			}
	}
}

static void a_surface_ends_where_its_samples_end(void **state)
{
	(void)state;
	static uint16_t weight[FIELD * FIELD];
	const uint32_t last = FIRST + (END - 1 - FIRST) / STEP * STEP;
	weigh_fence(weight, &(struct fence){ .wall = 2000, .step = STEP });
	for (uint32_t y = 0; y < FIELD; y++)
		for (uint32_t x = 0; x < FIELD; x++) {
			const int is_inside = x >= FIRST && y >= FIRST && x <= last && y <= last;
			const int is_sample = is_inside && (x - FIRST) % STEP == 0 && (y - FIRST) % STEP == 0;
			assert_int_equal(weight[y * FIELD + x], is_sample || !is_inside ? WEIGHT_ONE : 0);
		}
}

/* A wall behind by more than level 1's threshold and less than level 2's, and samples two pixels apart. It is hidden,
 * so nothing may depend on the level of its own blocks. */
static void samples_of_level_2_that_are_near_hide_what_is_near_behind_them_whatever_its_level(void **state)
{
	(void)state;
	static uint16_t weight[2][FIELD * FIELD];
	for (int wall_level = 0; wall_level < 2; wall_level++)
		weigh_fence(weight[wall_level],
		            &(struct fence){ .wall = 100 + 1.5f * THRESHOLD, .step = 2, .wall_level = wall_level });
	for (uint32_t y = FIRST; y < END - 1; y++)
		for (uint32_t x = FIRST; x < END - 1; x++) {
			const int is_sample = (x - FIRST) % 2 == 0 && (y - FIRST) % 2 == 0;
			for (int wall_level = 0; wall_level < 2; wall_level++)
				assert_int_equal(weight[wall_level][y * FIELD + x], is_sample ? WEIGHT_ONE : 0);
		}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_steep_plane_of_samples_covers_what_is_behind_it_and_not_itself),
		cmocka_unit_test(a_surface_ends_where_its_samples_end),
		cmocka_unit_test(samples_of_level_2_that_are_near_hide_what_is_near_behind_them_whatever_its_level),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}

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
#define FIELD 96     /* the picture's side */
#define FIRST 33     /* of the surface's pixels, in both directions, */
#define END 64

static void set_depth(struct psr_zstack *stack, uint32_t x, uint32_t y, float z)
{
	psr_zstack_row(stack, y)[x] = (uint64_t)psr_bits_from_float(z) << 32 | 1;
}

/* Samples every STEP pixels from FIRST to END, z' rising by `slope` a pixel to the right; behind them a wall, as fine
 * as pixels. Level 2 has the samples alone. */
static struct psr_zstack fence(float slope)
{
	const uint32_t cells = FIELD / 4 + 2;
	struct psr_zstack stack = { .width = FIELD, .height = FIELD, .levels = 1 << 2 };

	stack.word = malloc((size_t)FIELD * FIELD * sizeof *stack.word);
	stack.level[2].z = malloc((size_t)cells * cells * sizeof(float));
	stack.level[2].width = stack.level[2].height = cells;
	for (uint32_t i = 0; i < cells * cells; i++)
		stack.level[2].z[i] = INFINITY;
	for (uint32_t y = 0; y < FIELD; y++)
		for (uint32_t x = 0; x < FIELD; x++)
			set_depth(&stack, x, y, 2000);
	for (uint32_t y = FIRST; y < END; y += STEP)
		for (uint32_t x = FIRST; x < END; x += STEP) {
			const float z = 100 + slope * (float)x;
			float *cell = &stack.level[2].z[((y >> 2) + 1) * stack.level[2].width + (x >> 2) + 1];
			set_depth(&stack, x, y, z);
			*cell = fminf(*cell, z);
		}
	return stack;
}

static void weigh_fence(uint16_t weight[FIELD * FIELD], float slope)
{
	struct plan plan = { .gap_method = PSR_GAPS_CLOSED };
	struct psr_zstack stack = fence(slope);
	uint8_t bricks[FIELD / BRICK * (FIELD / BRICK)];

	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		plan.gap_scale[k] = 1;
		plan.gap_offset[k] = 1.5f * (float)(1 << k);
	}
	gaps_rows(simd_get(), &plan, &stack, 0, FIELD, &(struct gaps_map){ weight, bricks });
	free(stack.word);
	free(stack.level[2].z);
}

/* Up to 84 degrees. Samples at the rim have none on one side to take back what the other takes. */
static void a_steep_plane_of_samples_covers_what_is_behind_it_and_not_itself(void **state)
{
	(void)state;
	static uint16_t weight[FIELD * FIELD];
	for (int slope = -10; slope <= 10; slope++) {
		weigh_fence(weight, (float)slope);
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
	weigh_fence(weight, 0);
	for (uint32_t y = 0; y < FIELD; y++)
		for (uint32_t x = 0; x < FIELD; x++) {
			const int is_inside = x >= FIRST && y >= FIRST && x <= last && y <= last;
			const int is_sample = is_inside && (x - FIRST) % STEP == 0 && (y - FIRST) % STEP == 0;
			assert_int_equal(weight[y * FIELD + x], is_sample || !is_inside ? WEIGHT_ONE : 0);
		}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_steep_plane_of_samples_covers_what_is_behind_it_and_not_itself),
		cmocka_unit_test(a_surface_ends_where_its_samples_end),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}

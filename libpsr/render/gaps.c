#include "gaps.h"

#include <string.h>
#include "cracks.h"

/* Whole weights, where nothing is drawn nearby. */
static void make_whole(uint16_t *weight, uint32_t stride, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1)
{
	uint16_t whole[GAPS_WIDTH];

	for (uint32_t x = 0; x < GAPS_WIDTH; x++)
		whole[x] = WEIGHT_ONE;
	for (uint32_t y = y0; y < y1; y++)
		memcpy(weight + (size_t)y * stride + x0, whole, (x1 - x0) * sizeof *weight);
}

_Static_assert(PART_WIDTH % GAPS_WIDTH == 0 && PART_HEIGHT % BRICK == 0,
               "a piece lies in one part");

/* Takes the weights of a piece's slits that are cracks. */
static void close_cracks(struct gaps_counts *counts, uint8_t *marks, const struct plan *plan,
                         const struct gaps_target *target, uint32_t x0, uint32_t y0)
{
	const struct psr_zstack *stack = target->stack;

	for (uint32_t i = 0; i < counts->n_slits && !plan_is_cancelled_at(plan, i); i++) {
		const uint32_t beside = target->slit[i] % GAPS_WIDTH, x = x0 + beside, y = y0 + target->slit[i] / GAPS_WIDTH;
		uint16_t *weight = &target->weight[(size_t)y * stack->width + x];

		if (!is_in_crack(plan, stack, x, y))
			continue;
		counts->n_partial += psr_zstack_row(stack, y)[x] != PSR_WORD_EMPTY && *weight == WEIGHT_ONE;
		counts->n_pinholes++;
		counts->n_marked += !marks[beside / BRICK];
		marks[beside / BRICK] = 1;
		*weight = 0;
	}
}

struct gaps_counts gaps_rows(const struct simd *simd, const struct plan *plan, const struct psr_zstack *stack,
                             uint32_t y0, uint32_t y1, const struct gaps_map *map)
{
	uint16_t slit[GAPS_WIDTH * BRICK];
	const struct gaps_target target = { stack,       plan->gap_scale,  plan->gap_offset,
		                                map->weight, plan->gap_method, plan->has_points ? slit : NULL };
	const uint32_t bricks_x = (stack->width + BRICK - 1) / BRICK;
	struct gaps_counts total = { 0, 0, 0, 0 };

	for (uint32_t y = y0; y < y1; y += BRICK)
		for (uint32_t x = 0; x < stack->width; x += GAPS_WIDTH) {
			const uint32_t x1 = x + GAPS_WIDTH < stack->width ? x + GAPS_WIDTH : stack->width;
			const uint32_t brick_y1 = y + BRICK < y1 ? y + BRICK : y1;
			uint8_t marks[GAPS_WIDTH / BRICK] = { 0 };
			struct gaps_counts counts = { 0, 0, 0, 0 };

			if (plan_is_quiet(plan, x, y))
				make_whole(map->weight, stack->width, x, x1, y, brick_y1);
			else
				counts = simd->gaps(&target, x, x1, y, brick_y1, marks);
			close_cracks(&counts, marks, plan, &target, x, y);
			for (uint32_t b = x / BRICK; b * BRICK < x1; b++)
				map->bricks[(size_t)(y / BRICK) * bricks_x + b] = marks[b - x / BRICK];
			total.n_partial += counts.n_partial;
			total.n_pinholes += counts.n_pinholes;
			total.n_marked += counts.n_marked;
		}
	return total;
}

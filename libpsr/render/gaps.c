#include "render/render.h"

struct gaps_counts gaps_rows(const struct simd *simd, const struct plan *plan, const struct psr_zstack *stack, uint32_t y0,
                             uint32_t y1, uint16_t *weight, uint8_t *bricks)
{
	const struct gaps_target target = { stack, plan->gap_scale, plan->gap_offset, weight };
	const uint32_t bricks_x = (stack->width + BRICK - 1) / BRICK;
	struct gaps_counts total = { 0, 0, 0 };
	for (uint32_t y = y0; y < y1; y += BRICK)
		for (uint32_t x = 0; x < stack->width; x += GAPS_WIDTH) {
			const uint32_t x1 = x + GAPS_WIDTH < stack->width ? x + GAPS_WIDTH : stack->width;
			uint8_t marks[GAPS_WIDTH / BRICK];
			const struct gaps_counts counts = simd->gaps(&target, x, x1, y, y + BRICK < y1 ? y + BRICK : y1, marks);
			for (uint32_t b = x / BRICK; b * BRICK < x1; b++)
				bricks[(size_t)(y / BRICK) * bricks_x + b] = marks[b - x / BRICK];
			total.n_partial += counts.n_partial;
			total.n_pinholes += counts.n_pinholes;
			total.n_marked += counts.n_marked;
		}
	return total;
}

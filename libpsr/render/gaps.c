#include "base/maths.h"
#include "render/render.h"

/* Coverage of one row by one level: the pixel's centre lies in a square of four cell centres; each that is nearer
 * by more than the threshold covers it, bilinearly ([G] 4.6). In units of 1 / WEIGHT_ONE. */
static void cover_row(const struct plan *plan, const struct psr_zstack *stack, uint32_t y, int k, const uint64_t *word,
                      uint16_t *weight)
{
	const int32_t cell = 1 << k, twice = 2 * cell; /* positions in half pixels: centres are whole numbers */
	const int shift = 2 * k + 2 - 8;               /* from twice * twice to WEIGHT_ONE */
	const float scale = plan->gap_scale[k], offset = plan->gap_offset[k];
	const int32_t at_y = 2 * (int32_t)y + 1 - cell, fy = at_y & (twice - 1);
	const float *upper = stack->level[k].z + (size_t)((at_y >> (k + 1)) + 1) * stack->level[k].width;
	const float *lower = upper + stack->level[k].width;

	for (uint32_t x = 0; x < stack->width; x++) {
		const int32_t at_x = 2 * (int32_t)x + 1 - cell, fx = at_x & (twice - 1), i = (at_x >> (k + 1)) + 1;
		const float z = psr_float_from_bits((uint32_t)(word[x] >> 32));
		int32_t cover = (upper[i] * scale + offset < z ? (twice - fx) * (twice - fy) : 0) +
		                (upper[i + 1] * scale + offset < z ? fx * (twice - fy) : 0) +
		                (lower[i] * scale + offset < z ? (twice - fx) * fy : 0) +
		                (lower[i + 1] * scale + offset < z ? fx * fy : 0);
		int32_t w = WEIGHT_ONE - (shift >= 0 ? cover >> shift : cover << -shift);
		/* The maximum over levels: sums would take weight twice from pixels where levels overlap. */
		if (w < weight[x])
			weight[x] = (uint16_t)w;
	}
}

uint32_t gaps_row(const struct plan *plan, const struct psr_zstack *stack, uint32_t y, uint16_t *weight)
{
	const uint64_t *word = stack->word + (size_t)y * stack->width;
	uint32_t n_partial = 0;
	for (uint32_t x = 0; x < stack->width; x++)
		weight[x] = WEIGHT_ONE;
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++)
		if (stack->levels >> k & 1)
			cover_row(plan, stack, y, k, word, weight);
	for (uint32_t x = 0; x < stack->width; x++)
		n_partial += weight[x] < WEIGHT_ONE && word[x] != PSR_WORD_EMPTY;
	return n_partial;
}

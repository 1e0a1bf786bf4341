#include "base/maths.h"
#include "render/render.h"

/* Where the centre of pixel (x, y) lies among the cell centres of level k: in the square from cell (i, j) to (i +
 * 1, j + 1), counted with the guard band, at (fx, fy) of 2^(k+1). Positions are in half pixels, so that centres
 * are whole numbers. */
static inline int32_t square_of(uint32_t pixel, int k, int32_t *fraction)
{
	const int32_t at = 2 * (int32_t)pixel + 1 - (1 << k);
	*fraction = at & ((2 << k) - 1);
	return (at >> (k + 1)) + 1;
}

/* Bilinear coverage ([G] 4.6) of a square whose corners cover or not, in units of 1 / WEIGHT_ONE. */
static inline int32_t bilinear(int k, int32_t fx, int32_t fy, int c00, int c10, int c01, int c11)
{
	const int32_t one = 2 << k;
	const int shift = 2 * k + 2 - 8;
	const int32_t cover = (c00 ? (one - fx) * (one - fy) : 0) + (c10 ? fx * (one - fy) : 0) +
	                      (c01 ? (one - fx) * fy : 0) + (c11 ? fx * fy : 0);
	return shift >= 0 ? cover >> shift : cover << -shift;
}

/* Coverage of one row by one level: corners cover that are nearer than the pixel by more than the threshold. */
static void cover_row(const struct plan *plan, const struct psr_zstack *stack, uint32_t y, int k, const uint64_t *word,
                      uint16_t *cover)
{
	const float scale = plan->gap_scale[k], offset = plan->gap_offset[k];
	int32_t fx, fy;
	const float *upper = stack->level[k].z + (size_t)square_of(y, k, &fy) * stack->level[k].width;
	const float *lower = upper + stack->level[k].width;

	for (uint32_t x = 0; x < stack->width; x++) {
		const int32_t i = square_of(x, k, &fx);
		const float z = psr_float_from_bits((uint32_t)(word[x] >> 32));
		cover[x] = (uint16_t)bilinear(k, fx, fy, upper[i] * scale + offset < z, upper[i + 1] * scale + offset < z,
		                              lower[i] * scale + offset < z, lower[i + 1] * scale + offset < z);
	}
}

/* Whether cell (i, j) of level k + 1, or one of the four cells of level k in it, covers depth z. */
static int covers_either(const struct plan *plan, const struct psr_zstack *stack, int k, int32_t i, int32_t j, float z)
{
	const uint32_t width = stack->level[k].width, height = stack->level[k].height;
	const float own = stack->level[k + 1].z[(size_t)j * stack->level[k + 1].width + (size_t)i];
	if (own * plan->gap_scale[k + 1] + plan->gap_offset[k + 1] < z)
		return 1;
	for (int32_t v = 2 * j - 1; v <= 2 * j; v++)
		for (int32_t u = 2 * i - 1; u <= 2 * i; u++)
			if ((uint32_t)u < width && (uint32_t)v < height &&
			    stack->level[k].z[(size_t)v * width + (size_t)u] * plan->gap_scale[k] + plan->gap_offset[k] < z)
				return 1;
	return 0;
}

/* A surface may pass from blocks of one level to blocks of the next within a pixel's neighbourhood, and then neither
 * level covers it whole ([G] 9.1.2). Where the coarser one covers a part of a pixel, what counts is the coverage by
 * the coarser cells that either level fills: not the sum, which would take weight twice where blocks of both levels
 * hold the same surface. */
static uint16_t cover_seam(const struct plan *plan, const struct psr_zstack *stack, uint32_t x, uint32_t y, int k,
                           float z)
{
	int32_t fx, fy;
	const int32_t i = square_of(x, k + 1, &fx), j = square_of(y, k + 1, &fy);
	return (uint16_t)bilinear(k + 1, fx, fy, covers_either(plan, stack, k, i, j, z),
	                          covers_either(plan, stack, k, i + 1, j, z), covers_either(plan, stack, k, i, j + 1, z),
	                          covers_either(plan, stack, k, i + 1, j + 1, z));
}

uint32_t gaps_row(const struct plan *plan, const struct psr_zstack *stack, uint32_t y, uint16_t *weight)
{
	const uint64_t *word = stack->word + (size_t)y * stack->width;
	uint16_t cover[PSR_MAX_SIDE];
	uint32_t n_partial = 0;
	for (uint32_t x = 0; x < stack->width; x++)
		weight[x] = WEIGHT_ONE;
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		const int has_finer = k > 1 && (stack->levels >> (k - 1) & 1);
		if (!(stack->levels >> k & 1))
			continue;
		cover_row(plan, stack, y, k, word, cover);
		for (uint32_t x = 0; x < stack->width; x++) {
			if (has_finer && cover[x] > 0 && cover[x] < WEIGHT_ONE)
				cover[x] = cover_seam(plan, stack, x, y, k - 1, psr_float_from_bits((uint32_t)(word[x] >> 32)));
			if (WEIGHT_ONE - cover[x] < weight[x])
				weight[x] = (uint16_t)(WEIGHT_ONE - cover[x]);
		}
	}
	for (uint32_t x = 0; x < stack->width; x++)
		n_partial += weight[x] < WEIGHT_ONE && word[x] != PSR_WORD_EMPTY;
	return n_partial;
}

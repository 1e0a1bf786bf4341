#include <string.h>
#include "tests/simd/lib/blocks.h"

#define DEPTH_PADDING 64 /* what psr/model.h promises beyond the last depth */

/* Of the given number of bits, wherever they are: runs, rows and scattered ones. */
static uint64_t random_mask(struct check *c, uint32_t n)
{
	uint64_t mask = 0;
	if (n == 64)
		return ~UINT64_C(0);
	for (uint32_t at = check_below(c, 64); (uint32_t)__builtin_popcountll(mask) < n; at = (at + 1 + (check_one_in(c, 3) ? check_below(c, 64) : 0)) % 64)
		mask |= UINT64_C(1) << at;
	return mask;
}

void check_blocks(struct check *c, struct psr_blocks *blocks, uint32_t n_blocks, uint32_t n_projections, uint32_t n_samples)
{
	uint16_t *projection = check_in(c, n_blocks, 2), *depth;
	int16_t *col = check_in(c, n_blocks, 2), *row = check_in(c, n_blocks, 2);
	uint8_t *level = check_in(c, n_blocks, 1), *flags = check_in(c, n_blocks, 1);
	float *bias = check_in(c, n_blocks, 4), *step = check_in(c, n_blocks, 4);
	uint64_t *mask = check_in(c, n_blocks, 8);
	uint32_t *first = check_in(c, n_blocks, 4), n = 0;

	for (uint32_t b = 0; b < n_blocks; b++) {
		projection[b] = (uint16_t)check_below(c, n_projections);
		level[b] = (uint8_t)(check_one_in(c, 4) ? check_below(c, 32) : check_below(c, 3));
		flags[b] = (uint8_t)check_below(c, 2);
		if (!check_one_in(c, 8)) {
			col[b] = (int16_t)((int)check_below(c, 8) - 4);
			row[b] = (int16_t)((int)check_below(c, 8) - 4);
		}
		bias[b] = (float)check_real(c, -1, 1);
		step[b] = check_one_in(c, 8) ? 0 : (float)check_real(c, 0, 1.0 / 65536);
		const uint32_t any = check_one_in(c, 3) ? 64 : 1 + check_below(c, 64);
		mask[b] = random_mask(c, n_samples ? n_samples : any);
		first[b] = n;
		n += (uint32_t)__builtin_popcountll(mask[b]);
	}
	depth = check_in(c, n + DEPTH_PADDING, 2);
	*blocks = (struct psr_blocks){
		.n_blocks = n_blocks, .n_projections = n_projections, .n_samples = n, .block_projection = projection,
		.col = col, .row = row, .level = level, .flags = flags, .depth_bias = bias, .depth_step = step, .mask = mask,
		.attr_first = first, .depth = depth, .attr = check_in(c, n, 8),
	};
}

#include <string.h>
#include "blocks.h"

#define DEPTH_PADDING 64 /* what model/blocks.h promises beyond the last depth */

/* Of the given number of bits, wherever they are: runs, rows and scattered ones. */
static uint64_t random_mask(struct check *c, uint32_t n)
{
	uint64_t mask = 0;
	if (n == 64)
		return ~UINT64_C(0);
	for (uint32_t at = check_below(c, 64); (uint32_t)__builtin_popcountll(mask) < n; at = (at + 1) % 64) {
		mask |= UINT64_C(1) << at;
		if (check_one_in(c, 3))
			at = check_below(c, 64);
	}
	return mask;
}

void check_blocks(struct check *c, struct psr_blocks *blocks, uint32_t n_blocks, uint32_t n_projections,
                  uint32_t n_samples)
{
	const uint32_t n_runs = (n_blocks + PSR_RUN_BLOCKS - 1) / PSR_RUN_BLOCKS;
	struct psr_run *run = check_in(c, n_runs, sizeof *run);
	uint8_t *projection = check_in(c, n_blocks, 1), *flags = check_in(c, n_blocks, 1);
	struct psr_projection *lattice = check_in(c, n_projections, sizeof *lattice);
	uint16_t *offset = check_in(c, n_blocks, 2);
	uint64_t *mask = check_in(c, n_blocks, 8);
	uint8_t *traits = check_in(c, n_blocks, 1);
	uint32_t n = 0;

	/* Spheres anywhere are within four blocks of the origin on the one, and anywhere on the other. */
	for (uint32_t i = 0; i < n_projections; i++)
		lattice[i] = (struct psr_projection){ { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } },
			                                  check_one_in(c, 8) ? 0x1p-14f : 0x1p-4f };
	for (uint32_t b = 0; b < n_blocks; b++) {
		const uint32_t level = check_one_in(c, 4) ? check_below(c, PSR_MAX_LEVELS) : check_below(c, 3);
		projection[b] = (uint8_t)check_below(c, n_projections);
		traits[b] = (uint8_t)check_below(c, 4);
		flags[b] = (uint8_t)(level | (check_u32(c) & (PSR_BLOCK_DEPTH | PSR_BLOCK_TWO_SIDED)));
		if (b % PSR_RUN_BLOCKS == 0)
			run[b / PSR_RUN_BLOCKS] = (struct psr_run){ .attr_first = n };
		offset[b] = (uint16_t)(n - run[b / PSR_RUN_BLOCKS].attr_first);
		mask[b] = random_mask(c, n_samples ? n_samples : check_one_in(c, 3) ? 64 : 1 + check_below(c, 64));
		n += (uint32_t)__builtin_popcountll(mask[b]);
	}
	*blocks = (struct psr_blocks){
		.n_blocks = n_blocks,
		.n_projections = n_projections,
		.n_samples = n,
		.run = run,
		.projection = lattice,
		.block_projection = projection,
		.flags = flags,
		.mask = mask,
		.sphere_x = check_in(c, n_blocks, 2),
		.sphere_y = check_in(c, n_blocks, 2),
		.sphere_z = check_in(c, n_blocks, 2),
		.sphere_r = check_in(c, n_blocks, 2),
		.cone_x = check_in(c, n_blocks, 1),
		.cone_y = check_in(c, n_blocks, 1),
		.cone_z = check_in(c, n_blocks, 1),
		.cone_sine = check_in(c, n_blocks, 1),
		.traits = check_one_in(c, 2) ? traits : NULL,
		.attr_offset = offset,
		.depth = check_in(c, n + DEPTH_PADDING, 2),
		.attr = check_in(c, n, 8),
		.opacity = check_in(c, n, 1),
	};
}

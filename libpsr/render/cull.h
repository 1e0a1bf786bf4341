/* Cull: blocks in view, one level of each group of clusters, sorted into tiles ([G] 6). */
#ifndef PSR_RENDER_CULL_H
#define PSR_RENDER_CULL_H

#include "bins.h"

/* Fills the bins. Completes the plan: what shading needs for the blocks in view. MEMORY, LIMIT, CANCELLED. */
int cull_blocks(struct bins *bins, const struct simd *simd, struct plan *plan, struct psr_pool *pool,
                struct psr_report *report);

/* ---- for the files of the cull ---- */

struct cull_group {
	uint8_t level; /* of the cluster that is drawn */
	uint8_t fits;
};

static inline int cull_is_chosen(const struct bins *bins, const struct plan_instance *in, const struct psr_cluster *k)
{
	return bins->group[in->first_group + k->group].level == k->level;
}

/* As many bits as a block or cube has samples: a block's mask, the codes of a cube's octants. */
static inline uint64_t cull_lanes(const struct plan_instance *in, uint32_t block)
{
	const struct psr_cubes *cubes = in->cull.cubes;

	if (cubes == NULL)
		return in->cull.blocks->mask[block];
	const struct psr_cube_level *level = psr_cubes_level(cubes, block);
	const uint32_t code = psr_cubes_code(cubes, level, block);
	const unsigned n = (unsigned)__builtin_popcount(level->tree->code[code]);
	const uint64_t children = psr_cubes_children(level->tree, code);
	return n < 8 ? children & ((UINT64_C(1) << 8 * n) - 1) : children;
}

/* A cluster's sphere in camera space. */
struct cull_sphere {
	float c[3], r;
};
struct cull_sphere cull_view_cluster(const struct plan_instance *in, const struct psr_cluster *k);

/* Chooses of each group of clusters the coarsest level whose level_spacing is at most a pixel, or the settings'
 * spacing, where its blocks are nearest. Blocks of such a level need no depth buffer but the picture's, cubes one of
 * 2x2 pixels at most. The finest level if none fits.
 * Returns early if the frame is cancelled. */
void cull_choose_levels(struct bins *bins, const struct plan *plan);

/* Visibility masks of the screen's regions, for one instance ([G] 6.3): one mask for each of the 10 x 10 ranges of
 * regions that a block can lie in, in place of the smallest tree node that holds the block. */
struct cull_masks {
	uint64_t range[SCREEN_RANGES * SCREEN_RANGES][2];
};
void cull_masks_make(struct cull_masks *masks, const struct plan *plan, const struct plan_instance *in);

/* Whether a block is invisible from the regions of a range. */
static inline int cull_by_mask(const struct cull_masks *masks, const struct psr_blocks *b, uint32_t block,
                               uint32_t range)
{
	const uint64_t *own = b->visibility_mask[psr_blocks_visibility(b, block)], *seen = masks->range[range];

	return !((own[0] & seen[0]) | (own[1] & seen[1]));
}

#endif

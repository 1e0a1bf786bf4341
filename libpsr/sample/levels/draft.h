/* The kept samples of all levels in blocks, and the pieces of the object that levels are cut into. */
#ifndef PSR_SAMPLE_LEVELS_DRAFT_H
#define PSR_SAMPLE_LEVELS_DRAFT_H

#include "sample/own/kept.h"
#include "sample/project/sheet.h"

struct draft_sample {
	float z;
	uint32_t surface; /* a side: surface.h */
	uint64_t attr;
	uint8_t opacity;  /* own/kept.h */
};

struct draft_block {
	uint16_t projection;
	int16_t col, row; /* of its first lattice point; row is even */
	uint8_t level, two_sided, traits;
	uint32_t group;   /* of blocks */
	uint64_t mask;    /* of what is there, */
	uint64_t part;    /* the samples that the group needs: all sheer and all thin, or none */
	uint32_t first;   /* of its samples, one for each bit of mask */
};

struct draft {
	unsigned n_levels;
	const struct psr_projection *projection; /* of level 0 */
	double ds;                               /* of level 0 */
	uint32_t n_blocks, block_capacity, n_samples, sample_capacity, n_groups;
	struct draft_block *block;
	struct draft_sample *sample;
};

void draft_fini(struct draft *draft);

/* Adds the next level: kept samples of the sheets of all projections. MEMORY, LIMIT. */
int draft_add(struct draft *draft, const struct sheets *sheets, const struct kept *kept);

/* group.c: cuts the finest level into groups that lie together, and each coarser level into blocks of the same groups.
 * A group has all samples of a level within three quarters of its pixel of the group's finest samples, so that pieces
 * drawn at different levels meet. Groups have at most 131072 samples; the bound doubles until the blocks that groups
 * share do not cost too much (leaves may end in one group). The same whatever the threads. MEMORY. */
int draft_group(struct draft *draft, struct psr_pool *pool);

/* join.c: joins blocks of one level, group, projection and number of sides that fit one window of the lattice, have no
 * lattice point in common, and are not too deep together. Afterwards each block has samples of its own, and needs them
 * all. LIMIT, MEMORY. */
int draft_join(struct draft *draft);

static inline double draft_spacing(const struct draft *draft, const struct draft_block *block)
{
	return (double)draft->projection[block->projection].spacing * (double)(1u << block->level);
}

/* Sample s of a block, in the space of its projection and in inner coordinates. */
void draft_project(const struct draft *draft, const struct draft_block *block, unsigned s, double p[3]);
void draft_position(const struct draft *draft, const struct draft_block *block, unsigned s, float position[3]);

static inline const struct draft_sample *draft_sample(const struct draft *draft, const struct draft_block *block,
                                                      unsigned s)
{
	uint64_t below = block->mask & ((UINT64_C(1) << s) - 1);

	return &draft->sample[block->first + (uint32_t)__builtin_popcountll(below)];
}

#endif

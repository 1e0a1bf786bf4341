/* An octree, or part of one, level by level: the order in which it is packed. */
#ifndef PSR_OCTREE_LEVELS_H
#define PSR_OCTREE_LEVELS_H

#include "octree.h"

struct octree_level {
	uint32_t n, room; /* nodes; room for them */
	uint8_t *code;    /* in Morton order */
	uint32_t *first;  /* of each node: its first child, in the next level */
};

/* The subtrees below some nodes of one depth, the roots. at[0] are their codes, at[height - 1] those right above the
 * leaves. */
struct octree_levels {
	int height;           /* 1..OCTREE_MOST_LEVELS */
	uint32_t n_roots;
	const uint64_t *root; /* their paths in Morton order; the caller's */
	struct octree_level at[OCTREE_MOST_LEVELS];
};

#define OCTREE_NONE UINT32_MAX
#define OCTREE_NEAR 27
#define OCTREE_SELF 13 /* x + 3 y + 9 z, each 0, 1 or 2: one before, itself, one after */

/* Neighbours of a node among the nodes of its level: their index, or OCTREE_NONE. */
struct octree_near {
	uint32_t at[OCTREE_NEAR];
};

void octree_levels_fini(struct octree_levels *levels); /* frees what the functions below allocated */

/* Appends a node to a level, and sets its first child to the number of children of those before it. Returns 0 without
 * memory. */
int octree_level_put(struct octree_level *level, uint8_t code);

/* Makes room for n nodes, whose codes the caller then sets; then sets their first children. Returns 0 without memory. */
int octree_level_reserve(struct octree_level *level, uint32_t n);
void octree_level_finish(struct octree_level *level, uint32_t n);

/* Visits all nodes of a level, 0 to height (the leaves), in Morton order. Levels above it must be whole; the codes of
 * the level itself are not read. */
void octree_levels_walk(const struct octree_levels *levels, int level,
                        void (*visit)(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata),
                        void *userdata);

/* Returns how many bits of a code there are below bit j. */
extern const uint8_t octree_rank[8][256];

static inline unsigned octree_count(uint8_t code)
{
	return octree_rank[7][code] + (unsigned)(code >> 7);
}

#endif

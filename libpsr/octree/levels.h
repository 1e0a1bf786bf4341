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

#define OCTREE_NEAR 27
#define OCTREE_SELF 13 /* x + 3 y + 9 z, each 0, 1 or 2: one before, itself, one after */

/* Codes and first children of nodes that are neighbours. */
struct octree_family {
	uint32_t first[OCTREE_NEAR];
	uint8_t code[OCTREE_NEAR];
};

/* A node's neighbours among the nodes of its level. */
struct octree_near {
	uint32_t there;  /* bit k: neighbour k is there; the node itself is, too */
	uint32_t before; /* bit k: it is, and comes before the node */
	const struct octree_family *family; /* the node's parent and its neighbours */
	unsigned octant; /* of its parent; 8: a root */
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

/* Where neighbour k of octant j is in the family: 8 times whose child it is, and as which octant. Of a root, the ninth
 * row, it is k itself. */
extern const uint8_t octree_kin[9][OCTREE_NEAR];

/* Returns the index in its level of a neighbour that is there. */
static inline uint32_t octree_near_at(const struct octree_near *near, unsigned k)
{
	const unsigned kin = octree_kin[near->octant][k], of = kin >> 3;

	return near->family->first[of] + octree_rank[kin & 7][near->family->code[of]];
}

/* ---- children around a node: a cube of 4x4x4, bit x + 4 y + 16 z; the node's own are in the middle ---- */

extern const uint64_t octree_cube[256]; /* a code's bits at 0 and 1 of each axis */
/* By neighbour: which of its octants touch the node; how far to rotate the cube of these to where they are. */
extern const uint8_t octree_side[OCTREE_NEAR], octree_turn[OCTREE_NEAR];

static inline uint64_t octree_cube_of(unsigned code, unsigned k)
{
	const uint64_t cube = octree_cube[code & octree_side[k]];
	const unsigned up = octree_turn[k];

	return cube << up | cube >> (64 - up);
}

/* Where octant j's own surroundings begin in the cube. */
static inline unsigned octree_corner(unsigned j)
{
	return (j & 1) + 4 * (j >> 1 & 1) + 16 * (j >> 2);
}

#endif

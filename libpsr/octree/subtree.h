/* The subtrees below the nodes of the skip index: each is read without the others, so threads share them. */
#ifndef PSR_OCTREE_SUBTREE_H
#define PSR_OCTREE_SUBTREE_H

#include "octree.h"

#define OCTREE_TASKS 256 /* that a tree's subtrees are cut into */

/* Returns how many levels a subtree has, from its root to its leaves. */
static inline int octree_subtree_height(const struct octree *tree)
{
	return tree->levels < OCTREE_SKIP_LEVELS ? tree->levels : OCTREE_SKIP_LEVELS;
}

/* Returns the first subtree of a task; that of task OCTREE_TASKS is behind the last one. */
static inline uint64_t octree_task_first(const struct octree *tree, int task)
{
	return tree->n_skips / OCTREE_TASKS * (uint64_t)task + tree->n_skips % OCTREE_TASKS * (uint64_t)task / OCTREE_TASKS;
}

/* Returns how many codes stand right before subtree i, of nodes above it that no subtree before it has. Paths of the
 * skip index ascend. */
static inline unsigned octree_codes_above(const struct octree *tree, uint64_t i)
{
	if (i == 0)
		return (unsigned)(tree->levels - octree_subtree_height(tree));
	return (unsigned)(63 - __builtin_clzll(tree->skip[i].path ^ tree->skip[i - 1].path)) / 3;
}

/* Returns the number of bits of x; a call of the compiler's own would be to its library. */
static inline unsigned octree_popcount(uint64_t x)
{
	x -= x >> 1 & 0x5555555555555555u;
	x = (x & 0x3333333333333333u) + (x >> 2 & 0x3333333333333333u);
	x = (x + (x >> 4)) & 0x0f0f0f0f0f0f0f0fu;
	return (unsigned)(x * 0x0101010101010101u >> 56);
}

/* Adds the nodes of a subtree to n, by height: n[0] are leaves, n[height] its root. height: OCTREE_LEAST_LEVELS to
 * OCTREE_SKIP_LEVELS. Returns the end of its codes; NULL if they reach beyond `end`, or one is 0. */
const uint8_t *octree_subtree_count(uint64_t *n, const uint8_t *code, const uint8_t *end, int height);

#endif

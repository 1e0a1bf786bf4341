#include <assert.h>
#include <math.h>
#include "octree.h"

struct walk {
	const struct octree *tree;
	int depth;
	int (*visit)(const struct octree_node *node, void *userdata);
	void *userdata;
	uint64_t code, leaf; /* the next ones */
};

/* Passes a node, and visits those of the depth below it. */
static int pass(struct walk *walk, uint64_t path, int depth)
{
	const int levels = walk->tree->levels;
	int rc = 0;

	if (depth == walk->depth) {
		const struct octree_node node = { path, walk->code, walk->leaf };

		rc = walk->visit(&node, walk->userdata);
	}
	if (depth == levels) {
		walk->leaf++;
	} else {
		const uint8_t code = walk->tree->code[walk->code++];

		if (depth == levels - 1 && walk->depth < levels) {
			walk->leaf += (uint64_t)__builtin_popcount(code);
			return rc;
		}
		for (unsigned j = 0; j < 8 && rc == 0; j++)
			if (code >> j & 1)
				rc = pass(walk, path << 3 | j, depth + 1);
	}
	return rc;
}

int octree_walk(const struct octree *tree, int depth, int (*visit)(const struct octree_node *node, void *userdata),
                void *userdata)
{
	const int skips = tree->levels > OCTREE_SKIP_LEVELS ? tree->levels - OCTREE_SKIP_LEVELS : 0;
	struct walk walk = { tree, depth, visit, userdata, 0, 0 };
	int rc = 0;

	assert(depth >= 0 && depth <= tree->levels);
	for (uint64_t i = 0; i < tree->n_skips && rc == 0; i++) {
		const struct octree_skip *skip = &tree->skip[i];

		walk.code = skip->code;
		walk.leaf = skip->leaf;
		if (depth >= skips) {
			rc = pass(&walk, skip->path, skips);
		} else if (i == 0 || skip[-1].path >> 3 * (skips - depth) != skip->path >> 3 * (skips - depth)) {
			/* The codes between the node's own and its first subtree's are one a depth. */
			const struct octree_node node = { skip->path >> 3 * (skips - depth),
				                              skip->code - (uint64_t)(skips - depth), skip->leaf };

			rc = visit(&node, userdata);
		}
	}
	return rc;
}

uint64_t octree_mask(const struct octree *tree, uint64_t code)
{
	const uint8_t *at = &tree->code[code];
	const unsigned cell = *at++;
	uint64_t mask = 0;

	for (unsigned j = 0; j < 8; j++)
		if (cell >> j & 1)
			mask |= (uint64_t)*at++ << 8 * j;
	return mask;
}

void octree_center(const struct octree *tree, uint64_t path, int depth, double center[3])
{
	uint32_t at[3];

	octree_place(path, at);
	for (int c = 0; c < 3; c++)
		center[c] = tree->low[c] + tree->edge * ldexp((double)at[c] + 0.5, -depth);
}

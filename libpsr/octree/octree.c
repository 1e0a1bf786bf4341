#include <assert.h>
#include <stdlib.h>
#include "octree.h"
#include "base/array.h"

void octree_destroy(struct octree *tree)
{
	if (tree == NULL)
		return;
	free(tree->code);
	free(tree->skip);
	free(tree->normal);
	free(tree->color);
	free(tree->offset);
	free(tree->material);
	free(tree->lean);
	free(tree->one_material);
	free(tree->scan.intensity);
	free(tree->scan.class);
	free(tree->scan.returns);
	free(tree->scan.time);
	free(tree->scan.time_scale);
	free(tree);
}

int octree_maker_init(struct octree_maker *maker, int levels, struct psr_error *err)
{
	*maker = (struct octree_maker){ 0 };
	if (levels < OCTREE_LEAST_LEVELS || levels > OCTREE_MOST_LEVELS)
		return psr_fail(err, PSR_ERR_ARG, "an octree of %d levels; %d to %d are possible", levels, OCTREE_LEAST_LEVELS,
		                OCTREE_MOST_LEVELS);
	maker->tree = calloc(1, sizeof *maker->tree);
	if (maker->tree == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for an octree");
	maker->tree->levels = levels;
	maker->tree->edge = 1.0;
	return PSR_OK;
}

void octree_maker_fini(struct octree_maker *maker)
{
	octree_destroy(maker->tree);
	maker->tree = NULL;
}

static int skip_depth(int levels)
{
	return levels > OCTREE_SKIP_LEVELS ? levels - OCTREE_SKIP_LEVELS : 0;
}

/* Returns the depth of the lowest node that two leaves share. */
static int shared_depth(uint64_t a, uint64_t b, int levels)
{
	return levels - 1 - (63 - __builtin_clzll(a ^ b)) / 3;
}

int octree_maker_put(struct octree_maker *maker, uint64_t path, struct psr_error *err)
{
	struct octree *tree = maker->tree;
	const int levels = tree->levels, is_first = tree->n_leaves == 0;
	int depth = is_first ? -1 : 0;

	if (path >> 3 * levels != 0 || (!is_first && path <= maker->last))
		return psr_fail(err, PSR_ERR_ARG, "leaf %llu of an octree is not in Morton order, or outside of the cube",
		                (unsigned long long)tree->n_leaves);
	if (!is_first) {
		depth = shared_depth(path, maker->last, levels);
		tree->code[maker->at[depth]] |= (uint8_t)(1u << (path >> 3 * (levels - 1 - depth) & 7));
	}
	while (++depth < levels) {
		if (!ARRAY_ROOM(tree->code, tree->n_codes, maker->codes_room) ||
		    !ARRAY_ROOM(tree->skip, tree->n_skips, maker->skips_room))
			return psr_fail(err, PSR_ERR_MEMORY, "no memory for an octree of %llu leaves",
			                (unsigned long long)tree->n_leaves);
		if (depth == skip_depth(levels))
			tree->skip[tree->n_skips++] =
				(struct octree_skip){ path >> 3 * (levels - depth), tree->n_codes, tree->n_leaves };
		maker->at[depth] = tree->n_codes;
		tree->code[tree->n_codes++] = (uint8_t)(1u << (path >> 3 * (levels - 1 - depth) & 7));
	}
	maker->last = path;
	tree->n_leaves++;
	return PSR_OK;
}

struct octree *octree_maker_take(struct octree_maker *maker)
{
	struct octree *tree = maker->tree;

	if (tree->n_leaves == 0)
		return NULL;
	maker->tree = NULL;
	return tree;
}

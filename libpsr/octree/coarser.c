#include <stdlib.h>
#include <string.h>
#include "subtree.h"

static int put_leaf(const struct octree_node *node, void *userdata)
{
	return octree_maker_put(userdata, node->path, NULL);
}

struct averaging {
	const struct octree *finer;
	struct octree *tree;
	uint64_t n;
};

/* A node's children are leaves of the finer tree. */
static int put_means(const struct octree_node *node, void *userdata)
{
	struct averaging *a = userdata;
	const struct octree *finer = a->finer, *tree = a->tree;
	const unsigned code = finer->code[node->code], n = octree_popcount(code);
	const uint64_t leaf = a->n++;

	if (tree->normal != NULL)
		tree->normal[leaf] = octree_mean_normal(finer->normal + node->leaf, n);
	if (tree->color != NULL)
		octree_mean_color(tree->color[leaf], (const uint8_t(*)[3])finer->color + node->leaf, n);
	if (tree->material != NULL)
		octree_put_material(tree->material[leaf], octree_mean_material(finer, node->leaf, n));
	if (tree->offset != NULL)
		tree->offset[leaf] = (uint8_t)octree_mean_offset(code, tree->normal[leaf], finer->normal + node->leaf,
		                                                 finer->offset + node->leaf);
	return 0;
}

static int make_attributes(struct octree *tree, const struct octree *finer)
{
	struct averaging averaging = { finer, tree, 0 };

	if (finer->normal != NULL && (tree->normal = malloc(tree->n_leaves * sizeof *tree->normal)) == NULL)
		return 0;
	if (finer->color != NULL && (tree->color = malloc(tree->n_leaves * sizeof *tree->color)) == NULL)
		return 0;
	if (finer->normal != NULL && finer->offset != NULL && (tree->offset = malloc(tree->n_leaves)) == NULL)
		return 0;
	if (finer->material != NULL && (tree->material = malloc(tree->n_leaves * sizeof *tree->material)) == NULL)
		return 0;
	if (finer->one_material != NULL) {
		if ((tree->one_material = malloc(sizeof *tree->one_material)) == NULL)
			return 0;
		memcpy(tree->one_material, finer->one_material, sizeof *tree->one_material);
	}
	if (finer->lean != NULL) {
		if ((tree->lean = malloc(OCTREE_LEAN_CELLS)) == NULL)
			return 0;
		memcpy(tree->lean, finer->lean, OCTREE_LEAN_CELLS);
	}
	octree_walk(finer, tree->levels, put_means, &averaging);
	return 1;
}

struct octree *octree_coarser(const struct octree *finer)
{
	struct octree_maker maker;
	struct octree *tree = NULL;

	if (octree_maker_init(&maker, finer->levels - 1, NULL) == PSR_OK
	    && octree_walk(finer, finer->levels - 1, put_leaf, &maker) == PSR_OK)
		tree = octree_maker_take(&maker);
	octree_maker_fini(&maker);
	if (tree == NULL)
		return NULL;
	memcpy(tree->low, finer->low, sizeof tree->low);
	tree->edge = finer->edge;
	tree->is_one_sided = finer->is_one_sided;
	tree->is_cloud = finer->is_cloud;
	if (make_attributes(tree, finer))
		return tree;
	octree_destroy(tree);
	return NULL;
}

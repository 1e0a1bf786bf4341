#include <stdlib.h>
#include <string.h>
#include "octree.h"
#include "base/direction.h"

static int put_leaf(const struct octree_node *node, void *userdata)
{
	return octree_maker_put(userdata, node->path, NULL);
}

/* Where the leaves of a coarser tree take their offsets from. */
struct offsetting {
	const struct octree *finer;
	struct octree *tree;
	uint64_t n;
};

/* The mean place of a node's leaves tells its offset. Its code lists them. */
static int put_offset(const struct octree_node *node, void *userdata)
{
	struct offsetting *o = userdata;
	const float(*direction)[3] = psr_direction_table(), *normal = direction[o->tree->normal[o->n]];
	const unsigned code = o->finer->code[node->code];
	uint64_t leaf = node->leaf;
	double sum = 0.0;
	int count = 0;

	for (unsigned j = 0; j < 8; j++) {
		if (!(code >> j & 1))
			continue;
		const float *own = direction[o->finer->normal[leaf]];
		const double offset = octree_offset(o->finer->offset[leaf++]);

		for (int a = 0; a < 3; a++)
			sum += (double)normal[a] * ((j >> a & 1 ? 0.5 : -0.5) + offset * (double)own[a]);
		count++;
	}
	o->tree->offset[o->n++] = (uint8_t)octree_offset_step(sum / (2 * count));
	return 0;
}

static int make_attributes(struct octree *tree, const struct octree *finer)
{
	struct offsetting offsetting = { finer, tree, 0 };

	if (finer->normal != NULL && (tree->normal = malloc(tree->n_leaves * sizeof *tree->normal)) == NULL)
		return 0;
	if (finer->color != NULL && (tree->color = malloc(tree->n_leaves * sizeof *tree->color)) == NULL)
		return 0;
	if (tree->normal != NULL || tree->color != NULL)
		octree_average(finer, tree->levels, tree->normal, tree->color);
	if (finer->normal == NULL || finer->offset == NULL)
		return 1;
	tree->offset = malloc(tree->n_leaves);
	if (tree->offset == NULL)
		return 0;
	octree_walk(finer, tree->levels, put_offset, &offsetting);
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
	if (make_attributes(tree, finer))
		return tree;
	octree_destroy(tree);
	return NULL;
}

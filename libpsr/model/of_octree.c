#include <math.h>
#include "base/maths.h"
#include "base/vec.h"
#include "model/tree.h"

struct extent {
	uint32_t low[3], high[3]; /* leaves, both inside */
};

static int take_leaf(const struct octree_node *node, void *userdata)
{
	struct extent *extent = userdata;
	uint32_t at[3];

	octree_place(node->path, at);
	for (int c = 0; c < 3; c++) {
		extent->low[c] = at[c] < extent->low[c] ? at[c] : extent->low[c];
		extent->high[c] = at[c] > extent->high[c] ? at[c] : extent->high[c];
	}
	return 0;
}

void psr_octree_info(struct psr_model_info *info, const struct octree *tree)
{
	struct extent extent = { .low = { UINT32_MAX, UINT32_MAX, UINT32_MAX } };
	const double leaf = ldexp(tree->edge, -tree->levels);
	double half[3];

	octree_walk(tree, tree->levels, take_leaf, &extent);
	*info = (struct psr_model_info){ .up = { 0, 1, 0 } };
	for (int c = 0; c < 3; c++) {
		info->box_min[c] = tree->low[c] + extent.low[c] * leaf;
		info->box_max[c] = tree->low[c] + (extent.high[c] + 1.0) * leaf;
		half[c] = (info->box_max[c] - info->box_min[c]) / 2;
		info->origin[c] = info->box_min[c] + half[c];
	}
	info->scale = sqrt(v3d_dot(half, half));
	info->spacing = sqrt(3.0) * leaf;
	/* Blocks' spacing is 2 / resolution inner units. */
	info->resolution = (uint32_t)fmax(2.0 * info->scale / info->spacing, 1.0);
}

void psr_octree_to_inner(struct octree *inner, const struct octree *tree, const struct psr_model_info *info)
{
	*inner = *tree;
	for (int c = 0; c < 3; c++)
		inner->low[c] = (tree->low[c] - info->origin[c]) / info->scale;
	inner->edge = tree->edge / info->scale;
}

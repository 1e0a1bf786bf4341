/* A balanced tree of cells, by their middles: each leaf is one cell. Node i has the children 2 i + 1 and 2 i + 2,
 * halves of its cells; a node is named by its index. */
#ifndef PSR_DPOINT_CELL_TREE_H
#define PSR_DPOINT_CELL_TREE_H

#include "base/pool.h"
#include "look.h"
#include "surface.h"

#define CELL_NO_PART UINT32_MAX /* cells of several parts */

/* A sphere, and a box along the axes, that each hold the corners of a node's cells: what most questions end with. */
struct cell_ball {
	float middle[3], radius;
	float half[3]; /* of the box's sides; they have the same middle */
	float widest;  /* of the spheres of its cells alone */
};

struct cell_node {
	float normal[3], spread;   /* normals are no further from this one than `spread`; infinite: one has none, or is
	                            * beyond */
	uint32_t begin, end;       /* of order */
	uint32_t part;
	struct look_range looks;   /* of cells of the surface, if spread is finite */
};

struct cell_tree {
	struct cell_node *node;
	struct cell_ball *ball;    /* of each node; those of both children share a line of the cache */
	void *balls;               /* what they are in */
	uint32_t *order;
	size_t n_nodes;            /* places for nodes; not all are there */
};

/* MEMORY; n > 0; pool may be NULL. */
int cell_tree_init(struct cell_tree *tree, const struct dpoint_cell *cell, size_t n, struct psr_pool *pool);
void cell_tree_fini(struct cell_tree *tree);

static inline int cell_node_is_leaf(const struct cell_node *node)
{
	return node->end - node->begin == 1;
}

#endif

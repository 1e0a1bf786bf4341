#include "cell_tree.h"

#include <stdlib.h>
#include "base/vec.h"

struct entry {
	float middle[3];
	uint32_t cell;
};

static int is_before(const struct entry *a, const struct entry *b, int axis)
{
	return a->middle[axis] != b->middle[axis] ? a->middle[axis] < b->middle[axis] : a->cell < b->cell;
}

/* Hoare's selection: entries before k are not above it. Middle pivots, and a total order, keep it from n^2 on grids. */
static void select_kth(struct entry *e, long low, long high, long k, int axis)
{
	while (low < high) {
		const struct entry pivot = e[low + (high - low) / 2];
		long i = low, j = high;

		while (i <= j) {
			while (is_before(&e[i], &pivot, axis))
				i++;
			while (is_before(&pivot, &e[j], axis))
				j--;
			if (i <= j) {
				const struct entry swapped = e[i];

				e[i++] = e[j];
				e[j--] = swapped;
			}
		}
		if (k <= j)
			high = j;
		else if (k >= i)
			low = i;
		else
			return;
	}
}

struct making {
	struct cell_node *node;
	struct entry *entry;
	const struct dpoint_cell *cell;
};

/* Returns the axis along which the cells reach furthest. */
static int bound_places(struct cell_node *node, const struct making *m)
{
	float low[3] = { INFINITY, INFINITY, INFINITY }, high[3] = { -INFINITY, -INFINITY, -INFINITY };
	float radius2 = 0;
	int axis = 0;

	for (uint32_t e = node->begin; e < node->end; e++)
		for (int k = 0; k < 3; k++) {
			low[k] = fminf(low[k], m->entry[e].middle[k]);
			high[k] = fmaxf(high[k], m->entry[e].middle[k]);
		}
	for (int k = 0; k < 3; k++) {
		node->middle[k] = 0.5f * (low[k] + high[k]);
		axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
	}
	for (uint32_t e = node->begin; e < node->end; e++)
		for (int c = 0; c < 4; c++) {
			float away[3];

			v3f_sub(away, m->cell[m->entry[e].cell].corner[c], node->middle);
			radius2 = fmaxf(radius2, v3f_dot(away, away));
		}
	node->radius = sqrtf(radius2) * 1.00001f;
	return axis;
}

static void bound_normals(struct cell_node *node, const struct making *m)
{
	float spread2 = 0;

	look_range_of(&node->looks, m->cell[m->entry[node->begin].cell].attr);
	node->part = m->cell[m->entry[node->begin].cell].part;
	v3f_set(node->normal, 0, 0, 0);
	for (uint32_t e = node->begin; e < node->end; e++) {
		struct look_range looks;

		look_range_of(&looks, m->cell[m->entry[e].cell].attr);
		look_range_join(&node->looks, &looks);
		v3f_add(node->normal, node->normal, m->cell[m->entry[e].cell].normal);
		if (m->cell[m->entry[e].cell].part != node->part)
			node->part = CELL_NO_PART;
	}
	v3f_normalize(node->normal, node->normal);
	for (uint32_t e = node->begin; e < node->end; e++) {
		const struct dpoint_cell *cell = &m->cell[m->entry[e].cell];
		const float *normal = cell->normal;
		float away[3];

		v3f_sub(away, normal, node->normal);
		if (cell->part == DPOINT_BEYOND || v3f_dot(normal, normal) == 0)
			spread2 = INFINITY;
		spread2 = fmaxf(spread2, v3f_dot(away, away));
	}
	node->spread = sqrtf(spread2);
}

/* Above this many cells a node is nobody's as a whole, and its normals do not matter. */
#define MOST_WHOLE 65536

static void split(const struct making *m, size_t i, uint32_t begin, uint32_t end)
{
	struct cell_node *node = &m->node[i];
	int axis;

	node->begin = begin;
	node->end = end;
	axis = bound_places(node, m);
	node->spread = INFINITY;
	if (end - begin <= MOST_WHOLE)
		bound_normals(node, m);
	if (end - begin > 1) {
		const uint32_t half = begin + (end - begin) / 2;

		select_kth(m->entry, begin, (long)end - 1, half, axis);
		split(m, 2 * i + 1, begin, half);
		split(m, 2 * i + 2, half, end);
	}
}

int cell_tree_init(struct cell_tree *tree, const struct dpoint_cell *cell, size_t n)
{
	struct making m = { .cell = cell };

	/* Halves of halves: a level has at most one size more than the other, so the depth is that of a full tree. */
	for (tree->n_nodes = 1; (tree->n_nodes + 1) / 2 < n;)
		tree->n_nodes = 2 * tree->n_nodes + 1;
	tree->node = malloc(tree->n_nodes * sizeof *tree->node);
	tree->order = malloc(n * sizeof *tree->order);
	m.node = tree->node;
	m.entry = malloc(n * sizeof *m.entry);
	if (tree->node == NULL || tree->order == NULL || m.entry == NULL) {
		free(m.entry);
		return PSR_ERR_MEMORY;
	}
	for (size_t i = 0; i < n; i++) {
		dpoint_cell_middle(m.entry[i].middle, &cell[i]);
		m.entry[i].cell = (uint32_t)i;
	}
	split(&m, 0, 0, (uint32_t)n);
	for (size_t i = 0; i < n; i++)
		tree->order[i] = m.entry[i].cell;
	free(m.entry);
	return PSR_OK;
}

void cell_tree_fini(struct cell_tree *tree)
{
	free(tree->node);
	free(tree->order);
}

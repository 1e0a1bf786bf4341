#include "cell_tree.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "sight.h"

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
	struct cell_ball *ball;
	struct entry *entry;
	const struct dpoint_cell *cell;
	size_t first; /* node of a level that threads divide */
};

static inline float lesser(float a, float b)
{
	return b < a ? b : a;
}

static inline float greater(float a, float b)
{
	return b > a ? b : a;
}

/* The last lane is what comes after the corner. */
static inline lanes lanes_of_corner(const struct dpoint_cell *cell, int c)
{
	lanes corner;

	memcpy(&corner, (const char *)cell + offsetof(struct dpoint_cell, corner) + (size_t)c * sizeof cell->corner[0],
	       sizeof corner);
	return corner;
}

/* Returns the axis along which the cells reach furthest. */
static int bound_places(struct cell_ball *ball, const struct cell_node *node, const struct making *m)
{
	float low[3] = { INFINITY, INFINITY, INFINITY }, high[3] = { -INFINITY, -INFINITY, -INFINITY };
	float radius2 = 0;
	lanes middle, half = lanes_all(0);
	int axis = 0;

	for (uint32_t e = node->begin; e < node->end; e++)
		for (int k = 0; k < 3; k++) {
			low[k] = lesser(low[k], m->entry[e].middle[k]);
			high[k] = greater(high[k], m->entry[e].middle[k]);
		}
	for (int k = 0; k < 3; k++) {
		ball->middle[k] = 0.5f * (low[k] + high[k]);
		axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
	}
	middle = sight_place(ball->middle);
	for (uint32_t e = node->begin; e < node->end; e++)
		for (int c = 0; c < 4; c++) {
			const lanes away = lanes_of_corner(&m->cell[m->entry[e].cell], c) - middle, square = away * away;

			radius2 = greater(radius2, square[0] + square[1] + square[2]);
			half = lanes_greater(half, lanes_size(away));
		}
	ball->radius = sqrtf(radius2) * 1.00001f;
	half *= lanes_all(1.00001f);
	memcpy(ball->half, &half, sizeof ball->half);
	return axis;
}

static void bound_normals(struct cell_node *node, const struct making *m)
{
	float spread2 = 0;
	uint64_t attr = m->cell[m->entry[node->begin].cell].attr; /* most are as the one before */

	look_range_of(&node->looks, attr);
	node->part = m->cell[m->entry[node->begin].cell].part;
	v3f_set(node->normal, 0, 0, 0);
	for (uint32_t e = node->begin; e < node->end; e++) {
		const struct dpoint_cell *cell = &m->cell[m->entry[e].cell];

		if (cell->attr != attr) {
			struct look_range looks;

			attr = cell->attr;
			look_range_of(&looks, attr);
			look_range_join(&node->looks, &looks);
		}
		v3f_add(node->normal, node->normal, cell->normal);
		if (cell->part != node->part)
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
		spread2 = greater(spread2, v3f_dot(away, away));
	}
	node->spread = sqrtf(spread2);
}

/* Above this many cells a node is nobody's as a whole, and its normals do not matter. */
#define MOST_WHOLE 65536

static void bound(const struct making *m, size_t i, uint32_t begin, uint32_t end, int *axis)
{
	struct cell_node *node = &m->node[i];

	node->begin = begin;
	node->end = end;
	*axis = bound_places(&m->ball[i], node, m);
	node->spread = INFINITY;
	if (end - begin <= MOST_WHOLE)
		bound_normals(node, m);
}

static void join_widest(struct cell_ball *ball, size_t i)
{
	ball[i].widest = greater(ball[2 * i + 1].widest, ball[2 * i + 2].widest);
}

static void split(const struct making *m, size_t i, uint32_t begin, uint32_t end)
{
	const uint32_t half = begin + (end - begin) / 2;
	int axis;

	bound(m, i, begin, end, &axis);
	m->ball[i].widest = m->ball[i].radius;
	if (end - begin > 1) {
		select_kth(m->entry, begin, (long)end - 1, half, axis);
		split(m, 2 * i + 1, begin, half);
		split(m, 2 * i + 2, half, end);
		join_widest(m->ball, i);
	}
}

/* A level of as many nodes is the threads' work. */
#define PARTS 16
#define FIRST_PART (PARTS - 1) /* its first node */
#define LEAST_SHARED 4096      /* cells */

static void split_part(int part, void *userdata)
{
	const struct making *m = userdata;
	const size_t i = FIRST_PART + (size_t)part;

	split(m, i, m->node[i].begin, m->node[i].end);
}

/* Divides a node above the threads' parts, which are its level. */
static void split_first(int of_level, void *userdata)
{
	const struct making *m = userdata;
	const size_t i = m->first + (size_t)of_level;
	const uint32_t begin = m->node[i].begin, end = m->node[i].end, half = begin + (end - begin) / 2;
	int axis;

	bound(m, i, begin, end, &axis);
	select_kth(m->entry, begin, (long)end - 1, half, axis);
	m->node[2 * i + 1].begin = begin;
	m->node[2 * i + 1].end = m->node[2 * i + 2].begin = half;
	m->node[2 * i + 2].end = end;
}

/* Balls of two children begin at a multiple of their size. */
static int make_room(struct cell_tree *tree, size_t n)
{
	/* Halves of halves: a level has at most one size more than the other, so the depth is that of a full tree. */
	for (tree->n_nodes = 1; (tree->n_nodes + 1) / 2 < n;)
		tree->n_nodes = 2 * tree->n_nodes + 1;
	tree->node = malloc(tree->n_nodes * sizeof *tree->node);
	tree->balls = aligned_alloc(2 * sizeof *tree->ball, (tree->n_nodes + 1) * sizeof *tree->ball);
	tree->ball = tree->balls != NULL ? (struct cell_ball *)tree->balls + 1 : NULL;
	tree->order = malloc(n * sizeof *tree->order);
	return tree->node != NULL && tree->balls != NULL && tree->order != NULL ? PSR_OK : PSR_ERR_MEMORY;
}

int cell_tree_init(struct cell_tree *tree, const struct dpoint_cell *cell, size_t n, struct psr_pool *pool)
{
	struct making m = { .cell = cell, .entry = malloc(n * sizeof *m.entry) };
	int rc = make_room(tree, n);

	if (rc != PSR_OK || m.entry == NULL) {
		free(m.entry);
		return PSR_ERR_MEMORY;
	}
	m.node = tree->node;
	m.ball = tree->ball;
	for (size_t i = 0; i < n; i++) {
		dpoint_cell_middle(m.entry[i].middle, &cell[i]);
		m.entry[i].cell = (uint32_t)i;
	}
	if (n < LEAST_SHARED) {
		split(&m, 0, 0, (uint32_t)n);
	} else {
		m.node[0].begin = 0;
		m.node[0].end = (uint32_t)n;
		for (m.first = 0; m.first < FIRST_PART; m.first = 2 * m.first + 1)
			psr_pool_for(pool, (int)m.first + 1, split_first, &m);
		psr_pool_for(pool, PARTS, split_part, &m);
		for (size_t i = FIRST_PART; i-- > 0;)
			join_widest(m.ball, i);
	}
	for (size_t i = 0; i < n; i++)
		tree->order[i] = m.entry[i].cell;
	free(m.entry);
	return PSR_OK;
}

void cell_tree_fini(struct cell_tree *tree)
{
	free(tree->node);
	free(tree->balls);
	free(tree->order);
}

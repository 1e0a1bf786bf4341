#include <math.h>
#include <stdlib.h>
#include "leaves.h"
#include "runs.h"
#include "octree/levels.h"
#include "base/axes.h"
#include "base/direction.h"

#define CELL_LEAVES 3 /* in the mean, at least; on surfaces up to four times as many */
#define STEPS 8

/* Where a cell's codes and leaves begin. */
struct cell {
	uint64_t code, leaf;
};

/* Places of a cell's leaves, in its edges from its middle. */
struct moments {
	float n, sum[3], product[6]; /* xx xy xz yy yz zz */
};

struct normals {
	const struct built *built;
	const struct octree_build_options *options;
	struct octree_levels levels;  /* of the tree down to the cells' depth */
	int depth;                    /* of the cells */
	uint32_t n_cells, cell;       /* cell: the one that leaves belong to now */
	struct cell *first;           /* of each cell; one more than cells */
	struct moments *moments;
	float (*normal)[3];
	uint32_t *root;               /* a forest of cells whose sides agree: the one above, twice, and 1 if it is turned */
	uint32_t *highest;            /* of the cells of a tree of the forest, at its root */
	float *height;                /* of each cell's leaves, in cells */
	uint8_t *is_turned;           /* cells whose normals have to look the other way */
	float least;                  /* joining cells: agreement of their normals */
	int is_cancelled, has_own; /* has_own: some leaves have normals of the source's */
};

static void add_place(struct moments *m, const float p[3])
{
	m->n += 1.0f;
	for (int c = 0, k = 0; c < 3; c++) {
		m->sum[c] += p[c];
		for (int d = c; d < 3; d++)
			m->product[k++] += p[c] * p[d];
	}
}

/* Computes the place of a leaf's points in its cell, in the cell's edges from its middle. */
static void find_place(float p[3], const struct normals *s, uint64_t path, uint64_t leaf)
{
	const int up = s->built->tree->levels - s->depth;
	const float edge = 1.0f / (float)(1u << up);
	uint32_t at[3];

	octree_place(path & (((uint64_t)1 << 3 * up) - 1), at);
	for (int c = 0; c < 3; c++)
		p[c] = ((float)at[c] + ((float)s->built->part[leaf][c] + 0.5f) / 256.0f) * edge - 0.5f;
}

static int add_leaf(const struct octree_node *node, void *userdata)
{
	struct normals *s = userdata;
	float p[3];

	while (node->leaf >= s->first[s->cell + 1].leaf)
		s->cell++;
	find_place(p, s, node->path, node->leaf);
	add_place(&s->moments[s->cell], p);
	return 0;
}

/* Adds moments of a cell that is `step` cells away, by half for each axis along which it is. */
static void add_moments(double sum[10], const struct moments *m, const int step[3])
{
	const double weight = ldexp(1.0, -abs(step[0]) - abs(step[1]) - abs(step[2]));
	double moved[3];

	sum[0] += weight * (double)m->n;
	for (int c = 0; c < 3; c++) {
		moved[c] = (double)m->sum[c] + (double)m->n * step[c];
		sum[1 + c] += weight * moved[c];
	}
	/* (p + a)(q + b) = pq + a q + b p + ab */
	for (int c = 0, k = 0; c < 3; c++)
		for (int d = c; d < 3; d++, k++)
			sum[4 + k] += weight * ((double)m->product[k] + step[c] * (double)m->sum[d] + step[d] * moved[c]);
}

/* The direction in which a cell's surroundings extend least. */
static void find_normal(uint32_t cell, uint64_t path, const struct octree_near *near, void *userdata)
{
	struct normals *s = userdata;
	double sum[10] = { 0 }, m[3][3], axis[3][3];
	int least = 0;

	(void)path;
	for (uint32_t left = near->there; left != 0; left &= left - 1) {
		const int k = __builtin_ctz(left);

		add_moments(sum, &s->moments[octree_near_at(near, (unsigned)k)],
		            (const int[3]){ k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1 });
	}
	for (int c = 0, k = 4; c < 3; c++)
		for (int d = c; d < 3; d++, k++)
			m[c][d] = m[d][c] = sum[k] - sum[1 + c] * sum[1 + d] / sum[0];
	axes_find(m, axis);
	for (int c = 1; c < 3; c++)
		least = m[c][c] < m[least][least] ? c : least;
	for (int c = 0; c < 3; c++)
		s->normal[cell][c] = (float)axis[least][c];
}

/* Returns the root of a cell, twice, and 1 if the cell is turned towards it. Shortens the way by halves. */
static uint32_t find_root(uint32_t *root, uint32_t cell)
{
	uint32_t turned = 0;

	while (root[cell] >> 1 != cell) {
		const uint32_t above = root[cell] >> 1, over = root[above];

		root[cell] = over ^ (root[cell] & 1);
		turned ^= root[cell] & 1;
		cell = over >> 1;
	}
	return cell << 1 | turned;
}

static void join(uint32_t cell, uint64_t path, const struct octree_near *near, void *userdata)
{
	struct normals *s = userdata;

	(void)path;
	for (uint32_t left = near->there >> (OCTREE_SELF + 1) << (OCTREE_SELF + 1); left != 0; left &= left - 1) {
		const uint32_t other = octree_near_at(near, (unsigned)__builtin_ctz(left));
		uint32_t a, b;
		float agreement;

		agreement = s->normal[cell][0] * s->normal[other][0] + s->normal[cell][1] * s->normal[other][1] +
		            s->normal[cell][2] * s->normal[other][2];
		if (fabsf(agreement) < s->least)
			continue;
		a = find_root(s->root, cell);
		b = find_root(s->root, other);
		if (a >> 1 == b >> 1)
			continue;
		s->root[b >> 1] = (a & ~1u) | ((a ^ b ^ (agreement < 0.0f)) & 1);
		if (s->height[s->highest[b >> 1]] > s->height[s->highest[a >> 1]])
			s->highest[a >> 1] = s->highest[b >> 1];
	}
}

static void note_height(uint32_t cell, uint64_t path, const struct octree_near *near, void *userdata)
{
	struct normals *s = userdata;
	uint32_t at[3];

	(void)near;
	octree_place(path, at);
	s->height[cell] = (float)at[2] + s->moments[cell].sum[2] / s->moments[cell].n;
}

/* Joins cells that agree best first: what hangs together has one side, and its highest cell looks up ([Hoppe et al.
 * 1992] 3.3). */
static void orient(struct normals *s)
{
	static const float least[STEPS] = { 0.999f, 0.99f, 0.97f, 0.9f, 0.75f, 0.5f, 0.25f, 0.0f };

	octree_levels_walk(&s->levels, s->depth, note_height, s);
	for (uint32_t i = 0; i < s->n_cells; i++) {
		s->root[i] = i << 1;
		s->highest[i] = i;
	}
	for (int step = 0; step < STEPS; step++) {
		s->least = least[step];
		octree_levels_walk(&s->levels, s->depth, join, s);
		built_progress(s->options, "normals", 2 + (uint64_t)step, 3 + STEPS);
		if (psr_is_cancelled(s->options->cancel)) {
			s->is_cancelled = 1;
			return;
		}
	}
	for (uint32_t i = 0; i < s->n_cells; i++) {
		const uint32_t root = find_root(s->root, i), top = s->highest[root >> 1];

		s->is_turned[i] = (uint8_t)(((root ^ find_root(s->root, top)) & 1) ^ (s->normal[top][2] < 0.0f));
	}
	for (uint32_t i = 0; i < s->n_cells; i++)
		for (int c = 0; c < 3 && s->is_turned[i]; c++)
			s->normal[i][c] = -s->normal[i][c];
}

static uint8_t offset_of(const struct built *built, uint64_t leaf, const float normal[3])
{
	double offset = 0.0;

	for (int c = 0; c < 3; c++)
		offset += (((double)built->part[leaf][c] + 0.5) / 256.0 - 0.5) * (double)normal[c];
	return (uint8_t)octree_offset_step(offset);
}

/* A cell whose leaves get normals; the next code and leaf. */
struct setting {
	struct normals *normals;
	const struct octree_near *near;
	struct cell next;
};

/* Blends the normals of the eight cells whose middles are around a place of the first one. One that faces away, as the
 * other side of a wall does, has no part in it, and one beyond an edge less. */
static void blend(float normal[3], const struct setting *set, const float place[3])
{
	static const unsigned step[3] = { 1, 3, 9 };
	const struct normals *s = set->normals;
	const float *own = s->normal[octree_near_at(set->near, OCTREE_SELF)];

	for (int c = 0; c < 3; c++)
		normal[c] = 0.0f;
	for (int k = 0; k < 8; k++) {
		unsigned near = OCTREE_SELF;
		float weight = 1.0f, agreement = 0.0f;

		for (int c = 0; c < 3; c++) {
			const float away = fabsf(place[c]);

			near += !(k >> c & 1) ? 0 : place[c] < 0.0f ? -step[c] : step[c];
			weight *= k >> c & 1 ? away : 1.0f - away;
		}
		if (!(set->near->there >> near & 1))
			continue;
		const float *other = s->normal[octree_near_at(set->near, near)];

		for (int c = 0; c < 3; c++)
			agreement += own[c] * other[c];
		for (int c = 0; c < 3 && agreement > 0.0f; c++)
			normal[c] += weight * agreement * other[c];
	}
}

static void set_leaf(const struct setting *set, uint64_t path)
{
	const struct normals *s = set->normals;
	struct octree *tree = s->built->tree;
	const uint64_t leaf = set->next.leaf;
	float blended[3], place[3];
	const float *normal = blended;

	if (s->has_own && tree->normal[leaf] != RECORD_NO_NORMAL) {
		normal = psr_direction_table()[tree->normal[leaf]];
	} else {
		find_place(place, s, path, leaf);
		blend(blended, set, place);
		tree->normal[leaf] = psr_direction_encode(blended);
		normal = psr_direction_table()[tree->normal[leaf]];
	}
	tree->offset[leaf] = offset_of(s->built, leaf, normal);
}

static void set_leaves(struct setting *set, uint64_t path, int depth)
{
	const struct octree *tree = set->normals->built->tree;

	if (depth == tree->levels) {
		set_leaf(set, path);
		set->next.leaf++;
		return;
	}
	for (unsigned left = tree->code[set->next.code++]; left != 0; left &= left - 1)
		set_leaves(set, path << 3 | (unsigned)__builtin_ctz(left), depth + 1);
}

static void set_cell(uint32_t cell, uint64_t path, const struct octree_near *near, void *userdata)
{
	struct normals *s = userdata;
	struct setting set = { s, near, s->first[cell] };

	set_leaves(&set, path, s->depth);
}

/* All leaves have normals of the source's. */
static int set_offsets(const struct built *built)
{
	struct octree *tree = built->tree;

	tree->offset = malloc(tree->n_leaves);
	if (tree->offset == NULL)
		return PSR_ERR_MEMORY;
	for (uint64_t i = 0; i < tree->n_leaves; i++)
		tree->offset[i] = offset_of(built, i, psr_direction_table()[tree->normal[i]]);
	return PSR_OK;
}

static int count_node(const struct octree_node *node, void *userdata)
{
	(void)node;
	++*(uint64_t *)userdata;
	return 0;
}

static void find_depth(struct normals *s)
{
	const struct octree *tree = s->built->tree;
	uint64_t n = 0;

	for (s->depth = tree->levels; s->depth > 0; s->depth--) {
		n = 0;
		octree_walk(tree, s->depth, count_node, &n);
		if (n * CELL_LEAVES <= tree->n_leaves && n < UINT32_MAX / 2)
			break;
	}
	s->n_cells = (uint32_t)(s->depth > 0 ? n : 1);
}

static int note_first(const struct octree_node *node, void *userdata)
{
	struct normals *s = userdata;

	s->first[s->cell++] = (struct cell){ node->code, node->leaf };
	return 0;
}

struct filling {
	struct octree_levels *levels;
	const struct octree *tree;
	int level, has_failed;
};

static int put_code(const struct octree_node *node, void *userdata)
{
	struct filling *f = userdata;

	f->has_failed |= !octree_level_put(&f->levels->at[f->level], f->tree->code[node->code]);
	return f->has_failed;
}

static int allocate(struct normals *s)
{
	static const uint64_t root = 0;
	struct octree *tree = s->built->tree;
	struct filling filling = { &s->levels, tree, 0, 0 };

	s->levels.n_roots = 1;
	s->levels.root = &root;
	s->levels.height = s->depth;
	for (; filling.level < s->depth; filling.level++)
		octree_walk(tree, filling.level, put_code, &filling);
	s->first = malloc(((size_t)s->n_cells + 1) * sizeof *s->first);
	s->moments = calloc(s->n_cells, sizeof *s->moments);
	s->normal = malloc(s->n_cells * sizeof *s->normal);
	s->root = malloc(s->n_cells * sizeof *s->root);
	s->highest = malloc(s->n_cells * sizeof *s->highest);
	s->height = malloc(s->n_cells * sizeof *s->height);
	s->is_turned = malloc(s->n_cells);
	if (!s->has_own)
		tree->normal = malloc(tree->n_leaves * sizeof *tree->normal);
	tree->offset = malloc(tree->n_leaves);
	return filling.has_failed || s->first == NULL || s->moments == NULL || s->normal == NULL || s->root == NULL ||
	               s->highest == NULL || s->height == NULL || s->is_turned == NULL || tree->normal == NULL ||
	               tree->offset == NULL
	           ? PSR_ERR_MEMORY
	           : PSR_OK;
}

int built_normals(const struct built *built, const struct octree_build_options *options)
{
	const struct octree *tree = built->tree;
	struct normals s = { .built = built, .options = options, .has_own = tree->normal != NULL };
	int rc;

	if (s.has_own && built->n_without == 0)
		return set_offsets(built);

	find_depth(&s);
	rc = allocate(&s);
	if (rc == PSR_OK) {
		octree_walk(tree, s.depth, note_first, &s);
		s.first[s.n_cells].leaf = tree->n_leaves;
		s.cell = 0;
		octree_walk(tree, tree->levels, add_leaf, &s);
		built_progress(options, "normals", 1, 3 + STEPS);
		octree_levels_walk(&s.levels, s.depth, find_normal, &s);
		built_progress(options, "normals", 2, 3 + STEPS);
		orient(&s);
		octree_levels_walk(&s.levels, s.depth, set_cell, &s);
		built_progress(options, "normals", 3 + STEPS, 3 + STEPS);
		rc = s.is_cancelled ? PSR_ERR_CANCELLED : PSR_OK;
	}
	octree_levels_fini(&s.levels);
	free(s.first);
	free(s.moments);
	free(s.normal);
	free(s.root);
	free(s.highest);
	free(s.height);
	free(s.is_turned);
	return rc;
}

#include <math.h>
#include <stdlib.h>
#include "base/mem.h"
#include "cubes_make.h"

#define MOST_CUBES ((uint32_t)1 << 26)

_Static_assert(OCTREE_SKIP_LEVELS == CUBES_MOST_LEVELS + 1, "a cluster is a subtree of the skip index");

/* Counts all, by task, and makes each task's count that of all tasks before it. */
static void count(struct cubes_making *m, struct psr_pool *pool)
{
	struct cubes_count sum = { .cube = { 0 } };

	psr_pool_for(pool, OCTREE_TASKS, cubes_count_task, m);
	for (int task = 0; task <= OCTREE_TASKS; task++) {
		const struct cubes_count own = m->task[task];

		m->task[task] = sum;
		for (int l = 0; l < m->n_levels; l++) {
			sum.cube[l] += own.cube[l];
			sum.code[l] += own.code[l];
			sum.leaf[l] += own.leaf[l];
			sum.skip[l] += own.skip[l];
		}
	}
}

static int check_counts(const struct cubes_making *m, struct psr_error *err)
{
	const struct octree *tree = m->tree;
	uint64_t n_cubes = 0;

	if (tree->n_codes > UINT32_MAX || tree->n_leaves > UINT32_MAX)
		return psr_fail(err, PSR_ERR_LIMIT, "an octree of %llu leaves cannot be drawn; the limit is %u",
		                (unsigned long long)tree->n_leaves, UINT32_MAX);
	for (int l = 0; l < m->n_levels; l++)
		n_cubes += m->task[OCTREE_TASKS].cube[l];
	if (n_cubes > MOST_CUBES)
		return psr_fail(err, PSR_ERR_LIMIT, "an octree of more than %u cubes of 4x4x4 leaves cannot be drawn",
		                MOST_CUBES);
	return PSR_OK;
}

/* Returns a tree with room for a level; NULL without memory. */
static struct octree *make_tree(const struct cubes_making *m, int level)
{
	const struct cubes_count *n = &m->task[OCTREE_TASKS];
	const struct octree *finest = m->tree;
	struct octree *tree = calloc(1, sizeof *tree);
	int is_done;

	if (tree == NULL)
		return NULL;
	*tree = (struct octree){ .levels = finest->levels - level, .is_one_sided = finest->is_one_sided,
		                     .is_cloud = finest->is_cloud,
		                     .low = { finest->low[0], finest->low[1], finest->low[2] }, .edge = finest->edge,
		                     .n_codes = n->code[level], .n_leaves = n->leaf[level], .n_skips = n->skip[level] };
	tree->code = malloc(tree->n_codes);
	tree->skip = malloc(tree->n_skips * sizeof *tree->skip);
	is_done = tree->code != NULL && tree->skip != NULL;
	if (finest->normal != NULL)
		is_done &= (tree->normal = malloc(tree->n_leaves * sizeof *tree->normal)) != NULL;
	if (finest->color != NULL)
		is_done &= (tree->color = malloc(tree->n_leaves * sizeof *tree->color)) != NULL;
	if (finest->normal != NULL && finest->offset != NULL)
		is_done &= (tree->offset = malloc(tree->n_leaves)) != NULL;
	/* Lobes widen by level: one material of all leaves is none of all nodes. */
	if (finest->material != NULL || finest->one_material != NULL)
		is_done &= (tree->material = malloc(tree->n_leaves * sizeof *tree->material)) != NULL;
	if (finest->scan.intensity != NULL)
		is_done &= (tree->scan.intensity = malloc(tree->n_leaves * sizeof *tree->scan.intensity)) != NULL;
	if (finest->scan.class != NULL)
		is_done &= (tree->scan.class = malloc(tree->n_leaves)) != NULL;
	if (finest->scan.returns != NULL)
		is_done &= (tree->scan.returns = malloc(tree->n_leaves)) != NULL;
	if (is_done)
		return tree;
	octree_destroy(tree);
	return NULL;
}

static uint64_t bytes_of(const struct octree *tree)
{
	const struct octree_scan *scan = &tree->scan;
	const uint64_t leaf = (tree->normal != NULL ? 2 : 0) + (tree->color != NULL ? 3 : 0) + (tree->offset != NULL)
	                      + (tree->material != NULL ? 3 : 0)
	                      + (scan->intensity != NULL ? 2 : 0) + (scan->class != NULL) + (scan->returns != NULL);

	return sizeof *tree + tree->n_codes + tree->n_skips * sizeof *tree->skip + tree->n_leaves * leaf;
}

static int make_trees(struct cubes_making *m, struct psr_error *err)
{
	struct psr_cubes *cubes = m->cubes;

	for (int l = 0; l < m->n_levels; l++) {
		struct psr_cube_level *level = &cubes->level[l];

		if (l > 0) {
			level->tree = m->coarse[l] = make_tree(m, l);
			if (level->tree == NULL)
				return psr_fail(err, PSR_ERR_MEMORY, "no memory for the levels of an octree");
			cubes->n_bytes += bytes_of(level->tree);
		}
		level->edge = ldexp(level->tree->edge, -level->tree->levels);
		level->first = cubes->groups.n_blocks;
		level->n = (uint32_t)m->task[OCTREE_TASKS].cube[l];
		cubes->groups.n_blocks += level->n;
		cubes->groups.n_samples += level->tree->n_leaves;
	}
	cubes->groups.n_levels = (uint32_t)m->n_levels;
	return PSR_OK;
}

/* All arrays in one piece of memory, the widest elements first. */
static int make_arrays(struct cubes_making *m, struct psr_error *err)
{
	struct psr_cubes *cubes = m->cubes;
	const size_t n_cubes = cubes->groups.n_blocks, n_clusters = m->tree->n_skips * (uint64_t)m->n_levels;
	const int has_cones = psr_octree_is_one_sided(m->tree), has_traits = has_cones && m->tree->lean != NULL;
	const size_t n_bytes = sizeof *m->flags + (has_cones ? 4 : 0) + (has_traits ? 1 : 0);
	size_t n = n_cubes * (sizeof *m->cube + n_bytes) + n_clusters * sizeof *m->cluster;
	struct psr_cube_bound *bound;
	struct psr_cube_run *run;
	char *memory;

	n += cubes_n_bunches(m->tree) * sizeof *m->bunch;
	for (int l = 0; l < m->n_levels; l++)
		n += cubes_n_runs(&cubes->level[l]) * (sizeof *run + sizeof *bound);
	memory = psr_alloc_array(n, 1);
	if (memory == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %zu cubes of an octree", n_cubes);
	cubes->n_bytes += sizeof *cubes + n;
	cubes->cube = m->cube = (struct psr_cube *)(void *)memory;
	run = (struct psr_cube_run *)(m->cube + n_cubes);
	for (int l = 0; l < m->n_levels; l++) {
		cubes->level[l].run = m->run[l] = run;
		run += cubes_n_runs(&cubes->level[l]);
	}
	bound = (struct psr_cube_bound *)run;
	for (int l = 0; l < m->n_levels; l++) {
		cubes->level[l].bound = m->bound[l] = bound;
		bound += cubes_n_runs(&cubes->level[l]);
	}
	m->cluster = (struct psr_cluster *)bound;
	cubes->bunch = m->bunch = (struct psr_cube_bunch *)(m->cluster + n_clusters);
	m->flags = (uint8_t *)(m->bunch + cubes_n_bunches(m->tree));
	if (has_cones) {
		for (int a = 0; a < 3; a++)
			m->axis[a] = (int8_t *)m->flags + (size_t)(a + 1) * n_cubes;
		m->sine = m->flags + 4 * n_cubes;
	}
	if (has_traits)
		m->traits = m->flags + 5 * n_cubes;
	cubes->groups.n_clusters = (uint32_t)n_clusters;
	cubes->groups.cluster = m->cluster;
	cubes->groups.flags = m->flags;
	cubes->groups.cone_x = m->axis[0];
	cubes->groups.cone_y = m->axis[1];
	cubes->groups.cone_z = m->axis[2];
	cubes->groups.cone_sine = m->sine;
	cubes->groups.traits = m->traits;
	return PSR_OK;
}

/* Makes places of codes and leaves relative to their runs'. A run's are less than 2^16 apart. */
static void relate(int task, void *userdata)
{
	const struct cubes_making *m = userdata;

	for (int l = 0; l < m->n_levels; l++) {
		const struct psr_cube_level *level = &m->cubes->level[l];
		const uint64_t runs = cubes_n_runs(level), end = runs * ((uint64_t)task + 1) / OCTREE_TASKS;

		for (uint64_t r = runs * (uint64_t)task / OCTREE_TASKS; r < end; r++)
			for (uint64_t i = r * CUBES_RUN; i < level->n && i < (r + 1) * CUBES_RUN; i++) {
				struct psr_cube *cube = &m->cube[level->first + i];

				cube->code = (uint16_t)(cube->code - level->run[r].code);
				cube->leaf = (uint16_t)(cube->leaf - level->run[r].leaf);
			}
	}
}

static struct cubes_making *begin(const struct octree *tree, struct psr_pool *pool)
{
	struct cubes_making *m = calloc(1, sizeof *m);

	if (m == NULL)
		return NULL;
	m->tree = tree;
	m->height = octree_subtree_height(tree);
	m->n_levels = m->height - 1;
	count(m, pool);
	return m;
}

int psr_cubes_create(struct psr_cubes **out, const struct octree *tree, struct psr_pool *pool, struct psr_error *err)
{
	struct psr_cubes *cubes = calloc(1, sizeof *cubes);
	struct cubes_making *m = begin(tree, pool);
	int rc;

	if (cubes == NULL || m == NULL) {
		free(cubes);
		free(m);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the cubes of an octree");
	}
	m->cubes = cubes;
	cubes->level[0].tree = tree;
	rc = check_counts(m, err);
	if (rc == PSR_OK)
		rc = make_trees(m, err);
	if (rc == PSR_OK)
		rc = make_arrays(m, err);
	if (rc == PSR_OK) {
		psr_pool_for(pool, OCTREE_TASKS, cubes_fill_task, m);
		psr_pool_for(pool, OCTREE_TASKS, relate, m);
		psr_pool_for(pool, OCTREE_TASKS, cubes_bound_task, m);
		rc = cubes_survey_scan(&cubes->scan, tree, err);
	}
	if (rc == PSR_OK) {
		*out = cubes;
	} else {
		psr_cubes_destroy(cubes);
	}
	free(m);
	return rc;
}

uint64_t psr_cubes_guess(const struct octree *tree, unsigned leaf)
{
	const int height = octree_subtree_height(tree), n_levels = height - 1;
	/* A level has a part of the nodes of the one below it, the same everywhere: so leaves and codes tell it. Of the
	 * subtrees' roots the number is known. */
	const double part = 1 / (1 + (double)tree->n_leaves / (double)tree->n_codes), n_skips = (double)tree->n_skips;
	const double run = sizeof(struct psr_cube_run) + sizeof(struct psr_cube_bound);
	const double bytes_cube = sizeof(struct psr_cube) + run / CUBES_RUN + 1 + (psr_octree_is_one_sided(tree) ? 5 : 0);
	double nodes = (double)tree->n_leaves, codes = (double)tree->n_codes, skips = n_skips, bytes = sizeof(struct psr_cubes);

	for (int h = 1; h <= height; h++) {
		nodes = fmax(nodes * part, n_skips);
		skips *= part;
		codes = fmax(codes - nodes, 0);
		if (h < n_levels)
			bytes += nodes * leaf + codes + skips * sizeof(struct octree_skip);
		if (h >= 2)
			bytes += nodes * bytes_cube + n_skips * sizeof(struct psr_cluster);
	}
	bytes += (double)cubes_n_bunches(tree) * sizeof(struct psr_cube_bunch);
	return (uint64_t)bytes;
}

void psr_cubes_destroy(struct psr_cubes *cubes)
{
	if (cubes == NULL)
		return;
	for (int l = 1; l < CUBES_MOST_LEVELS; l++)
		octree_destroy((struct octree *)(uintptr_t)cubes->level[l].tree);
	psr_free((void *)(uintptr_t)cubes->cube);
	free(cubes);
}

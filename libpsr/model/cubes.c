#include <math.h>
#include <stdlib.h>
#include "base/direction.h"
#include "base/mem.h"
#include "cubes.h"

#define CLUSTER_LEVELS 6 /* from a cluster's node to leaves of level 0 */
#define MOST_CUBES ((uint32_t)1 << 26)
#define LEAST_COSINE 0.05

/* Arrays in the making, of one allocation each. */
struct making {
	struct psr_cubes *cubes;
	struct psr_cluster *cluster;
	struct psr_cube_run *run; /* of the level */
	struct psr_cube *cube;
	uint8_t *flags, *sine;
	int8_t *axis[3];
	int level, depth;         /* depth: of clusters' nodes */
	uint32_t n, n_clusters, n_groups;
	uint64_t path;            /* of the last cluster's node */
};

/* ---- coarser trees ---- */

static uint64_t bytes_of(const struct octree *tree)
{
	const uint64_t leaf = (tree->normal != NULL ? 2 : 0) + (tree->color != NULL ? 3 : 0) + (tree->offset != NULL);

	return sizeof *tree + tree->n_codes + tree->n_skips * sizeof *tree->skip + tree->n_leaves * leaf;
}

/* ---- cubes ---- */

static int count_node(const struct octree_node *node, void *userdata)
{
	(void)node;
	++*(uint32_t *)userdata;
	return 0;
}

/* Finds the cone of the normals of leaves first .. end - 1. */
static void make_cone(const struct making *m, const struct octree *tree, uint64_t first, uint64_t end)
{
	const float(*direction)[3] = psr_direction_table();
	double sum[3] = { 0, 0, 0 }, axis[3], most = 0, length = 0, least = 1;

	for (uint64_t i = first; i < end; i++)
		for (int a = 0; a < 3; a++)
			sum[a] += (double)direction[tree->normal[i]][a];
	for (int a = 0; a < 3; a++)
		most = fmax(most, fabs(sum[a]));
	for (int a = 0; a < 3; a++) {
		axis[a] = most > 1e-9 ? floor(sum[a] / most * 127 + 0.5) : 0;
		m->axis[a][m->n] = (int8_t)axis[a];
		length += axis[a] * axis[a];
	}
	length = sqrt(length);
	for (uint64_t i = first; i < end; i++) {
		const float *n = direction[tree->normal[i]];

		least = fmin(least, (axis[0] * (double)n[0] + axis[1] * (double)n[1] + axis[2] * (double)n[2]) / length);
	}
	const double sine = ceil(sqrt(1 - least * least) * 255 + 1e-3);
	m->sine[m->n] = (uint8_t)(least >= LEAST_COSINE && sine < PSR_CONE_ANY ? sine : PSR_CONE_ANY);
}

static void begin_cluster(struct making *m, uint64_t path)
{
	m->cluster[m->n_clusters++] =
		(struct psr_cluster){ .first_block = m->n, .group = m->n_groups++, .level = (uint8_t)m->level };
	m->path = path;
}

/* The sphere of a cluster's box of cubes, grown by how far leaves reach beyond their cubes' middles. */
static void end_cluster(const struct making *m)
{
	struct psr_cluster *k = &m->cluster[m->n_clusters - 1];
	const struct psr_cube_level *level = &m->cubes->level[m->level];
	double low[3] = { INFINITY, INFINITY, INFINITY }, high[3] = { -INFINITY, -INFINITY, -INFINITY }, square = 0;

	k->n_blocks = m->n - k->first_block;
	for (uint32_t i = k->first_block; i < m->n; i++) {
		double center[3];

		psr_cubes_center(m->cubes, level, i, center);
		for (int a = 0; a < 3; a++) {
			low[a] = fmin(low[a], center[a]);
			high[a] = fmax(high[a], center[a]);
		}
	}
	for (int a = 0; a < 3; a++) {
		const double center = (double)(float)((low[a] + high[a]) / 2);
		const double reach = fmax(high[a] - center, center - low[a]);

		k->center[a] = (float)center;
		square += reach * reach;
	}
	k->radius = (float)((sqrt(square) + CUBES_RADIUS * level->edge) * (1 + 1e-6));
}

static int put_cube(const struct octree_node *node, void *userdata)
{
	struct making *m = userdata;
	const struct psr_cube_level *level = &m->cubes->level[m->level];
	const struct octree *tree = level->tree;
	const int cube_depth = tree->levels - 2;
	const uint64_t path = node->path >> 3 * (cube_depth - m->depth);
	const uint32_t in_level = m->n - level->first;
	const unsigned n_leaves = (unsigned)__builtin_popcountll(octree_mask(tree, node->code));
	struct psr_cube_run *run = &m->run[in_level / CUBES_RUN];
	uint32_t at[3];

	if (in_level == 0 || path != m->path) {
		if (in_level > 0)
			end_cluster(m);
		begin_cluster(m, path);
	}
	if (in_level % CUBES_RUN == 0)
		*run = (struct psr_cube_run){ (uint32_t)node->code, (uint32_t)node->leaf };
	octree_place(node->path, at);
	const uint64_t place = at[0] | (uint64_t)at[1] << CUBES_PLACE_BITS | (uint64_t)at[2] << 2 * CUBES_PLACE_BITS
	                       | (uint64_t)m->level << 3 * CUBES_PLACE_BITS;
	m->cube[m->n] = (struct psr_cube){ { (uint32_t)place, (uint32_t)(place >> 32) },
		                               (uint16_t)(node->code - run->code), (uint16_t)(node->leaf - run->leaf) };
	m->flags[m->n] = (uint8_t)(m->level | (psr_octree_is_one_sided(tree) ? 0 : PSR_BLOCK_TWO_SIDED));
	if (m->sine != NULL)
		make_cone(m, tree, node->leaf, node->leaf + n_leaves);
	m->n++;
	return 0;
}

static void make_level(struct making *m, int level)
{
	struct psr_cube_level *to = &m->cubes->level[level];

	m->level = level;
	m->n_groups = 0;
	to->first = m->n;
	octree_walk(to->tree, to->tree->levels - 2, put_cube, m);
	end_cluster(m);
	m->run += (to->n + CUBES_RUN - 1) / CUBES_RUN;
}

/* Makes the trees of all levels, and counts cubes. */
static int make_trees(struct psr_cubes *cubes, uint32_t *n_cubes, uint32_t *n_runs, struct psr_error *err)
{
	const int possible = cubes->level[0].tree->levels - OCTREE_LEAST_LEVELS + 1;
	const int n = possible < CUBES_MOST_LEVELS ? possible : CUBES_MOST_LEVELS;

	*n_cubes = *n_runs = 0;
	for (int l = 0; l < n; l++) {
		struct psr_cube_level *level = &cubes->level[l];

		if (l > 0) {
			level->tree = octree_coarser(level[-1].tree);
			if (level->tree == NULL)
				return psr_fail(err, PSR_ERR_MEMORY, "no memory for the levels of an octree");
			cubes->n_bytes += bytes_of(level->tree);
		}
		if (level->tree->n_codes > UINT32_MAX || level->tree->n_leaves > UINT32_MAX)
			return psr_fail(err, PSR_ERR_LIMIT, "an octree of %llu leaves cannot be drawn; the limit is %u",
			                (unsigned long long)level->tree->n_leaves, UINT32_MAX);
		level->edge = ldexp(level->tree->edge, -level->tree->levels);
		level->n = 0;
		octree_walk(level->tree, level->tree->levels - 2, count_node, &level->n);
		*n_cubes += level->n;
		*n_runs += (level->n + CUBES_RUN - 1) / CUBES_RUN;
		if (*n_cubes > MOST_CUBES)
			return psr_fail(err, PSR_ERR_LIMIT, "an octree of more than %u cubes of 4x4x4 leaves cannot be drawn",
			                MOST_CUBES);
		cubes->groups.n_samples += level->tree->n_leaves;
		cubes->groups.n_levels = (uint32_t)l + 1;
	}
	return PSR_OK;
}

/* All arrays in one piece of memory, the widest elements first. */
static void *make_arrays(struct making *m, uint32_t n_cubes, uint32_t n_runs, uint32_t n_clusters)
{
	struct psr_cubes *cubes = m->cubes;
	const struct octree *tree = cubes->level[0].tree;
	const int has_cones = psr_octree_is_one_sided(tree);
	const size_t cube = sizeof *m->cube + sizeof *m->flags + (has_cones ? 4 : 0);
	const size_t n = n_cubes * cube + n_runs * sizeof *m->run + n_clusters * sizeof *m->cluster;
	char *const memory = psr_alloc_array(n, 1);

	if (memory == NULL)
		return NULL;
	cubes->n_bytes += sizeof *cubes + n;
	m->cube = (struct psr_cube *)(void *)memory;
	m->run = (struct psr_cube_run *)(m->cube + n_cubes);
	m->cluster = (struct psr_cluster *)(m->run + n_runs);
	m->flags = (uint8_t *)(m->cluster + n_clusters);
	if (has_cones) {
		for (int a = 0; a < 3; a++)
			m->axis[a] = (int8_t *)m->flags + (size_t)(a + 1) * n_cubes;
		m->sine = m->flags + 4 * (size_t)n_cubes;
	}
	return memory;
}

int psr_cubes_create(struct psr_cubes **out, const struct octree *tree, struct psr_error *err)
{
	struct psr_cubes *cubes = calloc(1, sizeof *cubes);
	struct making m = { .cubes = cubes };
	uint32_t n_cubes, n_runs, n_nodes = 0;
	int rc;

	if (cubes == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the cubes of an octree");
	cubes->level[0].tree = tree;
	rc = make_trees(cubes, &n_cubes, &n_runs, err);
	m.depth = tree->levels > CLUSTER_LEVELS ? tree->levels - CLUSTER_LEVELS : 0;
	octree_walk(tree, m.depth, count_node, &n_nodes);
	if (rc == PSR_OK && make_arrays(&m, n_cubes, n_runs, n_nodes * cubes->groups.n_levels) == NULL)
		rc = psr_fail(err, PSR_ERR_MEMORY, "no memory for %u cubes of an octree", n_cubes);
	if (rc != PSR_OK) {
		psr_cubes_destroy(cubes);
		return rc;
	}
	cubes->cube = m.cube;
	for (uint32_t l = 0; l < cubes->groups.n_levels; l++) {
		cubes->level[l].run = m.run;
		make_level(&m, (int)l);
	}
	cubes->groups.n_blocks = n_cubes;
	cubes->groups.n_clusters = m.n_clusters;
	cubes->groups.cluster = m.cluster;
	cubes->groups.flags = m.flags;
	cubes->groups.cone_x = m.axis[0];
	cubes->groups.cone_y = m.axis[1];
	cubes->groups.cone_z = m.axis[2];
	cubes->groups.cone_sine = m.sine;
	*out = cubes;
	return PSR_OK;
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

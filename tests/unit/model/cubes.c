/* Cubes of octrees against their definitions, by the slow way: trees of all levels, attributes, places, clusters. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "base/random.h"
#include "model/cubes.h"
#include "../octree/leaves.h"

#define CLUSTER_LEVELS 6

/* Some are shallower than a cluster, some wider than a task; one has a leaf in each of its clusters. */
static const struct {
	int levels;
	size_t n; /* leaves at random; 0: a sphere */
	int is_one_sided, has_attributes; /* 2: one material of all leaves */
} forms[] = { { 2, 5, 1, 1 },     { 3, 9, 0, 1 }, { 5, 0, 1, 1 }, { 6, 0, 1, 1 }, { 7, 0, 0, 1 },
	          { 8, 0, 1, 2 },     { 7, 0, 0, 0 }, { 9, 1, 1, 1 }, { 12, 5000, 0, 1 }, { 20, 2000, 1, 1 } };
#define N_FORMS (sizeof forms / sizeof *forms)

static struct octree *make_tree(size_t form)
{
	struct leaves leaves = forms[form].n > 0 ? leaves_at_random(forms[form].levels, forms[form].n)
	                                         : leaves_of_sphere(forms[form].levels);
	struct octree *tree = leaves_to_tree(&leaves, forms[form].levels);
	uint64_t random = 5;

	free(leaves.path);
	assert_non_null(tree);
	tree->low[0] = tree->low[1] = tree->low[2] = -1;
	tree->edge = 2;
	tree->is_one_sided = forms[form].is_one_sided;
	if (!forms[form].has_attributes)
		return tree;
	tree->normal = malloc(tree->n_leaves * sizeof *tree->normal);
	tree->offset = malloc(tree->n_leaves);
	tree->color = malloc(tree->n_leaves * sizeof *tree->color);
	assert_true(tree->normal != NULL && tree->offset != NULL && tree->color != NULL);
	tree->scan.intensity = malloc(tree->n_leaves * sizeof *tree->scan.intensity);
	tree->scan.class = malloc(tree->n_leaves);
	tree->scan.returns = malloc(tree->n_leaves);
	assert_true(tree->scan.intensity != NULL && tree->scan.class != NULL && tree->scan.returns != NULL);
	tree->material = malloc(tree->n_leaves * sizeof *tree->material);
	assert_non_null(tree->material);
	for (uint64_t i = 0; i < tree->n_leaves; i++) {
		octree_put_material(tree->material[i], (uint32_t)random_below(&random, 1 << 24));
		tree->scan.intensity[i] = (uint16_t)random_below(&random, 65536);
		tree->scan.class[i] = (uint8_t)random_below(&random, 256);
		tree->scan.returns[i] = (uint8_t)random_below(&random, 256);
		/* Runs of equal normals, and some at random. */
		tree->normal[i] = (uint16_t)(random_below(&random, 4) == 0 || i == 0 ? random_below(&random, PSR_DIRECTIONS)
		                                                                     : tree->normal[i - 1]);
		tree->offset[i] = (uint8_t)random_below(&random, OCTREE_OFFSETS);
		for (int c = 0; c < 3; c++)
			tree->color[i][c] = (uint8_t)random_below(&random, 256);
	}
	if (forms[form].has_attributes == 2) {
		tree->one_material = tree->material;
		tree->material = NULL;
	}
	return tree;
}

/* ---- trees ---- */

struct coarser {
	struct octree_maker maker;
	const struct octree *finer, *tree; /* tree: the one to be checked */
	uint64_t n;
};

static int put_leaf(const struct octree_node *node, void *userdata)
{
	return octree_maker_put(&((struct coarser *)userdata)->maker, node->path, NULL);
}

/* A node's children are its leaves in the finer tree. */
static int has_means(const struct octree_node *node, void *userdata)
{
	struct coarser *c = userdata;
	const unsigned code = c->finer->code[node->code], n = (unsigned)__builtin_popcount(code);
	const float(*of)[3] = psr_direction_table();
	double sum[3] = { 0, 0, 0 }, along = 0;
	uint8_t color[3];

	for (unsigned i = 0; i < n; i++)
		for (int a = 0; a < 3; a++)
			sum[a] += (double)of[c->finer->normal[node->leaf + i]][a];
	const uint16_t normal = psr_direction_encode((const float[3]){ (float)sum[0], (float)sum[1], (float)sum[2] });
	assert_int_equal(c->tree->normal[c->n], normal);
	octree_mean_color(color, (const uint8_t(*)[3])c->finer->color + node->leaf, n);
	assert_memory_equal(c->tree->color[c->n], color, 3);
	assert_int_equal(octree_material(c->tree, c->n), octree_mean_material(c->finer, node->leaf, n));
	const struct octree_scan *scan = &c->finer->scan;
	unsigned intensity = n / 2;
	for (unsigned i = 0; i < n; i++)
		intensity += scan->intensity[node->leaf + i];
	assert_int_equal(c->tree->scan.intensity[c->n], intensity / n);
	assert_int_equal(c->tree->scan.class[c->n], scan->class[node->leaf]);
	assert_int_equal(c->tree->scan.returns[c->n], scan->returns[node->leaf]);
	for (unsigned j = 0, i = 0; j < 8; j++) {
		if (!(code >> j & 1))
			continue;
		for (int a = 0; a < 3; a++)
			along += (double)of[normal][a] * ((j >> a & 1 ? 0.5 : -0.5) + octree_offset(c->finer->offset[node->leaf + i])
			                                  * (double)of[c->finer->normal[node->leaf + i]][a]);
		i++;
	}
	assert_int_equal(c->tree->offset[c->n++], octree_offset_step(along / (2 * (int)n)));
	return 0;
}

static void assert_coarser(const struct octree *tree, const struct octree *finer)
{
	struct coarser c = { .finer = finer, .tree = tree };
	struct octree *expected;

	assert_int_equal(octree_check(tree, NULL, NULL), PSR_OK);
	assert_int_equal(octree_maker_init(&c.maker, finer->levels - 1, NULL), PSR_OK);
	assert_int_equal(octree_walk(finer, finer->levels - 1, put_leaf, &c), PSR_OK);
	expected = octree_maker_take(&c.maker);
	octree_maker_fini(&c.maker);
	assert_non_null(expected);
	assert_int_equal(tree->levels, expected->levels);
	assert_int_equal(tree->n_codes, expected->n_codes);
	assert_int_equal(tree->n_leaves, expected->n_leaves);
	assert_int_equal(tree->n_skips, expected->n_skips);
	assert_memory_equal(tree->code, expected->code, tree->n_codes);
	assert_memory_equal(tree->skip, expected->skip, tree->n_skips * sizeof *tree->skip);
	assert_memory_equal(tree->low, finer->low, sizeof tree->low);
	assert_true(tree->edge == finer->edge && tree->is_one_sided == finer->is_one_sided);
	assert_int_equal(tree->normal != NULL, finer->normal != NULL);
	assert_int_equal(tree->color != NULL, finer->color != NULL);
	assert_int_equal(tree->offset != NULL, finer->offset != NULL);
	assert_int_equal(tree->material != NULL, finer->normal != NULL);
	assert_null(tree->one_material);
	if (tree->normal != NULL)
		octree_walk(finer, finer->levels - 1, has_means, &c);
	octree_destroy(expected);
}

/* ---- cubes ---- */

struct expected {
	const struct psr_cubes *cubes;
	int level;
	uint32_t cube, cluster, depth; /* the next cube; the cluster of the last one; depth of clusters */
	uint64_t path;                 /* of the cluster */
};

static void assert_cone(const int8_t at[3], uint8_t cone_sine, const uint16_t *normal, unsigned n)
{
	const double axis[3] = { at[0], at[1], at[2] };
	const double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
	const double sine = cone_sine / 255.0;

	for (unsigned i = 0; i < n && cone_sine != PSR_CONE_ANY; i++) {
		const float *v = psr_direction_table()[normal[i]];
		const double cosine = (axis[0] * (double)v[0] + axis[1] * (double)v[1] + axis[2] * (double)v[2]) / length;

		assert_true(cosine > 0 && sqrt(1 - fmin(cosine * cosine, 1)) <= sine + 1e-9);
	}
}

/* Returns the distance of two points. */
static double apart(const double a[3], const float b[3])
{
	double square = 0;

	for (int k = 0; k < 3; k++)
		square += (a[k] - (double)b[k]) * (a[k] - (double)b[k]);
	return sqrt(square);
}

static int is_next_cube(const struct octree_node *node, void *userdata)
{
	struct expected *e = userdata;
	const struct psr_cubes *cubes = e->cubes;
	const struct psr_cube_level *level = &cubes->level[e->level];
	const struct octree *tree = level->tree;
	const uint64_t path = node->path >> 3 * (tree->levels - 2 - (int)e->depth);
	const struct psr_cube_bound *bound = &level->bound[(e->cube - level->first) / CUBES_RUN];
	const struct psr_blocks *g = &cubes->groups;
	const unsigned n = (unsigned)__builtin_popcountll(octree_mask(tree, node->code));
	double center[3], found[3];

	assert_true(psr_cubes_level(cubes, e->cube) == level);
	assert_int_equal(psr_cubes_code(cubes, level, e->cube), node->code);
	assert_int_equal(psr_cubes_leaf(cubes, level, e->cube), node->leaf);
	octree_center(tree, node->path, tree->levels - 2, center);
	psr_cubes_center(cubes, level, e->cube, found);
	for (int a = 0; a < 3; a++)
		assert_true(fabs(center[a] - found[a]) <= 1e-12);
	assert_int_equal(cubes->groups.flags[e->cube],
	                 e->level | (psr_octree_is_one_sided(tree) ? 0 : PSR_BLOCK_TWO_SIDED));
	if (e->cube == level->first || path != e->path)
		assert_int_equal(cubes->groups.cluster[++e->cluster].first_block, e->cube);
	e->path = path;
	const struct psr_cluster *cluster = &cubes->groups.cluster[e->cluster];
	assert_int_equal(cluster->level, e->level);
	assert_true(e->cube < cluster->first_block + cluster->n_blocks);
	assert_true(apart(center, cluster->center) + CUBES_RADIUS * level->edge <= (double)cluster->radius);
	assert_true(apart(center, bound->center) + CUBES_RADIUS * level->edge <= (double)bound->radius);
	assert_int_equal(psr_cubes_n_leaves(cubes, e->cube), n);
	assert_int_equal(g->cone_x != NULL, psr_octree_is_one_sided(tree));
	if (g->cone_x != NULL) {
		const int8_t axis[3] = { g->cone_x[e->cube], g->cone_y[e->cube], g->cone_z[e->cube] };

		assert_cone(axis, g->cone_sine[e->cube], tree->normal + node->leaf, n);
		assert_cone(bound->axis, bound->sine, tree->normal + node->leaf, n);
	} else {
		assert_int_equal(bound->sine, PSR_CONE_ANY);
	}
	e->cube++;
	return 0;
}

static void assert_cubes(const struct psr_cubes *cubes, const struct octree *tree)
{
	const int possible = tree->levels - OCTREE_LEAST_LEVELS + 1;
	const int n = possible < CUBES_MOST_LEVELS ? possible : CUBES_MOST_LEVELS;
	const uint32_t n_clusters = cubes->groups.n_clusters / (uint32_t)n;
	struct expected e = { .cubes = cubes, .cluster = UINT32_MAX };
	uint64_t n_leaves = 0;

	e.depth = tree->levels > CLUSTER_LEVELS ? (uint32_t)(tree->levels - CLUSTER_LEVELS) : 0;
	assert_int_equal(cubes->groups.n_levels, n);
	for (e.level = 0; e.level < n; e.level++) {
		const struct psr_cube_level *level = &cubes->level[e.level];

		if (e.level > 0)
			assert_coarser(level->tree, level[-1].tree);
		assert_int_equal(level->first, e.cube);
		assert_true(level->edge == ldexp(tree->edge, e.level - tree->levels));
		octree_walk(level->tree, level->tree->levels - 2, is_next_cube, &e);
		assert_int_equal(level->n, e.cube - level->first);
		assert_int_equal(e.cluster + 1, (uint32_t)(e.level + 1) * n_clusters);
		n_leaves += level->tree->n_leaves;
	}
	assert_int_equal(cubes->groups.n_blocks, e.cube);
	assert_int_equal(cubes->groups.n_samples, n_leaves);
	for (uint32_t i = 0; i < cubes->groups.n_clusters; i++)
		assert_int_equal(cubes->groups.cluster[i].group, i % n_clusters);
}

static void cubes_and_their_trees_are_what_they_should_be(void **state)
{
	(void)state;
	for (size_t form = 0; form < N_FORMS; form++) {
		struct octree *tree = make_tree(form);
		struct psr_cubes *cubes;

		assert_int_equal(psr_cubes_create(&cubes, tree, NULL, NULL), PSR_OK);
		assert_cubes(cubes, tree);
		psr_cubes_destroy(cubes);
		octree_destroy(tree);
	}
}

static void threads_make_the_same_cubes(void **state)
{
	struct psr_pool *pool;

	(void)state;
	assert_int_equal(psr_pool_create(&pool, 3, NULL), PSR_OK);
	for (size_t form = 0; form < N_FORMS; form++) {
		struct octree *tree = make_tree(form);
		struct psr_cubes *alone, *shared;

		assert_int_equal(psr_cubes_create(&alone, tree, NULL, NULL), PSR_OK);
		assert_int_equal(psr_cubes_create(&shared, tree, pool, NULL), PSR_OK);
		const struct psr_blocks *a = &alone->groups, *b = &shared->groups;
		assert_int_equal(alone->n_bytes, shared->n_bytes);
		assert_int_equal(a->n_blocks, b->n_blocks);
		assert_memory_equal(alone->cube, shared->cube, a->n_blocks * sizeof *alone->cube);
		assert_memory_equal(a->cluster, b->cluster, a->n_clusters * sizeof *a->cluster);
		assert_memory_equal(a->flags, b->flags, a->n_blocks);
		for (uint32_t l = 0; l < a->n_levels; l++) {
			const size_t n_runs = (alone->level[l].n + CUBES_RUN - 1) / CUBES_RUN;

			assert_memory_equal(alone->level[l].bound, shared->level[l].bound, n_runs * sizeof *alone->level[l].bound);
		}
		if (a->cone_sine != NULL)
			assert_memory_equal(a->cone_sine, b->cone_sine, a->n_blocks);
		for (uint32_t l = 1; l < a->n_levels; l++) {
			const struct octree *x = alone->level[l].tree, *y = shared->level[l].tree;

			assert_int_equal(x->n_codes, y->n_codes);
			assert_memory_equal(x->code, y->code, x->n_codes);
			if (x->normal != NULL)
				assert_memory_equal(x->normal, y->normal, x->n_leaves * sizeof *x->normal);
		}
		psr_cubes_destroy(alone);
		psr_cubes_destroy(shared);
		octree_destroy(tree);
	}
	psr_pool_destroy(pool);
}

/* Leaves of a sphere, of a cloud of it, and dust. */
static void counts_tell_the_memory_of_cubes(void **state)
{
	(void)state;
	for (size_t form = 0; form < N_FORMS; form++) {
		struct octree *tree = make_tree(form);
		struct psr_cubes *cubes;
		uint64_t guess;

		assert_int_equal(psr_cubes_create(&cubes, tree, NULL, NULL), PSR_OK);
		guess = psr_cubes_guess(tree, tree->normal != NULL ? 13 : 0);
		if (tree->n_leaves > 1000)
			assert_true(guess > cubes->n_bytes * 7 / 8 && guess < cubes->n_bytes * 9 / 8);
		psr_cubes_destroy(cubes);
		octree_destroy(tree);
	}
}

/* Returns how many leaves have less. */
static uint64_t n_below(const struct octree *tree, unsigned intensity)
{
	uint64_t n = 0;

	for (uint64_t i = 0; i < tree->n_leaves; i++)
		n += tree->scan.intensity[i] < intensity;
	return n;
}

/* The range leaves out a fiftieth at either end; classes and orders are those that some leaf has. */
static void the_scan_of_a_tree_is_surveyed(void **state)
{
	(void)state;
	for (size_t form = 0; form < N_FORMS; form++) {
		struct octree *tree = make_tree(form);
		struct psr_cubes *cubes;
		uint64_t classes[4] = { 0 };
		unsigned orders = 0;

		assert_int_equal(psr_cubes_create(&cubes, tree, NULL, NULL), PSR_OK);
		const struct psr_scan *scan = &cubes->scan;
		assert_int_equal(scan->has_intensity, forms[form].has_attributes != 0);
		if (forms[form].has_attributes) {
			const uint64_t n = tree->n_leaves, outside = n / 50;

			assert_true(n_below(tree, scan->low) <= outside && n_below(tree, scan->low + 1u) > outside);
			assert_true(n - n_below(tree, scan->high + 1u) <= outside && n - n_below(tree, scan->high) > outside);
			for (uint64_t i = 0; i < tree->n_leaves; i++) {
				classes[tree->scan.class[i] / 64] |= UINT64_C(1) << tree->scan.class[i] % 64;
				orders |= 1u << psr_return_order(tree->scan.returns[i]);
			}
		}
		assert_memory_equal(scan->classes, classes, sizeof classes);
		assert_int_equal(scan->orders, orders);
		psr_cubes_destroy(cubes);
		octree_destroy(tree);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(cubes_and_their_trees_are_what_they_should_be),
		cmocka_unit_test(threads_make_the_same_cubes),
		cmocka_unit_test(counts_tell_the_memory_of_cubes),
		cmocka_unit_test(the_scan_of_a_tree_is_surveyed),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

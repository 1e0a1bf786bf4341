#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
#include <string.h>
#include "base/direction.h"
#include "leaves.h"

static const struct {
	int levels;
	size_t n; /* leaves at random; 0: a sphere */
} forms[] = { { 2, 5 }, { 6, 0 }, { 7, 0 }, { 12, 3000 }, { 20, 1000 }, { 9, 1 } };

static struct leaves leaves_of(size_t form)
{
	struct leaves leaves = forms[form].n > 0 ? leaves_at_random(forms[form].levels, forms[form].n)
	                                         : leaves_of_sphere(forms[form].levels);

	assert_non_null(leaves.path);
	return leaves;
}

struct expected {
	const struct leaves *leaves;
	int up; /* levels from the leaves to the nodes */
	size_t next;
};

/* The next node is that of the next leaf, and all further leaves of that node are passed. */
static int is_next(const struct octree_node *node, void *userdata)
{
	struct expected *e = userdata;

	assert_true(e->next < e->leaves->n);
	assert_int_equal(node->path, e->leaves->path[e->next] >> 3 * e->up);
	assert_int_equal(node->leaf, e->next);
	while (e->next < e->leaves->n && e->leaves->path[e->next] >> 3 * e->up == node->path)
		e->next++;
	return 0;
}

static void the_walk_of_each_depth_finds_the_leaves_and_what_is_above_them(void **state)
{
	(void)state;
	for (size_t f = 0; f < sizeof forms / sizeof *forms; f++) {
		struct leaves leaves = leaves_of(f);
		struct octree *tree = leaves_to_tree(&leaves, forms[f].levels);

		assert_non_null(tree);
		assert_int_equal(octree_check(tree, NULL), PSR_OK);
		assert_int_equal(tree->n_leaves, leaves.n);
		for (int depth = 0; depth <= tree->levels; depth++) {
			struct expected e = { &leaves, tree->levels - depth, 0 };

			assert_int_equal(octree_walk(tree, depth, is_next, &e), 0);
			assert_int_equal(e.next, leaves.n);
		}
		octree_destroy(tree);
		free(leaves.path);
	}
}

struct masks {
	const struct octree *tree;
	const struct leaves *leaves;
	size_t n;
};

static int has_leaves(const struct octree_node *node, void *userdata)
{
	struct masks *m = userdata;
	uint64_t mask = 0;

	for (; m->n < m->leaves->n && m->leaves->path[m->n] >> 6 == node->path; m->n++)
		mask |= (uint64_t)1 << (m->leaves->path[m->n] & 63);
	assert_true(octree_mask(m->tree, node->code) == mask);
	return 0;
}

static void a_mask_has_the_bits_of_its_cells_leaves(void **state)
{
	(void)state;
	for (size_t f = 0; f < sizeof forms / sizeof *forms; f++) {
		struct leaves leaves = leaves_of(f);
		struct octree *tree = leaves_to_tree(&leaves, forms[f].levels);
		struct masks m = { tree, &leaves, 0 };

		assert_non_null(tree);
		octree_walk(tree, tree->levels - 2, has_leaves, &m);
		assert_int_equal(m.n, leaves.n);
		octree_destroy(tree);
		free(leaves.path);
	}
}

static void paths_and_places_are_each_others_inverse(void **state)
{
	uint64_t random = 3;

	(void)state;
	for (int i = 0; i < 1000; i++) {
		const uint32_t at[3] = { random_below(&random, 1 << 20), random_below(&random, 1 << 20),
			                     random_below(&random, 1 << 20) };
		uint32_t back[3];

		octree_place(octree_path(at), back);
		assert_memory_equal(at, back, sizeof at);
	}
}

static void a_center_is_within_half_an_edge(void **state)
{
	const struct octree tree = { .levels = 4, .low = { 500000.0, -2.0, 0.0 }, .edge = 32.0 };
	double center[3];

	(void)state;
	octree_center(&tree, octree_path((const uint32_t[3]){ 3, 0, 15 }), 4, center);
	assert_true(center[0] == 500007.0 && center[1] == -1.0 && center[2] == 31.0);
	octree_center(&tree, 0, 0, center);
	assert_true(center[0] == 500016.0 && center[1] == 14.0 && center[2] == 16.0);
}

static void leaves_out_of_order_are_refused(void **state)
{
	struct octree_maker maker;

	(void)state;
	assert_int_equal(octree_maker_init(&maker, 1, NULL), PSR_ERR_ARG);
	assert_int_equal(octree_maker_init(&maker, OCTREE_MOST_LEVELS + 1, NULL), PSR_ERR_ARG);
	assert_int_equal(octree_maker_init(&maker, 3, NULL), PSR_OK);
	assert_null(octree_maker_take(&maker));
	assert_int_equal(octree_maker_put(&maker, 512, NULL), PSR_ERR_ARG);
	assert_int_equal(octree_maker_put(&maker, 7, NULL), PSR_OK);
	assert_int_equal(octree_maker_put(&maker, 7, NULL), PSR_ERR_ARG);
	assert_int_equal(octree_maker_put(&maker, 3, NULL), PSR_ERR_ARG);
	assert_int_equal(octree_maker_put(&maker, 8, NULL), PSR_OK);
	octree_maker_fini(&maker);
}

static void a_spoilt_tree_is_refused(void **state)
{
	struct leaves leaves = leaves_of_sphere(8);
	struct octree *tree = leaves_to_tree(&leaves, 8);

	(void)state;
	assert_non_null(tree);
	for (int spoil = 0; spoil < 8; spoil++) {
		struct octree spoilt = *tree;
		struct psr_error err;
		struct octree_skip skip = tree->skip[1];
		const uint8_t code = tree->code[100];

		spoilt.n_codes -= spoil == 0;
		spoilt.n_leaves += spoil == 1;
		tree->code[100] = spoil == 2 ? 0 : spoil == 3 ? code ^ (code == 1 ? 2 : code & -code) : code;
		tree->skip[1].path += spoil == 4;
		tree->skip[1].code += spoil == 5;
		tree->skip[1].leaf += spoil == 6;
		spoilt.n_skips -= spoil == 7;
		assert_int_equal(octree_check(&spoilt, &err), PSR_ERR_FORMAT);
		tree->code[100] = code;
		tree->skip[1] = skip;
	}
	assert_int_equal(octree_check(tree, NULL), PSR_OK);
	octree_destroy(tree);
	free(leaves.path);
}

static void offsets_are_within_half_a_step(void **state)
{
	const double step = sqrt(3.0) / OCTREE_OFFSETS;

	(void)state;
	for (double offset = -0.866; offset <= 0.866; offset += 0.001)
		assert_true(fabs(octree_offset(octree_offset_step(offset)) - offset) <= 0.5 * step + 1e-12);
	assert_int_equal(octree_offset_step(-9.0), 0);
	assert_int_equal(octree_offset_step(9.0), OCTREE_OFFSETS - 1);
}

static void an_average_is_of_the_leaves_below(void **state)
{
	const struct leaves leaves = { (uint64_t[]){ 0, 1, 8, 63 }, 4 };
	const float up[3] = { 0.0f, 0.0f, 1.0f }, right[3] = { 1.0f, 0.0f, 0.0f };
	struct octree *tree = leaves_to_tree(&leaves, 2);
	uint16_t normal[3];
	uint8_t color[3][3];

	(void)state;
	assert_non_null(tree);
	tree->normal = calloc(4, sizeof *tree->normal);
	tree->color = calloc(4, sizeof *tree->color);
	assert_true(tree->normal != NULL && tree->color != NULL);
	for (int i = 0; i < 4; i++) {
		tree->normal[i] = psr_direction_encode(i < 3 ? up : right);
		memset(tree->color[i], 10 * i, 3);
	}
	octree_average(tree, 1, normal, color);
	assert_int_equal(normal[0], tree->normal[0]);
	assert_int_equal(normal[2], tree->normal[3]);
	assert_true(color[0][0] == 5 && color[1][1] == 20 && color[2][2] == 30);
	octree_average(tree, 0, NULL, color);
	assert_int_equal(color[0][0], 15);
	octree_destroy(tree);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_walk_of_each_depth_finds_the_leaves_and_what_is_above_them),
		cmocka_unit_test(a_mask_has_the_bits_of_its_cells_leaves),
		cmocka_unit_test(paths_and_places_are_each_others_inverse),
		cmocka_unit_test(a_center_is_within_half_an_edge),
		cmocka_unit_test(leaves_out_of_order_are_refused),
		cmocka_unit_test(a_spoilt_tree_is_refused),
		cmocka_unit_test(offsets_are_within_half_a_step),
		cmocka_unit_test(an_average_is_of_the_leaves_below),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
#include <string.h>
#include "base/direction.h"
#include "leaves.h"
#include "tests/unit/lib/threads.h"

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
		assert_int_equal(octree_check(tree, NULL, NULL), PSR_OK);
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
		assert_int_equal(octree_check(&spoilt, NULL, &err), PSR_ERR_FORMAT);
		tree->code[100] = code;
		tree->skip[1] = skip;
	}
	assert_int_equal(octree_check(tree, NULL, NULL), PSR_OK);
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

static void means_are_of_the_children(void **state)
{
	const float up[3] = { 0.0f, 0.0f, 1.0f }, right[3] = { 1.0f, 0.0f, 0.0f }, between[3] = { 1.0f, 0.0f, 2.0f };
	const uint16_t normal[] = { psr_direction_encode(up), psr_direction_encode(up), psr_direction_encode(right) };
	const float(*unit)[3] = psr_direction_table();
	const uint8_t color[][3] = { { 0, 255, 7 }, { 10, 255, 7 }, { 21, 254, 8 } };
	const uint8_t low[] = { 0, 0, 0, 0 }, high[] = { 3, 3, 3, 3 };
	const uint16_t same[] = { normal[0], normal[0], normal[0], normal[0] };
	uint8_t mean[3];

	(void)state;
	const float *at = unit[octree_mean_normal(normal, 3)];
	assert_true(at[0] * between[0] + at[2] * between[2] > 0.998f * sqrtf(5.0f));
	for (unsigned n = 1; n <= 8; n++)
		for (unsigned sum = 0; sum <= 255 * n; sum++) {
			uint8_t of[8][3];

			for (unsigned i = 0; i < n; i++)
				memset(of[i], (int)((sum + i) / n), 3);
			octree_mean_color(mean, (const uint8_t(*)[3])of, n);
			assert_int_equal(mean[2], (sum + n / 2) / n);
		}
	octree_mean_color(mean, color, 3);
	assert_true(mean[0] == 10 && mean[1] == 255 && mean[2] == 7);
	/* Four lower leaves with low points; four upper ones with high points. Offsets of 3 sqrt(3) / 8 and half an edge. */
	assert_int_equal(octree_mean_offset(0x0f, normal[0], same, low), octree_offset_step((-0.5 - 0.6495) / 2));
	assert_int_equal(octree_mean_offset(0xf0, normal[0], same, high), octree_offset_step((0.5 + 0.6495) / 2));
	assert_int_equal(octree_mean_offset(0x0f, normal[0], same, high), octree_offset_step((-0.5 + 0.6495) / 2));
}

/* metallic and reflectance in steps; roughness in 255ths. */
static uint32_t material(uint32_t metallic, uint32_t reflectance, uint32_t shut, uint32_t roughness)
{
	return metallic | reflectance << 5 | shut << 10 | roughness << 16;
}

static uint32_t mean_of(const uint32_t *of, unsigned n, uint16_t *normal)
{
	uint8_t word[8][3];
	const struct octree tree = { .n_leaves = n, .normal = normal, .material = word };

	for (unsigned i = 0; i < n; i++)
		octree_put_material(word[i], of[i]);
	return octree_mean_material(&tree, 0, n);
}

static void means_of_materials_keep_what_is_mirrored(void **state)
{
	const float up[3] = { 0.0f, 0.0f, 1.0f }, aside[3] = { 0.6f, 0.0f, 0.8f };
	uint16_t same[] = { psr_direction_encode(up), psr_direction_encode(up) };
	uint16_t apart[] = { psr_direction_encode(up), psr_direction_encode(aside) };
	struct octree bare = { .n_leaves = 2, .normal = apart };
	uint8_t one[1][3];

	(void)state;
	/* Whatever it is, one material is its own mean. */
	for (uint32_t m = 0; m < 1u << 24; m += 4099)
		assert_int_equal(mean_of((const uint32_t[3]){ m, m, m }, 3, NULL), m);
	/* Half of a metal and half of what reflects (6 / 30)^2: the lobe is the metal's, but for a 26th: the fourth root of
	 * (0.2^4 + 0.04) / 1.04. */
	assert_int_equal(mean_of((const uint32_t[2]){ material(31, 6, 0, 51), material(0, 6, 63, 255) }, 2, same),
	                 material(16, 6, 32, 114));
	/* Reflectances are added, not their roots: those of 3 and 15 thirtieths have the mean of 10.8. */
	assert_int_equal(mean_of((const uint32_t[2]){ material(0, 3, 0, 99), material(0, 15, 0, 99) }, 2, same),
	                 material(0, 11, 0, 99));
	assert_int_equal(mean_of((const uint32_t[2]){ material(0, 0, 9, 0), material(0, 0, 10, 255) }, 2, apart),
	                 material(0, 0, 10, 214)); /* without lobes: the root of the mean width, whatever the normals */
	/* Normals of r = cos(18.4 degrees) = 0.949 widen by 2 (1 - r) / r = 0.108: a mirror's roughness is 0.573. They are
	 * stored within 1.27 degrees, so their angle within 2.54 of 36.9, and the roughness, about as the root of it. */
	octree_put_material(one[0], material(31, 6, 0, 0));
	bare.one_material = one;
	const double roughness = (octree_mean_material(&bare, 0, 2) >> 16) / 255.0;
	assert_true(roughness > 0.55 && roughness < 0.595);
	bare.one_material = NULL;
	assert_int_equal(octree_mean_material(&bare, 0, 2), OCTREE_MATTE);
	/* Unlit children count where they are more than half, and others alone where not. */
	assert_int_equal(mean_of((const uint32_t[3]){ OCTREE_UNLIT, material(9, 6, 3, 99), OCTREE_UNLIT }, 3, same),
	                 OCTREE_UNLIT);
	assert_int_equal(mean_of((const uint32_t[4]){ OCTREE_UNLIT, material(0, 6, 2, 99), material(0, 6, 4, 99), OCTREE_UNLIT }, 4,
	                         NULL), material(0, 6, 3, 99));
}

/* Which octree_mean_normal() takes for granted where all children have one. */
static void the_mean_of_equal_normals_is_theirs(void **state)
{
	const float(*of)[3] = psr_direction_table();

	(void)state;
	for (unsigned i = 0; i < PSR_DIRECTIONS; i++) {
		double sum[3] = { 0, 0, 0 };

		for (int n = 1; n <= 8; n++) {
			for (int c = 0; c < 3; c++)
				sum[c] += (double)of[i][c];
			assert_int_equal(psr_direction_encode((const float[3]){ (float)sum[0], (float)sum[1], (float)sum[2] }), i);
		}
	}
}

/* Whatever is wrong, and wherever: threads find the same fault as one. */
static void threads_find_the_first_fault(void **state)
{
	struct leaves leaves = leaves_of_sphere(9);
	struct octree *tree = leaves_to_tree(&leaves, 9);
	uint64_t random = 11;
	struct psr_pool *pool;

	(void)state;
	assert_int_equal(psr_pool_create(&pool, 3, NULL), PSR_OK);
	assert_int_equal(octree_check(tree, pool, NULL), PSR_OK);
	for (int i = 0; i < 300; i++) {
		struct psr_error alone, shared;
		const uint64_t at = random_below(&random, (uint32_t)tree->n_codes);
		const uint64_t more = random_below(&random, (uint32_t)tree->n_codes);
		const uint8_t code[2] = { tree->code[at], tree->code[more] };

		tree->code[at] = (uint8_t)random_below(&random, 256);
		tree->code[more] = i % 2 ? 0 : code[1];
		const int rc = octree_check(tree, NULL, &alone);
		assert_int_equal(octree_check(tree, pool, &shared), rc);
		if (rc != PSR_OK)
			assert_string_equal(alone.text, shared.text);
		tree->code[more] = code[1];
		tree->code[at] = code[0];
	}
	psr_pool_destroy(pool);
	octree_destroy(tree);
	free(leaves.path);
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
		cmocka_unit_test(means_are_of_the_children),
		cmocka_unit_test(the_mean_of_equal_normals_is_theirs),
		cmocka_unit_test(means_of_materials_keep_what_is_mirrored),
		cmocka_unit_test(threads_find_the_first_fault),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}

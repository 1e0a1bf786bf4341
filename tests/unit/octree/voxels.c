#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
#include "octree/build/build.h"
#include "octree/build/voxels.h"
#include "leaves.h"

#define LEVELS 5
#define SIDE (1 << LEVELS)

static struct octree *voxels(const double (*position)[3], const uint32_t (*triangle)[3], uint32_t n)
{
	const struct octree_surface surface = { .position = position, .triangle = triangle, .n_triangles = n, .edge = SIDE };
	struct octree *tree = NULL;

	assert_int_equal(octree_from_surface(&tree, &surface, LEVELS, OCTREE_LEAST_MEMORY, "/tmp", NULL), PSR_OK);
	assert_int_equal(octree_check(tree, NULL, NULL), PSR_OK);
	return tree;
}

static int mark(const struct octree_node *node, void *userdata)
{
	uint8_t *is_there = userdata;
	uint32_t at[3];

	octree_place(node->path, at);
	is_there[at[0] + SIDE * at[1] + SIDE * SIDE * at[2]] = 1;
	return 0;
}

/* Points of a grid on the triangle are less than a quarter of a cell apart: its longest side is below 56 cells. */
#define STEPS 256
static void triangles_meet_the_cells_that_their_points_are_in_and_none_far_from_these(void **state)
{
	static uint8_t is_there[SIDE * SIDE * SIDE], is_hit[SIDE * SIDE * SIDE];
	uint64_t random = 7;

	(void)state;
	for (int round = 0; round < 20; round++) {
		const uint32_t triangle[1][3] = { { 0, 1, 2 } };
		double p[3][3];
		struct octree *tree;

		for (int i = 0; i < 9; i++)
			p[i / 3][i % 3] = random_in(&random, 0.0, SIDE);
		for (size_t i = 0; i < sizeof is_there; i++)
			is_there[i] = is_hit[i] = 0;
		tree = voxels(p, triangle, 1);
		octree_walk(tree, LEVELS, mark, is_there);
		for (int a = 0; a <= STEPS; a++)
			for (int b = 0; a + b <= STEPS; b++) {
				uint32_t cell = 0;

				for (int c = 0; c < 3; c++) {
					const double x = (a * p[0][c] + b * p[1][c] + (STEPS - a - b) * p[2][c]) / STEPS;

					cell += (uint32_t)fmin(floor(x), SIDE - 1) << c * LEVELS;
				}
				assert_true(is_there[cell]);
				is_hit[cell] = 1;
			}
		/* A cell that no grid point is in was only touched at an edge: a neighbour has one. */
		for (int i = 0; i < SIDE * SIDE * SIDE; i++) {
			int near = 0;

			for (int k = 0; k < 27 && is_there[i]; k++) {
				const int x = i % SIDE + k % 3 - 1, y = i / SIDE % SIDE + k / 3 % 3 - 1, z = i / SIDE / SIDE + k / 9 - 1;

				near |= x >= 0 && y >= 0 && z >= 0 && x < SIDE && y < SIDE && z < SIDE &&
				        is_hit[x + SIDE * y + SIDE * SIDE * z];
			}
			assert_int_equal(near, is_there[i]);
		}
		octree_destroy(tree);
	}
}

static void a_triangle_across_a_corner_leaves_out_the_cells_beside_it(void **state)
{
	/* x + y + z = 10.5 within one octant of eight cells: the cells whose corners are on both sides. */
	const double p[3][3] = { { 10.5, 0.0, 0.0 }, { 0.0, 10.5, 0.0 }, { 0.0, 0.0, 10.5 } };
	const uint32_t triangle[1][3] = { { 0, 1, 2 } };
	struct octree *tree = voxels(p, triangle, 1);
	uint64_t n = 0;

	(void)state;
	for (int x = 0; x < SIDE; x++)
		for (int y = 0; y < SIDE; y++)
			for (int z = 0; z < SIDE; z++)
				n += x + y + z <= 10 && x + y + z + 3 >= 11;
	assert_int_equal(tree->n_leaves, n);
	octree_destroy(tree);
}

static void bad_levels_are_refused(void **state)
{
	struct octree *tree = NULL;
	const struct octree_surface surface = { .n_triangles = 0, .edge = 1.0 };

	(void)state;
	assert_int_equal(octree_from_surface(&tree, &surface, 1, OCTREE_LEAST_MEMORY, "/tmp", NULL), PSR_ERR_ARG);
	assert_int_equal(octree_from_surface(&tree, &surface, 21, OCTREE_LEAST_MEMORY, "/tmp", NULL), PSR_ERR_ARG);
	assert_null(tree);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(triangles_meet_the_cells_that_their_points_are_in_and_none_far_from_these),
		cmocka_unit_test(a_triangle_across_a_corner_leaves_out_the_cells_beside_it),
		cmocka_unit_test(bad_levels_are_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/cell.h"
#include "base/grid.h"
#include "base/random.h"
#include "psr/error.h"

#define N 3000
#define WIDTH 0.1

struct point {
	float p[3];
	uint32_t next;
};

static void scatter(struct grid *grid, struct point point[N])
{
	uint64_t random = 5;

	assert_int_equal(grid_init(grid, WIDTH), PSR_OK);
	for (uint32_t i = 0; i < N; i++) {
		for (int k = 0; k < 3; k++)
			point[i].p[k] = (float)random_in(&random, -1, 1);
		assert_int_equal(grid_put(grid, point[i].p, i, &point[i].next), PSR_OK);
	}
}

static void each_element_is_in_its_cell_once_the_last_one_first(void **state)
{
	static struct point point[N];
	struct grid grid;
	int at[3], n = 0;

	(void)state;
	scatter(&grid, point);
	for (at[0] = -10; at[0] < 10; at[0]++) {
		for (at[1] = -10; at[1] < 10; at[1]++) {
			for (at[2] = -10; at[2] < 10; at[2]++) {
				for (uint32_t i = grid_first(&grid, at); i != GRID_NONE; i = point[i].next, n++) {
					int own[3];

					cell_of(point[i].p, WIDTH, own);
					assert_memory_equal(own, at, sizeof own);
					assert_true(point[i].next == GRID_NONE || point[i].next < i);
				}
			}
		}
	}
	assert_int_equal(n, N);
	grid_fini(&grid);
}

static int is_within(const struct point *point, const float p[3], double radius)
{
	for (int k = 0; k < 3; k++)
		if (cell_floor((double)point->p[k] / WIDTH) < cell_floor(((double)p[k] - radius) / WIDTH)
		    || cell_floor((double)point->p[k] / WIDTH) > cell_floor(((double)p[k] + radius) / WIDTH))
			return 0;
	return 1;
}

static void cells_around_hold_all_that_a_cube_touches(void **state)
{
	static struct point point[N];
	struct grid grid;
	uint64_t random = 8;

	(void)state;
	scatter(&grid, point);
	for (int try = 0; try < 200; try++) {
		float p[3];
		double radius = random_in(&random, 0, 4 * WIDTH);
		uint32_t first[GRID_MOST_AROUND];
		int n_cells, n = 0, n_expected = 0;

		for (int k = 0; k < 3; k++)
			p[k] = (float)random_in(&random, -1.2, 1.2);
		n_cells = grid_around(&grid, p, radius, first);
		for (int c = 0; c < n_cells; c++)
			for (uint32_t i = first[c]; i != GRID_NONE; i = point[i].next, n++)
				assert_true(is_within(&point[i], p, radius));
		for (uint32_t i = 0; i < N; i++)
			n_expected += is_within(&point[i], p, radius);
		assert_int_equal(n, n_expected);
	}
	grid_fini(&grid);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(each_element_is_in_its_cell_once_the_last_one_first),
		cmocka_unit_test(cells_around_hold_all_that_a_cube_touches),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

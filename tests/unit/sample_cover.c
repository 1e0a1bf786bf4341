#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include "psr/direction.h"
#include "psr/error.h"
#include "sample/cover.h"

static const float upright[3][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } };

static uint16_t normal_towards(float z)
{
	const float v[3] = { 0.1f, 0.1f, z };

	return psr_direction_encode(v);
}

/* A disc of radius 0.9 at z = 0 on an equilateral lattice with this spacing. */
static void add_disc(struct cover *cover, double spacing, float z)
{
	int reach = (int)(1 / spacing * 1.2);

	assert_int_equal(cover_reserve(cover, (size_t)(2 * reach + 1) * (2 * reach + 1)), PSR_OK);
	for (int row = -reach; row <= reach; row++) {
		for (int col = -reach; col <= reach; col++) {
			double x = (col + (row & 1) / 2.0) * spacing, y = row * (sqrt(3.0) / 2) * spacing;
			struct cover_point point = { .position = { (float)x, (float)y, z }, .normal = normal_towards(1) };

			if (x * x + y * y <= 0.81)
				cover->point[cover->n_points++] = point;
		}
	}
}

static float *draw(struct cover *cover, const struct cover_grid *grid)
{
	float *z = malloc((size_t)grid->side * grid->side * sizeof *z);

	cover_look(cover, upright, NULL);
	cover_draw(cover, grid, z);
	return z;
}

/* The theorem of [G] 4.3: triangles with sides below a pixel's hit every pixel whose centre they contain. */
static void an_adequate_sampling_leaves_no_pixel_empty(void **state)
{
	const double ds = 1.0 / 64;
	struct cover cover = { 0 };

	(void)state;
	add_disc(&cover, 0.99 * ds, 0);
	for (int test = 0; test < 16; test++) {
		struct cover_grid grid;
		float *z;

		cover_grid_init(&grid, test / 4 * 0.3927, test % 2 / 2.0, test / 2 % 2 / 2.0, ds);
		z = draw(&cover, &grid);
		for (uint32_t i = 0; i < grid.side * grid.side; i++) {
			double x = (i % grid.side + 0.5 - (double)grid.shift[0]) * ds;
			double y = (i / grid.side + 0.5 - (double)grid.shift[1]) * ds;

			if (sqrt(x * x + y * y) < 0.9 - 2 * ds)
				assert_true(z[i] == 0);
			if (sqrt(x * x + y * y) > 0.9 + 2 * ds)
				assert_true(isinf(z[i]));
		}
		free(z);
	}
	cover_fini(&cover);
}

/* With sides of 1.2 pixels some pixel is missed: what the test above claims can fail. */
static void a_sparse_sampling_does(void **state)
{
	const double ds = 1.0 / 64;
	struct cover cover = { 0 };
	struct cover_grid grid;
	int n_empty = 0;
	float *z;

	(void)state;
	add_disc(&cover, 1.2 * ds, 0);
	cover_grid_init(&grid, 0, 0, 0, ds);
	z = draw(&cover, &grid);
	for (uint32_t y = grid.side / 2 - 20; y < grid.side / 2 + 20; y++)
		for (uint32_t x = grid.side / 2 - 20; x < grid.side / 2 + 20; x++)
			n_empty += isinf(z[y * grid.side + x]) != 0;
	assert_true(n_empty > 0);
	free(z);
	cover_fini(&cover);
}

static void the_nearest_point_that_faces_the_viewer_counts(void **state)
{
	struct cover cover = { 0 };
	struct cover_grid grid;
	struct cover_seen middle = { 0.01f, 0.01f, 0 };
	float *z;

	(void)state;
	assert_int_equal(cover_reserve(&cover, 4), PSR_OK);
	for (int i = 0; i < 3; i++)
		cover.point[i] = (struct cover_point){ .position = { 0.01f, 0.01f, 0.2f * (float)i }, .normal = normal_towards(1) };
	cover.n_points = 3;
	cover_grid_init(&grid, 0, 0, 0, 1.0 / 16);
	z = draw(&cover, &grid);
	assert_true(z[cover_pixel(&grid, &middle)] == 0.4f);
	free(z);
	cover.point[2].normal = normal_towards(-1);
	z = draw(&cover, &grid);
	assert_true(z[cover_pixel(&grid, &middle)] == 0.2f);
	free(z);
	cover.point[2].two_sided = 1;
	z = draw(&cover, &grid);
	assert_true(z[cover_pixel(&grid, &middle)] == 0.4f);
	free(z);
	cover_fini(&cover);
}

static void the_whole_unit_sphere_falls_into_the_grid(void **state)
{
	(void)state;
	for (int resolution = 8; resolution <= 8192; resolution *= 2) {
		for (int i = 0; i < 360; i++) {
			struct cover_seen p = { (float)cos(i * 0.01745329), (float)sin(i * 0.01745329), 0 };
			struct cover_grid grid;

			cover_grid_init(&grid, i * 0.004, 0.99, 0.99, 2.0 / resolution);
			assert_true(cover_pixel(&grid, &p) < (size_t)grid.side * grid.side);
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_adequate_sampling_leaves_no_pixel_empty),
		cmocka_unit_test(a_sparse_sampling_does),
		cmocka_unit_test(the_nearest_point_that_faces_the_viewer_counts),
		cmocka_unit_test(the_whole_unit_sphere_falls_into_the_grid),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

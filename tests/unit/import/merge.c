/* A mesh of many small triangles becomes one of fewer for a preview, without holes, and keeps what is large. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/random.h"
#include "base/vec.h"
#include "import/import.h"
#include "ray/ray.h"

#define ROWS 300 /* of quads: 360,000 triangles */
#define COLUMNS 600
#define N_BALL (2 * ROWS * COLUMNS)
#define CELL (2.0 / 128) /* of a ball of radius 1 */
#define PI 3.14159265358979323846

static void grow(struct import_mesh *im, uint32_t n_vertices, uint32_t n_triangles)
{
	struct psr_error err;

	if (import_mesh_grow(im, n_vertices, n_triangles, 0, &err) != PSR_OK)
		fail_msg("%s", err.text);
}

static void begin(struct import_mesh *im)
{
	struct psr_material material;
	struct psr_error err;

	assert_int_equal(import_mesh_init(im, "ball", &err), PSR_OK);
	im->options.is_preview = 1;
	psr_material_default(&material);
	assert_int_equal(import_mesh_add_material(im, &material, &err), 0);
}

/* Shared vertices, or three for each triangle, as in STL. */
static void add_ball(struct import_mesh *im, int rows, int is_shared)
{
	const uint32_t first = im->mesh->n_vertices;
	uint32_t t = im->mesh->n_triangles;

	grow(im, (uint32_t)((rows + 1) * COLUMNS), (uint32_t)(2 * rows * COLUMNS));
	for (int i = 0; i <= rows; i++)
		for (int k = 0; k < COLUMNS; k++) {
			const double theta = PI * i / rows, phi = 2 * PI * k / COLUMNS;

			v3d_set(im->mesh->position[first + (uint32_t)(i * COLUMNS + k)], sin(theta) * cos(phi), cos(theta),
			        -sin(theta) * sin(phi));
		}
	for (int i = 0; i < rows; i++)
		for (int k = 0; k < COLUMNS; k++, t += 2) {
			const uint32_t row = first + (uint32_t)(i * COLUMNS), a = row + (uint32_t)k;
			const uint32_t b = row + (uint32_t)((k + 1) % COLUMNS);
			const uint32_t corner[2][3] = { { a, a + COLUMNS, b + COLUMNS }, { a, b + COLUMNS, b } };

			memcpy(im->mesh->triangle[t], corner, sizeof corner);
		}
	for (uint32_t s = 0; !is_shared && s < 3 * im->mesh->n_triangles; s++) {
		const uint32_t v = im->mesh->n_vertices;

		grow(im, 1, 0);
		memcpy(im->mesh->position[v], im->mesh->position[im->mesh->triangle[s / 3][s % 3]], 3 * sizeof(double));
		im->mesh->triangle[s / 3][s % 3] = v;
	}
}

static void merge(struct import_mesh *im)
{
	struct psr_error err;

	if (import_mesh_merge(im, &err) != PSR_OK)
		fail_msg("%s", err.text);
}

/* Rays from all around to the middle meet the front of the surface, a cell beside the ball's at most. */
static void assert_closed(struct import_mesh *im)
{
	const double origin[3] = { 0, 0, 0 };
	struct ray_scene *scene;
	struct psr_error err;
	uint64_t state = 3;

	assert_int_equal(ray_scene_create(&scene, im->mesh, origin, 1, &err), PSR_OK);
	for (int i = 0; i < 50000; i++) {
		struct ray ray;
		struct ray_hit hit;

		for (int k = 0; k < 3; k++)
			ray.direction[k] = random_in(&state, -1, 1);
		if (v3d_length(ray.direction) < 0.1)
			continue;
		v3d_normalize(ray.direction, ray.direction);
		v3d_scale(ray.origin, ray.direction, -3);
		ray_scene_trace(scene, &ray, 1, 0, &hit);
		if (hit.prim == RAY_NONE || hit.is_back || fabs(hit.t - 2) > CELL)
			fail_msg("along %g,%g,%g: %u at %g", ray.direction[0], ray.direction[1], ray.direction[2], hit.prim, hit.t);
	}
	ray_scene_destroy(scene);
}

static void a_ball_of_small_triangles_keeps_its_surface_in_fewer(void **state)
{
	(void)state;
	for (int is_shared = 0; is_shared < 2; is_shared++) {
		struct import_mesh im;

		begin(&im);
		add_ball(&im, ROWS, is_shared);
		merge(&im);
		assert_true(im.mesh->n_triangles > 10000 && im.mesh->n_triangles < N_BALL / 2);
		assert_true(im.mesh->n_vertices <= 3 * im.mesh->n_triangles);
		assert_non_null(strstr(im.mesh->warning, "merged: 360000 became"));
		assert_closed(&im);
		import_mesh_fini(&im);
	}
}

static void shared_vertices_or_not_is_the_same(void **state)
{
	struct import_mesh im[2];

	(void)state;
	for (int i = 0; i < 2; i++) {
		begin(&im[i]);
		add_ball(&im[i], ROWS, i);
		merge(&im[i]);
	}
	assert_int_equal(im[0].mesh->n_triangles, im[1].mesh->n_triangles);
	for (uint32_t t = 0; t < im[0].mesh->n_triangles; t++)
		for (int c = 0; c < 3; c++)
			assert_memory_equal(im[0].mesh->position[im[0].mesh->triangle[t][c]],
			                    im[1].mesh->position[im[1].mesh->triangle[t][c]], 3 * sizeof(double));
	import_mesh_fini(&im[0]);
	import_mesh_fini(&im[1]);
}

static void without_a_wish_or_with_few_triangles_nothing_changes(void **state)
{
	(void)state;
	for (int is_wished = 0; is_wished < 2; is_wished++) {
		const int rows = is_wished ? ROWS / 3 : ROWS;
		struct import_mesh im;

		begin(&im);
		im.options.is_preview = is_wished;
		add_ball(&im, rows, 1);
		merge(&im);
		assert_int_equal(im.mesh->n_triangles, 2 * rows * COLUMNS);
		assert_int_equal(im.mesh->n_vertices, (rows + 1) * COLUMNS);
		assert_string_equal(im.mesh->warning, "");
		import_mesh_fini(&im);
	}
}

/* A bar of a 2000th of the ball's size. */
static void large_triangles_stay_however_thin(void **state)
{
	static const double corner[4][3] = { { 0, 0, 1.5 }, { 0, 0.001, 1.5 }, { 0, 1, 1.5 }, { 0, 1.001, 1.5 } };
	static const uint32_t bar[2][3] = { { 0, 1, 2 }, { 1, 3, 2 } };
	struct import_mesh im;
	int n = 0;

	(void)state;
	begin(&im);
	grow(&im, 4, 2);
	memcpy(im.mesh->position, corner, sizeof corner);
	memcpy(im.mesh->triangle, bar, sizeof bar);
	add_ball(&im, ROWS, 1);
	merge(&im);
	assert_true(im.mesh->n_triangles < N_BALL / 2);
	for (uint32_t t = 0; t < im.mesh->n_triangles; t++) {
		const uint32_t *v = im.mesh->triangle[t];

		if (im.mesh->position[v[0]][2] == 1.5)
			for (int c = 0; c < 3; c++)
				assert_memory_equal(im.mesh->position[v[c]], corner[bar[n][c]], sizeof corner[0]);
		n += im.mesh->position[v[0]][2] == 1.5;
	}
	assert_int_equal(n, 2);
	import_mesh_fini(&im);
}

static void broken_triangles_are_left_to_be_counted(void **state)
{
	struct psr_mesh *mesh;
	struct psr_error err;
	struct import_mesh im;

	(void)state;
	begin(&im);
	add_ball(&im, ROWS, 1);
	im.mesh->position[5 * COLUMNS + 7][1] = NAN; /* of six triangles */
	grow(&im, 1, 0);
	v3d_set(im.mesh->position[im.mesh->n_vertices - 1], 1e9, INFINITY, 0); /* of none */
	merge(&im);
	assert_int_equal(import_mesh_finish(&mesh, &im, &err), PSR_OK);
	assert_int_equal(mesh->n_dropped_triangles, 6);
	psr_mesh_destroy(mesh);
	import_mesh_fini(&im);
	begin(&im);
	add_ball(&im, ROWS, 1);
	im.mesh->triangle[100][1] = im.mesh->n_vertices;
	assert_int_equal(import_mesh_merge(&im, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "triangle 100 refers to vertex"));
	import_mesh_fini(&im);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_ball_of_small_triangles_keeps_its_surface_in_fewer),
		cmocka_unit_test(shared_vertices_or_not_is_the_same),
		cmocka_unit_test(without_a_wish_or_with_few_triangles_nothing_changes),
		cmocka_unit_test(large_triangles_stay_however_thin),
		cmocka_unit_test(broken_triangles_are_left_to_be_counted),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

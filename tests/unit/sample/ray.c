#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "surface/validate.h"
#include "ray/ray.h"
#include "ray/triangle.h"
#include "meshes.h"

static const double zero[3];

static struct ray_scene *open_scene(const struct psr_mesh *mesh, const double origin[3], double scale)
{
	struct ray_scene *scene = NULL;

	assert_int_equal(ray_scene_create(&scene, mesh, origin, scale, NULL), PSR_OK);
	return scene;
}

static struct ray down_at(double x, double y)
{
	return (struct ray){ .origin = { x, y, 2 }, .direction = { 0, 0, -1 } };
}

/* The hit is computed in double: a few roundings of 2^-53, where a float would be 2^-24 off. */
static void hits_are_exact_in_double(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);
	struct ray_scene *scene = open_scene(mesh, zero, 1);
	struct ray_hit hit;
	uint64_t seed = 7;

	(void)state;
	for (int i = 0; i < 1000; i++) {
		double x = 1.9 * meshes_random(&seed) - 0.95, y = 1.9 * meshes_random(&seed) - 0.95, at[3] = { 0, 0, 0 };
		struct ray ray = down_at(x, y);
		double weight[3];

		ray_scene_trace(scene, &ray, 1, 0, &hit);
		assert_int_not_equal(hit.prim, RAY_NONE);
		assert_false(hit.is_back);
		assert_true(fabs(hit.t - 2) < 1e-15);
		weight[0] = 1 - hit.u - hit.v;
		weight[1] = hit.u;
		weight[2] = hit.v;
		for (int k = 0; k < 3; k++)
			for (int c = 0; c < 2; c++)
				at[c] += weight[k] * mesh->position[mesh->triangle[hit.prim][k]][c];
		assert_true(fabs(at[0] - x) < 1e-14 && fabs(at[1] - y) < 1e-14);
	}
	ray_scene_destroy(scene);
	meshes_free(mesh);
}

static void no_ray_slips_through_an_edge(void **state)
{
	struct psr_mesh *mesh = meshes_sphere(60, zero, 0.999);
	struct ray_scene *scene = open_scene(mesh, zero, 1);
	uint64_t seed = 3;

	(void)state;
	for (int i = 0; i < 20000; i++) {
		/* Straight at the middles of edges, but for those at the poles, where faces have no area. */
		uint32_t row = 240, prim = row + (uint32_t)(meshes_random(&seed) * (mesh->n_triangles - 2 * row));
		const uint32_t *t = mesh->triangle[prim];
		struct ray ray;
		struct ray_hit hit;

		for (int k = 0; k < 3; k++) {
			double target = (mesh->position[t[0]][k] + mesh->position[t[1 + (i & 1)]][k]) / 2;

			ray.origin[k] = 2 * target;
			ray.direction[k] = -target;
		}
		ray_scene_trace(scene, &ray, 1, 0, &hit);
		assert_int_not_equal(hit.prim, RAY_NONE);
		assert_true(hit.t < 1.01);
	}
	ray_scene_destroy(scene);
	meshes_free(mesh);
}

static void backs_of_one_sided_faces_let_rays_through(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);
	struct ray_scene *scene = open_scene(mesh, zero, 1);
	struct ray ray = { .origin = { 0.1, 0.2, -2 }, .direction = { 0, 0, 1 } };
	struct ray_hit hit;

	(void)state;
	ray_scene_trace(scene, &ray, 1, 0, &hit);
	assert_int_equal(hit.prim, RAY_NONE);
	ray_scene_destroy(scene);
	mesh->material->two_sided = 1;
	scene = open_scene(mesh, zero, 1);
	ray_scene_trace(scene, &ray, 1, 0, &hit);
	assert_int_not_equal(hit.prim, RAY_NONE);
	assert_true(hit.is_back);
	ray_scene_destroy(scene);
	meshes_free(mesh);
}

static void cut_outs_show_what_is_behind(void **state)
{
	static const uint8_t texels[] = { 255, 255, 255, 0, 255, 255, 255, 255 }; /* left half away */
	struct psr_mesh *mesh = meshes_square(1);
	struct ray_scene *scene;
	struct ray rays[2] = { down_at(-0.6, 0.1), down_at(0.6, 0.1) };
	struct ray_hit hit[2];

	(void)state;
	meshes_texture(mesh, 2, 1, texels);
	mesh->material->base_texture.wrap_s = PSR_WRAP_CLAMP;
	mesh->material->alpha = PSR_ALPHA_MASK;
	scene = open_scene(mesh, zero, 1);
	ray_scene_trace(scene, rays, 2, 0, hit);
	assert_int_equal(hit[0].prim, RAY_NONE);
	assert_int_not_equal(hit[1].prim, RAY_NONE);
	ray_scene_destroy(scene);
	meshes_free(mesh);
}

/* At 5e6 units a float steps by half a unit, as large as the sphere. */
static void far_coordinates_lose_nothing(void **state)
{
	const double far[3] = { 5e6, -4e5, 120 };
	struct psr_mesh *mesh = meshes_sphere(40, far, 0.5), *near_mesh = meshes_sphere(40, zero, 0.5);
	double center[3], radius, near_center[3], near_radius;
	struct ray_scene *scene, *near_scene;
	uint64_t seed = 11;

	(void)state;
	assert_int_equal(validate_bound_mesh(mesh, center, &radius, NULL), PSR_OK);
	assert_int_equal(validate_bound_mesh(near_mesh, near_center, &near_radius, NULL), PSR_OK);
	scene = open_scene(mesh, center, radius);
	near_scene = open_scene(near_mesh, near_center, near_radius);
	for (int i = 0; i < 500; i++) {
		struct ray ray = down_at(meshes_random(&seed) - 0.5, meshes_random(&seed) - 0.5);
		struct ray_hit hit, near_hit;

		ray_scene_trace(scene, &ray, 1, 0, &hit);
		ray_scene_trace(near_scene, &ray, 1, 0, &near_hit);
		/* Doubles at 5e6 step by 1e-9, twice that in units of the radius; slopes here are below 2. */
		assert_true(fabs(hit.t - near_hit.t) < 1e-8);
	}
	ray_scene_destroy(scene);
	ray_scene_destroy(near_scene);
	meshes_free(mesh);
	meshes_free(near_mesh);
}

static void far_eyes_see_sharply(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);
	struct ray_scene *scene = open_scene(mesh, zero, 1);
	struct ray ray = { .origin = { 0.25, 0.5, 1e7 }, .direction = { 0, 0, -1 } };
	struct ray_hit hit;

	(void)state;
	ray.origin[0] = 1e7 + 1 - 1e-6; /* meets the square a millionth from its edge */
	ray.direction[0] = -1;
	ray_scene_trace(scene, &ray, 1, 0, &hit);
	assert_int_not_equal(hit.prim, RAY_NONE);
	ray.origin[0] = 1e7 + 1 + 1e-6;
	ray_scene_trace(scene, &ray, 1, 0, &hit);
	assert_int_equal(hit.prim, RAY_NONE);
	ray_scene_destroy(scene);
	meshes_free(mesh);
}

static void broken_meshes_stop_at_the_door(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);
	double center[3], radius;
	struct psr_error err;

	(void)state;
	assert_int_equal(validate_mesh(mesh, &err), PSR_OK);
	mesh->triangle[1][2] = mesh->n_vertices;
	assert_int_equal(validate_mesh(mesh, &err), PSR_ERR_ARG);
	mesh->triangle[1][2] = 0;
	mesh->triangle_material[0] = 1;
	assert_int_equal(validate_mesh(mesh, &err), PSR_ERR_ARG);
	mesh->triangle_material[0] = 0;
	mesh->material->base_texture.image = 0;
	assert_int_equal(validate_mesh(mesh, &err), PSR_ERR_ARG);
	mesh->material->base_texture.image = -1;
	mesh->position[2][1] = NAN;
	assert_int_equal(validate_mesh(mesh, &err), PSR_ERR_ARG);
	for (uint32_t i = 0; i < mesh->n_vertices; i++)
		for (int k = 0; k < 3; k++)
			mesh->position[i][k] = 4;
	assert_int_equal(validate_mesh(mesh, &err), PSR_OK);
	assert_int_equal(validate_bound_mesh(mesh, center, &radius, &err), PSR_ERR_ARG);
	mesh->position[0][0] = 1e300;
	assert_int_equal(validate_bound_mesh(mesh, center, &radius, &err), PSR_ERR_ARG);
	meshes_free(mesh);
}

/* A grid of points on the triangle, n + 1 a side: the nearest of them is at most a grid step further than the nearest of all. */
static double grid_distance(const double corner[3][3], const double p[3], int n)
{
	double nearest = INFINITY;

	for (int i = 0; i <= n; i++)
		for (int j = 0; i + j <= n; j++) {
			double d = 0;

			for (int k = 0; k < 3; k++) {
				double q = (i * corner[0][k] + j * corner[1][k] + (n - i - j) * corner[2][k]) / n - p[k];

				d += q * q;
			}
			nearest = fmin(nearest, d);
		}
	return sqrt(nearest);
}

static void distances_to_triangles_are_those_of_brute_force(void **state)
{
	struct psr_mesh *mesh = meshes_new(3 * 20, 20);
	struct ray_scene *scene;
	uint64_t seed = 3;
	const int n = 200;

	(void)state;
	for (uint32_t i = 0; i < 60; i++) {
		for (int k = 0; k < 3; k++)
			mesh->position[i][k] = meshes_random(&seed) - 0.5;
		mesh->triangle[i / 3][i % 3] = i;
	}
	memcpy(mesh->position[5], mesh->position[4], sizeof mesh->position[4]); /* a degenerate one */
	scene = open_scene(mesh, zero, 1);
	for (int i = 0; i < 40; i++) {
		double p[3], nearest = INFINITY, got;

		for (int k = 0; k < 3; k++)
			p[k] = 2 * meshes_random(&seed) - 1;
		for (uint32_t t = 0; t < 20; t++) {
			double corner[3][3], own, grid;

			ray_scene_corners(scene, t, corner);
			own = sqrt(triangle_distance2((const double(*)[3])corner, p));
			grid = grid_distance((const double(*)[3])corner, p, n);
			/* Sides are at most sqrt 3 long. */
			assert_true(own <= grid + 1e-12 && grid <= own + 1.74 / n);
			nearest = fmin(nearest, own);
		}
		got = ray_scene_distance(scene, p, 10);
		assert_true(fabs(got - nearest) <= 1e-12);
		assert_true(isinf(ray_scene_distance(scene, p, nearest * 0.999)));
	}
	ray_scene_destroy(scene);
	meshes_free(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(distances_to_triangles_are_those_of_brute_force),
		cmocka_unit_test(hits_are_exact_in_double),
		cmocka_unit_test(no_ray_slips_through_an_edge),
		cmocka_unit_test(backs_of_one_sided_faces_let_rays_through),
		cmocka_unit_test(cut_outs_show_what_is_behind),
		cmocka_unit_test(far_coordinates_lose_nothing),
		cmocka_unit_test(far_eyes_see_sharply),
		cmocka_unit_test(broken_meshes_stop_at_the_door),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

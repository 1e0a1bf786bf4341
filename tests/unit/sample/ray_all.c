#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/vec.h"
#include "base/pool.h"
#include "ray/ray.h"
#include "meshes.h"

static const double zero[3];

static struct ray_scene *open_scene(const struct psr_mesh *mesh)
{
	struct ray_scene *scene = NULL;

	assert_int_equal(ray_scene_create(&scene, mesh, zero, 1, NULL), PSR_OK);
	return scene;
}

static void random_vector(uint64_t *seed, double v[3], double reach)
{
	for (int k = 0; k < 3; k++)
		v[k] = reach * (2 * meshes_random(seed) - 1);
}

/* Triangles within the unit sphere, of sides up to 0.8. */
static struct psr_mesh *soup(uint64_t *seed, uint32_t n)
{
	struct psr_mesh *mesh = meshes_new(3 * n, n);

	for (uint32_t i = 0; i < n; i++) {
		double center[3], d[3];

		random_vector(seed, center, 0.4);
		for (uint32_t c = 0; c < 3; c++) {
			random_vector(seed, d, 0.15);
			v3d_add(mesh->position[3 * i + c], center, d);
			mesh->triangle[i][c] = 3 * i + c;
		}
	}
	return mesh;
}

static struct psr_mesh *cloud(uint64_t *seed, uint32_t n)
{
	struct psr_mesh *mesh = meshes_new(0, 0);

	mesh->n_points = n;
	mesh->point = calloc(n, sizeof *mesh->point);
	mesh->point_normal = calloc(n, sizeof *mesh->point_normal);
	mesh->point_radius = calloc(n, sizeof *mesh->point_radius);
	mesh->point_material = calloc(n, sizeof *mesh->point_material);
	for (uint32_t i = 0; i < n; i++) {
		double normal[3];

		random_vector(seed, mesh->point[i], 0.5);
		do
			random_vector(seed, normal, 1);
		while (v3d_normalize(normal, normal) < 0.1);
		for (int k = 0; k < 3; k++)
			mesh->point_normal[i][k] = (float)normal[k];
		mesh->point_radius[i] = (float)(0.02 + 0.2 * meshes_random(seed));
	}
	return mesh;
}

static void cloud_free(struct psr_mesh *mesh)
{
	free(mesh->point);
	free(mesh->point_normal);
	free(mesh->point_radius);
	free(mesh->point_color);
	free(mesh->point_material);
	meshes_free(mesh);
}

static struct ray random_ray(uint64_t *seed)
{
	struct ray ray;
	double target[3];

	random_vector(seed, target, 0.5);
	do
		random_vector(seed, ray.origin, 3);
	while (v3d_length(ray.origin) < 2);
	v3d_sub(ray.direction, target, ray.origin);
	v3d_normalize(ray.direction, ray.direction);
	return ray;
}

/* What brute force finds of one primitive: 1 met, 0 missed, -1 too close to a rim to tell in floats. */
struct found {
	int is_met, is_back;
	double t;
};

/* The tree's floats are off by 2^-24 of coordinates up to 4, and slopes multiply that; no ray is nearer to a rim. */
#define RIM 1e-4

static struct found meet_triangle(const struct psr_mesh *mesh, uint32_t prim, const struct ray *ray)
{
	const double *a = mesh->position[3 * prim], *b = mesh->position[3 * prim + 1], *c = mesh->position[3 * prim + 2];
	double e1[3], e2[3], n[3], s[3], p[3], q[3], side[3], det, least;
	struct found found;

	v3d_sub(e1, b, a);
	v3d_sub(e2, c, a);
	v3d_cross(n, e1, e2);
	det = -v3d_dot(n, ray->direction);
	v3d_sub(s, ray->origin, a);
	found.t = v3d_dot(s, n) / det;
	found.is_back = det < 0;
	v3d_add_scaled(p, s, found.t, ray->direction);
	v3d_cross(q, p, e2);
	side[0] = v3d_dot(q, n) / v3d_dot(n, n);
	v3d_cross(q, e1, p);
	side[1] = v3d_dot(q, n) / v3d_dot(n, n);
	side[2] = 1 - side[0] - side[1];
	least = fmin(side[0], fmin(side[1], side[2]));
	found.is_met = fabs(least) < RIM || fabs(det) < RIM * v3d_length(n) ? -1 : least > 0;
	return found;
}

static struct found meet_disc(const struct psr_mesh *mesh, uint32_t point, const struct ray *ray)
{
	double n[3], s[3], p[3], slope, beyond;
	struct found found;

	for (int k = 0; k < 3; k++)
		n[k] = (double)mesh->point_normal[point][k];
	slope = v3d_dot(n, ray->direction);
	v3d_sub(s, mesh->point[point], ray->origin);
	found.t = v3d_dot(s, n) / slope;
	found.is_back = slope > 0;
	v3d_scale(p, ray->direction, found.t);
	v3d_sub(p, p, s);
	beyond = v3d_length(p) - (double)mesh->point_radius[point];
	found.is_met = fabs(beyond) < RIM || fabs(slope) < RIM ? -1 : beyond < 0;
	return found;
}

/* All hits of a ray by brute force, sorted, at most `most`; -1 if a rim is too near. */
static int brute_force(const struct psr_mesh *mesh, const struct ray *ray, int most, struct ray_hit *hit)
{
	int n = 0;

	for (uint32_t i = 0; i < mesh->n_triangles + mesh->n_points; i++) {
		struct found found = i < mesh->n_triangles ? meet_triangle(mesh, i, ray)
		                                           : meet_disc(mesh, i - mesh->n_triangles, ray);
		int at;

		if (found.is_met < 0)
			return -1;
		if (!found.is_met || (found.is_back && !mesh->material->two_sided))
			continue;
		n = n < most ? n + 1 : n;
		for (at = n - 1; at > 0 && hit[at - 1].t > found.t; at--)
			hit[at] = hit[at - 1];
		if (at < n - 1 || hit[at].prim == RAY_NONE || hit[at].t > found.t)
			hit[at] = (struct ray_hit){ .prim = i, .is_back = found.is_back, .t = found.t };
	}
	return n;
}

static void compare_with_brute_force(const struct psr_mesh *mesh, int most, uint64_t seed)
{
	enum { RAYS = 2000 };
	struct ray_scene *scene = open_scene(mesh);
	static struct ray ray[RAYS];
	static struct ray_hit hit[RAYS * RAY_MOST_HITS], first[RAYS];
	static int n_hits[RAYS];
	static uint8_t is_occluded[RAYS], is_near[RAYS];
	int n_compared = 0, n_full = 0, n_near = 0;

	for (int i = 0; i < RAYS; i++)
		ray[i] = random_ray(&seed);
	ray_scene_trace_all(scene, ray, RAYS, most, hit, n_hits);
	ray_scene_trace(scene, ray, RAYS, 0, first);
	ray_scene_occluded(scene, ray, RAYS, INFINITY, is_occluded);
	ray_scene_occluded(scene, ray, RAYS, 3, is_near);
	for (int i = 0; i < RAYS; i++) {
		struct ray_hit truth[RAY_MOST_HITS];
		const struct ray_hit *got = hit + i * most;
		int n, close = 0;

		for (int h = 0; h < most; h++)
			truth[h] = (struct ray_hit){ .prim = RAY_NONE, .t = INFINITY };
		n = brute_force(mesh, &ray[i], most, truth);
		for (int h = 1; h < n; h++)
			close |= truth[h].t - truth[h - 1].t < 1e-5;
		if (n < 0 || close)
			continue;
		n_compared++;
		n_full += n == most;
		assert_int_equal(n_hits[i], n);
		assert_int_equal(is_occluded[i], n > 0);
		if (n == 0 || fabs(truth[0].t - 3) > 1e-5)
			assert_int_equal(is_near[i], n > 0 && truth[0].t < 3);
		n_near += is_near[i];
		assert_int_equal(first[i].prim, n > 0 ? truth[0].prim : RAY_NONE);
		for (int h = 0; h < n; h++) {
			assert_int_equal(got[h].prim, truth[h].prim);
			assert_int_equal(got[h].is_back, truth[h].is_back);
			/* Doubles, over a slope of RIM at least. */
			assert_true(fabs(got[h].t - truth[h].t) < 1e-10);
		}
		if (n > 0)
			assert_memory_equal(&first[i].t, &got[0].t, sizeof first[i].t);
	}
	assert_true(n_compared > RAYS / 2);
	assert_in_range(n_near, 10, n_compared - 10);
	assert_true(most > 8 || n_full > 50);
	ray_scene_destroy(scene);
}

static void all_hits_are_those_of_brute_force(void **state)
{
	uint64_t seed = 5;

	(void)state;
	for (int two_sided = 0; two_sided < 2; two_sided++) {
		struct psr_mesh *mesh = soup(&seed, 300);

		mesh->material->two_sided = two_sided;
		compare_with_brute_force(mesh, RAY_MOST_HITS, seed);
		compare_with_brute_force(mesh, 2, seed);
		meshes_free(mesh);
	}
}

/* Random discs face all ways: half of a radius apart they are one, so here they are few and far between. */
static void discs_are_met_as_by_brute_force(void **state)
{
	uint64_t seed = 9;

	(void)state;
	for (int two_sided = 0; two_sided < 2; two_sided++) {
		struct psr_mesh *mesh = cloud(&seed, 60);

		for (uint32_t i = 0; i < mesh->n_points; i++)
			mesh->point_radius[i] = 0.02f + 0.0005f * (float)i;
		mesh->material->two_sided = two_sided;
		compare_with_brute_force(mesh, RAY_MOST_HITS, seed);
		cloud_free(mesh);
	}
}

static void stacks_of_discs_are_one_surface(void **state)
{
	uint64_t seed = 4;
	struct psr_mesh *mesh = cloud(&seed, 40);
	struct ray_scene *scene;
	struct ray ray = { .origin = { 0.01, 0.02, 2 }, .direction = { 0, 0, -1 } };
	struct ray_hit hit[RAY_MOST_HITS];
	int n;

	(void)state;
	mesh->material->two_sided = 1;
	/* Thirty within 0.04 in depth, radius 0.1: one; ten 0.3 below: another; the one between looks down. */
	for (uint32_t i = 0; i < 40; i++) {
		v3d_set(mesh->point[i], 0, 0, (i < 30 ? 0.2 : -0.1) + 0.04 * meshes_random(&seed));
		v3f_set(mesh->point_normal[i], 0, 0, i == 3 ? -1 : 1);
		mesh->point_radius[i] = 0.1f;
	}
	mesh->point[7][2] = 0.25; /* the nearest */
	scene = open_scene(mesh);
	ray_scene_trace_all(scene, &ray, 1, RAY_MOST_HITS, hit, &n);
	assert_int_equal(n, 3);
	assert_int_equal(hit[0].prim, 7);
	assert_int_equal(hit[1].prim, 3);
	assert_true(hit[1].is_back);
	assert_true(fabs(hit[0].t - 1.75) < 1e-12);
	assert_true(hit[2].prim >= 30 && hit[2].t > 2.05);
	ray_scene_destroy(scene);
	cloud_free(mesh);
}

static void faces_that_coincide_are_met_once_a_side(void **state)
{
	struct psr_mesh *mesh = meshes_new(3, 8);
	struct ray_scene *scene;
	struct ray ray = { .origin = { 0.1, 0.1, 2 }, .direction = { 0, 0, -0.5 } };
	struct ray_hit hit[RAY_MOST_HITS];
	int n;

	(void)state;
	mesh->position[1][0] = mesh->position[2][1] = 0.5;
	for (uint32_t i = 0; i < 8; i++)
		for (uint32_t k = 0; k < 3; k++)
			mesh->triangle[i][k] = i == 2 || i == 5 ? 2 - k : (k + i) % 3;
	mesh->material->two_sided = 1;
	scene = open_scene(mesh);
	ray_scene_trace_all(scene, &ray, 1, RAY_MOST_HITS, hit, &n);
	assert_int_equal(n, 2);
	assert_int_equal(hit[0].prim + hit[1].prim, 0 + 2);
	assert_int_not_equal(hit[0].is_back, hit[1].is_back);
	assert_true(fabs(hit[0].t - 4) < 1e-12);
	ray_scene_destroy(scene);
	meshes_free(mesh);
}

/* More faces behind each other than are kept: the nearest stay, however the tree comes upon them. */
static void deep_piles_keep_their_nearest(void **state)
{
	enum { PILE = 5000 };
	struct psr_mesh *mesh = meshes_new(3 * PILE, PILE);
	struct ray_scene *scene;
	struct ray ray = { .origin = { 0.01, 0.01, 2 }, .direction = { 0, 0, -1 } };
	struct ray_hit hit[RAY_MOST_HITS];
	int n;

	(void)state;
	for (uint32_t i = 0; i < PILE; i++) {
		uint32_t place = (uint32_t)(i * UINT64_C(2654435761) % PILE); /* PILE and the factor have no common divisor */

		for (uint32_t k = 0; k < 3; k++) {
			mesh->position[3 * i + k][0] = k == 1 ? 0.5 : -0.1;
			mesh->position[3 * i + k][1] = k == 2 ? 0.5 : -0.1;
			mesh->position[3 * i + k][2] = 0.5 - (double)place / PILE;
			mesh->triangle[i][k] = 3 * i + k;
		}
	}
	scene = open_scene(mesh);
	ray_scene_trace_all(scene, &ray, 1, RAY_MOST_HITS, hit, &n);
	assert_int_equal(n, RAY_MOST_HITS);
	for (int i = 0; i < n; i++)
		assert_true(fabs(hit[i].t - (1.5 + (double)i / PILE)) < 1e-12);
	ray_scene_destroy(scene);
	meshes_free(mesh);
}

static void cut_outs_are_not_met(void **state)
{
	static const uint8_t texels[] = { 255, 255, 255, 0, 255, 255, 255, 255 }; /* left half away */
	struct psr_mesh *mesh = meshes_square(1);
	struct ray_scene *scene;
	struct ray ray[2] = { { { -0.6, 0.1, 2 }, { 0, 0, -1 } }, { { 0.6, 0.1, 2 }, { 0, 0, -1 } } };
	struct ray_hit hit[2 * RAY_MOST_HITS];
	uint8_t is_occluded[2];
	int n[2];

	(void)state;
	meshes_texture(mesh, 2, 1, texels);
	mesh->material->base_texture.wrap_s = PSR_WRAP_CLAMP;
	mesh->material->alpha = PSR_ALPHA_MASK;
	scene = open_scene(mesh);
	ray_scene_trace_all(scene, ray, 2, RAY_MOST_HITS, hit, n);
	assert_int_equal(n[0], 0);
	assert_int_equal(n[1], 1);
	ray_scene_occluded(scene, ray, 2, INFINITY, is_occluded);
	assert_false(is_occluded[0]);
	assert_true(is_occluded[1]);
	ray_scene_occluded(scene, ray, 2, 2.001, is_occluded);
	assert_true(is_occluded[1]);
	ray_scene_occluded(scene, ray, 2, 1.999, is_occluded);
	assert_false(is_occluded[1]);
	ray_scene_occluded(scene, ray, 2, 0.5, is_occluded); /* before it is anywhere near */
	assert_false(is_occluded[1]);
	ray_scene_destroy(scene);
	meshes_free(mesh);
}

static void transparent_points_are_not_met(void **state)
{
	uint64_t seed = 2;
	struct psr_mesh *mesh = cloud(&seed, 2);
	struct ray_scene *scene;
	struct ray ray = { { 0, 0, 2 }, { 0, 0, -1 } };
	struct ray_hit hit;

	(void)state;
	mesh->point_color = calloc(2, sizeof *mesh->point_color);
	for (uint32_t i = 0; i < 2; i++) {
		v3d_set(mesh->point[i], 0, 0, i == 0 ? 0.5 : 0);
		v3f_set(mesh->point_normal[i], 0, 0, 1);
		mesh->point_color[i][3] = i == 0 ? 0.4f : 0.6f;
	}
	mesh->material->alpha = PSR_ALPHA_BLEND;
	scene = open_scene(mesh);
	ray_scene_trace(scene, &ray, 1, 0, &hit);
	assert_int_equal(hit.prim, 1);
	ray_scene_destroy(scene);
	mesh->material->alpha = PSR_ALPHA_OPAQUE;
	scene = open_scene(mesh);
	ray_scene_trace(scene, &ray, 1, 0, &hit);
	assert_int_equal(hit.prim, 0);
	ray_scene_destroy(scene);
	cloud_free(mesh);
}

static void distances_to_discs_are_exact(void **state)
{
	uint64_t seed = 8;
	struct psr_mesh *mesh = cloud(&seed, 1);
	struct ray_scene *scene;

	(void)state;
	v3d_set(mesh->point[0], 0.1, 0.2, 0.3);
	v3f_set(mesh->point_normal[0], 0, 1, 0);
	mesh->point_radius[0] = 0.25f;
	scene = open_scene(mesh);
	assert_int_equal(ray_scene_index_distances(scene, NULL), PSR_OK);
	assert_true(fabs(ray_scene_distance(scene, (const double[]){ 0.2, 0.7, 0.3 }, 1) - 0.5) < 1e-14);
	/* 0.4 above and 0.3 beyond the rim */
	assert_true(fabs(ray_scene_distance(scene, (const double[]){ 0.1, -0.2, 0.85 }, 1) - 0.5) < 1e-14);
	assert_true(isinf(ray_scene_distance(scene, (const double[]){ 0.2, 0.7, 0.3 }, 0.49)));
	ray_scene_destroy(scene);
	cloud_free(mesh);
}

struct work {
	const struct ray_scene *scene;
	struct ray ray[64][64];
	struct ray_hit hit[64][64 * 4];
	int n_hits[64][64];
};

static void trace_some(int i, void *userdata)
{
	struct work *work = userdata;

	ray_scene_trace_all(work->scene, work->ray[i], 64, 4, work->hit[i], work->n_hits[i]);
}

static void threads_find_the_same_hits(void **state)
{
	uint64_t seed = 12;
	struct psr_mesh *mesh = soup(&seed, 2000);
	struct psr_pool *pool = NULL;
	struct work *one = calloc(1, sizeof *one), *many = calloc(1, sizeof *many);

	(void)state;
	assert_int_equal(psr_pool_create(&pool, 4, NULL), PSR_OK);
	for (int i = 0; i < 64; i++)
		for (int k = 0; k < 64; k++)
			one->ray[i][k] = many->ray[i][k] = random_ray(&seed);
	one->scene = open_scene(mesh);
	many->scene = open_scene(mesh);
	psr_pool_for(NULL, 64, trace_some, one);
	psr_pool_for(pool, 64, trace_some, many);
	for (int i = 0; i < 64; i++)
		for (int k = 0; k < 64; k++) {
			assert_int_equal(one->n_hits[i][k], many->n_hits[i][k]);
			for (int h = 0; h < one->n_hits[i][k]; h++) {
				const struct ray_hit *a = &one->hit[i][4 * k + h], *b = &many->hit[i][4 * k + h];

				assert_true(a->prim == b->prim && a->is_back == b->is_back);
				assert_memory_equal(&a->t, &b->t, 3 * sizeof a->t);
			}
		}
	ray_scene_destroy((struct ray_scene *)one->scene);
	ray_scene_destroy((struct ray_scene *)many->scene);
	psr_pool_destroy(pool);
	free(one);
	free(many);
	meshes_free(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(all_hits_are_those_of_brute_force),
		cmocka_unit_test(discs_are_met_as_by_brute_force),
		cmocka_unit_test(stacks_of_discs_are_one_surface),
		cmocka_unit_test(faces_that_coincide_are_met_once_a_side),
		cmocka_unit_test(deep_piles_keep_their_nearest),
		cmocka_unit_test(cut_outs_are_not_met),
		cmocka_unit_test(transparent_points_are_not_met),
		cmocka_unit_test(distances_to_discs_are_exact),
		cmocka_unit_test(threads_find_the_same_hits),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include "base/direction.h"
#include "model.h"

#define RESOLUTION 128 /* levels of 128 and 64 */
#define N_LEVELS 2

static const double zero[3];

/* Points without triangles, of radius 0 so far. */
static struct psr_mesh *cloud(uint32_t n)
{
	struct psr_mesh *mesh = meshes_new(0, 0);

	mesh->n_points = n;
	mesh->point = calloc(n, sizeof *mesh->point);
	mesh->point_normal = calloc(n, sizeof *mesh->point_normal);
	mesh->point_radius = calloc(n, sizeof *mesh->point_radius);
	mesh->point_color = calloc(n, sizeof *mesh->point_color);
	mesh->point_material = calloc(n, sizeof *mesh->point_material);
	for (uint32_t i = 0; i < n; i++)
		for (int k = 0; k < 4; k++)
			mesh->point_color[i][k] = 1;
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

/* n points evenly on the unit sphere, along a spiral: each has 4 pi / n of the area, its disc six times that. The
 * right half is red, the left one blue. */
static struct psr_mesh *sphere_cloud(uint32_t n)
{
	struct psr_mesh *mesh = cloud(n);

	for (uint32_t i = 0; i < n; i++) {
		double z = 1 - (2 * i + 1.0) / n, r = sqrt(1 - z * z), a = 2.399963229728653 * i;

		v3d_set(mesh->point[i], r * cos(a), r * sin(a), z);
		for (int k = 0; k < 3; k++)
			mesh->point_normal[i][k] = (float)mesh->point[i][k];
		v3f_normalize(mesh->point_normal[i], mesh->point_normal[i]);
		mesh->point_radius[i] = (float)(5 / sqrt(n));
		mesh->point_color[i][mesh->point[i][0] > 0 ? 2 : 0] = 0;
		mesh->point_color[i][1] = 0;
	}
	return mesh;
}

static double pixel(unsigned level)
{
	return 2.0 / RESOLUTION * (1u << level);
}

/* To inner coordinates. */
static void inner(const struct model_built *built, const double p[3], float out[3])
{
	const struct psr_model_info *info = psr_model_info(built->model);

	for (int k = 0; k < 3; k++)
		out[k] = (float)((p[k] - info->origin[k]) / info->scale);
}

/* Discs of radius 0.07 stand off from the sphere by 0.0025, a sixth of a pixel, at their rims; with it the 0.96
 * pixels that what is sampled may be away from samples (dice.c) are 1.12 at level 0, less above. */
static void a_dense_cloud_has_no_holes(void **state)
{
	const struct model_built *built = *state;
	uint64_t seed = 31;

	for (unsigned level = 0; level < N_LEVELS; level++) {
		struct kept map;
		double farthest = 0;

		model_map(&map, built->sample, built->blocks->n_samples, level, pixel(level));
		for (int i = 0; i < 20000; i++) {
			double p[3];
			float at[3];

			do
				for (int k = 0; k < 3; k++)
					p[k] = 2 * meshes_random(&seed) - 1;
			while (v3d_dot(p, p) > 1 || v3d_normalize(p, p) < 0.1);
			inner(built, p, at);
			farthest = fmax(farthest, (double)model_nearest(&map, at, UINT32_MAX));
		}
		printf("# level %u: %u samples, farthest %.3f pixels\n", level, map.n, farthest / pixel(level));
		assert_true(farthest < 1.12 * pixel(level));
		kept_fini(&map);
	}
}

/* However many discs lie over each other: as many samples as of a sphere of triangles, give or take a fifth (discs
 * lie off each other by fractions of a pixel). */
static void overlapping_discs_are_sampled_once(void **state)
{
	struct psr_mesh *sphere = meshes_sphere(60, zero, 1);
	struct psr_model *model = model_build(sphere, RESOLUTION);
	double n = (double)psr_model_blocks(model)->n_samples;
	const struct model_built *built = *state;

	printf("# %.2f of a mesh's samples\n", (double)built->blocks->n_samples / n);
	assert_true((double)built->blocks->n_samples < 1.2 * n && (double)built->blocks->n_samples > 0.8 * n);
	psr_model_unref(model);
	meshes_free(sphere);
}

/* Where only discs of one colour reach; normals are those of discs that are up to 0.07 away, 4 degrees, and quantised
 * to 1.3. What is bent to face its projection is none of these. */
static void samples_have_colors_and_normals_of_their_points(void **state)
{
	const struct model_built *built = *state;
	const struct psr_model_info *info = psr_model_info(built->model);

	for (uint64_t i = 0; i < built->blocks->n_samples; i++) {
		const struct model_sample *s = &built->sample[i];
		uint32_t color = PSR_ATTR_BASE(s->attr);
		double margin = 0.072 + 2 * pixel(s->level), p[3];

		for (int k = 0; k < 3; k++)
			p[k] = info->origin[k] + info->scale * (double)s->p[k];
		if (p[0] > margin)
			assert_int_equal(color, 0x0000ff);
		if (p[0] < -margin)
			assert_int_equal(color, 0xff0000);
		assert_int_equal(s->two_sided, 0);
		assert_true(fabs(v3d_length(p) - 1) < 0.005);
		if (s->level == 0) {
			const float *normal = psr_direction_table()[PSR_ATTR_NORMAL(s->attr)];

			v3d_normalize(p, p);
			assert_true(p[0] * (double)normal[0] + p[1] * (double)normal[1] + p[2] * (double)normal[2] > cos(0.1));
		}
	}
}

/* A disc of 40 pixels' radius by itself is round: covered to its rim, with nothing but what was moved by half a pixel
 * beyond. */
static void a_disc_is_round(void **state)
{
	struct psr_mesh *mesh = cloud(1);
	struct model_built built;
	double frame[3][3], normal[3] = { 0.36, 0.48, 0.8 };
	float center[3];

	(void)state;
	for (int k = 0; k < 3; k++)
		mesh->point_normal[0][k] = (float)normal[k];
	mesh->point_radius[0] = 3;
	model_open(&built, mesh, RESOLUTION, N_LEVELS);
	inner(&built, mesh->point[0], center);
	psr_direction_basis(normal, frame);
	for (uint64_t i = 0; i < built.blocks->n_samples; i++) {
		const struct model_sample *s = &built.sample[i];
		double radius = 3 / psr_model_info(built.model)->scale;
		float d[3];

		v3f_sub(d, s->p, center);
		assert_true((double)v3f_length(d) < radius + 0.56 * pixel(s->level));
		assert_true(fabs((double)v3f_dot(d, mesh->point_normal[0])) < 1e-3 * pixel(0));
	}
	for (unsigned level = 0; level < N_LEVELS; level++) {
		struct kept map;

		model_map(&map, built.sample, built.blocks->n_samples, level, pixel(level));
		for (int turn = 0; turn < 100; turn++) {
			for (int step = 0; step <= 40; step++) {
				double r = 3 * step / 40.0, p[3];
				float at[3];

				for (int k = 0; k < 3; k++)
					p[k] = r * (cos(turn * 0.0628) * frame[0][k] + sin(turn * 0.0628) * frame[1][k]);
				inner(&built, p, at);
				assert_true((double)model_nearest(&map, at, UINT32_MAX) < 0.97 * pixel(level));
			}
		}
		kept_fini(&map);
	}
	model_close(&built, cloud_free);
}

/* Alone, and a tenth of a pixel wide: each has a sample within half a pixel of its centre, by which it is tested. */
static void lone_points_are_all_there(void **state)
{
	struct psr_mesh *mesh = cloud(500);
	struct model_built built;
	uint64_t seed = 5;

	(void)state;
	for (uint32_t i = 0; i < mesh->n_points; i++) {
		do
			for (int k = 0; k < 3; k++)
				mesh->point_normal[i][k] = (float)(2 * meshes_random(&seed) - 1);
		while (v3f_dot(mesh->point_normal[i], mesh->point_normal[i]) > 1
		       || v3f_normalize(mesh->point_normal[i], mesh->point_normal[i]) < 0.1f);
		for (int k = 0; k < 3; k++)
			mesh->point[i][k] = 2 * meshes_random(&seed) - 1;
		mesh->point_radius[i] = (float)(0.05 * 2 / RESOLUTION);
	}
	model_open(&built, mesh, RESOLUTION, N_LEVELS);
	for (unsigned level = 0; level < N_LEVELS; level++) {
		struct kept map;
		int n_missing = 0;

		model_map(&map, built.sample, built.blocks->n_samples, level, pixel(level));
		for (uint32_t i = 0; i < mesh->n_points; i++) {
			float at[3];

			inner(&built, mesh->point[i], at);
			n_missing += (double)model_nearest(&map, at, UINT32_MAX) > 0.56 * pixel(level);
		}
		printf("# level %u: %d of %u points missing, %u samples\n", level, n_missing, mesh->n_points, map.n);
		assert_int_equal(n_missing, 0);
		kept_fini(&map);
	}
	model_close(&built, cloud_free);
}

static int open_sphere(void **state)
{
	static struct model_built sphere;

	model_open(&sphere, sphere_cloud(5000), RESOLUTION, N_LEVELS);
	*state = &sphere;
	return 0;
}

static int close_sphere(void **state)
{
	model_close(*state, cloud_free);
	return 0;
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_dense_cloud_has_no_holes),
		cmocka_unit_test(overlapping_discs_are_sampled_once),
		cmocka_unit_test(samples_have_colors_and_normals_of_their_points),
		cmocka_unit_test(a_disc_is_round),
		cmocka_unit_test(lone_points_are_all_there),
	};

	return cmocka_run_group_tests(tests, open_sphere, close_sphere);
}

/* Differential points of clouds. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/random.h"
#include "base/vec.h"
#include "model/blocks.h"
#include "sample/dpoint/of_mesh.h"

#define N 20000

/* Points evenly on a sphere of radius 3 about 10, 0, 0 along a spiral, without what is above `top` of its height; each
 * has 4 pi 9 / n of the area, and its disc six times that. The right half is red. */
static struct psr_mesh *sphere(uint32_t n, double top)
{
	struct psr_mesh *mesh = calloc(1, sizeof *mesh);

	mesh->point = calloc(n, sizeof *mesh->point);
	mesh->point_normal = calloc(n, sizeof *mesh->point_normal);
	mesh->point_radius = calloc(n, sizeof *mesh->point_radius);
	mesh->point_color = calloc(n, sizeof *mesh->point_color);
	mesh->point_material = calloc(n, sizeof *mesh->point_material);
	mesh->material = calloc(1, sizeof *mesh->material);
	mesh->n_materials = 1;
	mesh->up[2] = 1;
	psr_material_default(mesh->material);
	mesh->material[0].two_sided = 1;
	for (uint32_t i = 0; i < n; i++) {
		const double z = 1 - (2 * i + 1.0) / n, r = sqrt(1 - z * z), a = 2.399963229728653 * i;
		const double at[3] = { r * cos(a), r * sin(a), z };
		const uint32_t to = mesh->n_points;

		if (z > top)
			continue;
		for (int k = 0; k < 3; k++) {
			mesh->point[to][k] = 3 * at[k] + (k == 0) * 10;
			mesh->point_normal[to][k] = (float)at[k];
			mesh->point_color[to][k] = k == 0 || at[0] < 0;
		}
		mesh->point_radius[to] = (float)(3 * sqrt(24.0 / n) / 2);
		mesh->n_points++;
	}
	return mesh;
}

static void drop(struct psr_mesh *mesh)
{
	free(mesh->point);
	free(mesh->point_normal);
	free(mesh->point_radius);
	free(mesh->point_color);
	free(mesh->point_material);
	free(mesh->material);
	free(mesh);
}

static int make(struct dpoint_set *set, struct psr_model_info *info, struct dpoint_build_report *report,
                const struct psr_mesh *mesh, double error, struct psr_error *err)
{
	struct dpoint_build_options options;

	dpoint_build_options_default(&options, 256);
	options.error = error;
	*info = (struct psr_model_info){ .scale = 0 };
	return dpoint_of_mesh(set, info, report, mesh, &options, err);
}

/* Whether a point's rectangle is over the place, and its quadric within `off` of it. */
static int covers(const struct dpoint_set *set, const struct dpoint_group *g, uint32_t i, const float at[3], float off)
{
	const struct dpoint_limit limit = dpoint_limit_of(set, g, i);
	float away[3], v[3], extent[2], u, w;
	struct dpoint p;

	dpoint_unpack(&p, &set->word[g->first + i], &g->box);
	dpoint_extent(extent, &p, &limit);
	v3f_sub(away, at, p.at);
	v3f_cross(v, p.normal, p.u);
	u = v3f_dot(away, p.u);
	w = v3f_dot(away, v);
	return fabsf(u) <= extent[0] && fabsf(w) <= extent[1] &&
	       fabsf(v3f_dot(away, p.normal) - dpoint_quadric_at(p.lambda_u, p.rho, u, w)) <= off;
}

static int is_covered(const struct dpoint_set *set, const float at[3], float off)
{
	for (uint32_t i = 0; i < set->n_groups; i++)
		for (uint32_t k = 0; k < set->group[i].n; k++)
			if (covers(set, &set->group[i], k, at, off))
				return 1;
	return 0;
}

/* Points no further from where the halves meet than two squares' half diagonals, 2.83 radii of a disc, find no room for
 * the squares of theirs and stay as they are: at most these. */
static double at_the_seam(const struct psr_mesh *mesh)
{
	const double disc = (double)mesh->point_radius[0], pi = 180 * PSR_DEGREE;

	return 2 * pi * 3 * 2 * 2.83 * disc / (4 * pi * 9 / N);
}

/* Each place is within a rectangle that is off it by half a pixel (the height that is allowed) and the error of packing
 * at most, and the sphere is smooth enough for a twentieth of the points, but for those at the seam. */
static void few_points_cover_a_sphere(void **state)
{
	struct psr_mesh *mesh = sphere(N, 1);
	struct dpoint_build_report report;
	struct psr_model_info info;
	struct dpoint_set set;
	struct psr_error err = { 0 };
	uint64_t seed = 3;

	(void)state;
	assert_int_equal(make(&set, &info, &report, mesh, 0, &err), PSR_OK);
	assert_true(fabs(info.origin[0] - 10) < 0.01 && info.box_max[2] == mesh->point[0][2]);
	assert_true(report.n_flat == 0 && report.n_open == 0 && set.n_points == report.n_kept);
	print_message("# %u points of %u, and at most %.0f are at the seam\n", set.n_points, mesh->n_points,
	              at_the_seam(mesh));
	assert_true(20 * (set.n_points - at_the_seam(mesh)) < mesh->n_points);
	for (int i = 0; i < 2000; i++) {
		double p[3];
		float at[3];

		do
			for (int k = 0; k < 3; k++)
				p[k] = random_in(&seed, -1, 1);
		while (v3d_dot(p, p) > 1 || v3d_normalize(p, p) < 0.1);
		for (int k = 0; k < 3; k++)
			at[k] = (float)((3 * p[k] + (k == 0) * 10 - info.origin[k]) / info.scale);
		assert_true(is_covered(&set, at, 1.0f / 256 + 4e-5f));
	}
	for (uint32_t i = 0; i < set.n_groups; i++)
		assert_int_equal(set.group[i].flags, 0); /* it is closed: nobody sees its back */
	dpoint_set_fini(&set);
	drop(mesh);
}

/* A bowl is seen from both sides, and no rectangle reaches over its rim by more than a strip that begins at 1.5 radii of
 * a disc, one class more, and the overhang. */
static void a_bowl_ends_at_its_rim(void **state)
{
	const double top = 0.5;
	struct psr_mesh *mesh = sphere(N, top);
	struct dpoint_build_report report;
	struct psr_model_info info;
	struct dpoint_set set;
	struct psr_error err = { 0 };
	const double disc = (double)mesh->point_radius[0];

	(void)state;
	assert_int_equal(make(&set, &info, &report, mesh, 0, &err), PSR_OK);
	for (uint32_t i = 0; i < set.n_groups; i++) {
		assert_int_equal(set.group[i].flags, DPOINT_TWO_SIDED);
		for (uint32_t k = 0; k < set.group[i].n; k++) {
			const struct dpoint_limit limit = dpoint_limit_of(&set, &set.group[i], k);
			struct dpoint p;
			float extent[2], v[3];

			dpoint_unpack(&p, &set.word[set.group[i].first + k], &set.group[i].box);
			dpoint_extent(extent, &p, &limit);
			v3f_cross(v, p.normal, p.u);
			for (int side = -1; side <= 1; side += 2)
				for (int axis = 0; axis < 2; axis++) {
					const float *along = axis == 0 ? p.u : v;
					const double z = info.origin[2] + info.scale * (double)(p.at[2] + (float)side * extent[axis] * along[2]);

					assert_true(z < 3 * top + 1.2 * 1.5 * disc + 2 * 5e-4 * info.scale);
				}
		}
	}
	dpoint_set_fini(&set);
	drop(mesh);
}

/* The bound is proven against squares through the points: of a smooth cloud it holds, and is the set's. */
static void an_error_holds(void **state)
{
	struct psr_mesh *mesh = sphere(N, 1);
	struct dpoint_build_report report;
	struct psr_model_info info;
	struct dpoint_set set;
	struct psr_error err = { 0 };

	(void)state;
	assert_int_equal(make(&set, &info, &report, mesh, 0.1, &err), PSR_OK);
	assert_true(report.n_over == 0 && report.off_worst <= 0.1001 && report.off_worst > 0);
	dpoint_set_fini(&set);
	drop(mesh);
}

static void what_is_no_surface_is_refused(void **state)
{
	struct psr_mesh *mesh = sphere(N, 1);
	struct dpoint_build_report report;
	struct psr_model_info info;
	struct dpoint_set set;
	struct psr_error err = { 0 };

	(void)state;
	mesh->n_points = 6;
	assert_int_equal(make(&set, &info, &report, mesh, 0, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "no point of 6 has a surface around it"));
	mesh->n_points = 0;
	assert_int_equal(make(&set, &info, &report, mesh, 0, &err), PSR_ERR_ARG);
	mesh->n_points = 1;
	assert_int_equal(make(&set, &info, &report, mesh, 0, &err), PSR_ERR_FORMAT);
	mesh->n_points = N;
	mesh->point[7][1] = NAN;
	assert_int_equal(make(&set, &info, &report, mesh, 0, &err), PSR_ERR_ARG);
	drop(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(few_points_cover_a_sphere),
		cmocka_unit_test(a_bowl_ends_at_its_rim),
		cmocka_unit_test(an_error_holds),
		cmocka_unit_test(what_is_no_surface_is_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Differential points within an error: random places of what is drawn, and their distances from the source by another
 * code. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "../lib/nearest.h"
#include "base/random.h"
#include "base/vec.h"
#include "dpoint/bound.h"
#include "dpoint/mesh.h"
#include "sample/dpoint/of_mesh.h"

#define RESOLUTION 256
#define PLACES 24 /* of a point, beside the corners */

/* ---- surfaces ---- */

typedef void place_fn(double at[3], double s, double t);

static void sphere_at(double at[3], double s, double t)
{
	v3d_set(at, sin(M_PI * t) * cos(2 * M_PI * s), cos(M_PI * t), -sin(M_PI * t) * sin(2 * M_PI * s));
}

static void cylinder_at(double at[3], double s, double t)
{
	v3d_set(at, 0.4 * cos(2 * M_PI * s), 1 - 2 * t, -0.4 * sin(2 * M_PI * s));
}

static void torus_at(double at[3], double s, double t)
{
	const double r = 1 + 0.35 * cos(2 * M_PI * t);

	v3d_set(at, r * cos(2 * M_PI * s), -0.35 * sin(2 * M_PI * t), -r * sin(2 * M_PI * s));
}

static void saddle_at(double at[3], double s, double t)
{
	const double x = 2 * s - 1, y = 1 - 2 * t;

	v3d_set(at, x, y, 0.6 * (x * x - y * y));
}

/* Its border is no rectangle, and it leans. */
static void disc_at(double at[3], double s, double t)
{
	const double x = t * cos(2 * M_PI * s), y = t * sin(2 * M_PI * s);

	v3d_set(at, x + 0.3 * y, y, 0.7 * x - 0.2 * y);
}

static const struct form {
	const char *name;
	place_fn *at;
	uint32_t around, along;
} forms[] = {
	{ "sphere", sphere_at, 32, 16 }, { "cylinder", cylinder_at, 40, 3 }, { "torus", torus_at, 40, 20 },
	{ "saddle", saddle_at, 16, 16 }, { "plane", disc_at, 23, 2 },
};
#define N_FORMS (sizeof forms / sizeof *forms)

static struct psr_mesh *mesh_of(const struct form *form)
{
	const uint32_t n = form->around, m = form->along;
	double (*position)[3] = malloc((n + 1) * (m + 1) * sizeof *position);
	uint32_t (*triangle)[3] = malloc(2 * n * m * sizeof *triangle), count = 0;
	struct psr_mesh *mesh;

	assert_true(position != NULL && triangle != NULL);
	for (uint32_t i = 0; i <= n; i++)
		for (uint32_t k = 0; k <= m; k++) {
			form->at(position[i * (m + 1) + k], (double)i / n, (double)k / m);
			for (int c = 0; c < 3; c++) /* seams close */
				position[i * (m + 1) + k][c] = (double)(float)(position[i * (m + 1) + k][c] + 4) - 4;
		}
	for (uint32_t i = 0; i < n; i++)
		for (uint32_t k = 0; k < m; k++) {
			const uint32_t a = i * (m + 1) + k, b = a + m + 1;

			memcpy(triangle[count++], (const uint32_t[3]){ a, a + 1, b + 1 }, sizeof *triangle);
			memcpy(triangle[count++], (const uint32_t[3]){ a, b + 1, b }, sizeof *triangle);
		}
	assert_int_equal(psr_mesh_create(&mesh, (const double(*)[3])position, (n + 1) * (m + 1),
	                                 (const uint32_t(*)[3])triangle, count, NULL), PSR_OK);
	free(position);
	free(triangle);
	return mesh;
}

/* ---- distances ---- */

/* The triangles that come near to a place: others could only make distances less. */
static size_t gather(float (*to)[3][3], const float (*from)[3][3], size_t n, const float at[3], float near)
{
	size_t count = 0;

	for (size_t t = 0; t < n; t++) {
		int is_near = 1;

		for (int k = 0; k < 3; k++) {
			const float x = from[t][0][k] - at[k], y = from[t][1][k] - at[k], z = from[t][2][k] - at[k];

			is_near &= !((x > near && y > near && z > near) || (x < -near && y < -near && z < -near));
		}
		if (is_near)
			memcpy(to[count++], from[t], sizeof *to);
	}
	return count;
}

/* The greatest distance of places of what is drawn, in pixels. */
static double off_by(const struct dpoint_set *set, const struct psr_model_info *info, const struct psr_mesh *mesh)
{
	float (*source)[3][3] = malloc(mesh->n_triangles * sizeof *source);
	float (*close)[3][3] = malloc(mesh->n_triangles * sizeof *source);
	uint64_t seed = 8;
	double worst = 0;

	assert_true(source != NULL && close != NULL);
	for (uint32_t i = 0; i < 9 * mesh->n_triangles; i++)
		source[i / 9][i / 3 % 3][i % 3] = (float)((mesh->position[mesh->triangle[i / 9][i / 3 % 3]][i % 3] -
		                                           info->origin[i % 3]) / info->scale);
	for (uint32_t g = 0; g < set->n_groups; g++)
		for (uint32_t k = 0; k < set->group[g].n; k++) {
			const struct dpoint_limit limit = dpoint_limit_of(set, &set->group[g], k);
			float extent[2], v[3];
			struct dpoint p;
			size_t n;

			dpoint_unpack(&p, &set->word[set->group[g].first + k], &set->group[g].box);
			dpoint_extent(extent, &p, &limit);
			v3f_cross(v, p.normal, p.u);
			n = gather(close, (const float (*)[3][3])source, mesh->n_triangles, p.at, extent[0] + extent[1] + 0.05f);
			for (int place = 0; place < PLACES + 4; place++) {
				const float x = extent[0] * (place < 4 ? (float)(place % 2 * 2 - 1) : (float)random_in(&seed, -1, 1));
				const float y = extent[1] * (place < 4 ? (float)(place / 2 * 2 - 1) : (float)random_in(&seed, -1, 1));
				const float w = dpoint_quadric_at(p.lambda_u, p.rho, x, y);
				double at[3];

				for (int c = 0; c < 3; c++)
					at[c] = (double)p.at[c] + (double)x * p.u[c] + (double)y * v[c] + (double)w * p.normal[c];
				worst = fmax(worst, nearest_distance((const float (*)[3][3])close, n, at));
			}
		}
	free(source);
	free(close);
	return worst * RESOLUTION / 2;
}

static void make(struct dpoint_set *set, struct psr_model_info *info, struct dpoint_build_report *report,
                 const struct psr_mesh *mesh, double error)
{
	struct dpoint_build_options options;
	struct psr_error err = { 0 };

	dpoint_build_options_default(&options, RESOLUTION);
	options.error = error;
	options.piece = 0.04;
	*info = (struct psr_model_info){ .scale = 0 };
	if (dpoint_of_mesh(set, info, report, mesh, &options, &err) != PSR_OK)
		fail_msg("%s", err.text);
}

/* No piece is open, no place is further off than asked, or than is said: floats of a frame's size, 1e-6 inner units. */
static void nothing_drawn_is_further_off_than_the_error(void **state)
{
	static const double errors[3] = { 0.25, 0.5, 2 };

	(void)state;
	for (size_t f = 0; f < N_FORMS; f++) {
		struct psr_mesh *mesh = mesh_of(&forms[f]);
		uint64_t n_before = UINT64_MAX;

		for (int e = 0; e < 3; e++) {
			struct dpoint_build_report report;
			struct psr_model_info info;
			struct dpoint_set set;
			double off;

			make(&set, &info, &report, mesh, errors[e]);
			off = off_by(&set, &info, mesh);
			print_message("%s within %g pixels: %u points, sampled %.4f, proven %.4f\n", forms[f].name, errors[e],
			              set.n_points, off, report.off_worst);
			assert_int_equal(report.n_over, 0);
			assert_int_equal(report.n_open, 0);
			assert_true(off <= report.off_worst + 1e-6 * RESOLUTION / 2);
			assert_true(report.off_worst <= errors[e] * (1 + 1e-6));
			assert_true(fabs((double)set.height * RESOLUTION / 2 - report.off_worst) < 1e-9);
			/* What is allowed more needs no more points, but for the chance of the choice. */
			assert_true((double)report.n_kept < 1.1 * (double)n_before);
			n_before = report.n_kept;
			dpoint_set_fini(&set);
		}
		psr_mesh_destroy(mesh);
	}
}

/* Without an error, too, the file says what holds; a disc's rectangles then reach over its border. */
static void what_is_said_without_an_error_holds(void **state)
{
	(void)state;
	for (size_t f = 0; f < N_FORMS; f++) {
		struct psr_mesh *mesh = mesh_of(&forms[f]);
		struct dpoint_build_report report;
		struct psr_model_info info;
		struct dpoint_set set;
		double off;

		make(&set, &info, &report, mesh, 0);
		off = off_by(&set, &info, mesh);
		print_message("%s: %u points, sampled %.4f, proven %.4f\n", forms[f].name, set.n_points, off, report.off_worst);
		assert_true(off <= report.off_worst + 1e-6 * RESOLUTION / 2);
		/* Corners are among the places, and it is they that are furthest off or about. */
		assert_true(report.off_worst < 1.3 * off + 0.02);
		assert_int_equal(report.n_over, 0);
		dpoint_set_fini(&set);
		psr_mesh_destroy(mesh);
	}
}

/* Kept points that are not within an error, each looked at alone. */
static size_t count_over(const struct dpoint_surface *surface, const struct dpoint_choice *choice, double sine,
                         double error)
{
	struct bound_view view = { .seen = NULL };
	size_t n = 0;

	for (size_t c = 0; c < surface->n_candidates; c++) {
		float extent[2];

		if (!choice->is_kept[c])
			continue;
		dpoint_candidate_extent(extent, &surface->candidate[c], sine);
		n += bound_least(&view, &surface->facets, &surface->candidate[c].point, extent, error) > error;
	}
	bound_view_fini(&view);
	return n;
}

/* Cells that were not cut for the error: some of a disc's, at its border, have no point that is within it. */
static void what_cannot_hold_is_counted(void **state)
{
	const struct dpoint_cover_options cover_options = {
		.sine = dpoint_sine(0.01), .slack = 2e-5f, .angle = 0.03f, .height = 1e-3f, .overhang = 5e-4f, .looks = 8,
		.error = 1e-3f,
	};
	const struct dpoint_mesh_options options = { .scale = 1, .cell = 0.02, .delta = 0.125f };
	struct psr_mesh *mesh = mesh_of(&forms[N_FORMS - 1]);
	struct dpoint_surface surface;
	struct dpoint_cover cover = { 0 };
	struct dpoint_choice choice = { 0 };
	struct dpoint_bounds bounds;

	(void)state;
	dpoint_surface_init(&surface);
	assert_int_equal(dpoint_sample_mesh(&surface, mesh, &options, NULL), PSR_OK);
	assert_int_equal(dpoint_simplify(&choice, &cover, &surface, &cover_options, 1, NULL, NULL), PSR_OK);
	assert_int_equal(dpoint_bounds_measure(&bounds, &surface, &choice, &cover_options, NULL), PSR_OK);
	assert_true(bounds.n_over > 0 && bounds.n_over < choice.n_kept);
	assert_true(bounds.worst > 1e-3 && bounds.worst < 0.1);
	assert_int_equal(bounds.n_over, count_over(&surface, &choice, cover_options.sine, (double)cover_options.error));
	assert_int_equal(choice.n_holes, 0);
	dpoint_choice_fini(&choice);
	dpoint_cover_fini(&cover);
	dpoint_surface_fini(&surface);
	psr_mesh_destroy(mesh);
}

static void errors_out_of_range_are_refused(void **state)
{
	static const double bad[] = { -1, NAN, INFINITY, RESOLUTION + 1, 3.5e-5 * RESOLUTION };
	struct psr_mesh *mesh = mesh_of(&forms[0]);
	struct dpoint_build_options options;
	struct dpoint_build_report report;
	struct psr_model_info info;
	struct dpoint_set set;
	struct psr_error err;

	(void)state;
	dpoint_build_options_default(&options, RESOLUTION);
	assert_true(options.error == 0);
	for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
		options.error = bad[i];
		assert_int_equal(dpoint_of_mesh(&set, &info, &report, mesh, &options, &err), PSR_ERR_ARG);
	}
	assert_non_null(strstr(err.text, "ask for 0.0092 or more"));
	psr_mesh_destroy(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(nothing_drawn_is_further_off_than_the_error),
		cmocka_unit_test(what_is_said_without_an_error_holds),
		cmocka_unit_test(what_cannot_hold_is_counted),
		cmocka_unit_test(errors_out_of_range_are_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Proofs of distance (bound.h), beside distances of many places by a code of its own. */
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
#include "dpoint/bound.h"
#include "dpoint/rectangle.h"
#include "../lib/nearest.h"

#define SIDE 61 /* places along a side of a rectangle */

static struct dpoint point_of(float lambda_u, float rho)
{
	return (struct dpoint){ .normal = { 0, 0, 1 }, .u = { 1, 0, 0 }, .lambda_u = lambda_u, .rho = rho };
}

/* The greatest distance of a grid of places on the quadric. Places between two of them are further off by half a
 * diagonal of a step, times what the quadric's slope makes it longer, at most. */
static double sampled(double *beyond, const struct facets *facets, const struct dpoint *p, const float extent[2])
{
	const double a = p->lambda_u, b = a * p->rho;
	const double slope = hypot(a * extent[0], b * extent[1]);
	double worst = 0, v[3];

	v3d_set(v, (double)(p->normal[1] * p->u[2] - p->normal[2] * p->u[1]),
	        (double)(p->normal[2] * p->u[0] - p->normal[0] * p->u[2]),
	        (double)(p->normal[0] * p->u[1] - p->normal[1] * p->u[0]));
	for (int i = 0; i < SIDE * SIDE; i++) {
		const double x = extent[0] * (2.0 * (i % SIDE) / (SIDE - 1) - 1);
		const double y = extent[1] * (2.0 * (i / SIDE) / (SIDE - 1) - 1);
		double at[3];

		for (int k = 0; k < 3; k++)
			at[k] = p->at[k] + x * p->u[k] + y * v[k] + 0.5 * (a * x * x + b * y * y) * p->normal[k];
		worst = fmax(worst, nearest_distance((const float (*)[3][3])facets->facet, facets->n, at));
	}
	*beyond = worst + hypot(extent[0], extent[1]) / (SIDE - 1) * sqrt(1 + slope * slope);
	return worst;
}

/* A sheet of triangles over -1..1, at heights by `rough` about a quadric, with some left out. */
static void make_sheet(struct facets *facets, uint64_t *seed, int n, double rough, double left_out)
{
	float (*at)[3] = malloc((size_t)(n + 1) * (size_t)(n + 1) * sizeof *at);
	const double a = random_in(seed, -1, 1), b = random_in(seed, -1, 1);

	memset(facets, 0, sizeof *facets);
	assert_non_null(at);
	for (int i = 0; i <= n; i++)
		for (int k = 0; k <= n; k++) {
			const double x = 2.0 * i / n - 1, y = 2.0 * k / n - 1;

			v3f_set(at[i * (n + 1) + k], (float)x, (float)y,
			        (float)(0.5 * (a * x * x + b * y * y) + random_in(seed, -rough, rough)));
		}
	for (int i = 0; i < n; i++)
		for (int k = 0; k < n; k++) {
			float (*c)[3] = at + i * (n + 1) + k;

			if (random_in(seed, 0, 1) >= left_out)
				assert_int_equal(facets_add(facets, c[0], c[n + 1], c[n + 2]), PSR_OK);
			if (random_in(seed, 0, 1) >= left_out)
				assert_int_equal(facets_add(facets, c[0], c[n + 2], c[1]), PSR_OK);
		}
	free(at);
	assert_int_equal(facets_sort(facets), PSR_OK);
}

/* What is said to hold holds at all places; and what holds by a margin of a twentieth is said to: the finest parts are
 * a 32nd of the error, and see it from half of that away. */
static void what_holds_holds_at_all_places(void **state)
{
	static const double rough[4] = { 0, 0.002, 0.02, 0.1 };
	struct bound_view view = { .seen = NULL };
	int n_held = 0, n_failed = 0;
	uint64_t seed = 5;

	(void)state;
	for (int round = 0; round < 160; round++) {
		struct dpoint p = point_of((float)random_in(&seed, -2, 2), (float)random_in(&seed, -1, 1));
		const float extent[2] = { (float)random_in(&seed, 0.01, 0.5), (float)random_in(&seed, 0.01, 0.5) };
		struct facets facets;
		double worst, beyond;

		make_sheet(&facets, &seed, 3 + round % 14, rough[round % 4], round % 3 == 0 ? 0.2 : 0);
		p.at[0] = (float)random_in(&seed, -0.6, 0.6);
		p.at[1] = (float)random_in(&seed, -0.6, 0.6);
		worst = sampled(&beyond, &facets, &p, extent);
		for (int i = 0; i < 12; i++) {
			const double error = beyond * (0.5 + 0.075 * i) + 1e-4;

			assert_int_equal(bound_look(&view, &facets, &p, extent, error), PSR_OK);
			if (bound_holds(&view, extent, error, NULL)) {
				assert_true(worst <= error + 1e-9);
				n_held++;
			} else {
				assert_true(beyond > 0.95 * error);
				n_failed++;
			}
		}
		facets_fini(&facets);
	}
	assert_true(n_held > 300 && n_failed > 300);
	bound_view_fini(&view);
}

/* The exact distances of rectangles that are known: beside a border, over a plane, and of a sphere's quadric. */
static void distances_that_are_known_are_found(void **state)
{
	const float corner[4][3] = { { -1, -1, 0 }, { 1, -1, 0 }, { 1, 1, 0 }, { -1, 1, 0 } };
	const float extent[2] = { 0.25f, 0.125f };
	struct bound_view view = { .seen = NULL };
	struct facets facets = { NULL };
	struct dpoint flat = point_of(0, 0), bowl = point_of(2, 0.5f);
	double place[2];

	(void)state;
	facets_add(&facets, corner[0], corner[1], corner[2]);
	facets_add(&facets, corner[0], corner[2], corner[3]);
	assert_int_equal(facets_sort(&facets), PSR_OK);
	flat.at[0] = 0.875f; /* over the border by an eighth */
	assert_int_equal(bound_look(&view, &facets, &flat, extent, 1), PSR_OK);
	assert_true(bound_holds(&view, extent, 0.1251, NULL));
	assert_false(bound_holds(&view, extent, 0.1249, place));
	assert_true(place[0] > 0.24);
	/* A diagonal of a bowl rises to (2 / 16 + 1 / 64) / 2. */
	assert_int_equal(bound_look(&view, &facets, &bowl, extent, 1), PSR_OK);
	assert_true(bound_holds(&view, extent, 0.0704, NULL));
	assert_false(bound_holds(&view, extent, 0.0703, NULL));
	assert_true(fabs(bound_least(&view, &facets, &bowl, extent, 0.01) - 0.08) < 1e-9);
	assert_true(bound_least(&view, &facets, &bowl, extent, 0.2) == 0.2);
	bound_view_fini(&view);
	facets_fini(&facets);
}

/* Many facets over each other, slivers, and facets that are points or lines. */
static void odd_facets_end_and_bound(void **state)
{
	const float o[3] = { 0, 0, 0 }, far[3] = { 1, 0, 0 }, near[3] = { 1, 1e-6f, 0 };
	const float corner[4][3] = { { -1, -1, 0 }, { 1, -1, 0 }, { 1, 1, 0 }, { -1, 1, 0 } };
	const float extent[2] = { 0.5f, 0.5f }, thin[2] = { 0.2f, 1e-4f };
	struct bound_view view = { .seen = NULL };
	struct facets facets = { NULL };
	struct dpoint p = point_of(0, 0);

	(void)state;
	assert_int_equal(facets_sort(&facets), PSR_OK);
	assert_true(isinf(bound_least(&view, &facets, &p, extent, 0.01)));
	facets_fini(&facets);
	facets_add(&facets, o, o, o);
	facets_add(&facets, o, far, far);
	facets_add(&facets, o, far, near);
	assert_int_equal(facets_sort(&facets), PSR_OK);
	p.at[0] = 0.5f;
	assert_int_equal(bound_look(&view, &facets, &p, thin, 0.1), PSR_OK);
	assert_true(bound_holds(&view, thin, 1.1e-4, NULL));
	assert_false(bound_holds(&view, thin, 0.9e-4, NULL));
	facets_fini(&facets);
	p.at[0] = 0;
	for (int i = 0; i < 100; i++) {
		facets_add(&facets, corner[0], corner[1], corner[2]);
		facets_add(&facets, corner[0], corner[2], corner[3]);
	}
	assert_int_equal(facets_sort(&facets), PSR_OK);
	assert_int_equal(bound_look(&view, &facets, &p, extent, 1e-5), PSR_OK);
	assert_true(bound_holds(&view, extent, 1e-5, NULL));
	facets_fini(&facets);
	bound_view_fini(&view);
}

/* The rectangle around a cell is over its corners as the cover asks, and the next smaller class is not. */
static void rectangles_around_cells_cover_them(void **state)
{
	uint64_t seed = 11;
	int n = 0;

	(void)state;
	for (int round = 0; round < 2000; round++) {
		const struct dpoint_cover_options options = { .sine = 0.3f, .slack = 2e-5f, .angle = 1, .height = 1, .looks = 255 };
		struct dpoint_candidate c = { .point = point_of((float)exp2(random_in(&seed, -3, 6)), (float)random_in(&seed, -1, 1)),
			                          .delta = { 1, 1 } };
		struct dpoint_cell cell = { .normal = { 0, 0, 1 } };

		for (int i = 0; i < 4; i++)
			for (int k = 0; k < 2; k++)
				cell.corner[i][k] = (float)random_in(&seed, -0.05, 0.05);
		if (!rectangle_around(c.delta, &c, &cell, &options))
			continue;
		n++;
		for (int k = -1; k < 2; k++) {
			const struct dpoint_candidate was = c;
			struct rectangle r;
			int is_over = 1;

			if (k >= 0)
				c.delta[k] *= 0.84f * 0.995f; /* the next class, and what the margin takes */
			rectangle_of(&r, &c, &options);
			rectangle_shorten(&r, options.slack);
			for (int i = 0; i < 4; i++)
				is_over &= fabsf(cell.corner[i][0]) <= r.extent[0] && fabsf(cell.corner[i][1]) <= r.extent[1];
			assert_int_equal(is_over, k < 0);
			c = was;
		}
	}
	assert_true(n > 500);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_holds_holds_at_all_places),
		cmocka_unit_test(distances_that_are_known_are_found),
		cmocka_unit_test(odd_facets_end_and_bound),
		cmocka_unit_test(rectangles_around_cells_cover_them),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

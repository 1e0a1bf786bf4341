#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "base/maths.h"
#include "base/random.h"
#include "base/vec.h"
#include "dpoint/trimmed.h"
#include "patches.h"

#define MOST 1024 /* triangles */
#define TURN 0.07
#define HEM 1e-4
#define OVERHANG 5e-4f

/* A patch that is there where triangles are. */
struct trimmed {
	double knot[2][16], control[81][4], corner[MOST][2];
	uint32_t triangle[MOST][3];
	uint8_t rim[MOST];
	struct psr_patch patch;
};

static void take(struct trimmed *t, const struct dpoint_patch *from)
{
	memset(t, 0, sizeof *t);
	for (int k = 0; k < 2; k++) {
		t->patch.degree[k] = from->degree[k];
		t->patch.n[k] = from->n[k];
		t->patch.knot[k] = t->knot[k];
		memcpy(t->knot[k], from->knot[k], (from->n[k] + (unsigned)from->degree[k] + 1) * sizeof **t->knot);
	}
	memcpy(t->control, from->control, from->n[0] * from->n[1] * sizeof *t->control);
	t->patch.control = t->control;
	t->patch.corner = t->corner;
	t->patch.triangle = t->triangle;
	t->patch.rim = t->rim;
}

/* All of the domain. */
static void take_whole(struct trimmed *t, const struct dpoint_patch *from)
{
	take(t, from);
	for (int i = 0; i < 4; i++)
		for (int k = 0; k < 2; k++)
			t->corner[i][k] = t->knot[k][(i >> k & 1) != 0 ? t->patch.n[k] : (unsigned)t->patch.degree[k]];
	memcpy(t->triangle[0], (const uint32_t[3]){ 0, 1, 3 }, sizeof *t->triangle);
	memcpy(t->triangle[1], (const uint32_t[3]){ 0, 3, 2 }, sizeof *t->triangle);
	t->rim[0] = 1 | 2;
	t->rim[1] = 2 | 4;
	t->patch.n_corners = 4;
	t->patch.n_triangles = 2;
}

/* -1..1 of the plane z = 0, less a polygon of n sides around the middle. */
static void take_plate(struct trimmed *t, double radius, uint32_t n)
{
	static const double line[4] = { 0, 0, 1, 1 };
	static const double control[4][4] = { { -1, -1, 0, 1 }, { -1, 1, 0, 1 }, { 1, -1, 0, 1 }, { 1, 1, 0, 1 } };
	const struct dpoint_patch plane = { { 1, 1 }, { 2, 2 }, { line, line }, control };

	take(t, &plane);
	for (uint32_t i = 0; i < n; i++) {
		const double x = cos(2 * M_PI * i / n), y = sin(2 * M_PI * i / n), far = fmax(fabs(x), fabs(y));
		const uint32_t in = 2 * i, out = in + 1, next = 2 * ((i + 1) % n);

		t->corner[in][0] = 0.5 + 0.5 * radius * x;
		t->corner[in][1] = 0.5 + 0.5 * radius * y;
		t->corner[out][0] = fabs(x) >= far ? (x > 0 ? 1 : 0) : 0.5 + 0.5 * x / far;
		t->corner[out][1] = fabs(y) >= far ? (y > 0 ? 1 : 0) : 0.5 + 0.5 * y / far;
		memcpy(t->triangle[in], (const uint32_t[3]){ in, out, next + 1 }, sizeof *t->triangle);
		memcpy(t->triangle[out], (const uint32_t[3]){ in, next + 1, next }, sizeof *t->triangle);
		t->rim[in] = 2 | 2 << 3;
		t->rim[out] = 4 | 4 << 3;
	}
	t->patch.n_corners = t->patch.n_triangles = 2 * n;
}

static struct dpoint_trimmed_options options(double cell)
{
	return (struct dpoint_trimmed_options){ .scale = 1, .cell = cell, .turn = TURN, .hem = HEM, .delta = 0.125f };
}

static void sample(struct dpoint_surface *surface, const struct trimmed *t, double cell)
{
	const struct dpoint_trimmed_options o = options(cell);
	struct psr_error err = { 0, "" };

	dpoint_surface_init(surface);
	if (dpoint_sample_trimmed(surface, &t->patch, &o, &err) != PSR_OK)
		fail_msg("%s", err.text);
	for (size_t i = 0; i < surface->n_cells; i++)
		for (int c = 0; c < 4; c++)
			for (int k = 0; k < 3; k++)
				assert_true(isfinite(surface->cell[i].corner[c][k]));
}

/* Of all cells of the surface; hems are as wide as their rims are long. */
static double area_of(const struct dpoint_surface *surface)
{
	double area = 0;

	for (size_t i = 0; i < surface->n_cells; i++) {
		const struct dpoint_cell *cell = &surface->cell[i];
		float a[3], b[3], n[3];

		v3f_sub(a, cell->corner[2], cell->corner[0]);
		v3f_sub(b, cell->corner[3], cell->corner[1]);
		v3f_cross(n, a, b);
		area += cell->part == DPOINT_BEYOND ? 0 : 0.5 * (double)v3f_length(n);
	}
	return area;
}

/* Chords of arcs of TURN are shorter by TURN^2 / 24 at most, along and across, and their middles are TURN^2 / 8 of a
 * radius further in. Rims of one side around the whole surface have no hem. */
static void check_area(const struct dpoint_surface *surface, double area, double rims)
{
	const double found = area_of(surface) - rims * HEM;

	if (!(found <= area * (1 + 1e-5) && found >= area * (1 - 5 * TURN * TURN / 24)))
		fail_msg("%.9g, not %.9g", found, area);
}

/* Facets of a body that is turned around z cover it, and are nowhere further off than they may be: their sides are that
 * near, and a triangle is at most 4/3 as far off as its worst side; places are floats. */
static void check_facets(const struct trimmed *t, double most, double area, double (*off)(const double at[3]))
{
	struct dpoint_trimmed_options o = options(0.05);
	struct dpoint_surface surface;
	double found = 0;

	o.facet = most;
	dpoint_surface_init(&surface);
	assert_int_equal(dpoint_sample_trimmed(&surface, &t->patch, &o, NULL), PSR_OK);
	for (size_t i = 0; i < surface.facets.n; i++) {
		const float (*corner)[3] = (const float (*)[3])surface.facets.facet[i].corner;
		float a[3], b[3], n[3];

		v3f_sub(a, corner[1], corner[0]);
		v3f_sub(b, corner[2], corner[0]);
		v3f_cross(n, a, b);
		found += 0.5 * (double)v3f_length(n);
		for (int part = 0; part < 28; part++) {
			const int u = part % 7, v = part / 7;
			double at[3];

			for (int k = 0; k < 3 && u + v <= 6; k++)
				at[k] = (double)corner[0][k] + (double)(u * a[k] + v * b[k]) / 6;
			if (u + v <= 6 && !(fabs(off(at)) <= 4.0 / 3 * most + 1e-6))
				fail_msg("%zu of %zu: %g, not %g", i, surface.facets.n, off(at), most);
		}
	}
	/* Inside by `most` of a radius of 0.25, along and across. */
	assert_true(found <= area * (1 + 1e-5) && found >= area * (1 - 4 * most / 0.25));
	dpoint_surface_fini(&surface);
}

static double off_plane(const double at[3])
{
	return at[2];
}

static double off_cylinder(const double at[3])
{
	return hypot(at[0], at[1]) - 0.25;
}

static void facets_are_as_near_as_asked(void **state)
{
	struct revolved s;
	struct trimmed t;

	(void)state;
	cylinder(&s, 0.25);
	take_whole(&t, &s.patch);
	for (double most = 1e-2; most > 1e-5; most /= 3)
		check_facets(&t, most, M_PI, off_cylinder);
	take_plate(&t, 0.5, 48);
	check_facets(&t, 1e-4, 4 - 0.5 * 48 * 0.25 * sin(2 * M_PI / 48), off_plane);
}

/* Places are floats, and words of curvatures a factor of 2^(1/12) off. */
static void check_point(const struct dpoint *p, double away, double lambda, double rho)
{
	assert_true(fabs(away) < 1e-6);
	assert_true(fabs(log2((double)p->lambda_u / lambda)) <= 1.0 / 12 + 1e-6);
	assert_true(fabs((double)p->rho - rho) <= 1.0 / 126 + 1e-6);
}

static void whole_surfaces_are_covered_by_points_of_their_curvatures(void **state)
{
	struct dpoint_surface surface;
	struct revolved s;
	struct trimmed t;

	(void)state;
	cylinder(&s, 0.25);
	take_whole(&t, &s.patch);
	sample(&surface, &t, 0.05);
	check_area(&surface, M_PI, 4);
	for (size_t i = 0; i < surface.n_candidates; i++) {
		const struct dpoint *p = &surface.candidate[i].point;

		check_point(p, hypot((double)p->at[0], (double)p->at[1]) - 0.25, -4, 0);
	}
	dpoint_surface_fini(&surface);
	revolve(&s, 0.6, 0.2, 0, 9);
	take_whole(&t, &s.patch);
	sample(&surface, &t, 0.05);
	check_area(&surface, 4 * M_PI * M_PI * 0.12, 0);
	for (size_t i = 0; i < surface.n_candidates; i++) {
		const struct dpoint *p = &surface.candidate[i].point;
		const double r = hypot((double)p->at[0], (double)p->at[1]);

		check_point(p, hypot(r - 0.6, (double)p->at[2]) - 0.2, -5, (r - 0.6) / r);
	}
	dpoint_surface_fini(&surface);
	revolve(&s, 0, 0.5, 6, 5);
	take_whole(&t, &s.patch);
	sample(&surface, &t, 0.05);
	assert_true(surface.n_bad == 0);
	check_area(&surface, M_PI, M_PI);
	for (size_t i = 0; i < surface.n_candidates; i++) {
		const struct dpoint *p = &surface.candidate[i].point;

		/* Next to a pole Su is short: its rounding counts the more. */
		if (hypot((double)p->at[0], (double)p->at[1]) > 0.01)
			check_point(p, (double)v3f_length(p->at) - 0.5, -2, 1);
	}
	dpoint_surface_fini(&surface);
}

static void a_plate_with_a_hole_is_covered_up_to_its_rim(void **state)
{
	const double radius[] = { 0.4, 0.07 };

	(void)state;
	for (int i = 0; i < 2; i++) {
		const uint32_t n = 256;
		const double side = 2 * radius[i] * sin(M_PI / n), hole = 0.5 * n * radius[i] * radius[i] * sin(2 * M_PI / n);
		struct dpoint_surface surface;
		struct trimmed t;

		take_plate(&t, radius[i], n);
		sample(&surface, &t, 0.02);
		/* A cell of 0.02 is rounded to 2^-24 along each side. */
		assert_true(fabs(area_of(&surface) - HEM * (8 + n * side) - (4 - hole)) < 1e-4);
		for (size_t c = 0; c < surface.n_cells; c++)
			for (int k = 0; k < 4; k++) {
				const float *at = surface.cell[c].corner[k];
				const double r = hypot((double)at[0], (double)at[1]);

				if (surface.cell[c].part == DPOINT_BEYOND)
					assert_true(r < radius[i] + 1e-6 || fmax(fabsf(at[0]), fabsf(at[1])) > 1 - 1e-6);
				else
					assert_true(r > radius[i] * cos(M_PI / n) - 1.01 * HEM);
			}
		dpoint_surface_fini(&surface);
	}
}

struct chosen {
	struct dpoint_surface surface;
	struct dpoint_cover cover;
	struct dpoint_choice choice;
	struct dpoint_cover_options options;
};

static void choose(struct chosen *c, const struct trimmed *t)
{
	memset(c, 0, sizeof *c);
	c->options = (struct dpoint_cover_options){ .sine = dpoint_sine(0.01), .slack = 2e-5f, .angle = (float)(2 * PSR_DEGREE),
		                                        .height = 1e-3f, .overhang = OVERHANG, .margin = 0.08f, .delta = 0.125f };
	sample(&c->surface, t, 0.02);
	assert_int_equal(dpoint_simplify(&c->choice, &c->cover, &c->surface, &c->options, 4, NULL, NULL), PSR_OK);
}

static void chosen_fini(struct chosen *c)
{
	dpoint_choice_fini(&c->choice);
	dpoint_cover_fini(&c->cover);
	dpoint_surface_fini(&c->surface);
}

static void corner_of(double at[2], const struct chosen *c, uint32_t i, double u, double v)
{
	const struct dpoint *p = &c->surface.candidate[i].point;
	float extent[2], across[3];

	dpoint_candidate_extent(extent, &c->surface.candidate[i], c->options.sine);
	v3f_cross(across, p->normal, p->u);
	for (int k = 0; k < 2; k++)
		at[k] = (double)p->at[k] + u * (double)(extent[0] * p->u[k]) + v * (double)(extent[1] * across[k]);
}

static int is_over(const struct chosen *c, uint32_t i, double x, double y)
{
	const struct dpoint *p = &c->surface.candidate[i].point;
	const float away[3] = { (float)x - p->at[0], (float)y - p->at[1], 0 - p->at[2] };
	float extent[2], across[3];

	dpoint_candidate_extent(extent, &c->surface.candidate[i], c->options.sine);
	v3f_cross(across, p->normal, p->u);
	return fabsf(v3f_dot(away, p->u)) <= extent[0] && fabsf(v3f_dot(away, across)) <= extent[1];
}

/* Chosen rectangles are over all of the plate, and reach over its rim by the overhang; by as much again where a cell of
 * 0.02 by a hem was mended (a class is 19 % of it). They were as far beyond as a cell is long. */
static void rectangles_end_at_rims_and_leave_no_hole(void **state)
{
	const double radius = 0.4;
	struct trimmed t;
	struct chosen c;
	uint64_t seed = 3;

	(void)state;
	take_plate(&t, radius, 256);
	choose(&c, &t);
	for (uint32_t i = 0; i < c.surface.n_candidates; i++)
		for (int s = 0; s <= 40 && c.choice.is_kept[i]; s++) {
			const double x = s / 20.0 - 1;
			const double side[4][2] = { { x, -1 }, { x, 1 }, { -1, x }, { 1, x } };

			for (int k = 0; k < 4; k++) {
				double at[2];

				corner_of(at, &c, i, side[k][0], side[k][1]);
				assert_true(hypot(at[0], at[1]) > radius - 2 * (double)OVERHANG);
				assert_true(fmax(fabs(at[0]), fabs(at[1])) < 1 + 2 * (double)OVERHANG);
			}
		}
	for (int n = 0; n < 20000; n++) {
		const double x = random_in(&seed, -1, 1), y = random_in(&seed, -1, 1);
		uint32_t i = 0;

		if (hypot(x, y) < radius)
			continue;
		while (i < c.surface.n_candidates && !(c.choice.is_kept[i] && is_over(&c, i, x, y)))
			i++;
		assert_true(i < c.surface.n_candidates);
	}
	/* A rectangle of the least breadth that the rim leaves, 2 sqrt(2 R overhang), has a place of it each 0.04. */
	assert_true(c.choice.n_kept < 4 * (2 * M_PI * radius + 8) / 0.04);
	chosen_fini(&c);
}

/* Two planes that meet at a knot of full multiplicity. */
static void creases_run_along_cells(void **state)
{
	static const double knot[5] = { 0, 0, 0.4, 1, 1 }, line[4] = { 0, 0, 1, 1 };
	static const double control[6][4] = { { -0.5, 0, 0, 1 }, { -0.5, 1, 0, 1 }, { 0, 0, 0.5, 1 }, { 0, 1, 0.5, 1 },
		                                  { 0.5, 0, 0, 1 }, { 0.5, 1, 0, 1 } };
	const struct dpoint_patch fold = { { 1, 1 }, { 3, 2 }, { knot, line }, control };
	struct dpoint_surface surface;
	struct trimmed t;

	(void)state;
	take_whole(&t, &fold);
	sample(&surface, &t, 0.03);
	assert_true(fabs(area_of(&surface) - sqrt(2.0) - HEM * (2 + 2 * sqrt(2.0))) < 1e-5);
	for (size_t i = 0; i < surface.n_cells; i++) {
		const float (*p)[3] = (const float (*)[3])surface.cell[i].corner;
		const float low = fminf(fminf(p[0][0], p[1][0]), fminf(p[2][0], p[3][0]));
		const float high = fmaxf(fmaxf(p[0][0], p[1][0]), fmaxf(p[2][0], p[3][0]));

		/* A hem is along its rim, which the crease crosses. */
		if (surface.cell[i].part != DPOINT_BEYOND && fabsf(p[0][1] - p[2][1]) > 0.01f)
			assert_true(low > -1e-6f || high < 1e-6f);
	}
	dpoint_surface_fini(&surface);
}

static void what_has_no_extent_has_no_cells(void **state)
{
	static const double knot[5] = { 0, 0, 1e-310, 1, 1 };
	struct dpoint_surface surface;
	struct trimmed t;

	(void)state;
	take_plate(&t, 0.4, 8);
	memset(t.corner, 0, sizeof t.corner);
	sample(&surface, &t, 0.1);
	assert_true(surface.n_cells == 0 && surface.n_candidates == 0);
	dpoint_surface_fini(&surface);
	/* All of it is one place. */
	take_plate(&t, 0.4, 8);
	memset(t.control, 0, sizeof t.control);
	for (int i = 0; i < 4; i++)
		t.control[i][3] = 1;
	sample(&surface, &t, 0.1);
	assert_true(surface.n_candidates == 0 && surface.n_bad > 0);
	dpoint_surface_fini(&surface);
	/* A span that is too short to be told: what is no number is left out, the rest is there. */
	take_plate(&t, 0.4, 8);
	t.patch.n[0] = 3;
	memcpy(t.knot[0], knot, sizeof knot);
	memmove(t.control[2], t.control[0], 4 * sizeof *t.control);
	sample(&surface, &t, 0.1);
	assert_true(surface.n_candidates > 100);
	dpoint_surface_fini(&surface);
}

static void what_is_too_much_is_refused(void **state)
{
	const struct dpoint_trimmed_options o = options(1e-7);
	struct dpoint_surface surface;
	struct psr_error err = { 0, "" };
	struct trimmed t;

	(void)state;
	take_plate(&t, 0.4, 256);
	dpoint_surface_init(&surface);
	assert_int_equal(dpoint_sample_trimmed(&surface, &t.patch, &o, &err), PSR_ERR_LIMIT);
	assert_non_null(strstr(err.text, "build blocks"));
	dpoint_surface_fini(&surface);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(whole_surfaces_are_covered_by_points_of_their_curvatures),
		cmocka_unit_test(facets_are_as_near_as_asked),
		cmocka_unit_test(a_plate_with_a_hole_is_covered_up_to_its_rim),
		cmocka_unit_test(rectangles_end_at_rims_and_leave_no_hole),
		cmocka_unit_test(creases_run_along_cells),
		cmocka_unit_test(what_has_no_extent_has_no_cells),
		cmocka_unit_test(what_is_too_much_is_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "base/vec.h"
#include "dpoint/sample.h"
#include "patches.h"

#define OVERHANG 5e-4f

static const struct dpoint_cover_options options = {
	.sine = 0.0893f, .slack = 1e-5f, .angle = 0.035f, .height = 0.002f, .overhang = OVERHANG,
};

/* A parallelogram: a corner, and two sides from it. */
static void add_plane(struct dpoint_surface *surface, const double corner[3], const double a[3], const double b[3])
{
	static const double line[4] = { 0, 0, 1, 1 };
	static const struct dpoint_uniform uniform = { .n = 32, .cells = 2, .scale = 1, .delta = 0.25f };
	double control[4][4];
	const struct dpoint_patch patch = { { 1, 1 }, { 2, 2 }, { line, line }, (const double (*)[4])control };

	for (int i = 0; i < 4; i++) {
		for (int k = 0; k < 3; k++)
			control[i][k] = corner[k] + (i >> 1) * a[k] + (i & 1) * b[k];
		control[i][3] = 1;
	}
	assert_int_equal(dpoint_sample_uniform(surface, &patch, &uniform), PSR_OK);
}

/* How far the corners of the candidate's rectangle reach along an axis. */
static double reach(const struct dpoint_candidate *c, int axis)
{
	float extent[2], v[3];

	dpoint_candidate_extent(extent, c, options.sine);
	v3f_cross(v, c->point.normal, c->point.u);
	return (double)c->point.at[axis] + fabs((double)(extent[0] * c->point.u[axis])) + fabs((double)(extent[1] * v[axis]));
}

/* Two squares of 2 cross at a right angle. Rectangles that reach no border, but for a cell of 1/32 and the overhang,
 * stay as they are. */
static void sheets_that_cross_end_no_rectangle(void **state)
{
	struct dpoint_surface surface;
	size_t n_inner = 0, n_crossed = 0;

	(void)state;
	dpoint_surface_init(&surface);
	add_plane(&surface, (const double[3]){ -1, -1, 0 }, (const double[3]){ 2, 0, 0 }, (const double[3]){ 0, 2, 0 });
	add_plane(&surface, (const double[3]){ 0.01, -1, -1 }, (const double[3]){ 0, 2, 0 }, (const double[3]){ 0, 0, 2 });
	assert_int_equal(dpoint_fit(&surface, &options, NULL, NULL), PSR_OK);
	for (size_t i = 0; i < surface.n_candidates; i++) {
		const struct dpoint_candidate *c = &surface.candidate[i];

		if (fabsf(c->point.at[0]) > 0.65f || fabsf(c->point.at[1]) > 0.65f || fabsf(c->point.at[2]) > 0.65f)
			continue;
		n_inner++;
		n_crossed += fabsf(c->point.at[0] - 0.01f) < 0.25f && fabsf(c->point.at[2]) < 0.25f;
		assert_true(c->delta[0] == 0.25f && c->delta[1] == 0.25f);
	}
	assert_true(n_crossed > 300 && n_inner > n_crossed);
	dpoint_surface_fini(&surface);
}

/* An edge of 70 degrees: the second sheet goes back below the first one, which it ends. Cells there are 1/64 long, and
 * those of the second row below the edge may end rectangles, too. */
static void a_rectangle_ends_at_an_acute_edge(void **state)
{
	const double back[3] = { -0.34202014332566873, 0, -0.93969262078590838 };
	struct dpoint_surface surface;
	size_t n_near = 0;

	(void)state;
	dpoint_surface_init(&surface);
	add_plane(&surface, (const double[3]){ -1, -1, 0 }, (const double[3]){ 1, 0, 0 }, (const double[3]){ 0, 2, 0 });
	add_plane(&surface, (const double[3]){ 0, -1, 0 }, back, (const double[3]){ 0, 2, 0 });
	for (size_t i = 0; i < surface.n_cells / 2; i++) {
		assert_true(surface.cell[i].normal[2] > 0);
		assert_true(surface.cell[surface.n_cells / 2 + i].normal[0] > 0);
	}
	assert_int_equal(dpoint_fit(&surface, &options, NULL, NULL), PSR_OK);
	for (size_t i = 0; i < surface.n_candidates / 2; i++) {
		n_near += reach(&surface.candidate[i], 0) > -1.0 / 64 - (double)OVERHANG;
		/* A place is a float of about 1. */
		assert_true(reach(&surface.candidate[i], 0) <= (double)OVERHANG + 1e-6);
	}
	assert_true(n_near > 100);
	dpoint_surface_fini(&surface);
}

/* A quarter of the cylinder is six parts of two cells. A turn of rational quarters is 0.83 to 1.17 times as fast as the
 * mean: from the middle of a part to its side it is at least 0.83 r pi / 24, 0.108 r; of a cell at most 0.077 r. An
 * extent is 0.0893 r. */
static void samples_whose_rectangles_are_small_come_by_cells(void **state)
{
	struct revolved wall;

	(void)state;
	cylinder(&wall, 0.05);
	for (int k = 0; k < 2; k++) {
		struct dpoint_uniform uniform = { .n = 6, .cells = 2, .scale = 1, .delta = 0.5f, .sine = k ? options.sine : 0 };
		struct dpoint_surface surface;
		struct dpoint_cover cover;
		struct dpoint_choice choice;

		dpoint_surface_init(&surface);
		assert_int_equal(dpoint_sample_uniform(&surface, &wall.patch, &uniform), PSR_OK);
		assert_int_equal(surface.n_candidates, 4 * 36 * (k ? 5 : 1));
		assert_int_equal(dpoint_cover_init(&cover, &surface, &options, NULL, NULL), PSR_OK);
		assert_int_equal(dpoint_choose(&choice, &cover), PSR_OK);
		assert_int_equal(choice.n_holes, k ? 0 : surface.n_cells);
		for (size_t i = 0; i < surface.n_candidates; i++)
			assert_true(surface.candidate[i].cell < surface.n_cells);
		dpoint_choice_fini(&choice);
		dpoint_cover_fini(&cover);
		dpoint_surface_fini(&surface);
	}
}

/* A floor of 1/8 by 1/2, and a wall of 0.1 at its end. Rectangles that are narrower than the overhang along the wall
 * end there, but for the overhang, as wide ones do. A place is a float below 1. */
static void a_rectangle_narrower_than_the_overhang_ends_along_its_length(void **state)
{
	struct dpoint_surface surface;

	(void)state;
	dpoint_surface_init(&surface);
	add_plane(&surface, (const double[3]){ -0.125, 0, 0 }, (const double[3]){ 0.125, 0, 0 }, (const double[3]){ 0, 0.5, 0 });
	add_plane(&surface, (const double[3]){ 0, 0, 0 }, (const double[3]){ 0, 0, 0.1 }, (const double[3]){ 0, 0.5, 0 });
	for (size_t i = 0; i < surface.n_candidates; i++) {
		struct dpoint_candidate *c = &surface.candidate[i];
		float v[3];
		int across;

		v3f_cross(v, c->point.normal, c->point.u);
		across = fabsf(c->point.u[1]) > fabsf(v[1]) ? 0 : 1;
		c->delta[across] = dpoint_delta_of_class(dpoint_delta_class(0.8f * OVERHANG));
	}
	assert_int_equal(dpoint_fit(&surface, &options, NULL, NULL), PSR_OK);
	for (size_t i = 0; i < surface.n_candidates / 2; i++)
		assert_true(reach(&surface.candidate[i], 0) <= (double)OVERHANG + 1e-6);
	dpoint_surface_fini(&surface);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(sheets_that_cross_end_no_rectangle),
		cmocka_unit_test(a_rectangle_ends_at_an_acute_edge),
		cmocka_unit_test(a_rectangle_narrower_than_the_overhang_ends_along_its_length),
		cmocka_unit_test(samples_whose_rectangles_are_small_come_by_cells),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

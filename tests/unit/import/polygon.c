#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "import/ply/polygon.h"

static double turn(const double *a, const double *b, const double *c)
{
	return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Every triangle turns as the polygon does, and together they have its area (all coordinates are small integers). */
static void assert_tiled(const double (*p)[3], unsigned n, double twice_area)
{
	unsigned cut[POLYGON_MAX_CLIP][3];
	double sum = 0.0;

	polygon_cut(cut, p, n);
	for (unsigned t = 0; t + 2 < n; t++) {
		double a;

		assert_true(cut[t][0] < n && cut[t][1] < n && cut[t][2] < n);
		a = turn(p[cut[t][0]], p[cut[t][1]], p[cut[t][2]]);
		assert_true(a * twice_area >= 0.0);
		sum += a;
	}
	assert_true(sum == twice_area);
}

static void concave_polygons_are_tiled(void **state)
{
	(void)state;
	static const double arrow[4][3] = { { 0, 0, 5 }, { 4, -4, 5 }, { 1, 0, 5 }, { 4, 4, 5 } };
	static const double ell[6][3] = { { 0, 0, 0 }, { 3, 0, 0 }, { 3, 1, 0 }, { 1, 1, 0 }, { 1, 3, 0 }, { 0, 3, 0 } };
	double reversed[6][3];

	assert_tiled(arrow, 4, 8);
	assert_tiled(ell, 6, 10);
	for (int i = 0; i < 6; i++)
		memcpy(reversed[i], ell[5 - i], sizeof ell[i]);
	assert_tiled((const double(*)[3])reversed, 6, -10);
}

static void a_comb_is_tiled(void **state)
{
	(void)state;
	double comb[202][3] = { { 0 } };
	unsigned n = 0;

	/* 100 teeth upwards: area of each 1/2 above a bar of height 1 */
	comb[n][0] = 0, comb[n++][1] = -1;
	comb[n][0] = 200, comb[n++][1] = -1;
	for (int i = 100; i > 0; i--) {
		comb[n][0] = 2 * i, comb[n++][1] = 0;
		comb[n][0] = 2 * i - 1, comb[n++][1] = 3;
	}
	comb[1][0] = 200;
	/* teeth of base 2 and height 3, the last one ending at (1, 3) - (0, -1) */
	double twice = 0.0;

	for (unsigned i = 0; i < n; i++)
		twice += comb[i][0] * comb[(i + 1) % n][1] - comb[(i + 1) % n][0] * comb[i][1];
	assert_tiled((const double(*)[3])comb, n, twice);
}

static void upright_and_degenerate_polygons_end(void **state)
{
	(void)state;
	static const double wall[4][3] = { { 0, 0, 0 }, { 0, 2, 0 }, { 0, 0.5, 0.5 }, { 0, 0, 2 } };
	static const double bow[4][3] = { { 0, 0, 0 }, { 1, 1, 0 }, { 1, 0, 0 }, { 0, 1, 0 } };
	static const double line[5][3] = { { 0, 0, 0 }, { 1, 0, 0 }, { 2, 0, 0 }, { 3, 0, 0 }, { NAN, 0, 0 } };
	unsigned cut[3][3];

	/* corner 2 is the reflex one: the diagonal has to start there */
	polygon_cut(cut, wall, 4);
	for (int t = 0; t < 2; t++)
		assert_true(cut[t][0] == 2 || cut[t][1] == 2 || cut[t][2] == 2);
	assert_true(cut[0][0] == 0 || cut[0][1] == 0 || cut[0][2] == 0);
	assert_true(cut[1][0] == 0 || cut[1][1] == 0 || cut[1][2] == 0);
	polygon_cut(cut, bow, 4);
	polygon_cut(cut, line, 5);
	for (int t = 0; t < 3; t++)
		for (int c = 0; c < 3; c++)
			assert_true(cut[t][c] < 5);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(concave_polygons_are_tiled),
		cmocka_unit_test(a_comb_is_tiled),
		cmocka_unit_test(upright_and_degenerate_polygons_end),
	};

	return cmocka_run_group_tests_name("import_polygon", tests, NULL, NULL);
}

/* Differential points where their numbers are worst ([K] 4.1, 5.1). */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include "base/random.h"
#include "base/vec.h"
#include "dpoint/lean.h"
#include "lib/blocks.h"

/* 2^-24 */
#define E 0x1p-24

static void the_arc_of_sines_is_within_its_bound(void **state)
{
	(void)state;
	/* Every float from 2^-40 to 1 would be too many: a prime stride, and the ends of both pieces. */
	for (uint32_t bits = psr_bits_from_float(0x1p-40f); bits < psr_bits_from_float(1.0f); bits += 1009) {
		const float w = psr_float_from_bits(bits);

		assert_true(fabsl(dpoint_asin_ratio(w) - asinl(w) / w) <= 1e-6L);
		assert_true(dpoint_asin_ratio(-w) == dpoint_asin_ratio(w));
	}
	for (int i = -200; i <= 200; i++) {
		const float half = psr_float_from_bits(psr_bits_from_float(0.5f) + (uint32_t)i);
		const float one = psr_float_from_bits(psr_bits_from_float(1.0f) - (uint32_t)abs(i));

		assert_true(fabsl(dpoint_asin_ratio(half) - asinl(half) / half) <= 1e-6L);
		assert_true(fabsl(dpoint_asin_ratio(one) - asinl(one) / one) <= 1e-6L);
	}
	assert_true(dpoint_asin_ratio(0.0f) == 1.0f);
}

static void beyond_the_semicircle_the_arc_stays_at_a_quarter(void **state)
{
	(void)state;
	assert_true(fabs(dpoint_asin_ratio(1.0f) - 1.5707963267948966) < 1e-7);
	for (float w = 1.0f; w < 1e30f; w *= 1.7f)
		assert_true(dpoint_asin_ratio(w) == dpoint_asin_ratio(1.0f) &&
		            dpoint_asin_ratio(-w) == dpoint_asin_ratio(1.0f));
	assert_true(dpoint_asin_ratio(INFINITY) == dpoint_asin_ratio(1.0f));
}

/* (6) in long doubles, with w clamped. */
static void exact_normal(long double n[3], long double lambda, long double rho, long double u, long double v)
{
	const long double r = sqrtl(u * u + v * v), psi = r > 0 ? (u * u + rho * v * v) / r : 0;
	const long double w = fmaxl(fminl(lambda * psi, 1), -1);
	const long double k = fabsl(w) > 0 ? lambda * asinl(w) / w : lambda;

	n[0] = -u * k;
	n[1] = -rho * v * k;
	n[2] = 1;
}

/* From flat to DPOINT_MOST_LAMBDA, for any rho and any place of an extent of epsilon 0 to 1, corners included. lambda u
 * is at most 1, lambda rho v too, so k u is at most pi/2, and off by the arc's 1e-6, by what the rounding of w moves
 * it, and by five roundings. w is off by eight roundings, and the arc's slope is 1 / sqrt(1 - w^2): within a of 1 the
 * arc changes by sqrt(2 a) at most. */
static void normals_are_those_of_the_formula(void **state)
{
	const double bound = 1e-6 + sqrt(2 * 8 * E) * 1.6 + 5 * 1.6 * E;
	const double near = 1e-6 + 40 * E; /* |w| <= 1/2: the arc's ratio has a slope below 0.5 there */
	uint64_t seed = 1;

	(void)state;
	for (int i = 0; i < HARD_CASES(300000); i++) {
		static const float rhos[5] = { -1, 0, 1, -0x1p-20f, 0x1p-126f };
		const uint32_t which = random_below(&seed, 10);
		const float rho = which < 5 ? rhos[which] : (float)random_in(&seed, -1, 1);
		const float sign = random_below(&seed, 2) ? 1.0f : -1.0f;
		const float lambda = which == 9 ? 0 : sign * (float)exp2(random_in(&seed, -6, 16));
		const struct dpoint p = { .lambda_u = lambda, .rho = rho };
		const struct dpoint_limit limit = { dpoint_sine(random_in(&seed, 0, 1)), { 1, 1 } };
		const int corner = random_below(&seed, 3) == 0;
		float extent[2], n[3], u, v, h;
		long double exact[3];
		double w, most;

		dpoint_extent(extent, &p, &limit);
		u = extent[0] * (corner ? 1.0f : (float)random_in(&seed, -1, 1));
		v = extent[1] * (corner ? -1.0f : (float)random_in(&seed, -1, 1));
		dpoint_normal_at(n, lambda, rho, u, v);
		exact_normal(exact, lambda, rho, u, v);
		w = fabs((double)dpoint_sine_at(lambda, rho, u, v));
		most = (w <= 0.5 ? near : bound) + 1e-30;
		for (int k = 0; k < 3; k++) {
			assert_true(fabsf(n[k]) <= 1.5708f);
			assert_true(fabsl(n[k] - exact[k]) <= most);
		}
		/* S_p is no further from the plane than from the point: its chord is below a right angle's. */
		h = dpoint_height_at(lambda, rho, u, v);
		assert_true(fabsf(h) <= sqrtf(u * u + v * v) * 1.000001f);
	}
}

static void extents_are_where_the_semicircles_rise_by_epsilon(void **state)
{
	uint64_t seed = 2;

	(void)state;
	for (int i = 0; i < HARD_CASES(20000); i++) {
		const double epsilon = random_in(&seed, 0.001, 1);
		const float lambda = (float)exp2(random_in(&seed, -5, 16));
		const struct dpoint p = { .lambda_u = -lambda, .rho = (float)random_in(&seed, -1, 1) };
		const struct dpoint_limit limit = { dpoint_sine(epsilon), { 1e30f, 1e30f } };
		float extent[2];

		dpoint_extent(extent, &p, &limit);
		/* Near epsilon = 1 the height's slope is infinite: 8 roundings of the sine, as above. */
		assert_true(fabs(lambda * fabs(dpoint_height_at(p.lambda_u, p.rho, extent[0], 0)) - epsilon) <= sqrt(16 * E));
		assert_true(extent[1] >= extent[0]);
	}
}

static void a_flat_point_reaches_to_delta(void **state)
{
	const struct dpoint_limit limit = { 0, { 3, 1e30f } };
	const struct dpoint plane = { .lambda_u = 0 }, cylinder = { .lambda_u = 2, .rho = 0 };
	const struct dpoint_limit wide = { 0.1f, { 3, 7 } };
	float extent[2], n[3];

	(void)state;
	dpoint_extent(extent, &plane, &limit);
	assert_true(extent[0] == 3 && extent[1] == 1e30f);
	dpoint_normal_at(n, 0, 0, 3, 7);
	assert_true(n[0] == 0 && n[1] == 0 && n[2] == 1 && dpoint_height_at(0, 0, 3, 7) == 0);
	dpoint_extent(extent, &cylinder, &wide);
	assert_true(extent[0] == 0.05f && extent[1] == 7);
}

/* The semicircle of (u, v) is as wide as its radius where the sine is 1. Corners of a sphere's extent are sqrt(2) sines
 * away, so they reach it from 2 epsilon - epsilon^2 = 1/2 on. */
static void corners_reach_the_semicircles_end_from_epsilon_0_293(void **state)
{
	const struct dpoint p = { .lambda_u = 5, .rho = 1 };
	float below[2], above[2];

	(void)state;
	dpoint_extent(below, &p, &(struct dpoint_limit){ dpoint_sine(0.292), { 1, 1 } });
	dpoint_extent(above, &p, &(struct dpoint_limit){ dpoint_sine(0.294), { 1, 1 } });
	assert_true(dpoint_sine_at(5, 1, below[0], below[1]) < 1);
	assert_true(dpoint_sine_at(5, 1, above[0], above[1]) > 1);
	assert_true(dpoint_height_at(5, 1, above[0], above[1]) == sqrtf(above[0] * above[0] + above[1] * above[1]) /
	                                                          dpoint_sine_at(5, 1, above[0], above[1]));
}

static struct dpoint_local local_of(double a, double b, double c)
{
	return (struct dpoint_local){ { 0, 0, 0 }, { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }, { a, b, c } };
}

static void umbilic_points_have_a_direction(void **state)
{
	static const double lambdas[] = { 0, 1, -1, 1e-9, 65536, -1e-300 };

	(void)state;
	for (size_t i = 0; i < sizeof lambdas / sizeof *lambdas; i++) {
		for (int k = -1; k <= 1; k++) {
			const double l = lambdas[i];
			const struct dpoint_local local = local_of(l, k * 1e-13 * l, l);
			struct dpoint p;

			assert_int_equal(dpoint_make(&p, &local), DPOINT_MADE);
			assert_true(p.u[0] == 1 && p.u[1] == 0);
			assert_true(p.lambda_u == (fabs(l) < 1e-30 ? 0 : (float)l) && p.rho == (fabs(l) < 1e-30 ? 0 : 1));
		}
	}
}

static void saddles_and_cylinders_have_rho_at_its_ends(void **state)
{
	struct dpoint p;

	(void)state;
	for (int turned = 0; turned < 3; turned++) {
		const struct dpoint_local saddle = turned == 0 ? local_of(3, 0, -3) : turned == 1 ? local_of(-3, 0, 3)
		                                                                               : local_of(0, 3, 0);
		assert_int_equal(dpoint_make(&p, &saddle), DPOINT_MADE);
		assert_true(fabsf(p.lambda_u) == 3 && p.rho == -1);
	}
	const struct dpoint_local cylinder = local_of(0, 0, -4);

	assert_int_equal(dpoint_make(&p, &cylinder), DPOINT_MADE);
	assert_true(p.lambda_u == -4 && p.rho == 0 && fabsf(p.u[1]) == 1);
}

static void what_is_not_finite_makes_no_point(void **state)
{
	static const double bad[] = { NAN, INFINITY, -INFINITY };
	struct dpoint p;

	(void)state;
	for (int i = 0; i < 3; i++) {
		for (int k = 0; k < 3; k++) {
			struct dpoint_local local = local_of(1, 0, 1);

			local.shape[k] = bad[i];
			assert_int_equal(dpoint_make(&p, &local), DPOINT_BAD);
			local = local_of(1, 0, 1);
			local.at[k] = bad[i];
			assert_int_equal(dpoint_make(&p, &local), DPOINT_BAD);
			local = local_of(1, 0, 1);
			local.axis[k][1] = bad[i];
			assert_int_equal(dpoint_make(&p, &local), DPOINT_BAD);
		}
	}
}

static void curvatures_beyond_the_bound_are_brought_to_it(void **state)
{
	static const double sizes[] = { 65537, 1e10, 1e160, 1.7e308 };
	struct dpoint p;

	(void)state;
	for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
		const struct dpoint_local cusp = local_of(sizes[i], 0, 1), ball = local_of(-sizes[i], 0, -sizes[i]);
		const struct dpoint_local saddle = local_of(0, sizes[i], 0);

		assert_int_equal(dpoint_make(&p, &cusp), DPOINT_CLAMPED);
		assert_true(p.lambda_u == 65536 && fabs(p.rho * 65536 - 1) < 1e-6);
		assert_int_equal(dpoint_make(&p, &ball), DPOINT_CLAMPED);
		assert_true(p.lambda_u == -65536 && p.rho == 1);
		assert_int_equal(dpoint_make(&p, &saddle), DPOINT_CLAMPED);
		assert_true(p.lambda_u == 65536 && p.rho == -1);
	}
}

/* A face of three normals that are one, this many degrees off its own, or off its back's: the nearer one counts. Its
 * points lean by that within half a step of 2^-12 along u and v. Beyond 81 degrees a normal counts as one of 0.15 along
 * the face's, and leans by 79 at least, the same way. Where there is none nothing leans. */
static void normals_across_a_face_and_behind_it_lean_as_far_as_words_hold(void **state)
{
	static const double degrees[] = { 0, 1e-9, 30, 60, 80, 81, 82, 89.999, 90, 90.001, 120, 180, -1 };
	const float beyond[3] = { 1e-3f, 1e-3f, 1e-3f };

	(void)state;
	for (size_t i = 0; i < sizeof degrees / sizeof *degrees; i++) {
		struct dpoint_face face = { .corner = { { 0, 0, 0.5f }, { 0.1f, 0, 0.5f }, { 0, 0.1f, 0.5f } } };
		const double angle = degrees[i] * PSR_DEGREE, off = fmin(degrees[i], 180 - degrees[i]);
		const double normal[3] = { 0.6 * sin(angle), 0.8 * sin(angle), degrees[i] < 0 ? 0 : cos(angle) };
		struct dpoint_surface surface;

		for (int k = 0; k < 9; k++)
			face.normal[k / 3][k % 3] = degrees[i] < 0 ? 0 : (float)normal[k % 3];
		dpoint_surface_init(&surface);
		assert_int_equal(tile_face(&surface, &face, beyond, 0, 0.125f), PSR_OK);
		assert_true(surface.n_lean > 0 && surface.n_lean == surface.n_candidates);
		for (size_t t = 0; t < surface.n_lean; t++) {
			const struct dpoint *p = &surface.candidate[t].point;
			const struct dpoint_lean *lean = &surface.lean[t];
			const double x = lean->at[0] * (double)DPOINT_LEAN_STEP, y = lean->at[1] * (double)DPOINT_LEAN_STEP;
			const double tangent = sqrt(x * x + y * y);
			float across[3];
			double along[2];

			v3f_cross(across, p->normal, p->u);
			for (int k = 0; k < 2; k++)
				along[k] = x * p->u[k] + y * across[k];
			for (int k = 0; k < 4; k++)
				assert_true(dpoint_lean_by(lean->by[k / 2][k % 2]) == 0);
			/* Packed normals are 0.23 degrees off. */
			if (degrees[i] < 0)
				assert_true(tangent == 0);
			else if (off < 81)
				assert_true(fabs(atan(tangent) - off * PSR_DEGREE) < 0.25 * PSR_DEGREE + 0x1p-12);
			else
				assert_true(atan(tangent) > 79 * PSR_DEGREE && atan(tangent) < 82 * PSR_DEGREE);
			if (off > 1)
				assert_true(0.6 * along[0] + 0.8 * along[1] > 0.99 * tangent);
		}
		dpoint_surface_fini(&surface);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_arc_of_sines_is_within_its_bound),
		cmocka_unit_test(beyond_the_semicircle_the_arc_stays_at_a_quarter),
		cmocka_unit_test(normals_are_those_of_the_formula),
		cmocka_unit_test(extents_are_where_the_semicircles_rise_by_epsilon),
		cmocka_unit_test(a_flat_point_reaches_to_delta),
		cmocka_unit_test(corners_reach_the_semicircles_end_from_epsilon_0_293),
		cmocka_unit_test(umbilic_points_have_a_direction),
		cmocka_unit_test(saddles_and_cylinders_have_rho_at_its_ends),
		cmocka_unit_test(what_is_not_finite_makes_no_point),
		cmocka_unit_test(curvatures_beyond_the_bound_are_brought_to_it),
		cmocka_unit_test(normals_across_a_face_and_behind_it_lean_as_far_as_words_hold),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <string.h>
#include <cmocka.h>
#include "base/direction.h"
#include "base/random.h"
#include "base/vec.h"
#include "dpoint/dpoint.h"

static void random_unit(double d[3], uint64_t *seed)
{
	double size;

	do {
		for (int k = 0; k < 3; k++)
			d[k] = random_in(seed, -1, 1);
		size = v3d_dot(d, d);
	} while (size > 1 || size < 0.01);
	v3d_normalize(d, d);
}

/* A point of any curvatures: lambda_u from 2^-8 to 2^18 in magnitude. */
static enum dpoint_made random_point(struct dpoint *point, struct dpoint_local *local, uint64_t *seed)
{
	double normal[3], lambda, rho, angle, s, c;

	random_unit(normal, seed);
	psr_direction_basis(normal, local->axis);
	angle = random_in(seed, 0, 3.14159);
	s = sin(angle);
	c = cos(angle);
	for (int k = 0; k < 3; k++)
		local->at[k] = random_in(seed, -1, 1);
	lambda = exp2(random_in(seed, -8, 18)) * (random_below(seed, 2) ? 1 : -1);
	rho = random_in(seed, -1, 1);
	local->shape[0] = lambda * (c * c + rho * s * s);
	local->shape[1] = lambda * (1 - rho) * s * c;
	local->shape[2] = lambda * (s * s + rho * c * c);
	return dpoint_make(point, local);
}

/* The point's own second order is what it was made from: rounding of doubles, then of floats. */
static void a_made_point_has_the_shape_that_it_was_made_of(void **state)
{
	uint64_t seed = 1;

	(void)state;
	for (int i = 0; i < 20000; i++) {
		struct dpoint_local local;
		struct dpoint p;
		enum dpoint_made made = random_point(&p, &local, &seed);
		const double size = fmax(fmax(fabs(local.shape[0]), fabs(local.shape[1])), fabs(local.shape[2]));
		double u[3], c, s, l, m;

		if (made == DPOINT_CLAMPED)
			continue;
		assert_int_equal(made, DPOINT_MADE);
		for (int k = 0; k < 3; k++)
			u[k] = p.u[k];
		c = v3d_dot(u, local.axis[0]);
		s = v3d_dot(u, local.axis[1]);
		l = p.lambda_u;
		m = l * p.rho;
		assert_true(fabsf(p.rho) <= 1);
		/* Each of c, s, l, rho is off by 2^-23 of its size at most; the product of four by four of them. */
		assert_true(fabs(l * c * c + m * s * s - local.shape[0]) <= size * 0x1p-19);
		assert_true(fabs((l - m) * c * s - local.shape[1]) <= size * 0x1p-19);
		assert_true(fabs(l * s * s + m * c * c - local.shape[2]) <= size * 0x1p-19);
	}
}

/* Half a step along both tangents, where these cross the triangle's centre: an angle is less than its tangent. Steps of
 * a triangle, eight along each tangent, reach over its corners: their greatest distance is checked, too. */
static double normal_radius(void)
{
	double worst = 1;

	for (unsigned i = 0; i < PSR_DIRECTIONS; i++) {
		double center[3], corner[3][3];

		psr_direction_center(6, i, center);
		psr_direction_corners(6, i, corner);
		for (int k = 0; k < 3; k++)
			worst = fmin(worst, v3d_dot(center, corner[k]));
	}
	assert_true(tan(acos(worst)) <= 4 * (double)DPOINT_FINE_STEP);
	return sqrt(0.5) * (double)DPOINT_FINE_STEP + 1e-6;
}

static void an_unpacked_point_is_within_the_promised_steps(void **state)
{
	const float low[3] = { -1, -0.5f, -1 }, high[3] = { 1, 1, 1 };
	const double radius = normal_radius();
	struct dpoint_box box;
	uint64_t seed = 2;

	(void)state;
	dpoint_box_make(&box, low, high);
	for (int i = 0; i < 20000; i++) {
		struct dpoint_local local;
		struct dpoint p, q;
		struct dpoint_word word, again;
		double n[3], was_n[3], u[3], was_u[3], across[3], size;

		random_point(&p, &local, &seed);
		p.attr = random_next(&seed);
		if (p.at[1] < -0.5f)
			p.at[1] = -0.5f;
		dpoint_pack(&word, &p, &box);
		assert_true(dpoint_word_is_valid(&word));
		dpoint_unpack(&q, &word, &box);
		for (int k = 0; k < 3; k++) {
			assert_true(fabs((double)q.at[k] - p.at[k]) <= 0.5 * box.step[k] + 0x1p-22);
			n[k] = q.normal[k];
			was_n[k] = p.normal[k];
			u[k] = q.u[k];
			was_u[k] = p.u[k];
		}
		v3d_cross(across, n, was_n);
		assert_true(v3d_dot(n, was_n) > 0 && asin(v3d_length(across)) <= radius);
		assert_true(fabs(v3d_dot(n, u)) < 1e-6 && fabs(v3d_length(u) - 1) < 1e-6);
		v3d_add_scaled(was_u, was_u, -v3d_dot(was_u, n), n);
		v3d_normalize(was_u, was_u);
		v3d_cross(across, u, was_u);
		assert_true(asin(v3d_length(across)) <= 3.14159266 / 256 + 1e-6);
		size = fmin(fabs(p.lambda_u), DPOINT_MOST_LAMBDA);
		if (size < DPOINT_LEAST_LAMBDA) {
			assert_true(fabs((double)q.lambda_u - p.lambda_u) <= 0.5 * DPOINT_LEAST_LAMBDA);
		} else {
			assert_true(q.lambda_u / p.lambda_u > 0);
			assert_true(fabs(log2(fabs(q.lambda_u) / size)) <= 1.0 / 12 + 1e-6);
		}
		if (q.lambda_u != 0)
			assert_true(fabsf(q.rho - p.rho) <= 1.0f / 126 + 1e-6f);
		assert_true(q.attr >> 15 == p.attr >> 15);
		/* What was unpacked packs to the same word: to the same point. */
		dpoint_pack(&again, &q, &box);
		assert_true(again.attr == word.attr && again.place == word.place);
	}
}

static void corners_of_the_box_are_reached(void **state)
{
	uint64_t seed = 3;

	(void)state;
	for (int i = 0; i < 5000; i++) {
		struct dpoint p = { .normal = { 0, 0, 1 }, .u = { 1, 0, 0 } }, q;
		struct dpoint_word word;
		struct dpoint_box box;
		float low[3], high[3];

		for (int k = 0; k < 3; k++) {
			low[k] = (float)random_in(&seed, -1, 1);
			high[k] = low[k] + (float)(random_below(&seed, 4) == 0 ? 0 : exp2(random_in(&seed, -30, 1)));
		}
		dpoint_box_make(&box, low, high);
		memcpy(p.at, high, sizeof high);
		dpoint_pack(&word, &p, &box);
		dpoint_unpack(&q, &word, &box);
		for (int k = 0; k < 3; k++)
			assert_true(fabsf(q.at[k] - high[k]) <= 0.5f * box.step[k] + 0x1p-22f);
		memcpy(p.at, low, sizeof low);
		dpoint_pack(&word, &p, &box);
		dpoint_unpack(&q, &word, &box);
		assert_memory_equal(q.at, low, sizeof low);
	}
}

static void any_word_unpacks_to_a_point(void **state)
{
	const float low[3] = { -1, -1, -1 }, high[3] = { 1, 1, 1 };
	struct dpoint_box box;
	uint64_t seed = 4;

	(void)state;
	dpoint_box_make(&box, low, high);
	for (int i = 0; i < 50000; i++) {
		const struct dpoint_word word = { random_next(&seed), random_next(&seed) };
		struct dpoint_word again;
		struct dpoint p;

		dpoint_unpack(&p, &word, &box);
		assert_true(fabsf(p.rho) <= 1 && fabsf(p.lambda_u) <= (float)DPOINT_MOST_LAMBDA);
		dpoint_pack(&again, &p, &box);
		assert_true(dpoint_word_is_valid(&again));
		if (dpoint_word_is_valid(&word))
			assert_true(again.place == word.place && again.attr == word.attr);
	}
}

/* Seen along u alone, a side reaches as far as makes a strip as wide as the sixteenth times the sight's sine, up to 82
 * degrees. Whatever way a sight goes, w of length 1, what it sees of the reach is shorter than 3 sixteenths: with x = h
 * min(|wu / wn|, 1.5 (1 + |wu / wv|)), x sqrt(wv^2 + wn^2) <= x |wv| + x |wn| <= 1.5 h (|wv| + |wu|) + h |wu|, and
 * 1.5^2 + 2.5^2 < 3^2. */
static void what_grazes_reaches_over_sides_by_little(void **state)
{
	const float h = dpoint_graze(256);
	uint64_t seed = 4;

	(void)state;
	assert_true(dpoint_graze(256) == 0.125f / 256 && dpoint_graze(1) == 0x1p-8f);
	assert_true(dpoint_graze_by(h, 0, 0, 1) == 0 && dpoint_graze_by(h, 0, 1, 0) == 0);
	for (int i = 0; i < 20000; i++) {
		double w[3];

		random_unit(w, &seed);
		const float x = dpoint_graze_by(h, (float)w[0], (float)w[1], (float)w[2]);
		const float alone = dpoint_graze_by(h, (float)w[0], 0, (float)w[2]);

		assert_true(x >= 0 && x <= DPOINT_GRAZES * h && x <= alone);
		assert_true((double)x * sqrt(w[1] * w[1] + w[2] * w[2]) < 3 * (double)h);
		if (fabs(w[0]) < 7.9 * fabs(w[2]))
			assert_true(fabs((double)alone * fabs(w[2]) - (double)h * fabs(w[0])) <= (double)h * 0x1p-20);
	}
	assert_true(dpoint_graze_by(h, 1, 0, 0) == DPOINT_GRAZES * h);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_made_point_has_the_shape_that_it_was_made_of),
		cmocka_unit_test(an_unpacked_point_is_within_the_promised_steps),
		cmocka_unit_test(corners_of_the_box_are_reached),
		cmocka_unit_test(any_word_unpacks_to_a_point),
		cmocka_unit_test(what_grazes_reaches_over_sides_by_little),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/vec.h"
#include "psr/direction.h"
#include "sample/cone.h"
#include "sample_meshes.h"

#define SLACK 0x1p-19f /* of the header's rounding downwards, and of floats */

static void random_unit(uint64_t *seed, double v[3])
{
	do
		for (int k = 0; k < 3; k++)
			v[k] = 2 * meshes_random(seed) - 1;
	while (v3d_dot(v, v) > 1 || v3d_normalize(v, v) < 0.1);
}

/* Unit normals within `spread` (a sine) of a random direction; some of them quantised, as blocks have them. */
static void random_normals(uint64_t *seed, int n, double spread, float (*normal)[3])
{
	double center[3], v[3];

	random_unit(seed, center);
	for (int i = 0; i < n; i++) {
		random_unit(seed, v);
		v3d_scale(v, v, spread * meshes_random(seed));
		v3d_add(v, v, center);
		v3d_normalize(v, v);
		v3f_set(normal[i], (float)v[0], (float)v[1], (float)v[2]);
		if (i % 2 == 0)
			memcpy(normal[i], psr_direction_table()[psr_direction_encode(normal[i])], sizeof *normal);
	}
}

static float least_cosine(const float (*normal)[3], int n, const float axis[3])
{
	float least = 1;

	for (int i = 0; i < n; i++)
		least = fminf(least, v3f_dot(axis, normal[i]));
	return least;
}

static void the_cap_holds_every_normal(void **state)
{
	uint64_t seed = 3;

	(void)state;
	for (int round = 0; round < 20000; round++) {
		float normal[128][3], axis[3], cosine;
		int n = 1 + (int)(128 * meshes_random(&seed));

		random_normals(&seed, n, meshes_random(&seed), normal);
		cone_bound((const float(*)[3])normal, n, axis, &cosine);
		assert_true(fabsf(v3f_length(axis) - 1) < 1e-6f);
		assert_true(cosine < 1);
		assert_true(least_cosine((const float(*)[3])normal, n, axis) >= cosine);
	}
}

/* No axis of a grid does better, and those near to the one that was found, at a step of at most 0.05 each way, do worse. */
static void no_axis_has_a_smaller_cap(void **state)
{
	enum { STEPS = 64 };
	uint64_t seed = 5;

	(void)state;
	for (int round = 0; round < 60; round++) {
		float normal[128][3], axis[3], cosine;
		int n = 1 + (int)(128 * meshes_random(&seed));
		double z[3], frame[3][3], best = -1;

		random_normals(&seed, n, 0.95 * meshes_random(&seed), normal);
		cone_bound((const float(*)[3])normal, n, axis, &cosine);
		for (int k = 0; k < 3; k++)
			z[k] = (double)axis[k];
		v3d_normalize(z, z);
		psr_direction_frame(z, frame);
		for (int i = -STEPS; i <= STEPS; i++) {
			for (int j = -STEPS; j <= STEPS; j++) {
				/* Coarse over the sphere's half, then fine around the axis. */
				for (int fine = 0; fine < 2; fine++) {
					double reach = fine ? 0.05 : 1, x = reach * i / STEPS, y = reach * j / STEPS, least = 1;

					if (x * x + y * y >= 1)
						continue;
					for (int s = 0; s < n; s++) {
						double c = 0, height = sqrt(1 - x * x - y * y);

						for (int k = 0; k < 3; k++)
							c += (double)normal[s][k] * (x * frame[0][k] + y * frame[1][k] + height * z[k]);
						least = fmin(least, c);
					}
					best = fmax(best, least);
				}
			}
		}
		assert_true(best <= (double)cosine + (double)SLACK);
	}
}

static void one_normal_has_a_cap_of_no_extent(void **state)
{
	float normal[3][3] = { { 0, 0.6f, 0.8f }, { 0, 0.6f, 0.8f }, { 0, 0.6f, 0.8f } }, axis[3], cosine;

	(void)state;
	for (int n = 1; n <= 3; n++) {
		cone_bound((const float(*)[3])normal, n, axis, &cosine);
		assert_true(cosine > 1 - SLACK && v3f_dot(axis, normal[0]) > 1 - SLACK);
	}
}

static void two_and_three_normals_are_on_the_rim(void **state)
{
	float normal[3][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }, axis[3], cosine;

	(void)state;
	cone_bound((const float(*)[3])normal, 2, axis, &cosine);
	assert_true(fabsf(cosine - sqrtf(0.5f)) < SLACK);
	cone_bound((const float(*)[3])normal, 3, axis, &cosine);
	assert_true(fabsf(cosine - sqrtf(1.0f / 3)) < SLACK);
	/* A third one between two is inside. */
	v3f_set(normal[2], 0.6f, 0.8f, 0);
	cone_bound((const float(*)[3])normal, 3, axis, &cosine);
	assert_true(fabsf(cosine - sqrtf(0.5f)) < SLACK);
}

static void normals_all_around_have_no_cone(void **state)
{
	const float around[4][3] = { { 1, 0, 0 }, { -0.6f, 0.8f, 0 }, { -0.6f, -0.8f, 0 }, { 0, 0, 1 } };
	const float opposite[2][3] = { { 0, 1, 0 }, { 0, -1, 0 } };
	const float unknown[2][3] = { { 0, 0, 1 }, { 0, 0, 0 } }; /* a face without area */
	float axis[3], cosine;

	(void)state;
	cone_bound(around, 4, axis, &cosine);
	assert_true(cosine == -1);
	cone_bound(opposite, 2, axis, &cosine);
	assert_true(cosine == -1);
	cone_bound(unknown, 2, axis, &cosine);
	assert_true(cosine == -1);
	cone_bound(NULL, 0, axis, &cosine);
	assert_true(cosine == -1);
	assert_true(fabsf(v3f_length(axis) - 1) < 1e-6f);
}

/* The order of normals is that of samples, which means nothing: the cap is the same to rounding. */
static void the_order_does_not_matter(void **state)
{
	uint64_t seed = 8;

	(void)state;
	for (int round = 0; round < 2000; round++) {
		float normal[64][3], turned[64][3], axis[3], cosine, other_axis[3], other;

		random_normals(&seed, 64, 0.8 * meshes_random(&seed), normal);
		for (int i = 0; i < 64; i++)
			memcpy(turned[i], normal[(i * 37 + round) % 64], sizeof *turned);
		cone_bound((const float(*)[3])normal, 64, axis, &cosine);
		cone_bound((const float(*)[3])turned, 64, other_axis, &other);
		assert_true(fabsf(cosine - other) < SLACK);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_cap_holds_every_normal),
		cmocka_unit_test(no_axis_has_a_smaller_cap),
		cmocka_unit_test(one_normal_has_a_cap_of_no_extent),
		cmocka_unit_test(two_and_three_normals_are_on_the_rim),
		cmocka_unit_test(normals_all_around_have_no_cone),
		cmocka_unit_test(the_order_does_not_matter),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

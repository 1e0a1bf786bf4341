#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/vec.h"
#include "base/direction.h"
#include "sample/pack/cone.h"
#include "meshes.h"

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
		psr_direction_basis(z, frame);
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

/* Of a packed cone: the sine with which it holds the normals, and its own. */
static double widest_sine(const float (*normal)[3], int n, const int8_t axis[3])
{
	double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]), least = 1;

	for (int i = 0; i < n; i++) {
		double c = 0;

		for (int k = 0; k < 3; k++)
			c += axis[k] / length * (double)normal[i][k];
		least = fmin(least, c);
	}
	return least > 0 ? sqrt(1 - least * least) : 1;
}

/* At every size of cap, the smallest ones too. The bound is the header's: a step of the sine, the turn of the axis, half
 * a unit in two components of a vector of at least 127, and 2^-20 of the cosine, beside 2^-20 that cone_bound() takes. */
static void a_packed_cone_holds_every_normal_and_is_little_wider(void **state)
{
	const double turn = sqrt(0.5) / 127, slack = sqrt(2 * 0x1p-20);
	double most = 0;
	uint64_t seed = 11;
	int n_any = 0;

	(void)state;
	for (int round = 0; round < 40000; round++) {
		float normal[128][3], bound[3], cosine;
		int n = 1 + (int)(128 * meshes_random(&seed)), greatest = 0;
		double spread = 1.2 * pow(meshes_random(&seed), 4), smallest; /* mostly small; at times no cap holds them */
		int8_t axis[3];
		uint8_t sine;

		random_normals(&seed, n, spread, normal);
		cone_bound((const float(*)[3])normal, n, bound, &cosine);
		cone_pack((const float(*)[3])normal, n, axis, &sine);
		for (int k = 0; k < 3; k++)
			greatest = abs(axis[k]) > greatest ? abs(axis[k]) : greatest;
		assert_int_equal(greatest, 127);
		smallest = cosine > 0 ? sqrt(1 - (double)cosine * (double)cosine) : 1;
		if (sine == PSR_CONE_ANY) {
			assert_true(smallest + turn + slack > 254.0 / 255);
			n_any++;
			continue;
		}
		assert_true(widest_sine((const float(*)[3])normal, n, axis) <= sine / 255.0);
		assert_true(sine / 255.0 <= smallest + turn + slack + 1 / 255.0);
		most = fmax(most, sine / 255.0 - smallest);
	}
	assert_in_range(n_any, 40, 4000); /* both happen */
	assert_true(most > 1 / 255.0);    /* the turn shows: rounding the sine alone would stay below */
}

static void normals_all_around_pack_as_any(void **state)
{
	const float around[4][3] = { { 1, 0, 0 }, { -0.6f, 0.8f, 0 }, { -0.6f, -0.8f, 0 }, { 0, 0, 1 } };
	const float nearly[2][3] = { { 0.999999f, 0, 0.001414f }, { -0.999999f, 0, 0.001414f } }; /* of cosine 0.0014 */
	int8_t axis[3];
	uint8_t sine;

	(void)state;
	cone_pack(around, 4, axis, &sine);
	assert_int_equal(sine, PSR_CONE_ANY);
	cone_pack(nearly, 2, axis, &sine);
	assert_int_equal(sine, PSR_CONE_ANY);
	cone_pack(NULL, 0, axis, &sine);
	assert_int_equal(sine, PSR_CONE_ANY);
	assert_true(axis[0] == 0 && axis[1] == 0 && axis[2] == 127);
}

/* Directions whose axis has no rounding: what is left of a flat block is 2^-20 of the cosine, which is less than a step. */
static void flat_blocks_along_the_axes_pack_to_a_step(void **state)
{
	(void)state;
	for (int side = 0; side < 6; side++) {
		float normal[2][3] = { { 0 } };
		int8_t axis[3];
		uint8_t sine;

		normal[0][side % 3] = normal[1][side % 3] = side < 3 ? 1 : -1;
		cone_pack((const float(*)[3])normal, 2, axis, &sine);
		assert_int_equal(sine, 1);
		for (int k = 0; k < 3; k++)
			assert_int_equal(axis[k], k != side % 3 ? 0 : side < 3 ? 127 : -127);
	}
}

/* A block whose one sample still faces the eye, whatever the eye's place, is not culled: for random cones and eyes, some of
 * them nearly where they are. */
static void no_block_is_culled_while_a_normal_of_its_cone_faces_the_eye(void **state)
{
	const int16_t at_center[3] = { 1638, -3277, 4915 };
	const uint16_t reach = 1638;
	uint64_t seed = 12;
	int n_culled = 0, n_kept = 0;

	(void)state;
	for (int round = 0; round < 40000; round++) {
		float normal[16][3], center[3], radius, eye[3];
		int n = 1 + (int)(16 * meshes_random(&seed)), is_perspective = round % 2, faces = 0;
		double v[3];
		int8_t axis[3];
		uint8_t sine, flags = 0;
		struct psr_blocks blocks = { .n_blocks = 1, .sphere_x = &at_center[0], .sphere_y = &at_center[1],
			                         .sphere_z = &at_center[2], .sphere_r = &reach, .flags = &flags, .cone_x = &axis[0], .cone_y = &axis[1],
			                         .cone_z = &axis[2], .cone_sine = &sine };

		psr_blocks_sphere(&blocks, 0, center, &radius);
		random_normals(&seed, n, meshes_random(&seed), normal);
		cone_pack((const float(*)[3])normal, n, axis, &sine);
		random_unit(&seed, v);
		for (int k = 0; k < 3; k++)
			eye[k] = is_perspective ? center[k] + (float)(v[k] * (0.04 + 2 * meshes_random(&seed))) : (float)v[k];
		/* At its centre and at a place of its sphere, with what the renderer forgives left out. */
		for (int i = 0; i < 2 * n; i++) {
			double to[3], product = 0;

			random_unit(&seed, to);
			for (int k = 0; k < 3; k++) {
				double at = (double)center[k] + (i < n ? 0 : (double)radius * to[k]);

				to[k] = is_perspective ? (double)eye[k] - at : (double)eye[k];
				product += to[k] * (double)normal[i % n][k];
			}
			faces |= product >= -0.0125 * v3d_length(to);
		}
		if (cone_culls(&blocks, 0, eye, is_perspective)) {
			assert_false(faces);
			n_culled++;
		} else {
			n_kept++;
		}
	}
	assert_true(n_culled > 4000 && n_kept > 4000);
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
		cmocka_unit_test(a_packed_cone_holds_every_normal_and_is_little_wider),
		cmocka_unit_test(normals_all_around_pack_as_any),
		cmocka_unit_test(flat_blocks_along_the_axes_pack_to_a_step),
		cmocka_unit_test(no_block_is_culled_while_a_normal_of_its_cone_faces_the_eye),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

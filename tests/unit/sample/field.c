#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/vec.h"
#include "sample/own/field.h"
#include "meshes.h"

#define CELL 0.05

static void random_unit(uint64_t *seed, float n[3])
{
	do
		for (int k = 0; k < 3; k++)
			n[k] = (float)(2 * meshes_random(seed) - 1);
	while (v3f_dot(n, n) > 1 || v3f_normalize(n, n) < 0.1f);
}

/* Normals are put down in steps of 1/256: sums of n of them are off by at most n / 512, which is 1/512 of their
 * length. */
static void a_plane_has_its_own_normal(void **state)
{
	uint64_t seed = 7;

	(void)state;
	for (int round = 0; round < 20; round++) {
		struct field field;
		float n[3], x[3], y[3], p[3], smooth[3];

		assert_int_equal(field_init(&field, CELL), PSR_OK);
		random_unit(&seed, n);
		random_unit(&seed, x);
		v3f_add_scaled(x, x, -v3f_dot(x, n), n);
		v3f_normalize(x, x);
		v3f_cross(y, n, x);
		for (int i = 0; i < 10000; i++) {
			float a = (float)meshes_random(&seed) - 0.5f, b = (float)meshes_random(&seed) - 0.5f;

			v3f_scale(p, x, a);
			v3f_add_scaled(p, p, b, y);
			assert_int_equal(field_add(&field, p, n, 1), PSR_OK);
		}
		v3f_set(p, 0.01f, 0, 0);
		field_normal(&field, p, n, smooth);
		assert_true(v3f_length(smooth) > 0);
		v3f_normalize(smooth, smooth);
		/* sin <= sqrt(3) / 512 */
		assert_true(v3f_dot(smooth, n) > 1 - 0.5f * 3 / 512 / 512 - 1e-6f);
		field_fini(&field);
	}
}

/* Cells around a place reach no further than 1.5 sqrt(3) of them away from it, so what is mixed there is within twice
 * the angle that this chord of the sphere subtends. By symmetry it is far less: the mean of what lies around. Half
 * that angle bounds it: 1.5 sqrt(3) 0.05 / 0.8 = 0.162 rad. */
static void a_sphere_is_smoothed_to_itself(void **state)
{
	const float radius = 0.8f;
	struct field field;
	uint64_t seed = 8;
	float p[3], n[3], smooth[3];

	(void)state;
	assert_int_equal(field_init(&field, CELL), PSR_OK);
	for (int i = 0; i < 200000; i++) {
		random_unit(&seed, n);
		v3f_scale(p, n, radius);
		assert_int_equal(field_add(&field, p, n, 1), PSR_OK);
	}
	for (int i = 0; i < 2000; i++) {
		random_unit(&seed, n);
		v3f_scale(p, n, radius);
		field_normal(&field, p, n, smooth);
		v3f_normalize(smooth, smooth);
		assert_true(v3f_dot(smooth, n) > cosf(0.162f));
	}
	field_fini(&field);
}

/* Rough by 20 degrees, a plane is smooth on average: the spread of the mean of some 60 normals is 20 / sqrt(60)
 * degrees a way; five of these. */
static void roughness_is_smoothed_away(void **state)
{
	struct field field;
	uint64_t seed = 9;
	const float up[3] = { 0, 0, 1 };
	float p[3], n[3], smooth[3];

	(void)state;
	assert_int_equal(field_init(&field, CELL), PSR_OK);
	for (int i = 0; i < 60 * 20 * 20; i++) {
		v3f_set(p, (float)meshes_random(&seed), (float)meshes_random(&seed), 0.02f);
		v3f_set(n, (float)meshes_random(&seed) - 0.5f, (float)meshes_random(&seed) - 0.5f, 1);
		v3f_normalize(n, n);
		assert_int_equal(field_add(&field, p, n, 1), PSR_OK);
	}
	for (int i = 0; i < 500; i++) {
		v3f_set(p, 0.1f + 0.8f * (float)meshes_random(&seed), 0.1f + 0.8f * (float)meshes_random(&seed), 0.02f);
		v3f_set(n, 0.3f, 0.2f, 1);
		v3f_normalize(n, n);
		field_normal(&field, p, n, smooth);
		v3f_normalize(smooth, smooth);
		assert_true(v3f_dot(smooth, up) > cosf(5 * 0.35f / sqrtf(60)));
	}
	field_fini(&field);
}

/* A thin plate: each side has its own normal, whatever is on the other. */
static void opposite_sheets_do_not_mix(void **state)
{
	struct field field;
	uint64_t seed = 10;
	float up[3] = { 0.6f, 0, 0.8f }, down[3] = { -0.6f, 0, -0.8f }, p[3], smooth[3];

	(void)state;
	assert_int_equal(field_init(&field, CELL), PSR_OK);
	for (int i = 0; i < 20000; i++) {
		float x = (float)meshes_random(&seed), y = (float)meshes_random(&seed);

		v3f_set(p, x, y, -0.75f * x);
		assert_int_equal(field_add(&field, p, up, 1), PSR_OK);
		if (i % 3 == 0)
			assert_int_equal(field_add(&field, p, down, 2), PSR_OK);
	}
	v3f_set(p, 0.5f, 0.5f, -0.375f);
	for (int side = 0; side < 2; side++) {
		const float *n = side == 0 ? up : down;

		field_normal(&field, p, n, smooth);
		v3f_normalize(smooth, smooth);
		assert_true(v3f_dot(smooth, n) > 1 - 0.5f * 3 / 512 / 512 - 1e-6f);
	}
	field_fini(&field);
}

static void where_nothing_is_known_a_normal_is_itself(void **state)
{
	struct field field;
	const float p[3] = { -0.3f, 0.9f, 0 }, n[3] = { 0.36f, 0.48f, 0.8f };
	float smooth[3];

	(void)state;
	assert_int_equal(field_init(&field, CELL), PSR_OK);
	field_normal(&field, p, n, smooth);
	assert_memory_equal(smooth, n, sizeof n);
	field_fini(&field);
}

/* More pieces than fit the first table, in two orders. */
static void the_order_does_not_matter(void **state)
{
	struct field field[2];
	uint64_t seed = 12;
	const int n_pieces = 20000;
	float (*p)[3] = malloc((size_t)n_pieces * sizeof *p), (*n)[3] = malloc((size_t)n_pieces * sizeof *n), smooth[2][3];

	(void)state;
	for (int i = 0; i < n_pieces; i++) {
		random_unit(&seed, n[i]);
		random_unit(&seed, p[i]);
		v3f_scale(p[i], p[i], (float)meshes_random(&seed));
	}
	for (int f = 0; f < 2; f++) {
		assert_int_equal(field_init(&field[f], CELL), PSR_OK);
		for (int i = 0; i < n_pieces; i++) {
			int k = f == 0 ? i : n_pieces - 1 - i;

			assert_int_equal(field_add(&field[f], p[k], n[k], 1.5f), PSR_OK);
		}
	}
	assert_int_equal(field[0].cells.n, field[1].cells.n);
	assert_true(field[0].cells.n > 1024);
	for (int i = 0; i < n_pieces; i++) {
		for (int f = 0; f < 2; f++)
			field_normal(&field[f], p[i], n[i], smooth[f]);
		assert_memory_equal(smooth[0], smooth[1], sizeof *smooth);
	}
	field_fini(&field[0]);
	field_fini(&field[1]);
	free(p);
	free(n);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_plane_has_its_own_normal),
		cmocka_unit_test(a_sphere_is_smoothed_to_itself),
		cmocka_unit_test(roughness_is_smoothed_away),
		cmocka_unit_test(opposite_sheets_do_not_mix),
		cmocka_unit_test(where_nothing_is_known_a_normal_is_itself),
		cmocka_unit_test(the_order_does_not_matter),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

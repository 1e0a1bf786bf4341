#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "base/direction.h"

static uint64_t random_state = 0x9e3779b97f4a7c15u;

static double random_signed(void)
{
	random_state ^= random_state << 13;
	random_state ^= random_state >> 7;
	random_state ^= random_state << 17;
	return (double)(int64_t)random_state / 9223372036854775808.0;
}

static double determinant(const double a[3], const double b[3], const double c[3])
{
	return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/* The least of the distances from v to the planes of the triangle's sides, positive inside. */
static double depth_inside(int level, unsigned index, const double v[3])
{
	double corner[3][3], least = 2, side;
	double sign;

	psr_direction_corners(level, index, corner);
	sign = determinant(corner[0], corner[1], corner[2]) < 0 ? -1 : 1;
	for (int i = 0; i < 3; i++) {
		side = sign * determinant(corner[i], corner[(i + 1) % 3], v);
		if (side < least)
			least = side;
	}
	return least;
}

static void encode_of_every_table_vector_is_its_index(void **state)
{
	const float(*table)[3] = psr_direction_table();

	(void)state;
	for (unsigned i = 0; i < PSR_DIRECTIONS; i++)
		assert_int_equal(psr_direction_encode(table[i]), i);
}

static void table_vectors_are_the_unit_centers_of_the_triangles(void **state)
{
	const float(*table)[3] = psr_direction_table();

	(void)state;
	for (unsigned i = 0; i < PSR_DIRECTIONS; i++) {
		double v[3], length = 0;

		psr_direction_center(6, i, v);
		for (int k = 0; k < 3; k++) {
			assert_true(table[i][k] == (float)v[k]);
			length += (double)table[i][k] * table[i][k];
		}
		/* Each component is off by half an ulp of at most 2^-24; the squared length by 2 sqrt(3) times that. */
		assert_true(fabs(length - 1) < 4 * 0x1p-24);
	}
}

/* Rounding: the sides' planes and the encoder's come from the same corners; a product of three numbers <= 1 in double
 * is good to a few 2^-53, after six levels of midpoints the corners to some 2^-50. 2^-45 leaves a margin of 32. */
static void encode_finds_the_triangle_that_holds_the_vector(void **state)
{
	(void)state;
	for (int n = 0; n < 200000; n++) {
		float f[3];
		double v[3], length;
		unsigned index;

		for (int k = 0; k < 3; k++)
			f[k] = (float)random_signed();
		if (n % 4 == 0)
			f[n / 4 % 3] = (float)(f[n / 4 % 3] * 1e-6);
		length = sqrt((double)f[0] * f[0] + (double)f[1] * f[1] + (double)f[2] * f[2]);
		for (int k = 0; k < 3; k++)
			v[k] = f[k] / length;
		index = psr_direction_encode(f);
		assert_true(depth_inside(6, index, v) >= -0x1p-45);
	}
}

static void dropping_two_bits_gives_the_enclosing_triangle(void **state)
{
	(void)state;
	for (int level = 1; level <= 6; level++) {
		for (unsigned i = 0; i < 8u << 2 * level; i++) {
			double v[3];

			psr_direction_center(level, i, v);
			assert_true(depth_inside(level - 1, i >> 2, v) > 0);
		}
	}
}

static void child_0_is_in_the_middle_and_child_i_at_corner_i(void **state)
{
	(void)state;
	for (unsigned parent = 0; parent < 512; parent++) {
		double corner[3][3], center[3], child[3][3];

		psr_direction_corners(3, parent, corner);
		psr_direction_center(3, parent, center);
		assert_true(depth_inside(4, parent << 2, center) > 0);
		for (int i = 0; i < 3; i++) {
			psr_direction_corners(4, parent << 2 | (unsigned)(i + 1), child);
			assert_memory_equal(child[i], corner[i], sizeof child[i]);
		}
	}
}

static void centers_of_levels_1_and_2_are_distinct_unit_and_within_their_own_triangle(void **state)
{
	(void)state;
	for (int level = 1; level <= 2; level++) {
		unsigned n = level == 1 ? PSR_PROJECTIONS : PSR_MASK_TRIANGLES;
		double sum[3] = { 0, 0, 0 };

		assert_int_equal(n, 8 << 2 * level);
		for (unsigned i = 0; i < n; i++) {
			double v[3];
			float f[3];

			psr_direction_center(level, i, v);
			/* Three squares, a root and a division: some 2^-53 each. */
			assert_true(fabs(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - 1) < 0x1p-50);
			for (int k = 0; k < 3; k++) {
				f[k] = (float)v[k];
				sum[k] += v[k];
			}
			assert_int_equal(psr_direction_encode(f) >> (12 - 2 * level), i);
		}
		for (int k = 0; k < 3; k++)
			assert_true(fabs(sum[k]) < n * 0x1p-52); /* they balance */
	}
}

static void octant_bits_are_the_signs_and_zero_is_positive(void **state)
{
	(void)state;
	for (unsigned octant = 0; octant < 8; octant++) {
		float v[3] = { octant & 1 ? -0.3f : 0.3f, octant & 2 ? -0.5f : 0.5f, octant & 4 ? -0.7f : 0.7f };

		assert_int_equal(psr_direction_encode(v) >> 12, octant);
	}
	assert_int_equal(psr_direction_encode((float[3]){ -0.0f, -0.0f, 1 }) >> 12, 0);
	assert_int_equal(psr_direction_encode((float[3]){ 0, -1, 0 }) >> 12, 2);
}

static void useless_vectors_give_0_and_extreme_ones_their_triangle(void **state)
{
	const float plain[3] = { -0.25f, 0.5f, 0.125f };
	uint16_t index = psr_direction_encode(plain);
	float v[3];

	(void)state;
	assert_int_equal(psr_direction_encode((float[3]){ 0, 0, 0 }), 0);
	assert_int_equal(psr_direction_encode((float[3]){ -1, NAN, -1 }), 0);
	for (int e = -120; e <= 120; e += 24) {
		for (int k = 0; k < 3; k++)
			v[k] = ldexpf(plain[k], e);
		assert_int_equal(psr_direction_encode(v), index);
	}
	assert_int_equal(psr_direction_encode((float[3]){ -INFINITY, 5, 0 }), psr_direction_encode((float[3]){ -1, 0, 0 }));
}

static void frames_are_right_handed_and_orthonormal(void **state)
{
	(void)state;
	for (unsigned i = 0; i < 512 + 6; i++) {
		double v[3] = { 0, 0, 0 }, frame[3][3];

		if (i < 512)
			psr_direction_center(3, i, v);
		else
			v[(i - 512) % 3] = i < 515 ? 1 : -1;
		psr_direction_basis(v, frame);
		assert_memory_equal(frame[2], v, sizeof v);
		for (int a = 0; a < 3; a++) {
			for (int b = 0; b < 3; b++) {
				double dot = frame[a][0] * frame[b][0] + frame[a][1] * frame[b][1] + frame[a][2] * frame[b][2];

				/* A handful of roundings of 2^-53 on numbers <= 1; x is sqrt(2/3) long or more before it is made 1. */
				assert_true(fabs(dot - (a == b)) < 0x1p-49);
			}
		}
		assert_true(determinant(frame[0], frame[1], frame[2]) > 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(encode_of_every_table_vector_is_its_index),
		cmocka_unit_test(table_vectors_are_the_unit_centers_of_the_triangles),
		cmocka_unit_test(encode_finds_the_triangle_that_holds_the_vector),
		cmocka_unit_test(dropping_two_bits_gives_the_enclosing_triangle),
		cmocka_unit_test(child_0_is_in_the_middle_and_child_i_at_corner_i),
		cmocka_unit_test(centers_of_levels_1_and_2_are_distinct_unit_and_within_their_own_triangle),
		cmocka_unit_test(octant_bits_are_the_signs_and_zero_is_positive),
		cmocka_unit_test(useless_vectors_give_0_and_extreme_ones_their_triangle),
		cmocka_unit_test(frames_are_right_handed_and_orthonormal),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

/* The masks of EWA splats against the integral that defines them, and the shapes that they stand for. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include "simd/ewa_masks.h"

#define PI 3.14159265358979323846
#define PANELS 128 /* of Simpson's rule in a pixel */

/* exp(-(a x^2 + 2 b x y + c y^2) / 2), and the covariance that it has. */
struct bell {
	double a, b, c, xx, xy, yy;
};

static void make_bell(struct bell *g, uint32_t shape, double deviation)
{
	float m[3];

	ewa_tilt(m, shape);
	const double length = sqrt((double)m[0] * m[0] + (double)m[1] * m[1] + (double)m[2] * m[2]);
	const double x = m[0] / length, y = m[1] / length, square = deviation * deviation;
	g->xx = square * (1 - x * x);
	g->xy = -square * x * y;
	g->yy = square * (1 - y * y);
	const double area = g->xx * g->yy - g->xy * g->xy;
	g->a = g->yy / area;
	g->b = -g->xy / area;
	g->c = g->xx / area;
}

/* Along a row of the pixel the integral is a difference of error functions. */
static double row_of(const struct bell *g, double x, double y)
{
	const double root = sqrt(g->a / 2), shift = g->b * y / g->a;
	const double height = erf(root * (x + 0.5 + shift)) - erf(root * (x - 0.5 + shift));

	return exp(-(g->c - g->b * g->b / g->a) * y * y / 2) * height * sqrt(PI / (2 * g->a));
}

static double mean_in_pixel(const struct bell *g, double x, double y)
{
	double sum = row_of(g, x, y - 0.5) + row_of(g, x, y + 0.5);

	for (int i = 1; i < PANELS; i++)
		sum += (i % 2 ? 4 : 2) * row_of(g, x, y - 0.5 + (double)i / PANELS);
	return sum / (3 * PANELS);
}

/* The table sums 64 columns of a pixel, each an exact integral f of a log-concave function, so f rises and falls once
 * (Prekopa); the middles of such columns give the mean within a 64th of the greatest f, which is 1 or the deviation along a
 * column times sqrt(2 pi). Simpson's rule here integrates rows, in 128 panels, likewise within 4 of 128ths of theirs. Rounding
 * adds a half, and edges of 24 bits one part in 10^6. */
static void masks_are_integrals_over_pixels(void **state)
{
	(void)state;
	for (uint32_t k = 0; k < EWA_SIZES; k++)
		for (uint32_t i = 0; i < EWA_SHAPES * EWA_SECTORS; i++) {
			const int radius = (int)ewa_size[k].radius, side = 2 * radius + 1;
			const uint8_t *weight = ewa_weight + ewa_size[k].first + i * (uint32_t)(side * side);
			const double right = i & 1 ? 0.25 : -0.25, down = i & 2 ? 0.25 : -0.25;
			struct bell g;

			make_bell(&g, i / EWA_SECTORS, (double)EWA_SIGMA * (double)ewa_size[k].edge);
			const double most = fmin(1, sqrt(2 * PI / g.c)) / 64 + 4 * fmin(1, sqrt(2 * PI / g.a)) / PANELS;
			for (int n = 0; n < side * side; n++) {
				const double mean = mean_in_pixel(&g, n % side - radius - right, n / side - radius - down);

				if (!(fabs(weight[n] - 255 * mean) <= 0.5 + 255 * most + 0.001))
					fail_msg("size %u, shape and sector %u, pixel %d: %d, the integral is %g", k, i, n, weight[n],
					         255 * mean);
			}
		}
}

/* Beyond the sizes, and for how the table of the bell is rounded: half a step of q changes exp(-q / 2) by 1 / 128 at
 * most. */
static void the_bell_is_the_exponential(void **state)
{
	(void)state;
	for (int i = 0; i < EWA_BELL; i++)
		assert_true(fabs(ewa_bell[i] - 255 * exp(-(i + 0.5) / (2 * EWA_STEPS))) <= 0.5 + 1e-9);
	assert_true(EWA_BELL == EWA_MOST_SQUARE * EWA_STEPS);
}

/* A core is what closes a surface: it has the pixel that holds the middle, or it could vanish. */
static void each_mask_has_a_core_around_its_middle(void **state)
{
	(void)state;
	for (uint32_t k = 0; k < EWA_SIZES; k++)
		for (uint32_t i = 0; i < EWA_SHAPES * EWA_SECTORS; i++) {
			const uint32_t radius = ewa_size[k].radius, side = EWA_SIDE(radius);

			assert_true(ewa_core[k * EWA_SHAPES * EWA_SECTORS + i] > 0);
			assert_true(ewa_weight[ewa_size[k].first + i * side * side + radius * (side + 1)]
			            >= ewa_core[k * EWA_SHAPES * EWA_SECTORS + i]);
		}
}

static void the_core_radius_is_the_least_that_holds_all_cores(void **state)
{
	(void)state;
	for (uint32_t k = 0; k < EWA_SIZES; k++) {
		const int radius = (int)ewa_size[k].radius, side = EWA_SIDE(radius);
		int most = 0;

		for (int i = 0; i < EWA_SHAPES * EWA_SECTORS * side * side; i++) {
			const int x = abs(i % side - radius), y = abs(i / side % side - radius), at = x > y ? x : y;

			if (ewa_weight[ewa_size[k].first + (uint32_t)i] >= ewa_core[ewa_number(k, 0, 0) + (uint32_t)(i / (side * side))])
				most = at > most ? at : most;
		}
		assert_int_equal(ewa_size[k].core_radius, most);
	}
}

/* Narrow cores are told as bits, too. */
static void bits_of_narrow_cores_are_their_pixels(void **state)
{
	(void)state;
	for (uint32_t k = 0; k <= EWA_NARROW; k++)
		for (uint32_t i = 0; i < EWA_SHAPES * EWA_SECTORS; i++) {
			const int radius = (int)ewa_size[k].radius, side = EWA_SIDE(radius);
			const uint8_t *weight = ewa_weight + ewa_size[k].first + i * (uint32_t)(side * side);
			const uint32_t number = ewa_number(k, 0, 0) + i;
			uint32_t bits = 0;

			for (int n = 0; n < side * side; n++)
				if (weight[n] >= ewa_core[number]) {
					const int x = n % side - radius + EWA_CORE_RADIUS, y = n / side - radius + EWA_CORE_RADIUS;

					assert_in_range(x, 0, EWA_CORE_SIDE - 1);
					assert_in_range(y, 0, EWA_CORE_SIDE - 1);
					bits |= 1u << (EWA_CORE_SIDE * y + x);
				}
			assert_int_equal(ewa_core_bits[number], bits);
		}
}

static void sizes_fill_the_table(void **state)
{
	uint32_t first = 0;

	(void)state;
	for (uint32_t k = 0; k < EWA_SIZES; k++) {
		const uint32_t side = EWA_SIDE(ewa_size[k].radius);

		assert_int_equal(ewa_size[k].first, first);
		first += EWA_SHAPES * EWA_SECTORS * side * side;
		assert_true(fabs((double)ewa_size[k].edge - sqrt(0.5) * pow(2, k / 3.0)) < 1e-6);
		assert_true(ewa_size[k].radius <= EWA_MOST_RADIUS);
		if (k > 0)
			assert_true(ewa_size[k].radius + 0.5 >= 1.2 * (double)ewa_size[k].edge);
	}
	assert_int_equal(first, EWA_BYTES);
	assert_int_equal(EWA_MASKS, 2560);
}

/* Tilts lie in their octant, each in a cell of its own. */
static void shapes_are_64_tilts_of_an_octant(void **state)
{
	(void)state;
	for (uint32_t s = 0; s < EWA_SHAPES; s++) {
		float a[3], b[3];

		ewa_tilt(a, s);
		assert_true(a[0] > 0 && a[1] > 0 && a[2] > 0 && fabsf(a[0] + a[1] + a[2] - 8) < 1e-5f);
		for (uint32_t t = 0; t < s; t++) {
			ewa_tilt(b, t);
			assert_true(fabsf(a[0] - b[0]) + fabsf(a[1] - b[1]) > 0.5f);
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(masks_are_integrals_over_pixels),
		cmocka_unit_test(the_bell_is_the_exponential),
		cmocka_unit_test(each_mask_has_a_core_around_its_middle),
		cmocka_unit_test(the_core_radius_is_the_least_that_holds_all_cores),
		cmocka_unit_test(bits_of_narrow_cores_are_their_pixels),
		cmocka_unit_test(sizes_fill_the_table),
		cmocka_unit_test(shapes_are_64_tilts_of_an_octant),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Depth as u16: both ends exact, rising, off by half a step at most. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <cmocka.h>
#include <math.h>
#include "base/random.h"
#include "proto/proto.h"

#define STEPS 65534

static uint64_t random_state = 7;

static uint16_t quantise(float z, const struct psr_depth_range *range)
{
	uint16_t q;

	psr_depth_quantise(&q, &z, 1, range);
	return q;
}

static float restore(uint16_t q, const struct psr_depth_range *range)
{
	float z;

	psr_depth_restore(&z, &q, 1, range);
	return z;
}

/* Far is 1.0001 to 1e6 times near; both are floats. GCC 12 leaves the rounding out (-O2 -fno-math-errno) unless they are
 * volatile. */
static struct psr_depth_range random_range(int is_linear)
{
	const double near = pow(10, random_in(&random_state, -6, 6));
	volatile float min = (float)near, max = (float)(near * (1 + pow(10, random_in(&random_state, -4, 6))));

	return (struct psr_depth_range){ .min = (double)min, .max = (double)max, .is_linear = is_linear };
}

/* Steps from min to z. */
static double place(double z, const struct psr_depth_range *range)
{
	if (range->is_linear)
		return STEPS * (z - range->min) / (range->max - range->min);
	return STEPS * (1 / range->min - 1 / z) / (1 / range->min - 1 / range->max);
}

static void the_example_of_the_page_holds(void **state)
{
	const struct psr_depth_range near_far = { .min = 1, .max = 4 }, flat = { .min = 1, .max = 4, .is_linear = 1 };

	(void)state;
	/* 1/z falls from 1 to 1/4: 2 is at (1 - 1/2) / (3/4) = 2/3 of the steps; in z it is at 1/3. */
	assert_int_equal(quantise(2, &near_far), 43689);
	assert_int_equal(quantise(2, &flat), 21845);
}

static void ends_are_exact_and_beyond_them_it_is_clamped(void **state)
{
	(void)state;
	for (int round = 0; round < 2000; round++) {
		const struct psr_depth_range range = random_range(round & 1);
		const float min = (float)range.min, max = (float)range.max;

		assert_int_equal(quantise(min, &range), 0);
		assert_int_equal(quantise(nextafterf(min, 0), &range), 0);
		assert_int_equal(quantise(0, &range), 0);
		assert_int_equal(quantise(max, &range), STEPS);
		assert_int_equal(quantise(nextafterf(max, INFINITY), &range), STEPS);
		assert_int_equal(quantise(3e38f, &range), STEPS);
		assert_true(restore(0, &range) == min && restore(STEPS, &range) == max);
	}
}

static void nothing_is_65535(void **state)
{
	const struct psr_depth_range range = random_range(0);

	(void)state;
	assert_int_equal(quantise(INFINITY, &range), 65535);
	assert_true(isinf(restore(65535, &range)));
}

static void it_rises_with_depth(void **state)
{
	(void)state;
	for (int round = 0; round < 200; round++) {
		const struct psr_depth_range range = random_range(round & 1);
		uint16_t last = 0;

		for (int i = -5; i <= 1005; i++) {
			const uint16_t q = quantise((float)(range.min + (range.max - range.min) * i / 1000), &range);

			assert_true(q >= last);
			last = q;
		}
	}
}

/* Rounding: a dozen operations in double, here and there, are off by 2^-53 of 1/min each; these ranges are at least 2^-14 of
 * it wide, so that 65534 steps make it less than 2^-19 of a step. */
static void quantised_depth_is_off_by_half_a_step_at_most(void **state)
{
	(void)state;
	for (int round = 0; round < 100000; round++) {
		const struct psr_depth_range range = random_range(round & 1);
		const float z = (float)random_in(&random_state, range.min, range.max);

		assert_true(fabs(quantise(z, &range) - place((double)z, &range)) <= 0.5 + ldexp(1, -19));
	}
}

/* Beside half a step there is the rounding to float, 2^-24 of z. */
static void what_comes_back_is_off_by_half_a_step_at_most(void **state)
{
	(void)state;
	for (int round = 0; round < 100000; round++) {
		const struct psr_depth_range range = random_range(round & 1);
		const float z = (float)random_in(&random_state, range.min, range.max);
		const double back = (double)restore(quantise(z, &range), &range);
		const double ulp = back * ldexp(1, -24);
		const double low = place(back - ulp, &range), high = place(back + ulp, &range), at = place((double)z, &range);

		assert_true(low - 0.5 - ldexp(1, -19) <= at && at <= high + 0.5 + ldexp(1, -19));
	}
}

static void every_step_comes_back(void **state)
{
	const struct psr_depth_range ranges[2] = { { .min = 0.5, .max = 40 }, { .min = -3, .max = 40, .is_linear = 1 } };

	(void)state;
	for (int i = 0; i < 2; i++)
		for (uint32_t q = 0; q <= 65535; q++)
			assert_int_equal(quantise(restore((uint16_t)q, &ranges[i]), &ranges[i]), q);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_example_of_the_page_holds),
		cmocka_unit_test(ends_are_exact_and_beyond_them_it_is_clamped),
		cmocka_unit_test(nothing_is_65535),
		cmocka_unit_test(it_rises_with_depth),
		cmocka_unit_test(quantised_depth_is_off_by_half_a_step_at_most),
		cmocka_unit_test(what_comes_back_is_off_by_half_a_step_at_most),
		cmocka_unit_test(every_step_comes_back),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

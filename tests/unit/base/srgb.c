#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "base/srgb.h"

static double exact(double code)
{
	double c = code / 255;

	return c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}

/* pow is good to an ulp or two of double; rounding to float is the only error that counts. */
static void table_is_the_curve_rounded_to_float(void **state)
{
	(void)state;
	for (int i = 0; i < 256; i++)
		assert_true(psr_srgb_to_linear[i] == (float)exact(i));
	assert_true(psr_srgb_to_linear[0] == 0 && psr_srgb_to_linear[255] == 1);
}

static void every_code_comes_back(void **state)
{
	(void)state;
	for (int i = 0; i < 256; i++)
		assert_int_equal(psr_linear_to_srgb(psr_srgb_to_linear[i]), i);
}

static void codes_change_halfway_on_the_curve(void **state)
{
	(void)state;
	for (int i = 0; i < 255; i++) {
		float half = (float)exact(i + 0.5);

		assert_int_equal(psr_linear_to_srgb(nextafterf(nextafterf(half, 0), 0)), i);
		assert_int_equal(psr_linear_to_srgb(nextafterf(nextafterf(half, 2), 2)), i + 1);
	}
}

static void values_outside_are_clamped(void **state)
{
	(void)state;
	assert_int_equal(psr_linear_to_srgb(-1), 0);
	assert_int_equal(psr_linear_to_srgb(-INFINITY), 0);
	assert_int_equal(psr_linear_to_srgb(NAN), 0);
	assert_int_equal(psr_linear_to_srgb(1.5f), 255);
	assert_int_equal(psr_linear_to_srgb(INFINITY), 255);
}

static void the_table_of_16_bits_is_made_once_and_alike(void **state)
{
	const uint8_t *table = psr_srgb_of_16_bits();

	(void)state;
	assert_ptr_equal(psr_srgb_of_16_bits(), table);
	for (int i = 0; i < 65536; i++)
		assert_int_equal(table[i], psr_linear_to_srgb((float)i / 65535.0f));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(table_is_the_curve_rounded_to_float),
		cmocka_unit_test(every_code_comes_back),
		cmocka_unit_test(codes_change_halfway_on_the_curve),
		cmocka_unit_test(values_outside_are_clamped),
		cmocka_unit_test(the_table_of_16_bits_is_made_once_and_alike),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "base/maths.h"

static void sincos_is_within_its_bound(void **state)
{
	(void)state;
	for (int i = 0; i <= 100000; i++) {
		double a = 3.14159265358979323846 * i / 100000, s, c;
		psr_sincos(a, &s, &c);
		/* pi itself is rounded: mirroring moves the angle by 1.2e-16 more */
		assert_true(fabs(s - sin(a)) < 1.5e-15);
		assert_true(fabs(c - cos(a)) < 1.5e-15);
	}
}

static void floor_is_exact_around_whole_numbers(void **state)
{
	(void)state;
	for (int i = -40000; i <= 40000; i++) {
		float x = (float)i;
		assert_int_equal(psr_floor_int(x), i);
		assert_int_equal(psr_floor_int(nextafterf(x, -INFINITY)), i == 0 ? -1 : i - 1);
		assert_int_equal(psr_floor_int(nextafterf(x, INFINITY)), i);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(sincos_is_within_its_bound),
		cmocka_unit_test(floor_is_exact_around_whole_numbers),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}

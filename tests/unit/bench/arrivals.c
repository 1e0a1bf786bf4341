/* The times at which requests of a load are due. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "client/bench/arrivals.h"

static void constant_arrivals_never_drift(void **state)
{
	struct arrivals arrivals;

	(void)state;
	arrivals_init(&arrivals, 5000, 300, 0.5);
	for (int i = 0; i < 3000000; i++) {
		if (i % 100000 == 0) { /* rounded down to whole nanoseconds; the sum in doubles is off by far less than one */
			const double wanted = (i + 0.5) / 300 * 1e9;

			assert_true(fabs((double)(arrivals_due(&arrivals) - 5000) - wanted) <= 1.5);
		}
		arrivals_advance(&arrivals);
	}
}

/* Of n exponential gaps the mean has a standard deviation of 1 / sqrt(n) of itself, and so has the share of gaps above
 * the mean (1/e) sqrt(p (1 - p) / n); five of them are never passed by chance. */
static void random_arrivals_are_poisson_and_repeatable(void **state)
{
	const int n = 100000;
	struct arrivals arrivals, again;
	uint64_t before = 0, n_long = 0;

	(void)state;
	arrivals_init(&arrivals, 0, 1000, 0);
	arrivals_set_poisson(&arrivals, 42);
	arrivals_init(&again, 0, 1000, 0);
	arrivals_set_poisson(&again, 42);
	for (int i = 0; i < n; i++) {
		const uint64_t due = arrivals_due(&arrivals);

		assert_int_equal(due, arrivals_due(&again));
		n_long += due - before > 1000000;
		before = due;
		arrivals_advance(&arrivals);
		arrivals_advance(&again);
	}
	assert_true(fabs((double)before / 1e9 - n / 1000.0) <= 5 * n / 1000.0 / sqrt(n));
	assert_true(fabs((double)n_long / n - exp(-1)) <= 5 * sqrt(exp(-1) * (1 - exp(-1)) / n));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(constant_arrivals_never_drift),
		cmocka_unit_test(random_arrivals_are_poisson_and_repeatable),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

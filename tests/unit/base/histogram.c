/* The histogram against exact percentiles. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include "base/histogram.h"
#include "base/random.h"
#include "base/stats.h"

#define N 20000

static const double parts[] = { 0, 0.001, 0.25, 0.5, 0.9, 0.99, 0.999, 0.99999, 1 };

/* A time of each kind of distribution. */
static double draw(int kind, uint64_t *random)
{
	const double u = random_in(random, 0, 1);

	switch (kind) {
	case 0:
		return 1e6 + 1e6 * u; /* within an octave */
	case 1:
		return exp(u * log((double)HISTOGRAM_MAX)); /* over all octaves */
	case 2:
		return -1e7 * log(1 - u); /* exponential */
	default:
		return random_below(random, 100) < 98 ? 2e6 + 1e5 * u : 1e9 + 1e8 * u; /* two humps */
	}
}

static void percentiles_are_within_the_stated_error_of_exact_ones(void **state)
{
	(void)state;
	for (int kind = 0; kind < 4; kind++) {
		struct histogram *histogram = calloc(1, sizeof *histogram);
		double *exact = calloc(N, sizeof *exact), sum = 0;
		uint64_t random = (uint64_t)kind;

		assert_non_null(histogram);
		assert_non_null(exact);
		for (size_t i = 0; i < N; i++) {
			exact[i] = floor(draw(kind, &random));
			sum += exact[i];
			histogram_add(histogram, (uint64_t)exact[i]);
		}
		stats_sort(exact, N);
		for (size_t k = 0; k < sizeof parts / sizeof parts[0]; k++) {
			const double wanted = stats_percentile(exact, N, parts[k]);
			const double got = (double)histogram_percentile(histogram, parts[k]);

			/* half a nanosecond: a bucket's middle is rounded to whole ones */
			if (fabs(got - wanted) > HISTOGRAM_ERROR * wanted + 0.5)
				fail_msg("distribution %d, part %g: %.0f, exact %.0f", kind, parts[k], got, wanted);
		}
		assert_true(fabs(histogram_mean(histogram) - sum / N) <= 1e-9 * sum / N);
		assert_int_equal(histogram->max, (uint64_t)exact[N - 1]);
		assert_int_equal(histogram->min, (uint64_t)exact[0]);
		free(histogram);
		free(exact);
	}
}

static void buckets_follow_each_other_without_gaps(void **state)
{
	(void)state;
	for (size_t i = 0; i < HISTOGRAM_BUCKETS; i++)
		assert_int_equal(histogram_bucket(histogram_value(i)), i);
	for (unsigned k = HISTOGRAM_BITS; k < HISTOGRAM_OCTAVES - 1; k++) {
		const uint64_t edge = UINT64_C(1) << k;

		assert_int_equal(histogram_bucket(edge), histogram_bucket(edge - 1) + 1);
	}
	assert_int_equal(histogram_bucket(UINT64_MAX), HISTOGRAM_BUCKETS - 1);
}

static void merged_histograms_are_the_histogram_of_all(void **state)
{
	struct histogram *half[3], *all;
	uint64_t random = 7;

	(void)state;
	for (int k = 0; k < 3; k++)
		half[k] = calloc(1, sizeof *half[k]);
	all = calloc(1, sizeof *all);
	assert_true(half[0] != NULL && half[1] != NULL && half[2] != NULL && all != NULL);
	for (size_t i = 0; i < N; i++) {
		const uint64_t ns = (uint64_t)draw(2, &random);

		histogram_add(half[i % 3 == 0], ns);
		histogram_add(all, ns);
	}
	histogram_merge(half[2], half[0]);
	histogram_merge(half[2], half[1]);
	assert_int_equal(half[2]->n, all->n);
	assert_int_equal(half[2]->min, all->min);
	assert_int_equal(half[2]->max, all->max);
	assert_memory_equal(half[2]->count, all->count, sizeof all->count);
	for (int k = 0; k < 3; k++)
		free(half[k]);
	free(all);
}

static void nothing_has_percentiles_of_zero(void **state)
{
	static const struct histogram none;

	(void)state;
	assert_int_equal(histogram_percentile(&none, 0.99), 0);
	assert_true(histogram_mean(&none) == 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(percentiles_are_within_the_stated_error_of_exact_ones),
		cmocka_unit_test(buckets_follow_each_other_without_gaps),
		cmocka_unit_test(merged_histograms_are_the_histogram_of_all),
		cmocka_unit_test(nothing_has_percentiles_of_zero),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

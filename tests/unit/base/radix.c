#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <float.h>
#include <stdlib.h>
#include "base/radix.h"
#include "base/random.h"

static int compare(const void *a, const void *b)
{
	const struct radix_entry *x = a, *y = b;

	if (x->key != y->key)
		return x->key < y->key ? -1 : 1;
	return x->value < y->value ? -1 : x->value > y->value;
}

/* Values are places before sorting, so that a stable order is one by key and value. */
static void check_sorted(size_t n, int shift, uint64_t mask)
{
	struct radix_entry *entry = malloc((2 * n + 1) * sizeof *entry), *expected = malloc((n + 1) * sizeof *expected);
	uint64_t seed = n + (uint64_t)shift;

	assert_non_null(entry);
	assert_non_null(expected);
	for (size_t i = 0; i < n; i++)
		expected[i] = entry[i] = (struct radix_entry){ (random_next(&seed) & mask) << shift, (uint32_t)i };
	qsort(expected, n, sizeof *expected, compare);
	radix_sort(entry, n);
	for (size_t i = 0; i < n; i++) {
		assert_int_equal(entry[i].key, expected[i].key);
		assert_int_equal(entry[i].value, expected[i].value);
	}
	free(entry);
	free(expected);
}

static void test_sorts_and_keeps_the_order_of_equals(void **state)
{
	(void)state;
	for (size_t n = 0; n < 5; n++)
		check_sorted(n, 0, UINT64_MAX);
	check_sorted(5000, 0, UINT64_MAX);
	check_sorted(5000, 0, 15);  /* one digit */
	check_sorted(5000, 60, 15); /* the last one, which is short */
	check_sorted(5000, 11, 0xfff);
	check_sorted(5000, 0, 0);
}

static void test_floats_are_in_their_order(void **state)
{
	static const float ascending[] = { -FLT_MAX, -2, -1, -FLT_MIN, -0x1p-149f, 0, 0x1p-149f, FLT_MIN, 1, 2, FLT_MAX };

	(void)state;
	for (size_t i = 1; i < sizeof ascending / sizeof *ascending; i++)
		assert_true(radix_of_float(ascending[i - 1]) < radix_of_float(ascending[i]));
	assert_int_equal(radix_of_float(-0.0f), radix_of_float(0.0f));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_sorts_and_keeps_the_order_of_equals),
		cmocka_unit_test(test_floats_are_in_their_order),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

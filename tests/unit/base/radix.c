#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <float.h>
#include <stdlib.h>
#include <string.h>
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

/* Records of any size, by keys of 33 bits, which are three digits: they end in the other array. */
static void check_records(size_t bytes)
{
	const size_t n = 3000;
	uint8_t *record = malloc(n * bytes), *spare = malloc(n * bytes), *sorted;
	uint64_t seed = bytes, last = 0, key, order;

	assert_non_null(record);
	assert_non_null(spare);
	for (uint64_t i = 0; i < n; i++) {
		uint8_t *const at = record + i * bytes;

		key = (random_next(&seed) & 0xff) << (i & 1 ? 25 : 10);
		memset(at, (int)(i % 251), bytes);
		memcpy(at, &key, sizeof key);
		memcpy(at + bytes - sizeof i, &i, sizeof i);
	}
	sorted = radix_sort_records(record, spare, bytes, n, 33);
	assert_ptr_equal(sorted, spare);
	for (uint64_t i = 0, before = 0; i < n; i++, last = key, before = order) {
		const uint8_t *const at = sorted + i * bytes;

		memcpy(&key, at, sizeof key);
		memcpy(&order, at + bytes - sizeof order, sizeof order);
		assert_true(key > last || (key == last && (i == 0 || order > before)));
		for (size_t k = sizeof key; k < bytes - sizeof order; k++)
			assert_int_equal(at[k], order % 251);
	}
	free(record);
	free(spare);
}

static void test_sorts_records_of_any_size(void **state)
{
	(void)state;
	check_records(16);
	check_records(24);
	check_records(29);
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
		cmocka_unit_test(test_sorts_records_of_any_size),
		cmocka_unit_test(test_floats_are_in_their_order),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

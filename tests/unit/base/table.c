#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/random.h"
#include "base/table.h"
#include "psr/error.h"

#define N 5000

struct entry {
	uint64_t key, value;
};

static uint64_t nth_key(uint64_t i)
{
	return random_next(&i) & ~TABLE_MARK;
}

static void what_is_put_is_found_and_nothing_else(void **state)
{
	struct table table;

	(void)state;
	assert_int_equal(table_init(&table, sizeof(struct entry), 16), PSR_OK);
	for (uint64_t i = 0; i < N; i++) {
		struct entry *entry = table_put(&table, nth_key(i));

		assert_non_null(entry);
		assert_true(entry->key == nth_key(i) && entry->value == 0);
		entry->value = i + 1;
		assert_int_equal(table.n, i + 1);
		assert_true(4 * table.n <= 3 * table.size + 4);
	}
	for (uint64_t i = 0; i < 2 * N; i++) {
		const struct entry *entry = table_find(&table, nth_key(i));

		if (i < N)
			assert_int_equal(entry->value, i + 1);
		else
			assert_null(entry);
	}
	table_fini(&table);
}

static void a_key_is_put_once(void **state)
{
	struct table table;
	struct entry *entry;

	(void)state;
	assert_int_equal(table_init(&table, sizeof(struct entry), 4), PSR_OK);
	entry = table_put(&table, 0);
	entry->value = 7;
	entry = table_put(&table, 0);
	assert_int_equal(entry->value, 7);
	assert_int_equal(table.n, 1);
	table_fini(&table);
}

/* Marks move with their entries when the table grows. */
static void marked_entries_are_passed_over_until_they_are_not(void **state)
{
	struct table table;

	(void)state;
	assert_int_equal(table_init(&table, sizeof(uint64_t), 1024), PSR_OK);
	for (uint64_t i = 0; i < 500; i++)
		*(uint64_t *)table_put(&table, nth_key(i)) |= i % 2 != 0 ? TABLE_MARK : 0;
	assert_int_equal(table_grow(&table), PSR_OK);
	for (uint64_t i = 0; i < 500; i++)
		assert_int_equal(table_find(&table, nth_key(i)) != NULL, i % 2 == 0);
	for (size_t place = 0; place < table.size; place++)
		if (*table_at(&table, place) != TABLE_FREE)
			*table_at(&table, place) &= ~TABLE_MARK;
	for (uint64_t i = 0; i < 500; i++)
		assert_non_null(table_find(&table, nth_key(i)));
	table_fini(&table);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_put_is_found_and_nothing_else),
		cmocka_unit_test(a_key_is_put_once),
		cmocka_unit_test(marked_entries_are_passed_over_until_they_are_not),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

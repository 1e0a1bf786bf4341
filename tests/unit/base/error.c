#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>
#include "psr/error.h"

static void every_code_has_its_own_name(void **state)
{
	(void)state;
	for (int a = PSR_OK; a >= PSR_ERR_INTERNAL; a--) {
		assert_string_not_equal(psr_strerror(a), "unknown error");
		for (int b = PSR_OK; b > a; b--)
			assert_string_not_equal(psr_strerror(a), psr_strerror(b));
	}
	assert_string_equal(psr_strerror(1), "unknown error");
	assert_string_equal(psr_strerror(PSR_ERR_INTERNAL - 1), "unknown error");
	assert_string_equal(psr_strerror(INT32_MIN), "unknown error");
}

static void exit_statuses_are_those_of_the_table(void **state)
{
	static const int expected[] = { 0, 2, 3, 3, 3, 4, 4, 4, 5, 6, 6, 6, 6, 7 };

	(void)state;
	for (int i = 0; i <= -PSR_ERR_INTERNAL; i++)
		assert_int_equal(psr_exit_status(-i), expected[i]);
	assert_int_equal(psr_exit_status(99), 7);
	assert_int_equal(psr_exit_status(-99), 7);
}

static void fail_returns_its_code_and_fills_the_text(void **state)
{
	struct psr_error err = { 0 };

	(void)state;
	assert_int_equal(psr_fail(NULL, PSR_ERR_IO, "%s", "lost"), PSR_ERR_IO);
	assert_int_equal(psr_fail(&err, PSR_ERR_LIMIT, "%d is more than %s\n", 7, "six"), PSR_ERR_LIMIT);
	assert_int_equal(err.code, PSR_ERR_LIMIT);
	assert_string_equal(err.text, "7 is more than six");
}

static void long_texts_are_cut_with_their_end_in_place(void **state)
{
	struct psr_error err;
	char text[2 * PSR_ERROR_TEXT];

	(void)state;
	memset(text, 'x', sizeof text - 1);
	text[sizeof text - 1] = '\0';
	psr_fail(&err, PSR_ERR_ARG, "%s", text);
	assert_int_equal(strlen(err.text), PSR_ERROR_TEXT - 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_code_has_its_own_name),
		cmocka_unit_test(exit_statuses_are_those_of_the_table),
		cmocka_unit_test(fail_returns_its_code_and_fills_the_text),
		cmocka_unit_test(long_texts_are_cut_with_their_end_in_place),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

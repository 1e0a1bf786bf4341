/* Decimal numbers become the nearest doubles, as strtod() finds them. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/random.h"
#include "import/import.h"

#define N 400000

static locale_t locale;

static int make_locale(void **state)
{
	(void)state;
	locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
	return locale == (locale_t)0 ? -1 : 0;
}

static int free_locale(void **state)
{
	(void)state;
	freelocale(locale);
	return 0;
}

/* Bits, so that -0 and 0 differ; all NANs are one. */
static void check(const char *text)
{
	const double expected = strtod_l(text, NULL, locale);
	uint8_t word[128]; /* of exactly its bytes, no end after them */
	const size_t n = strlen(text);
	double x = 123;

	memset(word, '7', sizeof word);
	memcpy(word, text, n);
	if (!import_number(&x, word, n, locale))
		fail_msg("\"%s\" is no number", text);
	if (isnan(x) ? !isnan(expected) : memcmp(&x, &expected, sizeof x) != 0)
		fail_msg("\"%s\": %a is not %a", text, x, expected);
}

static uint64_t next(void)
{
	static uint64_t state = 7;

	return random_next(&state);
}

static void doubles_of_all_sizes_are_exact_in_any_precision(void **state)
{
	char text[64];

	(void)state;
	for (int i = 0; i < N; i++) {
		const uint64_t bits = next();
		double x;

		memcpy(&x, &bits, sizeof x);
		if (!isfinite(x))
			continue;
		snprintf(text, sizeof text, "%.*g", (int)(next() % 20), x);
		check(text);
		snprintf(text, sizeof text, "%.*e", (int)(next() % 19), x);
		check(text);
	}
}

/* As scans have them: few digits, a point anywhere. */
static void coordinates_are_exact(void **state)
{
	char text[64];

	(void)state;
	for (int i = 0; i < N; i++) {
		const double x = ((double)(next() >> 11) * 0x1p-53 - 0.5) * pow(10, (double)(next() % 9));

		snprintf(text, sizeof text, "%.*f", (int)(next() % 17), x);
		check(text);
		snprintf(text, sizeof text, "%.9g", (double)(float)x);
		check(text);
	}
}

/* Strings of digits around 2^53 and powers around 10^22, where products stop to be exact. */
static void the_limits_of_exact_products_are_kept(void **state)
{
	char text[64];

	(void)state;
	for (int i = 0; i < N; i++) {
		const uint64_t digits = (UINT64_C(1) << 53) - 2000 + next() % 4000;

		snprintf(text, sizeof text, "%s%llue%d", i % 2 == 0 ? "-" : "", (unsigned long long)digits,
		         (int)(next() % 50) - 25);
		check(text);
	}
}

/* Half way between two doubles, and a little beside. */
static void ties_go_to_even(void **state)
{
	char text[64];

	(void)state;
	for (int i = 0; i < N; i++) {
		const uint64_t even = (UINT64_C(1) << 53) + 2 * (next() >> 12);

		for (int beside = -1; beside <= 1; beside++) {
			snprintf(text, sizeof text, "%llu%s", (unsigned long long)(even + 1 + (uint64_t)beside),
			         i % 3 == 0 ? "" : i % 3 == 1 ? ".0000000001" : ".0");
			check(text);
		}
	}
}

static void forms_of_c_are_read(void **state)
{
	static const char *const texts[] = { "0",    "-0",  "+1",    "1.",     ".5",        "-.5e1", "1e5",  "1E+05",
		                                 "1e-5", "inf", "-inf",  "nan",    "infinity",  "1e400", "1e-400",
		                                 "0000000000000000000000001.5", "4.9e-324", "2.2250738585072011e-308",
		                                 "0.000000000000000000000000000000012345678901234567" };

	(void)state;
	for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++)
		check(texts[i]);
}

static void other_words_are_refused(void **state)
{
	static const char *const texts[] = { "", "-", "+", ".", "e5", "1e", "1e+", "1x", "0x10", "1,5", "--1", "1 ", " 1",
		                             "\f.5", "nan(1)" };
	double x;

	(void)state;
	for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++)
		if (import_number(&x, (const uint8_t *)texts[i], strlen(texts[i]), locale))
			fail_msg("\"%s\" was read as %g", texts[i], x);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(doubles_of_all_sizes_are_exact_in_any_precision),
		cmocka_unit_test(coordinates_are_exact),
		cmocka_unit_test(the_limits_of_exact_products_are_kept),
		cmocka_unit_test(ties_go_to_even),
		cmocka_unit_test(forms_of_c_are_read),
		cmocka_unit_test(other_words_are_refused),
	};

	return cmocka_run_group_tests(tests, make_locale, free_locale);
}

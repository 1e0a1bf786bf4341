/* A suite is refused with its name, or has tests whose every field is within its range. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "client/test/suite.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

#define require(claim) \
	do { \
		if (!(claim)) \
			abort(); \
	} while (0)

static void check_test(const struct suite *suite, const struct suite_test *test)
{
	const struct expect *e = &test->expect;

	require(test->name != NULL && test->name[0] != '\0' && test->line > 0 && test->column > 0);
	require(test->n_pictures > 0 && test->scene.n_instances > 0);
	require(test->n_turn == 0 || test->views.n == 1);
	require(test->n_pictures == (test->n_turn > 0 ? test->n_turn : test->views.n));
	require(test->frame.width > 0 && test->frame.height > 0 && test->frame.planes & 1);
	require((uint64_t)test->frame.width * test->frame.height <= PSR_WIRE_MAX_PIXELS);
	for (int i = 0; i < PSR_N_PLANES; i++) {
		require(e->hash[i].text == NULL || test->frame.planes >> i & 1);
		require(e->hash[i].value == NULL || e->hash[i].text != NULL);
	}
	require(e->of == NULL || (e->of_test < suite->n_tests && &suite->test[e->of_test] != test));
	require(e->of == NULL || (e->ratio > 0 && e->n_draws >= 1 && e->n_draws <= EXPECT_MOST_DRAWS));
	require(isnan(e->bound[EXPECT_OFF]) || (e->bound[EXPECT_OFF] >= 0 && e->bound[EXPECT_OFF] <= 1));
	require(e->off_codes <= 255);
	require(isnan(e->bound[EXPECT_PSNR]) || (e->bound[EXPECT_PSNR] >= 0 && isfinite(e->bound[EXPECT_PSNR])));
	require(e->depth == NULL || e->bound[EXPECT_DEPTH] >= 0);
}

/* Parses a copy, for the parser writes into its text; -1 leaves no suite behind. */
static int parse(struct suite **out, const uint8_t *data, size_t n, struct psr_error *err)
{
	char *text = malloc(n + 1);

	require(text != NULL);
	memcpy(text, data, n);
	text[n] = '\0';
	return suite_parse(out, "/nowhere/fuzz.suite", text, err);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	struct suite *suite = NULL, *again = NULL;
	struct psr_error err = { 0, "" };
	int code;

	if (n > 1 << 16 || memchr(data, 0, n) != NULL) /* infile_read_text() refuses NULs */
		return 0;
	code = parse(&suite, data, n, &err);
	require(code == err.code);
	if (code != PSR_OK) {
		require(suite == NULL && strncmp(err.text, "/nowhere/fuzz.suite", 19) == 0);
		return 0;
	}
	require(suite->n_tests > 0 && suite->n_tests <= SUITE_MAX_TESTS);
	for (uint32_t i = 0; i < suite->n_tests; i++)
		check_test(suite, &suite->test[i]);
	require(parse(&again, data, n, &err) == PSR_OK && again->n_tests == suite->n_tests);
	suite_free(again);
	suite_free(suite);
	return 0;
}

/* What came of the pictures of a suite. */
#ifndef PSR_CLIENT_TEST_RESULT_H
#define PSR_CLIENT_TEST_RESULT_H

#include "compare/compare.h"
#include "suite.h"

enum outcome { OUTCOME_NONE, OUTCOME_PASSED, OUTCOME_FAILED, OUTCOME_ACCEPTED };

struct result { /* of a picture */
	enum outcome outcome;
	char text[PSR_ERROR_TEXT]; /* what failed, or what was accepted; "" where it passed */
	struct compare_box box;    /* where the picture is worst; width 0: unknown */
	int has_hashes;
	uint64_t hash[PSR_N_PLANES];
	double seconds;            /* from the request to the verdict */
	char *figure;              /* of the page, as HTML; NULL: none */
};

struct results {
	struct suite *suite;
	struct result *of; /* all pictures of all tests, in the suite's order */
	uint32_t *first;   /* of each test: its first picture's place in `of` */
	uint8_t *is_chosen; /* of each test */
	uint8_t *is_accepted; /* of each test: what it draws is taken */
};

/* Chooses the tests whose names match `pattern`, and those to be accepted; both may be NULL: all, and none. MEMORY. */
int results_init(struct results *results, struct suite *suite, const char *pattern, const char *accept,
                 struct psr_error *err);
void results_fini(struct results *results);

/* Writes NAME, or NAME/3 for the third of several pictures; at most RESULT_NAME bytes. */
#define RESULT_NAME (PSR_WIRE_MAX_NAME + 16)
void result_name(char name[RESULT_NAME], const struct suite_test *test, uint32_t k);

/* Says that the picture failed; several reasons stand in one text. */
void result_fail(struct result *result, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif

#include "result.h"
#include <fnmatch.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int results_init(struct results *results, struct suite *suite, const char *pattern, const char *accept,
                 struct psr_error *err)
{
	uint32_t n = 0;

	for (uint32_t i = 0; i < suite->n_tests; i++)
		n += suite->test[i].n_pictures;
	*results = (struct results){ .suite = suite,
		                         .of = calloc(n, sizeof *results->of),
		                         .first = calloc(suite->n_tests, sizeof *results->first),
		                         .is_chosen = calloc(suite->n_tests, 1),
		                         .is_accepted = calloc(suite->n_tests, 1) };
	if (results->of == NULL || results->first == NULL || results->is_chosen == NULL || results->is_accepted == NULL) {
		results_fini(results);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %u results", n);
	}
	n = 0;
	for (uint32_t i = 0; i < suite->n_tests; i++) {
		const char *name = suite->test[i].name;

		results->is_accepted[i] = accept != NULL && fnmatch(accept, name, 0) == 0;
		results->is_chosen[i] = results->is_accepted[i] || (pattern != NULL && fnmatch(pattern, name, 0) == 0)
		                        || (pattern == NULL && accept == NULL);
		results->first[i] = n;
		n += suite->test[i].n_pictures;
	}
	return PSR_OK;
}

void results_fini(struct results *results)
{
	for (uint32_t i = 0; results->of != NULL && results->first != NULL && i < results->suite->n_tests; i++)
		for (uint32_t k = 0; k < results->suite->test[i].n_pictures; k++)
			free(results->of[results->first[i] + k].figure);
	free(results->of);
	free(results->first);
	free(results->is_chosen);
	free(results->is_accepted);
	memset(results, 0, sizeof *results);
}

void result_name(char name[RESULT_NAME], const struct suite_test *test, uint32_t k)
{
	if (test->n_pictures == 1)
		snprintf(name, RESULT_NAME, "%s", test->name);
	else
		snprintf(name, RESULT_NAME, "%s/%u", test->name, k + 1);
}

void result_fail(struct result *result, const char *format, ...)
{
	size_t used = strlen(result->text);
	va_list args;

	if (used > 0 && used + 2 < sizeof result->text) {
		strcpy(result->text + used, "; ");
		used += 2;
	}
	va_start(args, format);
	vsnprintf(result->text + used, sizeof result->text - used, format, args);
	va_end(args);
	result->outcome = OUTCOME_FAILED;
}

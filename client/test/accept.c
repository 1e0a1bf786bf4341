#include "accept.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/infile.h"
#include "base/outfile.h"

#define MAX_BYTES (16u << 20)

/* A word whose hashes change: where its value stands in the file. */
struct change {
	size_t at, length;
	uint32_t test;
	unsigned plane;
};

static int is_whole(const struct results *results, uint32_t test)
{
	const struct result *of = &results->of[results->first[test]];
	int n_accepted = 0;

	for (uint32_t k = 0; k < results->suite->test[test].n_pictures; k++) {
		if (of[k].outcome == OUTCOME_FAILED || !of[k].has_hashes)
			return 0;
		n_accepted += of[k].outcome == OUTCOME_ACCEPTED;
	}
	return n_accepted > 0;
}

static int by_place(const void *a, const void *b)
{
	const struct change *x = a, *y = b;

	return x->at < y->at ? -1 : x->at > y->at;
}

static size_t list_changes(struct change *change, const struct results *results)
{
	const struct suite *suite = results->suite;
	size_t n = 0;

	for (uint32_t i = 0; i < suite->n_tests; i++) {
		if (!results->is_accepted[i] || !is_whole(results, i))
			continue;
		for (unsigned plane = 0; plane < PSR_N_PLANES; plane++) {
			const char *text = suite->test[i].expect.hash[plane].text;

			if (text != NULL)
				change[n++] = (struct change){ (size_t)(text - suite->text), strlen(text), i, plane };
		}
	}
	qsort(change, n, sizeof *change, by_place);
	return n;
}

/* Whether several tests have the word from the defaults: it cannot be the hash of them all. */
static int is_default(const struct suite *suite, const char *text, unsigned plane)
{
	int n = 0;

	for (uint32_t i = 0; i < suite->n_tests; i++)
		n += suite->test[i].expect.hash[plane].text == text;
	return n > 1;
}

static void print_hashes(FILE *to, const struct results *results, const struct change *change)
{
	for (uint32_t k = 0; k < results->suite->test[change->test].n_pictures; k++)
		fprintf(to, "%s%016" PRIx64, k > 0 ? "," : "",
		        results->of[results->first[change->test] + k].hash[change->plane]);
}

/* text: of the file; the suite's own has lost its quotes and line ends. */
static int rewrite(FILE *to, const char *text, const struct results *results, const struct change *change, size_t n,
                   struct psr_error *err)
{
	const char *path = results->suite->path;
	const size_t n_text = strlen(text);
	size_t done = 0;

	for (size_t i = 0; i < n; i++) {
		const struct suite_test *test = &results->suite->test[change[i].test];
		const char *was = test->expect.hash[change[i].plane].text;

		if (is_default(results->suite, was, change[i].plane))
			return psr_fail(err, PSR_ERR_ARG, "%s: the hash of %s is a default of several tests; write hash=? behind "
			                "test=%s, and accept again", path, test->name, test->name);
		if (change[i].at + change[i].length > n_text || memcmp(text + change[i].at, was, change[i].length) != 0)
			return psr_fail(err, PSR_ERR_ARG, "%s: the hash of %s is not where it was; has the file changed, or is the "
			                "word in quotes?", path, test->name);
		fwrite(text + done, 1, change[i].at - done, to);
		print_hashes(to, results, &change[i]);
		done = change[i].at + change[i].length;
	}
	fwrite(text + done, 1, n_text - done, to);
	return PSR_OK;
}

int accept_write(const struct results *results, struct psr_error *err)
{
	const char *path = results->suite->path;
	struct change *change = calloc((size_t)results->suite->n_tests * PSR_N_PLANES, sizeof *change);
	const size_t n = change != NULL ? list_changes(change, results) : 0;
	char *text = NULL;
	struct outfile file;
	int code = change != NULL ? PSR_OK : psr_fail(err, PSR_ERR_MEMORY, "no memory for hashes");

	if (code == PSR_OK && n > 0)
		code = infile_read_text(&text, path, MAX_BYTES, err);
	if (code == PSR_OK && n > 0)
		code = outfile_open(&file, path, OUTFILE_PLAIN, err);
	if (code == PSR_OK && n > 0)
		code = outfile_close(&file, rewrite(file.stream, text, results, change, n, err), err);
	free(text);
	free(change);
	return code;
}

#include "report.h"
#include <inttypes.h>
#include <unistd.h>

int report_open(struct report *report, struct psr_error *err)
{
	int code = report->junit != NULL ? outfile_open(&report->junit_file, report->junit, OUTFILE_PLAIN, err) : PSR_OK;

	if (code != PSR_OK)
		return code;
	code = report->html != NULL ? outfile_open(&report->html_file, report->html, OUTFILE_PLAIN, err) : PSR_OK;
	if (code != PSR_OK && report->junit != NULL)
		outfile_close(&report->junit_file, code, NULL);
	if (code != PSR_OK)
		return code;
	if (report->junit != NULL)
		junit_begin(report->junit_file.stream);
	if (report->html != NULL)
		page_begin(report->html_file.stream);
	return PSR_OK;
}

static void print_place(const struct result *result)
{
	const struct compare_box *box = &result->box;

	if (box->width > 0)
		printf("; worst in %ux%u pixels at %u,%u", box->width, box->height, box->x, box->y);
}

static void print_result(const struct report *report, const struct results *results, const struct suite_test *test,
                         uint32_t k, const struct result *result)
{
	const uint64_t number = report->n_passed + report->n_failed + report->n_accepted;
	char name[RESULT_NAME];

	result_name(name, test, k);
	if (report->is_tap) {
		printf("%s %" PRIu64 " - %s: %s\n", result->outcome == OUTCOME_FAILED ? "not ok" : "ok", number,
		       results->suite->name, name);
		if (result->text[0] == '\0')
			return;
		printf("# %s%s", result->outcome == OUTCOME_ACCEPTED ? "accepted: " : "", result->text);
	} else {
		if (result->outcome == OUTCOME_PASSED)
			return;
		printf("%-8s %s: %s: %s", result->outcome == OUTCOME_FAILED ? "FAILED" : "accepted", results->suite->name, name,
		       result->text);
	}
	print_place(result);
	putchar('\n');
}

void report_suite(struct report *report, const struct results *results, const struct psr_error *why)
{
	const struct suite *suite = results->suite;

	for (uint32_t i = 0; i < suite->n_tests; i++)
		for (uint32_t k = 0; results->is_chosen[i] && k < suite->test[i].n_pictures; k++) {
			struct result *result = &results->of[results->first[i] + k];
			const int is_drawn = result->outcome != OUTCOME_NONE;

			if (!is_drawn)
				result_fail(result, "not drawn: %.400s", why != NULL ? why->text : "the run ended before");
			report->n_passed += result->outcome == OUTCOME_PASSED;
			report->n_failed += result->outcome == OUTCOME_FAILED;
			report->n_accepted += result->outcome == OUTCOME_ACCEPTED;
			if (is_drawn || report->is_tap) /* one line on standard error tells people */
				print_result(report, results, &suite->test[i], k, result);
		}
	if (report->junit != NULL)
		junit_suite(report->junit_file.stream, results);
	if (report->html != NULL)
		page_suite(report->html_file.stream, results);
}

static int close_file(struct outfile *file, int code, int *first, struct psr_error *err)
{
	struct psr_error why;
	const int closed = outfile_close(file, code, &why);

	if (closed != PSR_OK && *first == PSR_OK)
		*first = psr_fail(err, closed, "%s", why.text);
	return *first;
}

int report_close(struct report *report, int code, struct psr_error *err)
{
	const uint64_t n = report->n_passed + report->n_failed + report->n_accepted;
	int first = code;

	if (report->junit != NULL) {
		junit_end(report->junit_file.stream);
		close_file(&report->junit_file, code, &first, err);
	}
	if (report->html != NULL) {
		page_end(report->html_file.stream, report);
		close_file(&report->html_file, code, &first, err);
	}
	if (code != PSR_OK)
		return first;
	if (report->is_tap)
		printf("1..%" PRIu64 "\n", n);
	else
		printf("%" PRIu64 " passed, %" PRIu64 " failed", report->n_passed, report->n_failed);
	if (!report->is_tap && report->n_accepted > 0)
		printf(", %" PRIu64 " accepted", report->n_accepted);
	if (!report->is_tap)
		putchar('\n');
	return first != PSR_OK ? first : outfile_flush_stdout(err);
}

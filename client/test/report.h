/* Tells people and programs what came of suites. */
#ifndef PSR_CLIENT_TEST_REPORT_H
#define PSR_CLIENT_TEST_REPORT_H

#include "base/outfile.h"
#include "result.h"

struct report {
	int is_tap;                 /* TAP on standard output, not lines for people */
	const char *junit, *html;   /* files, or NULL */
	/* while it is open: */
	struct outfile junit_file, html_file;
	uint64_t n_passed, n_failed, n_accepted;
};

/* Opens the files. Begin with a report of zeros but for the first three fields. */
int report_open(struct report *report, struct psr_error *err);

/* Tells the results of a suite, in its order; why, if not NULL, ended it before all of them were there. */
void report_suite(struct report *report, const struct results *results, const struct psr_error *why);

/* Ends the files, or drops them unless code is PSR_OK, and prints the sums. Returns code, or the first error. */
int report_close(struct report *report, int code, struct psr_error *err);

/* ---- between report.c, junit.c and page.c ---- */

void junit_begin(FILE *to);
void junit_suite(FILE *to, const struct results *results);
void junit_end(FILE *to);

void page_begin(FILE *to);
void page_suite(FILE *to, const struct results *results);
void page_end(FILE *to, const struct report *report);

#endif

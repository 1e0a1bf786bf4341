#include "base/html.h"
#include "report.h"

void junit_begin(FILE *to)
{
	fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n", to);
}

static void print_case(FILE *to, const struct suite *suite, const char *name, const struct result *result)
{
	fputs("    <testcase classname=\"", to);
	html_escape(to, suite->name);
	fprintf(to, "\" name=\"%s\" time=\"%.3f\"", name, result->seconds);
	if (result->text[0] == '\0') {
		fputs("/>\n", to);
		return;
	}
	fputs(result->outcome == OUTCOME_FAILED ? ">\n      <failure message=\"" : ">\n      <system-out>accepted: ", to);
	html_escape(to, result->text);
	if (result->box.width > 0)
		fprintf(to, "; worst in %ux%u pixels at %u,%u", result->box.width, result->box.height, result->box.x,
		        result->box.y);
	fputs(result->outcome == OUTCOME_FAILED ? "\"/>\n    </testcase>\n" : "</system-out>\n    </testcase>\n", to);
}

void junit_suite(FILE *to, const struct results *results)
{
	const struct suite *suite = results->suite;
	unsigned long n = 0, n_failed = 0;
	double seconds = 0;

	for (int is_printing = 0; is_printing < 2; is_printing++) {
		if (is_printing) {
			fputs("  <testsuite name=\"", to);
			html_escape(to, suite->name);
			fprintf(to, "\" tests=\"%lu\" failures=\"%lu\" time=\"%.3f\">\n", n, n_failed, seconds);
		}
		for (uint32_t i = 0; i < suite->n_tests; i++)
			for (uint32_t k = 0; results->is_chosen[i] && k < suite->test[i].n_pictures; k++) {
				const struct result *result = &results->of[results->first[i] + k];
				char name[RESULT_NAME];

				result_name(name, &suite->test[i], k);
				n++;
				n_failed += result->outcome == OUTCOME_FAILED;
				seconds += result->seconds;
				if (is_printing)
					print_case(to, suite, name, result);
			}
	}
	fputs("  </testsuite>\n", to);
}

void junit_end(FILE *to)
{
	fputs("</testsuites>\n", to);
}

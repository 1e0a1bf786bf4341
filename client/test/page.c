#include <inttypes.h>
#include "base/html.h"
#include "report.h"

void page_begin(FILE *to)
{
	fputs("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>psr test</title>\n<style>\n"
	      "body { font: 15px/1.4 sans-serif; margin: 2em; color: #222; background: #fff }\n"
	      "h2 { margin: 1.5em 0 .5em } h3 { margin: 1.5em 0 .2em; color: #a00 } h3.accepted { color: #850 }\n"
	      "p { margin: 0 0 .6em }\n"
	      "div { display: flex; flex-wrap: wrap; gap: 1em } figure { margin: 0 }\n"
	      "figcaption { color: #666; font-size: 13px }\n"
	      "img { display: block; max-width: 100%; height: auto; image-rendering: pixelated }\n"
	      "span { display: inline-block; position: relative; margin-bottom: .6em }\n"
	      "i { position: absolute; box-sizing: border-box; border: 1px solid #f0f }\n"
	      "</style>\n</head>\n<body>\n<h1>psr test</h1>\n", to);
}

static void print_failure(FILE *to, const char *name, const struct result *result)
{
	fprintf(to, "<h3%s>%s</h3>\n<p>%s", result->outcome == OUTCOME_ACCEPTED ? " class=\"accepted\"" : "", name,
	        result->outcome == OUTCOME_ACCEPTED ? "accepted: " : "");
	html_escape(to, result->text);
	if (result->box.width > 0)
		fprintf(to, "<br>worst in %ux%u pixels at %u,%u, enlarged below", result->box.width, result->box.height,
		        result->box.x, result->box.y);
	fputs("</p>\n", to);
	if (result->figure != NULL)
		fprintf(to, "<div>\n%s</div>\n", result->figure);
}

void page_suite(FILE *to, const struct results *results)
{
	const struct suite *suite = results->suite;
	unsigned long n_passed = 0;

	fputs("<h2>", to);
	html_escape(to, suite->name);
	fputs("</h2>\n", to);
	for (int is_passing = 0; is_passing < 2; is_passing++) {
		for (uint32_t i = 0; i < suite->n_tests; i++)
			for (uint32_t k = 0; results->is_chosen[i] && k < suite->test[i].n_pictures; k++) {
				const struct result *result = &results->of[results->first[i] + k];
				char name[RESULT_NAME];

				if ((result->outcome == OUTCOME_PASSED) != is_passing)
					continue;
				result_name(name, &suite->test[i], k);
				if (is_passing)
					fprintf(to, "%s%s", n_passed++ > 0 ? ", " : "<p>passed: ", name);
				else
					print_failure(to, name, result);
			}
	}
	fputs(n_passed > 0 ? "</p>\n" : "", to);
}

void page_end(FILE *to, const struct report *report)
{
	fprintf(to, "<h2>%" PRIu64 " passed, %" PRIu64 " failed", report->n_passed, report->n_failed);
	if (report->n_accepted > 0)
		fprintf(to, ", %" PRIu64 " accepted", report->n_accepted);
	fputs("</h2>\n</body>\n</html>\n", to);
}

/* What psr bench prints and writes of a load. */
#ifndef PSR_CLIENT_BENCH_REPORT_H
#define PSR_CLIENT_BENCH_REPORT_H

#include <cjson/cJSON.h>
#include "bench.h"

/* Print a row while a load runs, and the table at its end, on standard output. `what` names models, size and codec. */
void report_print_row(const struct measure_row *row);
void report_print(const struct bench_result *result, const char *what);

/* An object with all figures and rows; the caller frees it. NULL without memory. */
cJSON *report_json(const struct bench_result *result, const char *what);

/* Writes the rows as a table of comma-separated values. NOT_FOUND, IO, MEMORY. */
int report_csv(const struct bench_result *result, const char *path, struct psr_error *err);

#endif

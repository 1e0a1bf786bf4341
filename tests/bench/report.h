/* What all parts of `make bench` share: the clock, medians, targets, and the JSON that stands beside the tables. */
#ifndef TESTS_BENCH_REPORT_H
#define TESTS_BENCH_REPORT_H

#include <cjson/cJSON.h>
#include <stdint.h>

double report_ms(void);                    /* a clock */
double report_ratio(double a, double b);   /* a / b, 0 if b is */

void report_die(const char *what, const char *detail) __attribute__((noreturn));
void *report_alloc(size_t n, size_t size); /* zeroed, or the end */

/* The members of the root; it is made on first use. */
cJSON *report_array(const char *name);
cJSON *report_object(const char *name);
cJSON *report_add(cJSON *array); /* a new object at its end */
void report_number(cJSON *object, const char *name, double value);
void report_text(cJSON *object, const char *name, const char *value);

enum report_bound { REPORT_AT_MOST, REPORT_AT_LEAST };

/* Remembers a figure beside its target. A missed target is said and fails nothing. */
void report_target(const char *what, double value, const char *unit, enum report_bound kind, double bound);
void report_print_targets(void);

/* Prints the root, ends the use of this module. */
void report_write(const char *path);

#endif

/* Recordings of loads: requests with their times and cameras, and what was answered. A text file of a JSON object a
 * line: first the kinds of requests, as a report of psr shot has them, then each request that was answered. */
#ifndef PSR_CLIENT_BENCH_RECORD_H
#define PSR_CLIENT_BENCH_RECORD_H

#include "bench.h"

/* Writes all kept answers. NOT_FOUND, IO, MEMORY. */
int record_write(const char *path, const struct bench_plan *plan, const struct bench_result *result,
                 struct psr_error *err);

/* Makes a plan of a recording, as bench_plan_make() does of a mix. FORMAT, with the line that is wrong; VERSION: the
 * server's models differ from the recorded ones. */
int record_read(struct bench_plan *plan, const char *path, const char *server, int timeout_ms, struct psr_error *err);

#endif

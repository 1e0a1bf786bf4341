/* Runs a part of the benchmark in a process of its own, so that one renderer's threads, allocations and code generators
 * never stand beside another's. */
#ifndef TESTS_BENCH_ISOLATE_H
#define TESTS_BENCH_ISOLATE_H

#include <stddef.h>

/* Memory that both processes see, zeroed; the only way back from the part. */
void *isolate_alloc(size_t n_bytes);
void isolate_free(void *memory, size_t n_bytes);

/* Calls part(arg) in a child and waits. A child that fails ends the benchmark: it has said why. */
void isolate_run(void (*part)(void *arg), void *arg);

#endif

/* Files that memory no longer holds, for what is measured from the disk on. */
#ifndef TESTS_BENCH_COLD_H
#define TESTS_BENCH_COLD_H

#include <stdint.h>
#include "psr/error.h"

/* Puts a file out of the page cache, once what was written of it is on the disk. Tells how many pages it has and how
 * many of them stayed: those that a process maps, or all where the file system is memory. IO. */
int cold_drop(uint64_t *n_left, uint64_t *n_pages, const char *path, struct psr_error *err);

/* Reads all of it from the beginning, and tells the seconds that it took. IO, MEMORY. */
int cold_read(double *seconds, uint64_t *n_bytes, const char *path, struct psr_error *err);

#endif

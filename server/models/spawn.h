/* Child processes of a program with many threads. */
#ifndef PSRD_SPAWN_H
#define PSRD_SPAWN_H

#include <stdint.h>
#include <sys/types.h>
#include "psr/error.h"

struct spawn_limits {
	uint64_t memory_bytes, cpu_seconds; /* RLIMIT_AS, RLIMIT_CPU */
	int nice;
};

/* Starts argv[0] (a path) in a process group of its own: standard input and output are /dev/null, standard error and
 * descriptor 3 are pipes whose other ends come back, non-blocking, the caller's. No other descriptor is passed on,
 * signals are at their defaults, and the child is killed when this process ends. IO; NOT_FOUND if there is
 * no argv[0]. */
int spawn_start(pid_t *pid, int *fd3, int *error_fd, const char *const *argv, const struct spawn_limits *limits,
                struct psr_error *err);

#endif

/* Child processes for programs with many threads. */
#ifndef PSRD_SPAWN_H
#define PSRD_SPAWN_H

#include <stdint.h>
#include <sys/types.h>
#include "psr/error.h"

struct spawn_limits {
	uint64_t memory_bytes, cpu_seconds, file_bytes; /* RLIMIT_AS, RLIMIT_CPU, RLIMIT_FSIZE; no core is dumped */
	int nice;
};

/* Starts argv[0] (a path) in a process group of its own. Its standard input and output are /dev/null; its standard
 * error and descriptor 3 are pipes: the caller gets their other ends, non-blocking, and closes them. The child inherits
 * no other descriptor, has default signals, and is killed when this process ends. IO; NOT_FOUND if argv[0] does not
 * exist. */
int spawn_start(pid_t *pid, int *fd3, int *error_fd, const char *const *argv, const struct spawn_limits *limits,
                struct psr_error *err);

#endif

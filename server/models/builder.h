/* Builds models from sources in child processes:
 *
 *   psr-model build SOURCE -o TARGET -r RESOLUTION --progress-fd 3 --quiet --threads N
 *
 * niced, with limits of address space, processor time, wall-clock time and file size, ended with the daemon. Lines
 * "stage done total" on descriptor 3 become progress, the last line on standard error becomes the text of a failure.
 *
 * A file is at fault, for good, if psr-model ends with the exit status of bad data: remembered by key. A limit, and a
 * crash, are remembered by key and resolution for BUILDER_RETRY_US. Nothing else is remembered: an error of the system,
 * a child that somebody killed, a build that nobody waits for.
 *
 * All functions belong to the loop's thread. */
#ifndef PSRD_BUILDER_H
#define PSRD_BUILDER_H

#include "catalogue.h"
#include "server/net/loop.h"
#include "psr/error.h"

#define BUILDER_RETRY_US UINT64_C(600000000)

struct builder_limits {
	int max_builds, threads;
	uint64_t memory_bytes, cpu_seconds, wall_seconds, file_bytes; /* file: each one that the build writes */
};

struct builder;

/* Gets the child's progress. Neither progress->stage nor `done` within a stage ever falls. The first 16 messages come
 * at once, then the latest one a tick. */
typedef void builder_on_progress(const struct psr_msg_progress *progress, void *userdata);
typedef void builder_on_done(const struct psr_error *failure, void *userdata); /* failure NULL: TARGET is there */

int builder_create(struct builder **out, struct loop *loop, const struct builder_limits *limits);
void builder_destroy(struct builder *builder); /* kills running children, calls nobody; NULL is fine */

struct builder_job {
	const char *program, *source, *target; /* paths of psr-model, of the source, of the model */
	const char *key;                       /* the source's, CATALOGUE_KEY bytes */
	uint32_t resolution;
	builder_on_progress *on_progress;
	builder_on_done *on_done;
	void *userdata;
};

/* Starts a build, or queues it behind --max-builds others; copies the strings. Calls on_done exactly once, possibly
 * before it returns PSR_OK. MEMORY: on_done is never called. */
int builder_start(struct builder *builder, const struct builder_job *job);

/* Gives up the build with this userdata: on_done gets CANCELLED, at once if the build had not begun, else when its
 * child is gone. */
void builder_drop(struct builder *builder, const void *userdata);

void builder_reap(struct builder *builder);          /* call it on SIGCHLD */
void builder_tick(struct builder *builder);          /* call it on the loop's ticks */
int builder_is_running(const struct builder *builder); /* whether it needs ticks; NULL: no */

struct builder_stats {
	uint64_t n_running, n_waiting; /* now */
	uint64_t n_done, n_failed;     /* failed: or stopped */
};
struct builder_stats builder_stats(const struct builder *builder); /* NULL: all 0 */

/* Returns how the build of this key at this resolution failed before; NULL if it did not. */
const struct psr_error *builder_failure(const struct builder *builder, const char *key, uint32_t resolution);

#endif

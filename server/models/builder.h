/* Builds models from sources in child processes:
 *
 *   psr-model build SOURCE -o TARGET -r RESOLUTION --progress-fd 3 --quiet --threads N
 *
 * niced, with limits of address space and processor time, ended with the daemon. Lines "stage done total" on
 * descriptor 3 become progress, the last line on standard error becomes the text of a failure. It remembers failures
 * of a source (not of the system) by key, those of a limit by key and resolution.
 *
 * All functions belong to the loop's thread. */
#ifndef PSRD_BUILDER_H
#define PSRD_BUILDER_H

#include "catalogue.h"
#include "server/net/loop.h"
#include "psr/error.h"

struct builder_limits {
	int max_builds, threads;
	uint64_t memory_bytes, cpu_seconds;
};

struct builder;

/* progress->stage never falls, nor does `done` within a stage. */
typedef void builder_on_progress(const struct psr_msg_progress *progress, void *userdata);
typedef void builder_on_done(const struct psr_error *failure, void *userdata); /* NULL: TARGET is there */

int builder_create(struct builder **out, struct loop *loop, const struct builder_limits *limits);
void builder_destroy(struct builder *builder); /* kills what runs, calls nobody; NULL is fine */

struct builder_job {
	const char *program, *source, *target; /* paths: psr-model, the source, the model */
	const char *key;                       /* of the source, CATALOGUE_KEY bytes */
	uint32_t resolution;
	builder_on_progress *on_progress;
	builder_on_done *on_done;
	void *userdata;
};

/* Starts a build, or queues it behind --max-builds others; copies the strings. Calls on_done exactly once, possibly
 * before it returns PSR_OK. MEMORY: never calls it. */
int builder_start(struct builder *builder, const struct builder_job *job);

void builder_reap(struct builder *builder); /* on SIGCHLD */

/* How the build of this key failed before, at this resolution; NULL if it did not. */
const struct psr_error *builder_failure(const struct builder *builder, const char *key, uint32_t resolution);

#endif

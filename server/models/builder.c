#define _GNU_SOURCE
#include <errno.h>
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include "base/outfile.h"
#include "builder.h"
#include "failures.h"
#include "lines.h"
#include "outcome.h"
#include "server/log.h"
#include "spawn.h"

#define PROGRESS_AT_ONCE 16

struct build {
	struct build *next;
	struct builder *builder;
	struct builder_job job; /* copies of the job's strings; its key is a copy in */
	char key[CATALOGUE_KEY];
	pid_t pid;              /* 0: not yet started */
	uint64_t start_us;
	enum outcome_end end;
	struct lines progress_lines, error_lines;
	char last_error[LINES_LENGTH];
	struct psr_msg_progress progress;
	int n_progress_left, has_unsent; /* messages that may be passed on before the next tick; whether `progress` was not
	                                  * passed on */
};

struct builder {
	struct loop *loop;
	struct builder_limits limits;
	struct build *first;    /* in order of arrival, running or not */
	int n_running;
	uint64_t n_done, n_failed;
	struct failures failures;
};

int builder_create(struct builder **out, struct loop *loop, const struct builder_limits *limits)
{
	struct builder *builder = calloc(1, sizeof *builder);

	if (builder == NULL)
		return PSR_ERR_MEMORY;
	builder->loop = loop;
	builder->limits = *limits;
	*out = builder;
	return PSR_OK;
}

static void destroy_build(struct build *build)
{
	free((char *)build->job.program);
	free((char *)build->job.source);
	free((char *)build->job.target);
	free(build);
}

static enum psr_progress_stage stage_of(const char *name, enum psr_progress_stage now)
{
	static const struct {
		const char *name;
		enum psr_progress_stage stage;
	} names[] = {
		{ "import", PSR_PROGRESS_IMPORT }, { "read", PSR_PROGRESS_IMPORT }, { "load", PSR_PROGRESS_IMPORT },
		{ "bounds", PSR_PROGRESS_IMPORT }, { "points", PSR_PROGRESS_IMPORT },
		{ "rays", PSR_PROGRESS_SAMPLE }, { "sample", PSR_PROGRESS_SAMPLE },
		{ "merge", PSR_PROGRESS_SAMPLE }, { "leaves", PSR_PROGRESS_SAMPLE }, { "normals", PSR_PROGRESS_SELECT },
		{ "select", PSR_PROGRESS_SELECT }, { "write", PSR_PROGRESS_WRITE },
	};

	for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
		if (strcmp(name, names[i].name) == 0)
			return names[i].stage;
	return now;
}

static void send_progress(struct build *build)
{
	build->n_progress_left--;
	build->has_unsent = 0;
	build->job.on_progress(&build->progress, build->job.userdata);
}

static void on_progress_line(const char *line, void *userdata)
{
	struct build *build = userdata;
	struct psr_msg_progress next = { 0 };
	unsigned long long done, total;
	char name[32];

	if (sscanf(line, "%31s %llu %llu", name, &done, &total) != 3 || done > PSR_WIRE_MAX_INTEGER
	    || total > PSR_WIRE_MAX_INTEGER || (total > 0 && done > total))
		return;
	next.stage = (uint16_t)stage_of(name, build->progress.stage);
	next.done = done;
	next.total = total;
	if (next.stage < build->progress.stage || (next.stage == build->progress.stage && done < build->progress.done))
		return;
	build->progress = next;
	build->has_unsent = 1;
	if (build->n_progress_left > 0)
		send_progress(build);
}

static void on_error_line(const char *line, void *userdata)
{
	static const char *const prefixes[] = { "psr-model: ", "psr-model build: " };
	struct build *build = userdata;

	for (size_t i = 0; i < sizeof prefixes / sizeof prefixes[0]; i++)
		if (strncmp(line, prefixes[i], strlen(prefixes[i])) == 0)
			line += strlen(prefixes[i]);
	if (line[0] != '\0')
		memcpy(build->last_error, line, strlen(line) + 1);
}

const struct psr_error *builder_failure(const struct builder *builder, const char *key, uint32_t resolution)
{
	return failures_find(&builder->failures, key, resolution, builder->loop->now_us);
}

static void remove_remains(const struct build *build)
{
	unlink(build->job.target);
	if (build->pid != 0)
		outfile_remove_remains(build->job.target, build->pid);
}

static void start_waiting(struct builder *builder);

/* failure NULL: the model is built. */
static void finish(struct build *build, const struct psr_error *failure)
{
	struct builder *builder = build->builder;
	struct build **at = &builder->first;

	while (*at != build)
		at = &(*at)->next;
	*at = build->next;
	builder->n_done += failure == NULL;
	builder->n_failed += failure != NULL;
	if (failure != NULL) {
		log_warn("build of %s failed: %s", build->job.source, failure->text);
		remove_remains(build);
	} else {
		log_info("build of %s done", build->job.source);
	}
	build->job.on_done(failure, build->job.userdata);
	destroy_build(build);
	start_waiting(builder);
}

static int run(struct build *build, struct psr_error *err)
{
	struct builder *builder = build->builder;
	char threads[16], resolution[16];
	const char *argv[] = {
		build->job.program, "build", build->job.source, "-o", build->job.target, "-r", resolution, "--progress-fd", "3",
		"--quiet", "--threads", threads, "--scan", NULL,
	};
	const struct spawn_limits limits = {
		.memory_bytes = builder->limits.memory_bytes, .cpu_seconds = builder->limits.cpu_seconds,
		.file_bytes = builder->limits.file_bytes, .nice = 10,
	};
	int progress_fd, error_fd, code;

	snprintf(threads, sizeof threads, "%d", builder->limits.threads);
	snprintf(resolution, sizeof resolution, "%" PRIu32, build->job.resolution);
	code = spawn_start(&build->pid, &progress_fd, &error_fd, argv, &limits, err);
	if (code != PSR_OK)
		return code;
	builder->n_running++;
	log_info("build of %s started, at %" PRIu32, build->job.source, build->job.resolution);
	lines_open(&build->progress_lines, builder->loop, progress_fd, on_progress_line, build);
	lines_open(&build->error_lines, builder->loop, error_fd, on_error_line, build);
	build->start_us = builder->loop->now_us;
	build->progress.stage = PSR_PROGRESS_IMPORT;
	build->n_progress_left = PROGRESS_AT_ONCE;
	send_progress(build);
	return PSR_OK;
}

static void start_waiting(struct builder *builder)
{
	struct build *next;

	for (struct build *build = builder->first; build != NULL && builder->n_running < builder->limits.max_builds;
	     build = next) {
		struct psr_error error;

		next = build->next;
		if (build->pid == 0 && run(build, &error) != PSR_OK) {
			finish(build, &error);
			return; /* finish() has gone on with the list */
		}
	}
}

int builder_start(struct builder *builder, const struct builder_job *job)
{
	struct build *build = calloc(1, sizeof *build), **at = &builder->first;

	if (build == NULL)
		return PSR_ERR_MEMORY;
	build->builder = builder;
	build->job = *job;
	build->job.program = strdup(job->program);
	build->job.source = strdup(job->source);
	build->job.target = strdup(job->target);
	memcpy(build->key, job->key, CATALOGUE_KEY);
	build->job.key = build->key;
	if (build->job.program == NULL || build->job.source == NULL || build->job.target == NULL) {
		destroy_build(build);
		return PSR_ERR_MEMORY;
	}
	while (*at != NULL)
		at = &(*at)->next;
	*at = build;
	start_waiting(builder);
	return PSR_OK;
}

static void fail(struct build *build, int status)
{
	struct builder *builder = build->builder;
	const struct outcome outcome = { .source = build->job.source, .target = build->job.target,
		                             .last_line = build->last_error, .status = status, .end = build->end,
		                             .limits = &builder->limits };
	struct psr_error failure;
	enum outcome_memory memory = outcome_explain(&failure, &outcome);

	if (memory == OUTCOME_FOR_GOOD)
		failures_add(&builder->failures, build->key, 0, FAILURES_ALWAYS, &failure);
	else if (memory == OUTCOME_FOR_A_WHILE)
		failures_add(&builder->failures, build->key, build->job.resolution,
		             builder->loop->now_us + BUILDER_RETRY_US, &failure);
	finish(build, &failure);
}

static void on_ended(struct build *build, int status)
{
	struct builder *builder = build->builder;
	builder->n_running--;
	lines_finish(&build->progress_lines);
	lines_finish(&build->error_lines);
	if (build->has_unsent)
		send_progress(build);
	if (WIFEXITED(status) && WEXITSTATUS(status) == 0)
		finish(build, NULL);
	else
		fail(build, status);
}

/* Kills the group, with all processes that the child has started. While the child is a zombie, no other process gets
 * its number. */
static void kill_group(pid_t pid)
{
	kill(-pid, SIGKILL);
	kill(pid, SIGKILL);
}

void builder_reap(struct builder *builder)
{
	struct build *build = builder->first;

	while (build != NULL) {
		siginfo_t info = { .si_pid = 0 };
		int status;

		if (build->pid == 0 || waitid(P_PID, (id_t)build->pid, &info, WEXITED | WNOHANG | WNOWAIT) != 0
		    || info.si_pid != build->pid) {
			build = build->next;
			continue;
		}
		kill_group(build->pid);
		waitpid(build->pid, &status, 0);
		on_ended(build, status);
		build = builder->first; /* starts again at the front: the next build may have ended, too */
	}
}

void builder_drop(struct builder *builder, const void *userdata)
{
	struct build *build = builder->first;

	while (build != NULL && build->job.userdata != userdata)
		build = build->next;
	if (build == NULL || build->end != OUTCOME_BY_ITSELF)
		return;
	build->end = OUTCOME_UNWANTED;
	if (build->pid != 0)
		kill_group(build->pid);
	else
		fail(build, SIGKILL);
}

void builder_tick(struct builder *builder)
{
	const uint64_t now_us = builder->loop->now_us, wall_us = builder->limits.wall_seconds * 1000000;

	for (struct build *build = builder->first; build != NULL; build = build->next) {
		if (build->pid == 0)
			continue;
		if (build->n_progress_left < PROGRESS_AT_ONCE)
			build->n_progress_left++;
		if (build->has_unsent)
			send_progress(build);
		lines_tick(&build->progress_lines);
		lines_tick(&build->error_lines);
		if (build->end == OUTCOME_BY_ITSELF && now_us - build->start_us > wall_us) {
			build->end = OUTCOME_WALL;
			kill_group(build->pid);
		}
	}
}

int builder_is_running(const struct builder *builder)
{
	return builder != NULL && builder->n_running > 0;
}

struct builder_stats builder_stats(const struct builder *builder)
{
	struct builder_stats stats = { 0 };

	if (builder == NULL)
		return stats;
	stats = (struct builder_stats){ .n_done = builder->n_done, .n_failed = builder->n_failed };
	for (const struct build *build = builder->first; build != NULL; build = build->next)
		*(build->pid != 0 ? &stats.n_running : &stats.n_waiting) += 1;
	return stats;
}

void builder_destroy(struct builder *builder)
{
	if (builder == NULL)
		return;
	while (builder->first != NULL) {
		struct build *build = builder->first;

		builder->first = build->next;
		if (build->pid != 0) {
			lines_close(&build->progress_lines);
			lines_close(&build->error_lines);
			kill_group(build->pid);
			while (waitpid(build->pid, NULL, 0) < 0 && errno == EINTR)
				;
			remove_remains(build);
		}
		destroy_build(build);
	}
	failures_fini(&builder->failures);
	free(builder);
}

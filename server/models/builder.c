#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include "base/outfile.h"
#include "builder.h"
#include "server/log.h"
#include "spawn.h"

#define MAX_FAILURES 256
#define LINE 512

struct failure {
	char key[CATALOGUE_KEY];
	uint32_t resolution; /* 0: every one */
	struct psr_error error;
};

struct build {
	struct build *next;
	struct builder *builder;
	struct builder_job job; /* its strings are copies, the key's is this: */
	char key[CATALOGUE_KEY];
	pid_t pid;              /* 0: waits for its turn */
	struct loop_source progress_source, error_source;
	char progress_line[LINE], error_line[LINE], last_error[LINE];
	size_t n_progress, n_error;
	struct psr_msg_progress progress;
};

struct builder {
	struct loop *loop;
	struct builder_limits limits;
	struct build *first;    /* in order of arrival, running or not */
	int n_running;
	struct failure *failure[MAX_FAILURES]; /* a ring */
	unsigned n_failures;
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

static void close_pipe(struct build *build, struct loop_source *source)
{
	int fd = source->fd;

	if (fd < 0)
		return;
	loop_remove(build->builder->loop, source);
	close(fd);
}

static enum psr_progress_stage stage_of(const char *name, enum psr_progress_stage now)
{
	static const struct {
		const char *name;
		enum psr_progress_stage stage;
	} names[] = {
		{ "import", PSR_PROGRESS_IMPORT }, { "read", PSR_PROGRESS_IMPORT }, { "load", PSR_PROGRESS_IMPORT },
		{ "rays", PSR_PROGRESS_SAMPLE }, { "sample", PSR_PROGRESS_SAMPLE },
		{ "select", PSR_PROGRESS_SELECT }, { "write", PSR_PROGRESS_WRITE },
	};

	for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
		if (strcmp(name, names[i].name) == 0)
			return names[i].stage;
	return now;
}

static void on_progress_text(struct build *build, const char *line)
{
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
	build->job.on_progress(&build->progress, build->job.userdata);
}

static void on_error_text(struct build *build, const char *line)
{
	static const char prefix[] = "psr-model: ";

	if (strncmp(line, prefix, sizeof prefix - 1) == 0)
		line += sizeof prefix - 1;
	if (line[0] != '\0')
		memcpy(build->last_error, line, strlen(line) + 1);
}

/* Reads all lines that have come; a line of over LINE bytes loses its end. */
static void read_lines(struct build *build, struct loop_source *source, char line[LINE], size_t *used,
                       void (*on_line)(struct build *, const char *))
{
	char bytes[4096];
	ssize_t n;

	while ((n = read(source->fd, bytes, sizeof bytes)) > 0) {
		for (ssize_t i = 0; i < n; i++) {
			if (bytes[i] == '\n') {
				line[*used] = '\0';
				on_line(build, line);
				*used = 0;
			} else if (*used < LINE - 1 && bytes[i] != '\0') {
				line[(*used)++] = bytes[i];
			}
		}
	}
	if (n == 0 || errno != EAGAIN)
		close_pipe(build, source);
}

static void on_progress_ready(uint32_t events, void *userdata)
{
	struct build *build = userdata;

	(void)events;
	read_lines(build, &build->progress_source, build->progress_line, &build->n_progress, on_progress_text);
}

static void on_error_ready(uint32_t events, void *userdata)
{
	struct build *build = userdata;

	(void)events;
	read_lines(build, &build->error_source, build->error_line, &build->n_error, on_error_text);
}

static void watch(struct build *build, struct loop_source *source, int fd, void (*on_ready)(uint32_t, void *))
{
	*source = (struct loop_source){ .fd = fd, .on_ready = on_ready, .userdata = build };
	if (loop_add(build->builder->loop, source, EPOLLIN, NULL) != PSR_OK) {
		close(fd);
		source->fd = -1;
	}
}

/* A limit may hold at a lower resolution; a defect of the source shows at every one. */
static void remember(struct builder *builder, const struct build *build, const struct psr_error *error)
{
	struct failure **place = &builder->failure[builder->n_failures++ % MAX_FAILURES];

	if (*place == NULL)
		*place = malloc(sizeof **place);
	if (*place == NULL)
		return;
	memcpy((*place)->key, build->key, CATALOGUE_KEY);
	(*place)->resolution = error->code == PSR_ERR_LIMIT ? build->job.resolution : 0;
	(*place)->error = *error;
}

const struct psr_error *builder_failure(const struct builder *builder, const char *key, uint32_t resolution)
{
	for (size_t i = 0; i < MAX_FAILURES && builder->failure[i] != NULL; i++) {
		const struct failure *failure = builder->failure[i];

		if (strcmp(failure->key, key) == 0 && (failure->resolution == 0 || failure->resolution == resolution))
			return &failure->error;
	}
	return NULL;
}

static void remove_remains(const struct build *build)
{
	unlink(build->job.target);
	if (build->pid != 0)
		outfile_remove_remains(build->job.target, build->pid);
}

static void start_waiting(struct builder *builder);

/* failure NULL: built. */
static void finish(struct build *build, const struct psr_error *failure)
{
	struct builder *builder = build->builder;
	struct build **at = &builder->first;

	while (*at != build)
		at = &(*at)->next;
	*at = build->next;
	close_pipe(build, &build->progress_source);
	close_pipe(build, &build->error_source);
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
		"--quiet", "--threads", threads, NULL,
	};
	const struct spawn_limits limits = {
		.memory_bytes = builder->limits.memory_bytes, .cpu_seconds = builder->limits.cpu_seconds, .nice = 10,
	};
	int progress_fd, error_fd, code;

	snprintf(threads, sizeof threads, "%d", builder->limits.threads);
	snprintf(resolution, sizeof resolution, "%" PRIu32, build->job.resolution);
	code = spawn_start(&build->pid, &progress_fd, &error_fd, argv, &limits, err);
	if (code != PSR_OK)
		return code;
	builder->n_running++;
	log_info("build of %s started, at %" PRIu32, build->job.source, build->job.resolution);
	watch(build, &build->progress_source, progress_fd, on_progress_ready);
	watch(build, &build->error_source, error_fd, on_error_ready);
	build->progress.stage = PSR_PROGRESS_IMPORT;
	build->job.on_progress(&build->progress, build->job.userdata);
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
			return; /* finish() went on with the rest */
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
	build->progress_source.fd = build->error_source.fd = -1;
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

/* Exit codes are those of psr_exit_status. */
static int explain(struct psr_error *error, const struct build *build, const struct builder_limits *limits, int status)
{
	const char *name = strrchr(build->job.source, '/') != NULL ? strrchr(build->job.source, '/') + 1 : build->job.source;

	if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGKILL))
		return psr_fail(error, PSR_ERR_LIMIT, "%s: the build was stopped: it needed more than %llu s of processor time "
		                "(--build-time), or the machine's memory; a lower --max-resolution takes less of both", name,
		                (unsigned long long)limits->cpu_seconds);
	if (WIFSIGNALED(status))
		return psr_fail(error, PSR_ERR_FORMAT, "%s: psr-model crashed on it (signal %d)", name, WTERMSIG(status));
	psr_fail(error, PSR_ERR_INTERNAL, "%s: %.400s", name,
	         build->last_error[0] != '\0' ? build->last_error : "psr-model failed without saying why");
	switch (WEXITSTATUS(status)) {
	case 3:
		return error->code = PSR_ERR_IO;
	case 4:
		return error->code = PSR_ERR_FORMAT;
	case 5:
		return error->code = PSR_ERR_LIMIT;
	default:
		return error->code;
	}
}

void builder_reap(struct builder *builder)
{
	struct build *build = builder->first;

	while (build != NULL) {
		struct psr_error failure;
		int status;

		if (build->pid == 0 || waitpid(build->pid, &status, WNOHANG) != build->pid) {
			build = build->next;
			continue;
		}
		builder->n_running--;
		if (build->progress_source.fd >= 0)
			on_progress_ready(0, build);
		if (build->error_source.fd >= 0)
			on_error_ready(0, build);
		if (build->n_error > 0) {
			build->error_line[build->n_error] = '\0';
			on_error_text(build, build->error_line);
		}
		if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
			finish(build, NULL);
		} else {
			if (explain(&failure, build, &builder->limits, status) != PSR_ERR_IO)
				remember(builder, build, &failure);
			finish(build, &failure);
		}
		build = builder->first; /* the next one may have ended too */
	}
}

void builder_destroy(struct builder *builder)
{
	if (builder == NULL)
		return;
	while (builder->first != NULL) {
		struct build *build = builder->first;

		builder->first = build->next;
		close_pipe(build, &build->progress_source);
		close_pipe(build, &build->error_source);
		if (build->pid != 0) {
			kill(-build->pid, SIGKILL);
			kill(build->pid, SIGKILL);
			while (waitpid(build->pid, NULL, 0) < 0 && errno == EINTR)
				;
			remove_remains(build);
		}
		destroy_build(build);
	}
	for (size_t i = 0; i < MAX_FAILURES; i++)
		free(builder->failure[i]);
	free(builder);
}

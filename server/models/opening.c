#define _GNU_SOURCE
#include <errno.h>
#include <inttypes.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#include "base/clock.h"
#include "model/cubes.h"
#include "cache.h"
#include "cachekey.h"
#include "opening.h"

/* What takes so much memory is read on all cores for up to many seconds. Threads of a nice value of 5 get a third of
 * what those of frames get, where these want the cores, too: setpriority(2), sched(7). */
#define LARGE_BYTES ((uint64_t)16 << 20)
#define LARGE_NICE 5

static void post(struct opening *o)
{
	loop_post(o->loop, &o->note);
}

static int is_stopped(void *userdata)
{
	const struct opening *o = userdata;

	return atomic_load_explicit(&o->is_stopped, memory_order_relaxed);
}

static void *read_model(void *userdata)
{
	struct opening *o = userdata;
	const struct psr_cancel cancel = { is_stopped, o };

	if (o->bytes >= LARGE_BYTES) /* of this thread, and of those that it starts */
		setpriority(PRIO_PROCESS, (id_t)gettid(), LARGE_NICE);
	o->code = psr_model_read_levels(&o->model, o->file.is_source ? o->cached : o->file.path, o->levels, &cancel,
	                                &o->error);
	/* Here, and not with the first frame: the catalogue counts them. */
	if (o->code == PSR_OK && (o->code = psr_model_make_cubes(o->model, &o->error)) != PSR_OK) {
		psr_model_unref(o->model);
		o->model = NULL;
	}
	return NULL;
}

/* A thread cannot raise its priority again: one of its own reads what is large. */
static void read_aside(struct opening *o)
{
	pthread_t thread;

	if (o->bytes >= LARGE_BYTES && pthread_create(&thread, NULL, read_model, o) == 0)
		pthread_join(thread, NULL);
	else
		read_model(o);
}

void opening_load(void *userdata)
{
	struct opening *o = userdata;

	o->code = PSR_OK;
	if (o->was_built && rename(o->temporary, o->cached) != 0)
		o->code = psr_fail(&o->error, PSR_ERR_IO, "%s: %s", o->cached, strerror(errno));
	else if (o->was_built)
		cache_trim(o->cache, o->max_cache, (const char(*)[CATALOGUE_KEY])o->in_use, o->n_in_use);
	else if (o->file.is_source)
		cache_touch(o->cached);
	if (o->code == PSR_OK)
		read_aside(o);
	post(o);
}

/* The psr-model beside psrd's own executable, else the first in PATH. */
static int find_program(char path[PATH_MAX], struct psr_error *err)
{
	const char *folder = getenv("PATH");
	char own[PATH_MAX], *slash;
	ssize_t n = readlink("/proc/self/exe", own, sizeof own - 1);

	if (n > 0) {
		own[n] = '\0';
		slash = strrchr(own, '/');
		if (slash != NULL && snprintf(path, PATH_MAX, "%.*s/psr-model", (int)(slash - own), own) < PATH_MAX
		    && access(path, X_OK) == 0)
			return PSR_OK;
	}
	while (folder != NULL && *folder != '\0') {
		size_t length = strcspn(folder, ":");

		if (length > 0 && snprintf(path, PATH_MAX, "%.*s/psr-model", (int)length, folder) < PATH_MAX
		    && access(path, X_OK) == 0)
			return PSR_OK;
		folder += length + (folder[length] == ':');
	}
	return psr_fail(err, PSR_ERR_NOT_FOUND,
	                "psr-model, which builds models from sources, is neither beside psrd nor in "
	                "PATH; install it there, or put a .psr file into the models folder");
}

static int prepare_source(struct opening *o)
{
	const char *cache = o->cache;
	int code = find_program(o->program, &o->error);

	if (code == PSR_OK)
		code = cachekey_find(o->key, o->file.path, o->program, &o->error);
	if (code == PSR_OK)
		code = cache_make(cache, &o->error);
	if (code != PSR_OK)
		return code;
	free(o->cached);
	free(o->temporary);
	o->cached = cache_path(cache, o->key, o->resolution);
	/* Unlike names of other openings, and of other daemons that share the folder. */
	if (asprintf(&o->temporary, "%s/.built-%ld-%" PRIx64 ".tmp", cache, (long)getpid(), clock_ns()) < 0)
		o->temporary = NULL;
	if (o->cached == NULL || o->temporary == NULL)
		return psr_fail(&o->error, PSR_ERR_MEMORY, "no memory");
	o->is_cached = cache_find(&o->bytes, o->cached);
	return PSR_OK;
}

void opening_prepare(void *userdata)
{
	struct opening *o = userdata;
	struct stat status;
	uint64_t need;

	o->code = PSR_OK;
	if (o->file.is_source)
		o->code = prepare_source(o);
	else if (psr_model_need(&need, o->file.path, o->levels, NULL) == PSR_OK)
		o->bytes = need;
	else if (stat(o->file.path, &status) == 0) /* loading it will say what is wrong */
		o->bytes = (uint64_t)status.st_size;
	else
		o->code = psr_fail(&o->error, errno == ENOENT ? PSR_ERR_NOT_FOUND : PSR_ERR_IO, "%s", strerror(errno));
	post(o);
}

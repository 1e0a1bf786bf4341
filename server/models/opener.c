#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include "base/pool.h"
#include "opening.h"
#include "server/log.h"

struct opener {
	struct opener_parts parts;
	int is_stopped;
	struct opening *first;
};

int opener_create(struct opener **out, const struct opener_parts *parts)
{
	struct opener *opener = calloc(1, sizeof *opener);

	if (opener == NULL)
		return PSR_ERR_MEMORY;
	opener->parts = *parts;
	*out = opener;
	return PSR_OK;
}

static void destroy_opening(struct opening *o)
{
	while (o->waiters != NULL) {
		struct waiter *waiter = o->waiters;

		o->waiters = waiter->next;
		free(waiter);
	}
	psr_model_unref(o->model);
	free(o->file.path);
	free(o->cached);
	free(o->temporary);
	free(o);
}

void opener_destroy(struct opener *opener)
{
	if (opener == NULL)
		return;
	while (opener->first != NULL) {
		struct opening *o = opener->first;

		opener->first = o->next;
		if (o->reserved > 0)
			catalogue_release(opener->parts.catalogue, o->reserved);
		destroy_opening(o);
	}
	free(opener);
}

static void set_progress(struct opening *o, const struct psr_msg_progress *progress)
{
	if (progress->stage < o->progress.stage)
		return;
	o->progress = *progress;
	for (struct waiter *waiter = o->waiters; waiter != NULL; waiter = waiter->next)
		o->opener->parts.user->on_progress(waiter->client, waiter->id, progress);
}

static void unlink_opening(struct opening *o)
{
	struct opening **at = &o->opener->first;

	while (*at != o)
		at = &(*at)->next;
	*at = o->next;
}

/* The opening's entry, if the catalogue still has it. */
static struct catalogue_entry *entry_of(const struct opening *o)
{
	struct catalogue_entry *entry = catalogue_find(o->opener->parts.catalogue, o->file.name);

	return entry != NULL && strcmp(entry->file.path, o->file.path) == 0 ? entry : NULL;
}

static void end(struct opening *o, struct catalogue_model *model, int code, const char *text)
{
	const struct opener_user *user = o->opener->parts.user;

	unlink_opening(o);
	if (model == NULL)
		log_info("model %s: %s", o->file.name, text);
	while (o->waiters != NULL) {
		struct waiter *waiter = o->waiters;

		o->waiters = waiter->next;
		if (model != NULL)
			user->on_opened(waiter->client, waiter->id, model);
		else
			user->on_refused(waiter->client, waiter->id, code, text);
		free(waiter);
	}
	destroy_opening(o);
}

/* The list shows failures of the file; the system may grant later what it refuses now. */
static void end_failed(struct opening *o, const struct psr_error *error)
{
	struct catalogue_entry *entry = entry_of(o);

	if (entry != NULL && (error->code == PSR_ERR_FORMAT || error->code == PSR_ERR_VERSION
	                      || error->code == PSR_ERR_UNSUPPORTED || error->code == PSR_ERR_INTERNAL))
		entry->has_failed = 1;
	end(o, NULL, error->code, error->text);
}

static void submit(struct opening *o, void (*job)(void *), void (*then)(void *))
{
	o->note = (struct loop_note){ .fn = then, .userdata = o };
	o->has_job = psr_pool_submit(o->opener->parts.io, job, o) == PSR_OK;
	if (!o->has_job)
		end(o, NULL, PSR_ERR_MEMORY, "no memory to open a model");
}

/* Errors name the model, and hide the server's folders. */
static void name_error(struct opening *o)
{
	const char *path = o->file.is_source ? o->cached : o->file.path;
	char text[PSR_ERROR_TEXT];
	const char *rest = o->error.text;

	if (path != NULL && strncmp(rest, path, strlen(path)) == 0)
		rest += strlen(path) + strspn(rest + strlen(path), ": ");
	snprintf(text, sizeof text, "model %.200s: %.300s", o->file.name, rest);
	memcpy(o->error.text, text, sizeof text);
}

static void build(struct opening *o);

static void on_loaded(void *userdata)
{
	struct opening *o = userdata;
	struct catalogue *catalogue = o->opener->parts.catalogue;
	struct psr_model *model = o->model;
	struct catalogue_loaded loaded;
	struct catalogue_model *added;
	uint64_t reserved = o->reserved;

	o->has_job = 0;
	o->reserved = 0;
	o->model = NULL;
	if (o->code != PSR_OK) {
		catalogue_release(catalogue, reserved);
		if (o->is_cached && (o->code == PSR_ERR_FORMAT || o->code == PSR_ERR_VERSION)
		    && !o->opener->is_stopped) {
			log_warn("%s is damaged: building it again", o->cached);
			o->is_cached = 0;
			build(o);
			return;
		}
		name_error(o);
		end_failed(o, &o->error);
		return;
	}
	loaded = (struct catalogue_loaded){ .entry = entry_of(o), .model = model, .key = o->key,
		                                .resolution = o->resolution, .reserved = reserved };
	if (catalogue_add(&added, catalogue, &loaded) != PSR_OK) {
		end(o, NULL, PSR_ERR_MEMORY, "no memory to open a model");
		return;
	}
	log_info("model %s: loaded, %.1f MB", o->file.name, (double)added->bytes * 1e-6);
	end(o, added, PSR_OK, NULL);
	catalogue_unref(catalogue, added);
}

static void load(struct opening *o)
{
	int code = catalogue_reserve(o->opener->parts.catalogue, o->bytes, o->file.name, &o->error);

	if (code != PSR_OK) {
		end_failed(o, &o->error);
		return;
	}
	o->reserved = o->bytes;
	set_progress(o, &(struct psr_msg_progress){ .stage = PSR_PROGRESS_LOAD });
	submit(o, opening_load, on_loaded);
}

static void on_build_progress(const struct psr_msg_progress *progress, void *userdata)
{
	set_progress(userdata, progress);
}

static void on_built(const struct psr_error *failure, void *userdata)
{
	struct opening *o = userdata;
	struct catalogue_entry *entry = entry_of(o);
	struct stat status;

	if (failure != NULL) {
		if (entry != NULL && builder_failure(o->opener->parts.builder, o->key, o->resolution) != NULL)
			entry->has_failed = 1; /* and will, until it changes */
		end_failed(o, failure);
		return;
	}
	o->was_built = 1;
	if (stat(o->temporary, &status) != 0) {
		psr_fail(&o->error, PSR_ERR_INTERNAL, "%s: psr-model left no file", o->file.name);
		end_failed(o, &o->error);
		return;
	}
	o->bytes = (uint64_t)status.st_size;
	load(o);
}

static void build(struct opening *o)
{
	struct builder *builder = o->opener->parts.builder;
	const struct psr_error *failure = builder_failure(builder, o->key, o->resolution);
	const struct builder_job job = {
		.program = o->program, .source = o->file.path, .target = o->temporary, .key = o->key,
		.resolution = o->resolution, .on_progress = on_build_progress, .on_done = on_built, .userdata = o,
	};

	if (failure != NULL)
		end_failed(o, failure);
	else if (builder_start(builder, &job) != PSR_OK)
		end(o, NULL, PSR_ERR_MEMORY, "no memory to build a model");
}

static void on_prepared(void *userdata)
{
	struct opening *o = userdata;
	struct catalogue *catalogue = o->opener->parts.catalogue;
	struct catalogue_entry *entry = entry_of(o);
	struct catalogue_model *model = NULL;

	o->has_job = 0;
	if (o->opener->is_stopped) {
		end(o, NULL, PSR_ERR_CANCELLED, "the server is shutting down");
		return;
	}
	if (o->code != PSR_OK) {
		name_error(o);
		end_failed(o, &o->error);
		return;
	}
	if (o->file.is_source && entry != NULL)
		model = catalogue_model(entry, o->resolution);
	if (model != NULL && strcmp(model->key, o->key) == 0) {
		catalogue_ref(catalogue, model);
		model->is_stale = 0;
		end(o, model, PSR_OK, NULL);
		catalogue_unref(catalogue, model);
		return;
	}
	if (!o->file.is_source || o->is_cached) {
		load(o);
		return;
	}
	build(o);
}

static struct opening *start(struct opener *opener, const struct catalogue_entry *entry, uint32_t resolution)
{
	struct opening *o = calloc(1, sizeof *o);

	if (o == NULL)
		return NULL;
	o->opener = opener;
	o->loop = opener->parts.loop;
	o->cache = opener->parts.cache;
	o->resolution = resolution;
	o->file = entry->file;
	o->file.path = strdup(entry->file.path);
	if (o->file.path == NULL) {
		free(o);
		return NULL;
	}
	o->next = opener->first;
	opener->first = o;
	return o;
}

/* The resolution of the model for pictures of so many pixels (0: unknown): of --resolution, its doubles, and
 * --max-resolution, the first that has nine tenths of them. So the cache holds few models of a source, and which one a
 * client gets depends on nothing else. */
static uint32_t find_resolution(const struct opener_parts *parts, uint32_t pixels)
{
	const uint32_t most = parts->max_resolution;
	uint32_t step = parts->resolution;

	while (step < most && 10 * step < 9 * pixels)
		step *= 2;
	return step < most && pixels != most ? step : most;
}

void opener_open(struct opener *opener, void *client, uint32_t id, const struct psr_msg_open *msg)
{
	const struct opener_user *user = opener->parts.user;
	struct catalogue_entry *entry = catalogue_find(opener->parts.catalogue, msg->name);
	struct catalogue_model *model;
	struct opening *o = opener->first;
	struct waiter *waiter;
	char text[PSR_ERROR_TEXT];
	uint32_t resolution;
	int is_new;

	if (entry == NULL) {
		snprintf(text, sizeof text, "there is no model %.255s; psr list shows all", msg->name);
		user->on_refused(client, id, PSR_ERR_NOT_FOUND, text);
		return;
	}
	if (entry->file.reason != NULL) {
		user->on_refused(client, id, PSR_ERR_UNSUPPORTED, entry->file.reason);
		return;
	}
	resolution = entry->file.is_source ? find_resolution(&opener->parts, msg->resolution) : 0;
	model = catalogue_model(entry, resolution);
	if (model != NULL && !model->is_stale) {
		user->on_opened(client, id, model);
		return;
	}
	while (o != NULL && (o->resolution != resolution || strcmp(o->file.path, entry->file.path) != 0))
		o = o->next;
	is_new = o == NULL;
	waiter = calloc(1, sizeof *waiter);
	if (waiter != NULL && is_new)
		o = start(opener, entry, resolution);
	if (waiter == NULL || o == NULL) {
		free(waiter);
		user->on_refused(client, id, PSR_ERR_MEMORY, "no memory to open a model");
		return;
	}
	*waiter = (struct waiter){ .next = o->waiters, .client = client, .id = id };
	o->waiters = waiter;
	user->on_progress(client, id, &o->progress);
	if (is_new)
		submit(o, opening_prepare, on_prepared);
}

static int remove_waiters(struct opener *opener, const void *client, uint32_t id, int all)
{
	int n = 0;

	for (struct opening *o = opener->first; o != NULL; o = o->next) {
		struct waiter **at = &o->waiters;

		while (*at != NULL) {
			struct waiter *waiter = *at;

			if (waiter->client == client && (all || waiter->id == id)) {
				*at = waiter->next;
				free(waiter);
				n++;
			} else {
				at = &waiter->next;
			}
		}
	}
	return n;
}

int opener_cancel(struct opener *opener, const void *client, uint32_t id)
{
	return remove_waiters(opener, client, id, 0);
}

void opener_forget(struct opener *opener, const void *client)
{
	remove_waiters(opener, client, 0, 1);
}

void opener_stop(struct opener *opener, int code, const char *text)
{
	opener->is_stopped = 1;
	for (struct opening *o = opener->first; o != NULL; o = o->next) {
		while (o->waiters != NULL) {
			struct waiter waiter = *o->waiters;

			free(o->waiters);
			o->waiters = waiter.next;
			opener->parts.user->on_refused(waiter.client, waiter.id, code, text);
		}
	}
}

int opener_is_working(const struct opener *opener)
{
	for (const struct opening *o = opener->first; o != NULL; o = o->next)
		if (o->has_job)
			return 1;
	return 0;
}

#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include "builder.h"
#include "server/net/conn.h"
#include "server/log.h"
#include "opener.h"
#include "opening.h"
#include "server/server.h"

#define MAX_WAITING_PROGRESS 65536

struct opener {
	struct server *server;
	struct opening *first;
};

int opener_create(struct opener **out, struct server *server)
{
	struct opener *opener = calloc(1, sizeof *opener);

	if (opener == NULL)
		return PSR_ERR_MEMORY;
	opener->server = server;
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
			catalogue_release(&opener->server->catalogue, o->reserved);
		destroy_opening(o);
	}
	free(opener);
}

static void send_progress(const struct opening *o, const struct waiter *waiter)
{
	uint8_t bytes[64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (psr_msg_progress_encode(&buf, waiter->id, &o->progress, NULL) == PSR_OK)
		conn_send(waiter->conn, &buf);
}

static void set_progress(struct opening *o, const struct psr_msg_progress *progress)
{
	if (progress->stage < o->progress.stage)
		return;
	o->progress = *progress;
	for (struct waiter *waiter = o->waiters; waiter != NULL; waiter = waiter->next) {
		if (waiter->conn->out.size > MAX_WAITING_PROGRESS)
			continue; /* news for a reader that takes none would only pile up */
		send_progress(o, waiter);
		conn_flush(waiter->conn);
	}
}

static void unlink_opening(struct opening *o)
{
	struct opening **at = &o->opener->first;

	while (*at != o)
		at = &(*at)->next;
	*at = o->next;
}

/* The entry that this opening is about, if the catalogue still has it. */
static struct catalogue_entry *entry_of(const struct opening *o)
{
	struct catalogue_entry *entry = catalogue_find(&o->opener->server->catalogue, o->file.name);

	return entry != NULL && strcmp(entry->file.path, o->file.path) == 0 ? entry : NULL;
}

static void end(struct opening *o, struct catalogue_model *model, int code, const char *text)
{
	unlink_opening(o);
	if (model == NULL)
		log_info("model %s: %s", o->file.name, text);
	while (o->waiters != NULL) {
		struct waiter *waiter = o->waiters;

		o->waiters = waiter->next;
		if (model != NULL)
			session_opened(waiter->conn, waiter->id, model);
		else
			session_refuse(waiter->conn, waiter->id, 0, code, text);
		conn_flush(waiter->conn);
		free(waiter);
	}
	destroy_opening(o);
}

/* What the system refuses now it may grant later; anything else is the file's fault and shows in the list. */
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
	o->has_job = psr_pool_submit(o->opener->server->io, job, o) == PSR_OK;
	if (!o->has_job)
		end(o, NULL, PSR_ERR_MEMORY, "no memory to open a model");
}

/* Errors name the model; folders of the server are nobody's business. */
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
	struct catalogue *catalogue = &o->opener->server->catalogue;
	struct psr_model *model = o->model;
	struct catalogue_model *added;
	uint64_t reserved = o->reserved;

	o->has_job = 0;
	o->reserved = 0;
	o->model = NULL;
	if (o->code != PSR_OK) {
		catalogue_release(catalogue, reserved);
		if (o->is_cached && (o->code == PSR_ERR_FORMAT || o->code == PSR_ERR_VERSION)
		    && !o->opener->server->is_draining) {
			log_warn("%s is damaged, it is built again", o->cached);
			o->is_cached = 0;
			build(o);
			return;
		}
		name_error(o);
		end_failed(o, &o->error);
		return;
	}
	if (catalogue_add(&added, catalogue, entry_of(o), model, o->key, o->resolution, reserved) != PSR_OK) {
		end(o, NULL, PSR_ERR_MEMORY, "no memory to open a model");
		return;
	}
	log_info("model %s: loaded, %.1f MB", o->file.name, (double)added->bytes * 1e-6);
	end(o, added, PSR_OK, NULL);
	catalogue_unref(catalogue, added);
}

static void load(struct opening *o)
{
	int code = catalogue_reserve(&o->opener->server->catalogue, o->bytes, o->file.name, &o->error);

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
		if (entry != NULL && builder_failure(o->opener->server->builder, o->key, o->resolution) != NULL)
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
	struct builder *builder = o->opener->server->builder;
	const struct psr_error *failure = builder_failure(builder, o->key, o->resolution);

	if (failure != NULL)
		end_failed(o, failure);
	else if (builder_start(builder, o->program, o->key, o->resolution, o->file.path, o->temporary, on_build_progress,
	                       on_built, o) != PSR_OK)
		end(o, NULL, PSR_ERR_MEMORY, "no memory to build a model");
}

static void on_prepared(void *userdata)
{
	struct opening *o = userdata;
	struct server *server = o->opener->server;
	struct catalogue_entry *entry = entry_of(o);
	struct catalogue_model *model = NULL;

	o->has_job = 0;
	if (server->is_draining) {
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
		catalogue_ref(&server->catalogue, model);
		model->is_stale = 0;
		end(o, model, PSR_OK, NULL);
		catalogue_unref(&server->catalogue, model);
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
	o->loop = &opener->server->loop;
	o->cache = opener->server->options->cache;
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

/* The resolution at which a source is built for pictures of so many pixels, 0 if that is not known: of --resolution,
 * its doubles, and --max-resolution, the first that has nine tenths of them. So a source has few models in the cache,
 * whatever clients ask for; which one a client gets depends on nothing else; and a model's own resolution asks for
 * it. */
static uint32_t find_resolution(const struct options *options, uint32_t pixels)
{
	const uint32_t most = (uint32_t)options->max_resolution;
	uint32_t step = (uint32_t)options->resolution;

	while (step < most && 10 * step < 9 * pixels)
		step *= 2;
	return step < most && pixels != most ? step : most;
}

void opener_open(struct opener *opener, struct conn *conn, uint32_t id, const struct psr_msg_open *msg)
{
	struct catalogue_entry *entry = catalogue_find(&opener->server->catalogue, msg->name);
	struct catalogue_model *model;
	struct opening *o = opener->first;
	struct waiter *waiter;
	char text[PSR_ERROR_TEXT];
	uint32_t resolution;
	int is_new;

	if (entry == NULL) {
		snprintf(text, sizeof text, "there is no model %.255s; psr list shows those that there are", msg->name);
		session_refuse(conn, id, 0, PSR_ERR_NOT_FOUND, text);
		return;
	}
	if (entry->file.reason != NULL) {
		session_refuse(conn, id, 0, PSR_ERR_UNSUPPORTED, entry->file.reason);
		return;
	}
	resolution = entry->file.is_source ? find_resolution(opener->server->options, msg->resolution) : 0;
	model = catalogue_model(entry, resolution);
	if (model != NULL && !model->is_stale) {
		session_opened(conn, id, model);
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
		session_refuse(conn, id, 0, PSR_ERR_MEMORY, "no memory to open a model");
		return;
	}
	*waiter = (struct waiter){ .next = o->waiters, .conn = conn, .id = id };
	o->waiters = waiter;
	send_progress(o, waiter);
	if (is_new)
		submit(o, opening_prepare, on_prepared);
}

static int remove_waiters(struct opener *opener, const struct conn *conn, uint32_t id, int all)
{
	int n = 0;

	for (struct opening *o = opener->first; o != NULL; o = o->next) {
		struct waiter **at = &o->waiters;

		while (*at != NULL) {
			struct waiter *waiter = *at;

			if (waiter->conn == conn && (all || waiter->id == id)) {
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

int opener_cancel(struct opener *opener, struct conn *conn, uint32_t id)
{
	return remove_waiters(opener, conn, id, 0);
}

void opener_forget(struct opener *opener, struct conn *conn)
{
	remove_waiters(opener, conn, 0, 1);
}

void opener_refuse_all(struct opener *opener, int code, const char *text)
{
	for (struct opening *o = opener->first; o != NULL; o = o->next) {
		while (o->waiters != NULL) {
			struct waiter waiter = *o->waiters;

			free(o->waiters);
			o->waiters = waiter.next;
			session_refuse(waiter.conn, waiter.id, 0, code, text);
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

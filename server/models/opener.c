#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "hide.h"
#include "opening.h"
#include "psr/mesh.h"
#include "server/log.h"

#define GRACE_US 1000000 /* time for a client to reconnect and ask again before psrd drops its build */

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
	if (o->reserved > 0)
		catalogue_release(o->opener->parts.catalogue, o->reserved);
	psr_model_unref(o->model);
	free(o->file.path);
	free(o->cached);
	free(o->temporary);
	free(o->in_use);
	free(o);
}

void opener_destroy(struct opener *opener)
{
	if (opener == NULL)
		return;
	while (opener->first != NULL) {
		struct opening *o = opener->first;

		opener->first = o->next;
		catalogue_unclaim(opener->parts.catalogue, &o->claim);
		destroy_opening(o);
	}
	free(opener);
}

void opener_progress(struct opening *o, const struct psr_msg_progress *progress)
{
	if (progress->stage < o->progress.stage)
		return;
	o->progress = *progress;
	for (struct waiter *waiter = o->waiters; waiter != NULL; waiter = waiter->next)
		if (waiter->model == NULL)
			o->opener->parts.user->on_progress(waiter->client, waiter->id, progress);
}

static void unlink_opening(struct opening *o)
{
	struct opening **at = &o->opener->first;

	while (*at != o)
		at = &(*at)->next;
	*at = o->next;
}

struct catalogue_entry *opener_entry(const struct opening *o)
{
	struct catalogue_entry *entry = catalogue_find(o->opener->parts.catalogue, o->file.name);

	return entry != NULL && strcmp(entry->file.path, o->file.path) == 0 ? entry : NULL;
}

int opener_has(const struct opening *o, int is_rebuild)
{
	const struct waiter *waiter = o->waiters;

	while (waiter != NULL && (waiter->model != NULL) != is_rebuild)
		waiter = waiter->next;
	return waiter != NULL;
}

/* If a model that was to come back is in memory by now, it came another way: the one that was read is not needed. */
static void tell(struct opening *o, const struct waiter *waiter, struct catalogue_model *model,
                 const struct psr_error *error)
{
	const struct opener_user *user = o->opener->parts.user;

	if (waiter->model != NULL)
		o->opener->parts.on_rebuilt(waiter->model, error);
	else if (error == NULL)
		user->on_opened(waiter->client, waiter->id, model);
	else
		user->on_refused(waiter->client, waiter->id, error->code, error->text);
}

void opener_end(struct opening *o, struct catalogue_model *model, const struct psr_error *error)
{
	const char *const folders[] = { o->opener->parts.models, o->opener->parts.cache };
	struct psr_error shown = { 0 };

	unlink_opening(o);
	if (error != NULL) {
		log_info("model %s: %s", o->file.name, error->text);
		shown = *error;
		hide_paths(shown.text, folders, sizeof folders / sizeof folders[0]);
	}
	while (o->waiters != NULL) {
		struct waiter waiter = *o->waiters;

		free(o->waiters);
		o->waiters = waiter.next;
		tell(o, &waiter, model, error != NULL ? &shown : NULL);
	}
	destroy_opening(o);
}

static struct opening *start(struct opener *opener, const struct catalogue_entry *entry, uint32_t resolution,
                             uint32_t levels)
{
	struct opening *o = calloc(1, sizeof *o);

	if (o == NULL)
		return NULL;
	o->opener = opener;
	o->loop = opener->parts.loop;
	o->cache = opener->parts.cache;
	o->max_cache = opener->parts.max_cache;
	o->resolution = resolution;
	o->levels = levels;
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

/* Chooses the resolution of a model for pictures of so many pixels (0: unknown): the first of --resolution, its
 * doubles, and --max-resolution that has nine tenths of these pixels. So the cache holds few models of a source, and
 * nothing else decides which one a client gets. Clouds are octrees, as fine as their points, above a first look. */
static uint32_t find_resolution(const struct opener_parts *parts, uint32_t pixels, int is_cloud)
{
	const uint32_t most = parts->max_resolution;
	uint32_t step = parts->resolution;

	while (step < most && 10 * step < 9 * pixels && !(is_cloud && step > PSR_PREVIEW_RESOLUTION))
		step *= 2;
	return step < most && (pixels != most || is_cloud) ? step : most;
}

/* Finds the shortest beginning of at least so many levels. Returns its levels; 0: all of the file is needed. */
static uint32_t find_levels(const struct catalogue_file *file, uint32_t levels)
{
	const uint32_t enough = file->beginnings >> levels;

	return levels > 0 && enough != 0 ? levels + (uint32_t)__builtin_ctz(enough) : 0;
}

/* Has `who` wait for the entry's model of this resolution and levels. MEMORY. */
static int wait_for(struct opener *opener, const struct catalogue_entry *entry, uint32_t resolution, uint32_t levels,
                    const struct waiter *who)
{
	struct opening *o = opener->first;
	struct waiter *waiter = malloc(sizeof *waiter);
	int is_new;

	while (o != NULL && (o->resolution != resolution || o->levels != levels
	                     || strcmp(o->file.path, entry->file.path) != 0))
		o = o->next;
	is_new = o == NULL;
	if (waiter != NULL && is_new)
		o = start(opener, entry, resolution, levels);
	if (waiter == NULL || o == NULL) {
		free(waiter);
		return PSR_ERR_MEMORY;
	}
	*waiter = *who;
	waiter->next = o->waiters;
	o->waiters = waiter;
	if (who->model == NULL)
		opener->parts.user->on_progress(who->client, who->id, &o->progress);
	if (is_new)
		opening_start(o);
	return PSR_OK;
}

void opener_open(struct opener *opener, void *client, uint32_t id, const struct psr_msg_open *msg)
{
	const struct opener_user *user = opener->parts.user;
	const struct waiter waiter = { .client = client, .id = id };
	struct catalogue_entry *entry = catalogue_find(opener->parts.catalogue, msg->name);
	struct catalogue_model *model;
	char text[PSR_ERROR_TEXT];
	uint32_t resolution = 0, levels = 0;

	if (entry == NULL) {
		snprintf(text, sizeof text, "there is no model %.255s; psr list shows all", msg->name);
		user->on_refused(client, id, PSR_ERR_NOT_FOUND, text);
		return;
	}
	if (entry->file.reason != NULL) {
		user->on_refused(client, id, PSR_ERR_UNSUPPORTED, entry->file.reason);
		return;
	}
	if (entry->file.is_source)
		resolution = find_resolution(&opener->parts, msg->resolution, catalogue_is_cloud(entry->file.path));
	else
		levels = find_levels(&entry->file, msg->levels);
	model = catalogue_model(entry, resolution, levels);
	if (model != NULL && !model->is_stale)
		user->on_opened(client, id, model);
	else if (wait_for(opener, entry, resolution, levels, &waiter) != PSR_OK)
		user->on_refused(client, id, PSR_ERR_MEMORY, "no memory to open a model");
}

int opener_rebuild(struct opener *opener, struct catalogue_model *model)
{
	const struct waiter waiter = { .client = model, .model = model };

	if (opener->is_stopped)
		return PSR_ERR_CANCELLED;
	return wait_for(opener, model->entry, model->resolution, 0, &waiter);
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
		if (o->waiters == NULL && o->is_loading)
			atomic_store(&o->is_stopped, 1);
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

void opener_tick(struct opener *opener)
{
	const uint64_t now_us = opener->parts.loop->now_us;

	for (struct opening *o = opener->first; o != NULL; o = o->next) {
		if (o->waiters != NULL)
			o->unwanted_us = 0;
		else if (o->unwanted_us == 0)
			o->unwanted_us = now_us;
		else if (o->is_building && !opener->is_stopped && now_us - o->unwanted_us >= GRACE_US) {
			builder_drop(opener->parts.builder, o);
			return; /* the list may have changed */
		}
	}
}

void opener_stop(struct opener *opener, int code, const char *text)
{
	struct psr_error error;

	psr_fail(&error, code, "%s", text);
	opener->is_stopped = 1;
	for (struct opening *o = opener->first; o != NULL; o = o->next) {
		atomic_store(&o->is_stopped, 1);
		while (o->waiters != NULL) {
			struct waiter waiter = *o->waiters;

			free(o->waiters);
			o->waiters = waiter.next;
			tell(o, &waiter, NULL, &error);
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

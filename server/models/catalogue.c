#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include "catalogue.h"
#include "server/log.h"

void catalogue_init(struct catalogue *catalogue, uint64_t max_bytes)
{
	*catalogue = (struct catalogue){ .max_bytes = max_bytes };
}

static void leave_entry(struct catalogue_model *model)
{
	struct catalogue_model **at = &model->entry->model;

	while (*at != model)
		at = &(*at)->of_entry;
	*at = model->of_entry;
	model->entry = NULL;
}

static void drop(struct catalogue *catalogue, struct catalogue_model *model)
{
	struct catalogue_model **at = &catalogue->models;

	assert(model->n_users == 0);
	while (*at != model)
		at = &(*at)->next;
	*at = model->next;
	if (model->entry != NULL)
		leave_entry(model);
	catalogue->bytes -= model->bytes;
	catalogue->n_models--;
	psr_model_unref(model->model);
	free(model);
}

static void detach(struct catalogue *catalogue, struct catalogue_model *model)
{
	leave_entry(model);
	if (model->n_users == 0)
		drop(catalogue, model);
}

static void destroy_entries(struct catalogue *catalogue)
{
	for (size_t i = 0; i < catalogue->n; i++) {
		while (catalogue->entry[i].model != NULL)
			detach(catalogue, catalogue->entry[i].model);
		catalogue_file_fini(&catalogue->entry[i].file);
	}
	free(catalogue->entry);
	catalogue->entry = NULL;
	catalogue->n = 0;
}

void catalogue_fini(struct catalogue *catalogue)
{
	destroy_entries(catalogue);
	assert(catalogue->models == NULL && catalogue->reserved == 0);
}

static int is_same_file(const struct catalogue_file *a, const struct catalogue_file *b)
{
	return strcmp(a->path, b->path) == 0 && a->is_source == b->is_source && !a->reason == !b->reason
	       && a->bytes == b->bytes
	       && a->device == b->device && a->inode == b->inode && a->modified_ns == b->modified_ns;
}

int catalogue_adopt(struct catalogue *catalogue, struct catalogue_listing *listing)
{
	struct catalogue_entry *entry = calloc(listing->n > 0 ? listing->n : 1, sizeof *entry);

	if (entry == NULL) {
		catalogue_listing_destroy(listing);
		return PSR_ERR_MEMORY;
	}
	for (size_t i = 0; i < listing->n; i++) {
		struct catalogue_entry *old = catalogue_find(catalogue, listing->file[i].name);

		entry[i].file = listing->file[i];
		entry[i].has_failed = entry[i].file.is_broken || entry[i].file.reason != NULL;
		if (old != NULL && is_same_file(&old->file, &entry[i].file)) {
			entry[i].model = old->model;
			for (struct catalogue_model *model = old->model; model != NULL; model = model->of_entry) {
				model->entry = &entry[i];
				model->is_stale = entry[i].file.is_source;
			}
			old->model = NULL;
			memcpy(entry[i].content_id, old->content_id, sizeof old->content_id);
			entry[i].has_failed = old->has_failed;
		}
	}
	destroy_entries(catalogue);
	catalogue->entry = entry;
	catalogue->n = listing->n;
	free(listing->file);
	free(listing);
	return PSR_OK;
}

static int compare_name(const void *name, const void *entry)
{
	return strcmp(name, ((const struct catalogue_entry *)entry)->file.name);
}

struct catalogue_entry *catalogue_find(struct catalogue *catalogue, const char *name)
{
	if (catalogue->n == 0)
		return NULL;
	return bsearch(name, catalogue->entry, catalogue->n, sizeof *catalogue->entry, compare_name);
}

/* Drops unused models, the least recently used first, until `bytes` more fit. 1: they fit. */
static int make_room(struct catalogue *catalogue, uint64_t bytes)
{
	for (;;) {
		struct catalogue_model *oldest = NULL;
		uint64_t held = catalogue->bytes + catalogue->reserved;

		if (held <= catalogue->max_bytes && bytes <= catalogue->max_bytes - held)
			return 1;
		for (struct catalogue_model *model = catalogue->models; model != NULL; model = model->next)
			if (model->n_users == 0 && (oldest == NULL || model->last_use < oldest->last_use))
				oldest = model;
		if (oldest == NULL)
			return 0;
		log_info("model %s: dropped from memory", oldest->entry != NULL ? oldest->entry->file.name : "(replaced)");
		drop(catalogue, oldest);
	}
}

int catalogue_reserve(struct catalogue *catalogue, uint64_t bytes, const char *name, struct psr_error *err)
{
	const double mb = 1e-6;

	if (bytes > catalogue->max_bytes)
		return psr_fail(err, PSR_ERR_LIMIT,
		                "model %s needs %.1f MB of memory; this server holds models of %.1f MB at most "
		                "(--max-memory)",
		                name, (double)bytes * mb, (double)catalogue->max_bytes * mb);
	if (!make_room(catalogue, bytes))
		return psr_fail(err, PSR_ERR_LIMIT,
		                "model %s needs %.1f MB of memory, and models in use hold %.1f of this server's %.1f MB "
		                "(--max-memory); close others, or try again later",
		                name, (double)bytes * mb, (double)(catalogue->bytes + catalogue->reserved) * mb,
		                (double)catalogue->max_bytes * mb);
	catalogue->reserved += bytes;
	return PSR_OK;
}

void catalogue_release(struct catalogue *catalogue, uint64_t bytes)
{
	assert(bytes <= catalogue->reserved);
	catalogue->reserved -= bytes;
}

struct catalogue_model *catalogue_model(const struct catalogue_entry *entry, uint32_t resolution)
{
	struct catalogue_model *model = entry->model;

	while (model != NULL && model->resolution != resolution)
		model = model->of_entry;
	return model;
}

int catalogue_add(struct catalogue_model **out, struct catalogue *catalogue, const struct catalogue_loaded *loaded)
{
	struct catalogue_entry *entry = loaded->entry;
	struct catalogue_model *added = calloc(1, sizeof *added), *old;

	catalogue_release(catalogue, loaded->reserved);
	if (added == NULL) {
		psr_model_unref(loaded->model);
		return PSR_ERR_MEMORY;
	}
	*added = (struct catalogue_model){
		.model = loaded->model, .entry = entry, .bytes = psr_model_bytes(loaded->model),
		.last_use = ++catalogue->clock, .n_users = 1, .resolution = loaded->resolution, .next = catalogue->models,
	};
	strncpy(added->key, loaded->key, sizeof added->key - 1);
	if (entry != NULL) {
		old = catalogue_model(entry, loaded->resolution);
		if (old != NULL)
			detach(catalogue, old);
		added->of_entry = entry->model;
		entry->model = added;
		entry->has_failed = 0;
		psr_model_content_id(loaded->model, entry->content_id);
	}
	catalogue->models = added;
	catalogue->bytes += added->bytes;
	catalogue->n_models++;
	make_room(catalogue, 0);
	*out = added;
	return PSR_OK;
}

struct catalogue_model *catalogue_ref(struct catalogue *catalogue, struct catalogue_model *model)
{
	model->n_users++;
	model->last_use = ++catalogue->clock;
	return model;
}

void catalogue_unref(struct catalogue *catalogue, struct catalogue_model *model)
{
	assert(model->n_users > 0);
	model->last_use = ++catalogue->clock;
	if (--model->n_users > 0)
		return;
	if (model->entry == NULL)
		drop(catalogue, model);
	else
		make_room(catalogue, 0);
}

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include "catalogue.h"

void catalogue_init(struct catalogue *catalogue, uint64_t max_bytes)
{
	*catalogue = (struct catalogue){ .max_bytes = max_bytes };
	catalogue->last_claim = &catalogue->first_claim;
}

void catalogue_fini(struct catalogue *catalogue)
{
	for (size_t i = 0; i < catalogue->n; i++)
		while (catalogue->entry[i].model != NULL)
			catalogue_detach(catalogue, catalogue->entry[i].model);
	for (size_t i = 0; i < catalogue->n; i++)
		catalogue_file_fini(&catalogue->entry[i].file);
	free(catalogue->entry);
	catalogue->entry = NULL;
	catalogue->n = 0;
	assert(catalogue->n_models == 0 && catalogue->reserved == 0 && catalogue->first_claim == NULL);
}

static int is_same_file(const struct catalogue_file *a, const struct catalogue_file *b)
{
	return strcmp(a->path, b->path) == 0 && a->is_source == b->is_source && !a->reason == !b->reason
	       && a->bytes == b->bytes
	       && a->device == b->device && a->inode == b->inode && a->modified_ns == b->modified_ns;
}

static void inherit(struct catalogue_entry *entry, struct catalogue_entry *old)
{
	entry->model = old->model;
	for (struct catalogue_model *model = old->model; model != NULL; model = model->of_entry) {
		model->entry = entry;
		model->is_stale = entry->file.is_source;
	}
	old->model = NULL;
	memcpy(entry->content_id, old->content_id, sizeof old->content_id);
	entry->has_failed = old->has_failed;
}

static void destroy_job(void *listing)
{
	catalogue_listing_destroy(listing);
}

/* Both lists are sorted, so one walk compares them. Entries that are left over are freed off the loop. */
void catalogue_adopt(struct catalogue *catalogue, struct catalogue_listing *listing)
{
	struct catalogue_entry *entry = listing->entry, *old = catalogue->entry;
	const size_t n = listing->n, n_old = catalogue->n;
	const struct pool_job destroy = { .fn = destroy_job, .userdata = listing };

	for (size_t i = 0, k = 0; k < n_old; k++) {
		int order = 1;

		while (i < n && (order = strcmp(entry[i].file.name, old[k].file.name)) < 0)
			i++;
		if (i < n && order == 0 && is_same_file(&old[k].file, &entry[i].file))
			inherit(&entry[i], &old[k]);
		while (old[k].model != NULL)
			catalogue_detach(catalogue, old[k].model);
	}
	catalogue->entry = entry;
	catalogue->n = n;
	*listing = (struct catalogue_listing){ .entry = old, .n = n_old };
	if (catalogue->io == NULL || psr_pool_submit(catalogue->io, &destroy) != PSR_OK)
		catalogue_listing_destroy(listing);
	catalogue_try_claims(catalogue);
}

int catalogue_has_sources(const struct catalogue *catalogue)
{
	for (size_t i = 0; i < catalogue->n; i++)
		if (catalogue->entry[i].file.is_source && catalogue->entry[i].file.reason == NULL)
			return 1;
	return 0;
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

struct catalogue_model *catalogue_model(const struct catalogue_entry *entry, uint32_t resolution, uint32_t levels)
{
	struct catalogue_model *model = entry->model;

	while (model != NULL && (model->resolution != resolution || model->levels != levels))
		model = model->of_entry;
	return model;
}

int catalogue_is_loaded(const struct catalogue_entry *entry)
{
	const struct catalogue_model *model = entry->model;

	while (model != NULL && model->model == NULL)
		model = model->of_entry;
	return model != NULL;
}

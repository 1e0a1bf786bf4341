#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include "catalogue.h"
#include "server/log.h"

#define MAX_OVERTAKES 256

static const char *name_of(const struct catalogue_model *model)
{
	return model->entry != NULL ? model->entry->file.name : "(replaced)";
}

/* ---- in order of last use: models in memory without pins ---- */

static int is_evictable(const struct catalogue_model *model)
{
	return model->model != NULL && model->n_pins == 0;
}

static void add_newest(struct catalogue *catalogue, struct catalogue_model *model)
{
	model->newer = NULL;
	model->older = catalogue->newest;
	*(catalogue->newest != NULL ? &catalogue->newest->newer : &catalogue->oldest) = model;
	catalogue->newest = model;
}

static void take_out(struct catalogue *catalogue, struct catalogue_model *model)
{
	*(model->older != NULL ? &model->older->newer : &catalogue->oldest) = model->newer;
	*(model->newer != NULL ? &model->newer->older : &catalogue->newest) = model->older;
	model->older = model->newer = NULL;
}

static void touch(struct catalogue *catalogue, struct catalogue_model *model)
{
	if (!is_evictable(model))
		return;
	take_out(catalogue, model);
	add_newest(catalogue, model);
}

/* ---- leaving ---- */

static void let_go_job(void *model)
{
	psr_model_unref(model);
}

void catalogue_let_go(struct catalogue *catalogue, struct psr_model *model)
{
	const struct pool_job job = { .fn = let_go_job, .userdata = model };

	if (model != NULL && (catalogue->io == NULL || psr_pool_submit(catalogue->io, &job) != PSR_OK))
		psr_model_unref(model);
}

static void leave_entry(struct catalogue_model *model)
{
	struct catalogue_model **at = &model->entry->model;

	while (*at != model)
		at = &(*at)->of_entry;
	*at = model->of_entry;
	model->of_entry = NULL;
	model->entry = NULL;
}

/* An unused model is worth keeping while it is in memory and requests can find it. */
static void forget_if_useless(struct catalogue_model *model)
{
	if (model->n_users > 0 || model->model != NULL)
		return;
	assert(model->n_pins == 0 && model->coming == NULL);
	if (model->entry != NULL)
		leave_entry(model);
	card_fini(&model->card);
	free(model);
}

static void evict(struct catalogue *catalogue, struct catalogue_model *model)
{
	take_out(catalogue, model);
	catalogue->bytes -= model->bytes;
	catalogue->n_models--;
	catalogue->n_left += model->n_users > 0;
	catalogue_let_go(catalogue, model->model);
	model->model = NULL;
	forget_if_useless(model);
}

void catalogue_detach(struct catalogue *catalogue, struct catalogue_model *model)
{
	leave_entry(model);
	if (model->n_users == 0 && is_evictable(model))
		evict(catalogue, model);
	else
		forget_if_useless(model);
}

/* Returns the longest unused model that can come back; else one that cannot, since its file has changed. NULL: all are
 * pinned. */
static struct catalogue_model *find_victim(const struct catalogue *catalogue)
{
	struct catalogue_model *model = catalogue->oldest;

	while (model != NULL && model->entry == NULL && model->key[0] == '\0')
		model = model->newer;
	return model != NULL ? model : catalogue->oldest;
}

uint64_t catalogue_make_room(struct catalogue *catalogue, uint64_t bytes)
{
	const uint64_t before = catalogue->bytes;
	struct catalogue_model *model;

	while (before - catalogue->bytes < bytes && (model = find_victim(catalogue)) != NULL) {
		log_info("model %s: leaves memory, %.1f MB", name_of(model), (double)model->bytes * 1e-6);
		evict(catalogue, model);
	}
	return before - catalogue->bytes;
}

/* ---- room ---- */

/* Returns the bytes that others leave free. If these are fewer than `wanted`, unpinned models leave before others give
 * up what they keep for later. */
static uint64_t most_of_models(const struct catalogue *catalogue, uint64_t wanted)
{
	const uint64_t pinned = catalogue->pinned + catalogue->reserved;
	uint64_t held = 0;

	if (catalogue->others.held == NULL)
		return catalogue->max_bytes;
	held = catalogue->others.held(0, catalogue->others.userdata);
	if (held + pinned + wanted > catalogue->max_bytes)
		held = catalogue->others.held(held + pinned + wanted - catalogue->max_bytes, catalogue->others.userdata);
	return held < catalogue->max_bytes ? catalogue->max_bytes - held : 0;
}

int catalogue_reserve(struct catalogue *catalogue, uint64_t bytes, const char *name, struct psr_error *err)
{
	const uint64_t kept = catalogue->pinned + catalogue->reserved, most = most_of_models(catalogue, bytes);
	const double mb = 1e-6;
	uint64_t held;

	if (bytes > catalogue->max_bytes)
		return psr_fail(err, PSR_ERR_LIMIT,
		                "model %s needs %.1f MB of memory; this server holds models of %.1f MB at most "
		                "(--max-memory)", name, (double)bytes * mb, (double)catalogue->max_bytes * mb);
	if (bytes > most || kept > most - bytes)
		return psr_fail(err, PSR_ERR_BUSY,
		                "model %s needs %.1f MB of memory; models being drawn or read, and pictures, hold %.1f of this "
		                "server's %.1f MB (--max-memory); try again later", name, (double)bytes * mb,
		                (double)(kept + catalogue->max_bytes - most) * mb, (double)catalogue->max_bytes * mb);
	held = catalogue->bytes + catalogue->reserved;
	if (held > most - bytes)
		catalogue_make_room(catalogue, held - (most - bytes));
	catalogue->reserved += bytes;
	return PSR_OK;
}

/* A claim that succeeds may free room for the next, or take it, so claims are tried in order, one at a time. */
void catalogue_try_claims(struct catalogue *catalogue)
{
	if (catalogue->is_trying)
		return;
	catalogue->is_trying = 1;
	while (catalogue->first_claim != NULL) {
		struct catalogue_claim *claim = catalogue->first_claim;

		if (!claim->try(claim->userdata))
			break;
	}
	catalogue->is_trying = 0;
}

void catalogue_claim(struct catalogue *catalogue, struct catalogue_claim *claim)
{
	claim->next = NULL;
	claim->n_overtaken = 0;
	*catalogue->last_claim = claim;
	catalogue->last_claim = &claim->next;
	catalogue_try_claims(catalogue);
}

void catalogue_unclaim(struct catalogue *catalogue, struct catalogue_claim *claim)
{
	struct catalogue_claim **at = &catalogue->first_claim;

	while (*at != NULL && *at != claim)
		at = &(*at)->next;
	if (*at == NULL)
		return;
	*at = claim->next;
	if (catalogue->last_claim == &claim->next)
		catalogue->last_claim = at;
	catalogue_try_claims(catalogue); /* the next claim may need less */
}

int catalogue_overtake(struct catalogue *catalogue)
{
	return catalogue->first_claim == NULL || catalogue->first_claim->n_overtaken++ < MAX_OVERTAKES;
}

void catalogue_release(struct catalogue *catalogue, uint64_t bytes)
{
	assert(bytes <= catalogue->reserved);
	catalogue->reserved -= bytes;
	catalogue_try_claims(catalogue);
}

/* ---- coming ---- */

static void take_in(struct catalogue *catalogue, struct catalogue_model *model, struct psr_model *returned,
                    uint64_t reserved)
{
	assert(model->model == NULL);
	model->model = returned;
	model->bytes = psr_model_bytes(returned);
	catalogue->bytes += model->bytes;
	catalogue->n_models++;
	if (model->n_pins == 0)
		add_newest(catalogue, model);
	else
		catalogue->pinned += model->bytes;
	if (catalogue->bytes > catalogue->max_bytes) /* the file's header promised a smaller model */
		catalogue_make_room(catalogue, catalogue->bytes - catalogue->max_bytes);
	catalogue_release(catalogue, reserved);
}

void catalogue_return(struct catalogue *catalogue, struct catalogue_model *model, struct psr_model *returned,
                      uint64_t reserved)
{
	catalogue->n_returned++;
	take_in(catalogue, model, returned, reserved);
}

static struct catalogue_model *create(const struct catalogue_loaded *loaded)
{
	struct catalogue_model *model = calloc(1, sizeof *model);

	if (model == NULL)
		return NULL;
	if (card_init(&model->card, loaded->model) != PSR_OK) {
		free(model);
		return NULL;
	}
	model->resolution = loaded->resolution;
	model->levels = loaded->levels;
	strncpy(model->key, loaded->key, sizeof model->key - 1);
	return model;
}

static int is_same(const struct catalogue_model *model, const struct catalogue_loaded *loaded)
{
	uint8_t content_id[16];

	psr_model_content_id(loaded->model, content_id);
	return model->model == NULL && strcmp(model->key, loaded->key) == 0
	       && memcmp(model->card.content_id, content_id, sizeof content_id) == 0;
}

/* Replaces the entry's old model. */
static void enter(struct catalogue *catalogue, struct catalogue_model *model, struct catalogue_entry *entry)
{
	struct catalogue_model *old = catalogue_model(entry, model->resolution, model->levels);

	if (old != NULL)
		catalogue_detach(catalogue, old);
	model->entry = entry;
	model->of_entry = entry->model;
	entry->model = model;
	memcpy(entry->content_id, model->card.content_id, sizeof entry->content_id);
}

int catalogue_add(struct catalogue_model **out, struct catalogue *catalogue, const struct catalogue_loaded *loaded)
{
	struct catalogue_entry *entry = loaded->entry;
	struct catalogue_model *model = entry != NULL ? catalogue_model(entry, loaded->resolution, loaded->levels) : NULL;

	if (model == NULL || !is_same(model, loaded)) {
		model = create(loaded);
		if (model == NULL) {
			catalogue_let_go(catalogue, loaded->model);
			catalogue_release(catalogue, loaded->reserved);
			return PSR_ERR_MEMORY;
		}
		if (entry != NULL)
			enter(catalogue, model, entry);
	}
	if (entry != NULL)
		entry->has_failed = 0;
	model->is_stale = 0;
	catalogue->n_returned += model->n_users > 0;
	model->n_users++;
	*out = model;
	take_in(catalogue, model, loaded->model, loaded->reserved);
	return PSR_OK;
}

/* ---- users and pins ---- */

struct catalogue_model *catalogue_ref(struct catalogue *catalogue, struct catalogue_model *model)
{
	model->n_users++;
	touch(catalogue, model);
	return model;
}

void catalogue_unref(struct catalogue *catalogue, struct catalogue_model *model)
{
	assert(model->n_users > 0);
	touch(catalogue, model);
	if (--model->n_users > 0)
		return;
	if (model->entry == NULL && is_evictable(model)) {
		evict(catalogue, model);
		catalogue_try_claims(catalogue);
	} else {
		forget_if_useless(model);
	}
}

void catalogue_pin(struct catalogue *catalogue, struct catalogue_model *model)
{
	if (is_evictable(model)) {
		take_out(catalogue, model);
		catalogue->pinned += model->bytes;
	}
	model->n_pins++;
}

void catalogue_unpin(struct catalogue *catalogue, struct catalogue_model *model)
{
	assert(model->n_pins > 0);
	if (--model->n_pins > 0 || model->model == NULL)
		return;
	catalogue->pinned -= model->bytes;
	add_newest(catalogue, model);
	catalogue_try_claims(catalogue);
}

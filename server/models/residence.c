#include <stdlib.h>
#include <string.h>
#include "cache.h"
#include "residence.h"
#include "model/cubes.h"
#include "server/log.h"

#define MAX_TRIES 4 /* the first model may leave again before the last one is there */

struct coming { /* a model on its way back; counts as one of its users */
	struct coming *next;
	struct residence *residence;
	struct catalogue_model *model;
	struct residence_need *first; /* needs that wait for it; they have pins, unless it is built again */
	struct loop_note note;
	uint64_t reserved;
	int is_rebuilding;
	/* Belong to the job: */
	char *path;
	struct psr_model *read;
	struct psr_error error;
	int code;
};

struct residence {
	struct residence_parts parts;
	struct coming *first;
};

int residence_create(struct residence **out, const struct residence_parts *parts)
{
	struct residence *residence = calloc(1, sizeof *residence);

	if (residence == NULL)
		return PSR_ERR_MEMORY;
	residence->parts = *parts;
	*out = residence;
	return PSR_OK;
}

/* ---- pins ---- */

static void pin(struct residence_need *need)
{
	for (uint32_t i = 0; i < need->n; i++)
		catalogue_pin(need->residence->parts.catalogue, need->model[i]);
	need->is_pinned = 1;
}

static void unpin(struct residence_need *need)
{
	if (!need->is_pinned)
		return;
	need->is_pinned = 0;
	residence_put(need->residence, need->model, need->n);
}

void residence_put(struct residence *residence, struct catalogue_model *const *model, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++)
		catalogue_unpin(residence->parts.catalogue, model[i]);
}

/* ---- one model ---- */

static void unlink_coming(struct coming *coming)
{
	struct coming **at = &coming->residence->first;

	while (*at != coming)
		at = &(*at)->next;
	*at = coming->next;
	coming->model->coming = NULL;
}

static void destroy_coming(struct coming *coming)
{
	catalogue_unref(coming->residence->parts.catalogue, coming->model);
	free(coming->path);
	free(coming);
}

static void read_job(void *userdata)
{
	struct coming *coming = userdata;
	uint8_t content_id[16];

	coming->code = psr_model_read_levels(&coming->read, coming->path, coming->model->levels, NULL, &coming->error);
	if (coming->code == PSR_OK) {
		psr_model_content_id(coming->read, content_id);
		if (memcmp(content_id, coming->model->card.content_id, sizeof content_id) != 0) {
			psr_model_unref(coming->read);
			coming->read = NULL;
			coming->code = PSR_ERR_NOT_FOUND;
		}
	}
	/* Its bytes were counted with them. */
	if (coming->code == PSR_OK && (coming->code = psr_model_make_cubes(coming->read, &coming->error)) != PSR_OK) {
		psr_model_unref(coming->read);
		coming->read = NULL;
	}
	if (coming->code == PSR_OK && coming->model->key[0] != '\0')
		cache_touch(coming->path);
	loop_post(coming->residence->parts.loop, &coming->note);
}

static void on_read(void *userdata);

/* Loads it, after its bytes have been reserved. */
static void start_coming(struct residence *residence, struct catalogue_model *model)
{
	struct coming *coming = calloc(1, sizeof *coming);
	const struct pool_job job = { .fn = read_job, .userdata = coming };

	if (coming != NULL) {
		*coming = (struct coming){ .residence = residence, .model = model, .reserved = model->bytes,
			                       .path = cache_model_path(residence->parts.cache, model) };
		coming->note = (struct loop_note){ .fn = on_read, .userdata = coming };
	}
	if (coming == NULL || coming->path == NULL || psr_pool_submit(residence->parts.io, &job) != PSR_OK) {
		if (coming != NULL)
			free(coming->path);
		free(coming);
		catalogue_release(residence->parts.catalogue, model->bytes);
		return; /* go_on() finds that it is not coming */
	}
	coming->next = residence->first;
	residence->first = coming;
	model->coming = coming;
	catalogue_ref(residence->parts.catalogue, model);
}

/* ---- all models of a need ---- */

static int try_claim(void *userdata);

static void fail_need(struct residence_need *need, const struct psr_error *error)
{
	unpin(need);
	need->on_end(error, need->userdata);
}

static void claim(struct residence_need *need)
{
	struct psr_error error;

	unpin(need);
	if (need->n_tries++ < MAX_TRIES) {
		need->claim = (struct catalogue_claim){ .try = try_claim, .userdata = need };
		catalogue_claim(need->residence->parts.catalogue, &need->claim);
		return;
	}
	psr_fail(&error, PSR_ERR_BUSY, "the models of this frame leave memory before all of them are there; try again later");
	fail_need(need, &error);
}

/* Waits for the next missing model. */
static void go_on(struct residence_need *need)
{
	struct catalogue_model *model;
	struct psr_error error;

	while (need->at < need->n && need->model[need->at]->model != NULL)
		need->at++;
	if (need->at == need->n) {
		need->on_end(NULL, need->userdata);
		return;
	}
	model = need->model[need->at];
	if (model->coming != NULL) {
		if (model->coming->is_rebuilding)
			unpin(need);
		need->next = model->coming->first;
		need->waits_for = model->coming;
		model->coming->first = need;
	} else if (model->entry == NULL && model->key[0] == '\0') {
		psr_fail(&error, PSR_ERR_NOT_FOUND, "a model left memory, and its file has changed or gone since it was opened; "
		         "open it again");
		fail_need(need, &error);
	} else {
		claim(need); /* it failed for another need */
	}
}

/* Pins all models first, so that none of them leaves for another; unpins them all if there is too little room. */
static int try_claim(void *userdata)
{
	struct residence_need *need = userdata;
	struct residence *residence = need->residence;
	struct catalogue *catalogue = residence->parts.catalogue;
	struct psr_error error;
	const char *name = "of this frame";
	uint64_t pinned = 0, bytes = 0;
	int code;

	for (uint32_t i = 0; i < need->n; i++) {
		const struct catalogue_model *model = need->model[i];

		if (model->model == NULL && model->coming == NULL) {
			bytes += model->bytes;
			name = model->entry != NULL ? model->entry->file.name : name;
		} else {
			pinned += model->bytes;
		}
	}
	pin(need);
	if (bytes + pinned > catalogue->max_bytes)
		code = psr_fail(&error, PSR_ERR_LIMIT, "the models of this frame need %.1f MB of memory together; this server "
		                "holds models of %.1f MB at most (--max-memory)", (double)(bytes + pinned) * 1e-6,
		                (double)catalogue->max_bytes * 1e-6);
	else
		code = catalogue_reserve(catalogue, bytes, name, &error);
	if (code == PSR_ERR_BUSY) {
		unpin(need);
		return 0;
	}
	catalogue_unclaim(catalogue, &need->claim);
	if (code != PSR_OK) {
		fail_need(need, &error);
		return 1;
	}
	for (uint32_t i = 0; i < need->n; i++)
		if (need->model[i]->model == NULL && need->model[i]->coming == NULL)
			start_coming(residence, need->model[i]);
	need->at = 0;
	go_on(need);
	return 1;
}

int residence_get(struct residence *residence, struct residence_need *need)
{
	uint32_t n_there = 0;

	need->residence = residence;
	need->waits_for = NULL;
	need->is_pinned = need->n_tries = 0;
	while (n_there < need->n && need->model[n_there]->model != NULL)
		n_there++;
	if (n_there == need->n && catalogue_overtake(residence->parts.catalogue)) {
		pin(need);
		return 1;
	}
	claim(need);
	return 0;
}

void residence_cancel(struct residence_need *need)
{
	struct coming *coming = need->waits_for;
	struct residence_need **at;

	catalogue_unclaim(need->residence->parts.catalogue, &need->claim);
	if (coming != NULL) {
		for (at = &coming->first; *at != need;)
			at = &(*at)->next;
		*at = need->next;
		if (coming->first == NULL && coming->is_rebuilding) {
			opener_forget(need->residence->parts.opener, coming->model);
			unlink_coming(coming);
			destroy_coming(coming);
		}
	}
	unpin(need);
}

/* ---- one model has come, or not ---- */

/* One need after another: the end of one may cancel others. */
static void finish(struct coming *coming, const struct psr_error *error)
{
	struct residence_need *need;

	unlink_coming(coming);
	coming->is_rebuilding = 0;
	coming->model->is_stale |= error != NULL; /* on an error, the next OPEN looks at the file again */
	while ((need = coming->first) != NULL) {
		coming->first = need->next;
		need->waits_for = NULL;
		if (error != NULL)
			fail_need(need, error);
		else if (need->is_pinned)
			go_on(need);
		else
			claim(need);
	}
	destroy_coming(coming);
}

/* The cache has lost the built file: builds it again if the source is there and unchanged. */
static void rebuild(struct coming *coming)
{
	struct psr_error error;
	int code;

	coming->is_rebuilding = 1;
	for (struct residence_need *need = coming->first; need != NULL; need = need->next)
		unpin(need);
	code = opener_rebuild(coming->residence->parts.opener, coming->model);
	if (code == PSR_OK)
		return;
	psr_fail(&error, code, "a model that left memory cannot be built again: %s", psr_strerror(code));
	finish(coming, &error);
}

static void on_read(void *userdata)
{
	struct coming *coming = userdata;
	struct catalogue *catalogue = coming->residence->parts.catalogue;
	struct catalogue_model *model = coming->model;
	const char *name = model->entry != NULL ? model->entry->file.name : "(replaced)";
	const uint64_t reserved = coming->reserved;
	struct psr_error error;

	coming->reserved = 0;
	if (coming->code == PSR_OK && model->model == NULL) {
		log_info("model %s: came back, %.1f MB", name, (double)model->bytes * 1e-6);
		catalogue_return(catalogue, model, coming->read, reserved);
		finish(coming, NULL);
		return;
	}
	catalogue_release(catalogue, reserved);
	if (coming->code == PSR_OK) { /* it came back for another request */
		catalogue_let_go(catalogue, coming->read);
		finish(coming, NULL);
	} else if (model->key[0] != '\0' && model->entry != NULL && coming->first != NULL) {
		log_warn("model %s: not in the cache any more: building it again", name);
		rebuild(coming);
	} else {
		psr_fail(&error, PSR_ERR_NOT_FOUND, RESIDENCE_CHANGED, name);
		if (coming->code == PSR_ERR_MEMORY || coming->code == PSR_ERR_IO)
			psr_fail(&error, coming->code, "model %.200s left memory, and cannot be read again: %s", name,
			         psr_strerror(coming->code));
		finish(coming, &error);
	}
}

void residence_on_rebuilt(struct catalogue_model *model, const struct psr_error *error)
{
	struct psr_error changed;

	if (error == NULL && model->model == NULL) {
		psr_fail(&changed, PSR_ERR_NOT_FOUND, RESIDENCE_CHANGED,
		         model->entry != NULL ? model->entry->file.name : "(replaced)");
		error = &changed;
	}
	finish(model->coming, error);
}

int residence_is_working(const struct residence *residence)
{
	for (const struct coming *coming = residence->first; coming != NULL; coming = coming->next)
		if (!coming->is_rebuilding)
			return 1;
	return 0;
}

void residence_destroy(struct residence *residence)
{
	if (residence == NULL)
		return;
	while (residence->first != NULL) {
		struct coming *coming = residence->first;

		if (coming->reserved > 0)
			catalogue_release(residence->parts.catalogue, coming->reserved);
		psr_model_unref(coming->read);
		unlink_coming(coming);
		destroy_coming(coming);
	}
	free(residence);
}

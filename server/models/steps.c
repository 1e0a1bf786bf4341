#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include "base/pool.h"
#include "opening.h"
#include "residence.h"
#include "server/log.h"
#include "server/net/conn.h"

static void fail(struct opening *o, int code, const char *text)
{
	struct psr_error error;

	psr_fail(&error, code, "%s", text);
	opener_end(o, NULL, &error);
}

/* The list shows failures that lie in the file; a resource that the system refuses now it may grant later. */
static void end_failed(struct opening *o, const struct psr_error *error)
{
	struct catalogue_entry *entry = opener_entry(o);

	if (entry != NULL && (error->code == PSR_ERR_FORMAT || error->code == PSR_ERR_VERSION
	                      || error->code == PSR_ERR_UNSUPPORTED || error->code == PSR_ERR_INTERNAL))
		entry->has_failed = 1;
	opener_end(o, NULL, error);
}

static void submit(struct opening *o, void (*job)(void *), void (*then)(void *))
{
	const struct pool_job pool_job = { .fn = job, .userdata = o };

	o->note = (struct loop_note){ .fn = then, .userdata = o };
	o->has_job = psr_pool_submit(o->opener->parts.io, &pool_job) == PSR_OK;
	if (!o->has_job)
		fail(o, PSR_ERR_MEMORY, "no memory to open a model");
}

/* Errors name the model, not the file that psrd read. */
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
static void load(struct opening *o);

static int is_lost(int code)
{
	return code == PSR_ERR_FORMAT || code == PSR_ERR_VERSION || code == PSR_ERR_NOT_FOUND;
}

static void log_loaded(const struct opening *o)
{
	const double megabytes = (double)psr_model_bytes(o->model) * 1e-6;
	struct psr_model_prefix prefix;

	if (psr_model_is_prefix(o->model, &prefix) && prefix.levels == prefix.of_levels)
		log_info("model %s: loaded, all %u levels of its octree without its scan, %.1f MB", o->file.name, prefix.levels,
		         megabytes);
	else if (prefix.levels > 0)
		log_info("model %s: loaded, %u of the %u levels of its octree, %.1f MB", o->file.name, prefix.levels,
		         prefix.of_levels, megabytes);
	else
		log_info("model %s: loaded, %.1f MB", o->file.name, megabytes);
}

static void on_loaded(void *userdata)
{
	struct opening *o = userdata;
	struct catalogue *catalogue = o->opener->parts.catalogue;
	struct catalogue_loaded loaded = { .entry = opener_entry(o), .model = o->model, .key = o->key,
		                               .resolution = o->resolution, .levels = o->levels, .reserved = o->reserved };
	struct catalogue_model *added;

	o->has_job = o->is_loading = 0;
	o->reserved = 0;
	if (o->code == PSR_OK)
		log_loaded(o);
	o->model = NULL;
	if (o->code == PSR_ERR_CANCELLED && o->waiters != NULL && !o->opener->is_stopped) {
		catalogue_release(catalogue, loaded.reserved);
		o->was_built = 0; /* and is in the cache by now */
		load(o); /* a new request came while the job was ending */
		return;
	}
	if (o->code != PSR_OK) {
		catalogue_release(catalogue, loaded.reserved);
		if (o->is_cached && is_lost(o->code) && !o->opener->is_stopped) {
			log_warn("%s is damaged or gone: building it again", o->cached);
			o->is_cached = 0;
			build(o);
			return;
		}
		name_error(o);
		end_failed(o, &o->error);
		return;
	}
	if (catalogue_add(&added, catalogue, &loaded) != PSR_OK) {
		fail(o, PSR_ERR_MEMORY, "no memory to open a model");
		return;
	}
	/* It may have left memory again by now, for another opening that waited for its room. */
	opener_end(o, added, NULL);
	catalogue_unref(catalogue, added);
}

/* Collects keys of open models: they may leave memory, and come back from the cache. */
static void list_in_use(struct opening *o)
{
	const struct catalogue *catalogue = o->opener->parts.catalogue;
	size_t n = 1;

	for (size_t i = 0; i < catalogue->n; i++)
		for (const struct catalogue_model *model = catalogue->entry[i].model; model != NULL; model = model->of_entry)
			n += model->key[0] != '\0';
	o->in_use = malloc(n * sizeof *o->in_use);
	if (o->in_use == NULL)
		return;
	memcpy(o->in_use[o->n_in_use++], o->key, CATALOGUE_KEY);
	for (size_t i = 0; i < catalogue->n; i++)
		for (const struct catalogue_model *model = catalogue->entry[i].model; model != NULL; model = model->of_entry)
			if (model->key[0] != '\0')
				memcpy(o->in_use[o->n_in_use++], model->key, CATALOGUE_KEY);
}

static int try_load(void *userdata)
{
	struct opening *o = userdata;
	struct catalogue *catalogue = o->opener->parts.catalogue;
	int code = catalogue_reserve(catalogue, o->bytes, o->file.name, &o->error);

	if (code == PSR_ERR_BUSY)
		return 0;
	catalogue_unclaim(catalogue, &o->claim);
	if (code != PSR_OK) {
		end_failed(o, &o->error);
		return 1;
	}
	o->reserved = o->bytes;
	o->is_loading = 1;
	atomic_store(&o->is_stopped, o->opener->is_stopped || o->waiters == NULL);
	opener_progress(o, &(struct psr_msg_progress){ .stage = PSR_PROGRESS_LOAD });
	submit(o, opening_load, on_loaded);
	return 1;
}

static void load(struct opening *o)
{
	o->claim = (struct catalogue_claim){ .try = try_load, .userdata = o };
	catalogue_claim(o->opener->parts.catalogue, &o->claim);
}

static void on_build_progress(const struct psr_msg_progress *progress, void *userdata)
{
	opener_progress(userdata, progress);
}

static void on_built(const struct psr_error *failure, void *userdata)
{
	struct opening *o = userdata;
	struct catalogue_entry *entry = opener_entry(o);
	struct stat status;

	o->is_building = 0;
	if (failure != NULL && failure->code == PSR_ERR_CANCELLED && o->waiters != NULL) {
		build(o); /* a new request came while the build was ending */
	} else if (failure != NULL) {
		if (entry != NULL && builder_failure(o->opener->parts.builder, o->key, o->resolution) != NULL)
			entry->has_failed = 1; /* until the file changes */
		end_failed(o, failure);
	} else if (stat(o->temporary, &status) != 0) {
		psr_fail(&o->error, PSR_ERR_INTERNAL, "%s: psr-model left no file", o->file.name);
		end_failed(o, &o->error);
	} else {
		o->was_built = 1;
		o->bytes = (uint64_t)status.st_size;
		psr_model_need(&o->bytes, o->temporary, 0, NULL); /* if that fails the size stays; loading says what is wrong */
		list_in_use(o);
		load(o);
	}
}

static void build(struct opening *o)
{
	struct builder *builder = o->opener->parts.builder;
	const struct psr_error *failure = builder_failure(builder, o->key, o->resolution);
	const struct builder_job job = {
		.program = o->program, .source = o->file.path, .target = o->temporary, .key = o->key,
		.resolution = o->resolution, .on_progress = on_build_progress, .on_done = on_built, .userdata = o,
	};

	o->is_building = 1;
	if (failure != NULL)
		end_failed(o, failure);
	else if (builder_start(builder, &job) != PSR_OK)
		fail(o, PSR_ERR_MEMORY, "no memory to build a model");
}

/* Models in memory, and out of memory, count as those of the key. */
static int answer_known(struct opening *o)
{
	struct catalogue *catalogue = o->opener->parts.catalogue;
	struct catalogue_entry *entry = opener_entry(o);
	struct catalogue_model *model = entry != NULL ? catalogue_model(entry, o->resolution, o->levels) : NULL;

	if (!o->file.is_source || model == NULL)
		return 0;
	if (strcmp(model->key, o->key) != 0) {
		if (opener_has(o, 0))
			return 0;
		psr_fail(&o->error, PSR_ERR_NOT_FOUND, RESIDENCE_CHANGED, o->file.name);
		opener_end(o, NULL, &o->error);
		return 1;
	}
	if (opener_has(o, 1))
		return 0;
	catalogue_ref(catalogue, model);
	model->is_stale = 0;
	opener_end(o, model, NULL);
	catalogue_unref(catalogue, model);
	return 1;
}

static void on_prepared(void *userdata)
{
	struct opening *o = userdata;

	o->has_job = 0;
	if (o->opener->is_stopped) {
		fail(o, PSR_ERR_CANCELLED, CONN_SHUTDOWN);
	} else if (o->code != PSR_OK) {
		name_error(o);
		end_failed(o, &o->error);
	} else if (!answer_known(o)) {
		if (!o->file.is_source || o->is_cached)
			load(o);
		else
			build(o);
	}
}

void opening_start(struct opening *o)
{
	submit(o, opening_prepare, on_prepared);
}

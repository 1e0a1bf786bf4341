#include <assert.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/mman.h>
#include "base/mem.h"
#include "cubes.h"
#include "file.h"
#include "pack.h"

#define LEAST_SHARED ((size_t)8 << 20) /* bytes of an image whose checks threads share */

struct psr_model {
	atomic_uint n_refs;
	int is_mapped, is_packed;
	uint64_t file_bytes;
	size_t n_bytes;
	const uint8_t *bytes; /* the image */
	struct content content;
	pthread_mutex_t making;  /* held by the one who makes the cubes */
	_Atomic(struct psr_cubes *) cubes; /* of its octree, once somebody has asked for them; or NULL */
	struct psr_points *points; /* of its differential points, or NULL */
	struct pack_facts facts; /* of the packed file */
};

static void release_image(const uint8_t *bytes, size_t n_bytes, int is_mapped)
{
	if (is_mapped)
		munmap((void *)bytes, n_bytes);
	else
		psr_free_huge((void *)bytes, n_bytes);
}

/* Returns threads for what is large; NULL otherwise, and where the system has none: the caller then works alone. */
static struct psr_pool *pool_for(size_t n_bytes)
{
	struct psr_pool *pool = NULL;

	return n_bytes >= LEAST_SHARED && psr_pool_create(&pool, psr_pool_all_cores(), NULL) == PSR_OK ? pool : NULL;
}

int model_adopt(struct psr_model **out, const uint8_t *bytes, size_t n_bytes, int is_mapped, const char *name,
                struct psr_error *err)
{
	struct psr_model *model = calloc(1, sizeof *model);
	struct psr_pool *pool = pool_for(n_bytes);
	int code;

	if (model == NULL)
		code = psr_fail(err, PSR_ERR_MEMORY, "%s: out of memory", name);
	else
		code = file_parse(bytes, n_bytes, pool, name, &model->content, err);
	if (code == PSR_OK && model->content.has_points)
		code = psr_points_create(&model->points, &model->content.points, model->content.info.resolution, name,
		                         err);
	psr_pool_destroy(pool);
	if (code != PSR_OK) {
		free(model);
		release_image(bytes, n_bytes, is_mapped);
		return code;
	}
	atomic_init(&model->n_refs, 1);
	atomic_init(&model->cubes, NULL);
	pthread_mutex_init(&model->making, NULL);
	model->is_mapped = is_mapped;
	model->bytes = bytes;
	model->n_bytes = n_bytes;
	*out = model;
	return PSR_OK;
}

void model_set_source(struct psr_model *model, uint64_t file_bytes, const struct pack_facts *facts)
{
	model->file_bytes = file_bytes;
	model->is_packed = facts != NULL;
	if (facts != NULL)
		model->facts = *facts;
}

size_t model_own_bytes(void)
{
	return sizeof(struct psr_model);
}

struct psr_model *psr_model_ref(struct psr_model *model)
{
	atomic_fetch_add_explicit(&model->n_refs, 1, memory_order_relaxed);
	return model;
}

void psr_model_unref(struct psr_model *model)
{
	if (model == NULL || atomic_fetch_sub_explicit(&model->n_refs, 1, memory_order_acq_rel) != 1)
		return;
	release_image(model->bytes, model->n_bytes, model->is_mapped);
	psr_cubes_destroy(atomic_load_explicit(&model->cubes, memory_order_acquire));
	pthread_mutex_destroy(&model->making);
	psr_points_destroy(model->points);
	free(model);
}

const struct psr_model_info *psr_model_info(const struct psr_model *model)
{
	return &model->content.info;
}

const struct psr_blocks *psr_model_blocks(const struct psr_model *model)
{
	return model->content.has_blocks ? &model->content.blocks : NULL;
}

const struct octree *psr_model_octree(const struct psr_model *model)
{
	return model->content.has_octree ? &model->content.octree : NULL;
}

int psr_model_octree_shares(const struct psr_model *model, struct octree_shares *shares)
{
	*shares = model->facts.shares;
	return shares->codes > 0;
}

const struct psr_presets *psr_model_presets(const struct psr_model *model)
{
	return &model->content.presets;
}

int psr_model_is_prefix(const struct psr_model *model, struct psr_model_prefix *prefix)
{
	*prefix = model->facts.prefix;
	return prefix->levels > 0;
}

void psr_model_content_id(const struct psr_model *model, uint8_t id[16])
{
	memcpy(id, model->bytes + HEADER_CONTENT_ID, 16);
}

uint64_t psr_model_file_bytes(const struct psr_model *model, int *is_packed)
{
	*is_packed = model->is_packed;
	return model->file_bytes;
}

uint64_t psr_model_bytes(const struct psr_model *model)
{
	const struct psr_cubes *cubes = psr_model_cubes(model);

	return model->n_bytes + sizeof *model + (cubes != NULL ? cubes->n_bytes : 0)
	       + (model->points != NULL ? model->points->n_bytes : 0);
}

int psr_model_make_cubes(const struct psr_model *model, struct psr_error *err)
{
	/* Cubes are a cache: whoever reads the model sees no change. */
	struct psr_model *own = (struct psr_model *)(uintptr_t)model;
	int code = PSR_OK;

	if (!model->content.has_octree || psr_model_cubes(model) != NULL)
		return PSR_OK;
	pthread_mutex_lock(&own->making);
	if (psr_model_cubes(model) == NULL) {
		struct psr_pool *pool = pool_for(model->n_bytes);
		struct psr_cubes *cubes = NULL;

		code = psr_cubes_create(&cubes, &model->content.octree, pool, err);
		psr_pool_destroy(pool);
		atomic_store_explicit(&own->cubes, cubes, memory_order_release);
	}
	pthread_mutex_unlock(&own->making);
	return code;
}

const struct psr_cubes *psr_model_cubes(const struct psr_model *model)
{
	return atomic_load_explicit(&model->cubes, memory_order_acquire);
}

const struct psr_points *psr_model_points(const struct psr_model *model)
{
	return model->points;
}

const struct dpoint_set *psr_model_point_set(const struct psr_model *model)
{
	return model->content.has_points ? &model->content.points : NULL;
}

const uint8_t *model_image(const struct psr_model *model, size_t *n_bytes)
{
	*n_bytes = model->n_bytes;
	return model->bytes;
}

const struct content *model_content(const struct psr_model *model)
{
	return &model->content;
}

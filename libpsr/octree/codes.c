#include "codes.h"

static int code_levels(struct codes_job *job, enum octree_packing packing, int is_decoding)
{
	job->model = packing == OCTREE_FAST ? codes_fast_model() : codes_mixed_model();
	if (job->model == NULL)
		return PSR_ERR_MEMORY;
	for (job->level = 0; job->level < job->levels->height && job->rc == PSR_OK; job->level++) {
		if (packing == OCTREE_FAST)
			codes_fast_level(job, is_decoding);
		else
			codes_mixed_level(job, is_decoding);
	}
	free(job->model);
	if (job->rc == PSR_OK && job->coder->has_failed)
		return is_decoding ? PSR_ERR_FORMAT : PSR_ERR_MEMORY;
	return job->rc;
}

int octree_codes_pack(struct coder *coder, const struct octree_levels *levels, enum octree_packing packing)
{
	/* Coding only reads the levels. */
	struct codes_job job = { .coder = coder, .levels = (struct octree_levels *)(uintptr_t)levels };

	return code_levels(&job, packing, 0);
}

int octree_codes_unpack(struct octree_levels *levels, struct coder *coder, uint64_t n_codes,
                        enum octree_packing packing)
{
	struct codes_job job = { .coder = coder, .levels = levels, .n_codes = n_codes };

	return code_levels(&job, packing, 1);
}

#include "codes.h"

int octree_codes_begin(struct codes_job *job, struct octree_levels *levels, enum octree_packing packing)
{
	*job = (struct codes_job){ .levels = levels, .packing = packing };
	job->model = packing == OCTREE_FAST ? codes_fast_model() : codes_mixed_model();
	return job->model != NULL ? PSR_OK : PSR_ERR_MEMORY;
}

void octree_codes_end(struct codes_job *job)
{
	free(job->model);
	job->model = NULL;
}

#define MOST_NODES (1u << 28) /* of a level: children have 32 bits */

uint32_t codes_count(const struct codes_job *job)
{
	const struct octree_level *above;

	if (job->level == 0)
		return job->levels->n_roots;
	above = &job->levels->at[job->level - 1];
	return above->first[above->n - 1] + octree_count(above->code[above->n - 1]);
}

void codes_begin_level(struct codes_job *job, uint32_t n)
{
	if (n > job->n_codes || n > MOST_NODES)
		job->rc = PSR_ERR_FORMAT;
	else if (!octree_level_reserve(&job->levels->at[job->level], n))
		job->rc = PSR_ERR_MEMORY;
}

void codes_end_level(struct codes_job *job, uint32_t n)
{
	if (job->coder->has_failed)
		job->rc = PSR_ERR_FORMAT;
	if (job->rc != PSR_OK)
		return;
	octree_level_finish(&job->levels->at[job->level], n);
	job->n_codes -= n;
}

static int code_levels(struct codes_job *job, struct coder *coder, int end, int is_decoding)
{
	job->coder = coder;
	for (; job->level < end && job->rc == PSR_OK; job->level++) {
		if (job->packing == OCTREE_FAST)
			codes_fast_level(job, is_decoding);
		else
			codes_mixed_level(job, is_decoding);
	}
	if (job->rc == PSR_OK && coder->has_failed)
		job->rc = is_decoding ? PSR_ERR_FORMAT : PSR_ERR_MEMORY;
	return job->rc;
}

int octree_codes_pack(struct codes_job *job, struct coder *coder, int end)
{
	return code_levels(job, coder, end, 0);
}

int octree_codes_unpack(struct codes_job *job, struct coder *coder, int end, uint64_t n_codes)
{
	job->n_codes = n_codes;
	return code_levels(job, coder, end, 1);
}

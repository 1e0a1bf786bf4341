#include "greedy.h"

#include <assert.h>
#include <string.h>
#include "base/clock.h"
#include "base/maths.h"
#include "base/mem.h"
#include "parts.h"

#define SCOUT_STRIDE 4
#define OUTLINE_COSINE 0.5f

struct job {
	struct greedy *greedy;
	int side, failed;
};

void greedy_select_default(struct greedy_select_options *options)
{
	memset(options, 0, sizeof *options);
	options->side = 8;
	options->n_rotations = GREEDY_MOST_ROTATIONS;
	options->n_shifts = GREEDY_MOST_SHIFTS;
	options->is_facing = 1;
	options->depth_tolerance = 1;
	options->second_pass = 1;
}

static void keep(struct greedy_view *view, struct greedy_block *block, int is_kept)
{
	block->is_kept = (uint8_t)is_kept;
	for (uint32_t i = block->first; i < block->first + block->n; i++)
		view->sample[i].is_kept = (uint8_t)is_kept;
}

static void start_view(int v, void *userdata)
{
	struct job *job = userdata;
	struct greedy_view *view = &job->greedy->view[v];

	if (view->block == NULL || job->side != job->greedy->side) {
		if (greedy_divide(view, job->side) != PSR_OK)
			__atomic_store_n(&job->failed, 1, __ATOMIC_RELAXED);
	} else {
		for (uint32_t b = 0; b < view->n_blocks; b++)
			keep(view, &view->block[b], 0);
	}
}

/* Blocks of this side, none of them kept, and no scouts. */
static int start(struct greedy *greedy, int side)
{
	struct job job = { greedy, side, 0 };

	for (int v = greedy->n_views - greedy->n_scouts; v < greedy->n_views; v++)
		greedy_forget(&greedy->view[v]);
	psr_pool_for(greedy->pool, greedy->n_views - greedy->n_scouts, start_view, &job);
	greedy->side = job.failed ? 0 : side;
	return job.failed ? PSR_ERR_MEMORY : PSR_OK;
}

/* Adds the blocks that S lacks, or removes blocks that it does not need. */
static int visit(struct greedy *greedy, int v, const struct greedy_select_options *options,
                 struct greedy_strictness strictness)
{
	struct greedy_view *view = &greedy->view[v];
	uint8_t *is_missed = psr_alloc_array(view->n_blocks, 1);
	int rc;

	if (is_missed == NULL)
		return PSR_ERR_MEMORY;
	rc = greedy_find_missed(greedy, v, options, strictness, options->n_rotations * options->n_shifts, is_missed);
	for (uint32_t b = 0; rc == PSR_OK && b < view->n_blocks; b++) {
		int was_kept = view->block[b].is_kept;

		if (strictness.kept_only ? was_kept && !is_missed[b] : !was_kept && is_missed[b])
			keep(view, &view->block[b], !was_kept);
	}
	psr_free(is_missed);
	return rc;
}

/* A scout looks at a part of its view, and is a view like the others if it finds a sample that is missed. */
static int visit_scout(struct greedy *greedy, int v, const struct greedy_select_options *options,
                       struct greedy_strictness strictness)
{
	struct greedy_view *view = &greedy->view[v];
	uint8_t *is_missed = NULL, is_any = 0;
	int rc = greedy_trace(greedy, v, SCOUT_STRIDE);

	if (rc == PSR_OK)
		rc = greedy_divide(view, greedy->side);
	if (rc == PSR_OK && (is_missed = psr_alloc_array(view->n_blocks, 1)) == NULL)
		rc = PSR_ERR_MEMORY;
	if (rc == PSR_OK)
		rc = greedy_find_missed(greedy, v, options, strictness, 1, is_missed);
	for (uint32_t b = 0; rc == PSR_OK && b < view->n_blocks; b++)
		is_any |= is_missed[b];
	psr_free(is_missed);
	greedy_forget(view);
	if (rc != PSR_OK || !is_any)
		return rc;
	rc = greedy_trace(greedy, v, 1);
	if (rc == PSR_OK)
		rc = greedy_divide(view, greedy->side);
	return rc == PSR_OK ? visit(greedy, v, options, strictness) : rc;
}

typedef int visit_fn(struct greedy *greedy, int v, const struct greedy_select_options *options,
                     struct greedy_strictness strictness);

static int run_pass(struct greedy *greedy, const struct greedy_select_options *options, int from, int to,
                    struct greedy_strictness strictness, visit_fn *visit_one)
{
	int rc = PSR_OK;

	for (int v = from; rc == PSR_OK && v < to; v++)
		rc = visit_one(greedy, v, options, strictness);
	return rc;
}

static int run_passes(struct greedy *greedy, const struct greedy_select_options *options, struct greedy_result *result)
{
	const struct greedy_strictness strict = { .least_cosine = greedy->view[0].projection.spacing / (float)greedy->ds };
	const struct greedy_strictness all = { .lenient_below = options->forgives_outlines ? OUTLINE_COSINE : 0 };
	const struct greedy_strictness second = { .lenient_below = all.lenient_below, .kept_only = 1 };
	int n_views = greedy->n_views - greedy->n_scouts, rc = PSR_OK;

	if (!options->goes_on && options->is_strict_first)
		rc = run_pass(greedy, options, 0, n_views, strict, visit);
	if (!options->goes_on && rc == PSR_OK)
		rc = run_pass(greedy, options, 0, n_views, all, visit);
	if (!options->goes_on && rc == PSR_OK)
		rc = run_pass(greedy, options, n_views, greedy->n_views, all, visit_scout);
	for (int v = 0; v < greedy->n_views; v++)
		for (uint32_t b = 0; b < greedy->view[v].n_blocks; b++)
			result->n_first_pass += greedy->view[v].block[b].is_kept;
	if (rc == PSR_OK && options->second_pass)
		rc = run_pass(greedy, options, 0, greedy->n_views, second, visit);
	return rc;
}

static int keep_all_and_prune(struct greedy *greedy, const struct greedy_select_options *options,
                              struct greedy_result *result)
{
	for (int v = 0; v < greedy->n_views; v++) {
		for (uint32_t b = 0; b < greedy->view[v].n_blocks; b++)
			keep(&greedy->view[v], &greedy->view[v].block[b], 1);
		result->n_first_pass += greedy->view[v].n_blocks;
	}
	return greedy_prune(greedy, options, 0);
}

void greedy_count(const struct greedy *greedy, struct greedy_result *result)
{
	uint64_t lanes = (uint64_t)greedy->side * (uint64_t)greedy->side;

	for (int v = 0; v < greedy->n_views; v++) {
		const struct greedy_view *view = &greedy->view[v];

		for (uint32_t b = 0; b < view->n_blocks; b++)
			result->n_blocks += view->block[b].is_kept;
		for (uint32_t i = 0; i < view->n_samples; i++)
			result->n_samples += view->sample[i].is_kept;
	}
	result->n_lanes = result->n_blocks * lanes;
	result->n_bytes = result->n_samples * GREEDY_SAMPLE_BYTES + result->n_blocks * (GREEDY_BLOCK_BYTES + lanes / 8);
}

int greedy_select(struct greedy *greedy, const struct greedy_select_options *options, struct greedy_result *result,
                  struct psr_error *err)
{
	double started = clock_seconds();
	int rc;

	assert(options->side >= 4 && options->side <= GREEDY_MOST_SIDE);
	assert(options->n_rotations >= 1 && options->n_rotations <= GREEDY_MOST_ROTATIONS);
	assert(options->n_shifts >= 1 && options->n_shifts <= GREEDY_MOST_SHIFTS);
	memset(result, 0, sizeof *result);
	assert(!options->goes_on || options->side == greedy->side);
	rc = options->goes_on ? PSR_OK : start(greedy, options->side);
	if (rc == PSR_OK && options->by_score && !options->goes_on)
		rc = keep_all_and_prune(greedy, options, result);
	else if (rc == PSR_OK)
		rc = run_passes(greedy, options, result);
	if (rc == PSR_OK && options->drops_samples)
		rc = greedy_prune(greedy, options, 1);
	if (rc != PSR_OK)
		return psr_fail(err, rc, "no memory to select blocks at resolution %u; use a lower one",
		                greedy->options.resolution);
	greedy_count(greedy, result);
	result->seconds = clock_seconds() - started;
	return PSR_OK;
}

void greedy_samples(const struct greedy *greedy, struct trials_sample *to)
{
	for (int v = 0; v < greedy->n_views; v++) {
		for (uint32_t i = 0; i < greedy->view[v].n_samples; i++) {
			const struct greedy_sample *sample = &greedy->view[v].sample[i];

			if (!sample->is_kept)
				continue;
			memcpy(to->position, sample->position, sizeof to->position);
			to->normal = (uint16_t)PSR_ATTR_NORMAL(sample->attr);
			to->two_sided = sample->two_sided;
			to++;
		}
	}
}

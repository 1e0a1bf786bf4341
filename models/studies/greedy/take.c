#include <stdlib.h>
#include "base/mem.h"
#include "sample/levels/draft.h"
#include "parts.h"

/* A block of a model or of a draft. */
struct taken {
	unsigned projection;
	int16_t col, row; /* of its first lattice point */
	uint8_t two_sided;
	uint64_t mask;
};

static void take_block(struct greedy *greedy, const struct taken *taken)
{
	struct greedy_view *view = &greedy->view[taken->projection];

	view->block[view->n_blocks++] =
		(struct greedy_block){ .col = taken->col, .row = taken->row, .first = view->n_samples,
			                   .n = (uint32_t)__builtin_popcountll(taken->mask), .is_kept = 1 };
}

/* Sample s of the block that was taken last. */
static void take_sample(struct greedy *greedy, const struct taken *taken, unsigned s, float z, uint64_t attr)
{
	struct greedy_view *view = &greedy->view[taken->projection];
	const struct psr_projection *p = &view->projection;
	struct greedy_sample *sample = &view->sample[view->n_samples++];
	const int col = taken->col + (int)(s % PSR_BLOCK_SIDE), row = taken->row + (int)(s / PSR_BLOCK_SIDE);
	const double x = (col + greedy_shift(GREEDY_EQUILATERAL, row)) * (double)p->spacing;
	const double y = row * greedy_row_pitch(GREEDY_EQUILATERAL) * (double)p->spacing;

	*sample = (struct greedy_sample){ .col = (int16_t)col, .row = (int16_t)row, .z = z, .attr = attr,
		                              .two_sided = taken->two_sided, .is_kept = 1 };
	for (int k = 0; k < 3; k++)
		sample->position[k] = (float)(x * (double)p->axis[0][k] + y * (double)p->axis[1][k]
		                              + (double)sample->z * (double)p->axis[2][k]);
}

/* Blocks and samples of each projection. */
struct counts {
	uint32_t n_blocks[GREEDY_MOST_VIEWS], n_samples[GREEDY_MOST_VIEWS];
};

static void count_block(struct counts *counts, unsigned projection, uint64_t mask)
{
	counts->n_blocks[projection]++;
	counts->n_samples[projection] += (uint32_t)__builtin_popcountll(mask);
}

/* Without blocks, but with memory for them. MEMORY. */
static int create(struct greedy **out, const struct psr_projection *projection, unsigned n, const struct counts *counts,
                  uint32_t resolution, struct psr_error *err)
{
	struct greedy *greedy = calloc(1, sizeof *greedy);
	int failed = greedy == NULL;

	for (unsigned v = 0; !failed && v < n; v++) {
		struct greedy_view *view = &greedy->view[v];

		view->projection = projection[v];
		view->sample = psr_alloc_array(counts->n_samples[v], sizeof *view->sample);
		view->block = psr_alloc_array(counts->n_blocks[v], sizeof *view->block);
		greedy->n_views = (int)v + 1;
		failed = view->sample == NULL || view->block == NULL;
	}
	if (failed) {
		greedy_destroy(greedy);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a sampling of %u projections", n);
	}
	greedy->options.resolution = resolution;
	greedy->ds = 2.0 / resolution;
	greedy->side = PSR_BLOCK_SIDE;
	*out = greedy;
	return PSR_OK;
}

int greedy_take_model(struct greedy **out, const struct psr_blocks *blocks, uint32_t resolution,
                      struct greedy_result *result, struct psr_error *err)
{
	struct counts counts = { { 0 }, { 0 } };
	int rc;

	*result = (struct greedy_result){ .n_blocks = 0 };
	if (blocks->n_projections > GREEDY_MOST_VIEWS)
		return psr_fail(err, PSR_ERR_LIMIT, "a model of %u projections is over the limit of %d", blocks->n_projections,
		                GREEDY_MOST_VIEWS);
	for (uint32_t b = 0; b < blocks->n_blocks; b++)
		if (psr_blocks_level(blocks, b) == 0)
			count_block(&counts, blocks->block_projection[b], blocks->mask[b]);
	rc = create(out, blocks->projection, blocks->n_projections, &counts, resolution, err);
	for (uint32_t b = 0; rc == PSR_OK && b < blocks->n_blocks; b++) {
		uint64_t at = psr_blocks_attr_first(blocks, b);
		struct psr_place place;
		struct taken taken;

		if (psr_blocks_level(blocks, b) != 0)
			continue;
		psr_blocks_place(blocks, b, &place);
		taken = (struct taken){ blocks->block_projection[b], (int16_t)place.col, (int16_t)place.row,
			                    (blocks->flags[b] & PSR_BLOCK_TWO_SIDED) != 0, blocks->mask[b] };
		take_block(*out, &taken);
		for (uint64_t left = taken.mask; left != 0; left &= left - 1, at++)
			take_sample(*out, &taken, (unsigned)__builtin_ctzll(left), psr_place_depth(&place, blocks->depth[at]),
			            blocks->attr[at]);
	}
	if (rc == PSR_OK)
		greedy_count(*out, result);
	return rc;
}

int greedy_take_draft(struct greedy **out, const struct draft *draft, unsigned n_projections, uint32_t resolution,
                      struct greedy_result *result, struct psr_error *err)
{
	struct counts counts = { { 0 }, { 0 } };
	int rc;

	*result = (struct greedy_result){ .n_blocks = 0 };
	for (uint32_t b = 0; b < draft->n_blocks; b++)
		count_block(&counts, draft->block[b].projection, draft->block[b].mask);
	rc = create(out, draft->projection, n_projections, &counts, resolution, err);
	for (uint32_t b = 0; rc == PSR_OK && b < draft->n_blocks; b++) {
		const struct draft_block *block = &draft->block[b];
		const struct taken taken = { block->projection, block->col, block->row, block->two_sided, block->mask };

		take_block(*out, &taken);
		for (uint64_t left = taken.mask; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);
			const struct draft_sample *sample = draft_sample(draft, block, s);

			take_sample(*out, &taken, s, sample->z, sample->attr);
		}
	}
	if (rc == PSR_OK)
		greedy_count(*out, result);
	return rc;
}

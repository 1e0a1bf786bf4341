#include <stdlib.h>
#include <string.h>
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

static int is_first_level(const struct psr_blocks *blocks, uint32_t b)
{
	return psr_blocks_level(blocks, b) == 0;
}

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

/* n_blocks and n_samples: of each projection. MEMORY. */
static int create(struct greedy **out, const struct psr_projection *projection, unsigned n, const uint32_t *n_blocks,
                  const uint32_t *n_samples, uint32_t resolution)
{
	struct greedy *greedy = calloc(1, sizeof *greedy);

	if (greedy == NULL)
		return PSR_ERR_MEMORY;
	greedy->options.resolution = resolution;
	greedy->ds = 2.0 / resolution;
	greedy->side = PSR_BLOCK_SIDE;
	greedy->n_views = (int)n;
	for (unsigned v = 0; v < n; v++) {
		struct greedy_view *view = &greedy->view[v];

		view->projection = projection[v];
		view->sample = psr_alloc_array(n_samples[v], sizeof *view->sample);
		view->block = psr_alloc_array(n_blocks[v], sizeof *view->block);
		if (view->sample == NULL || view->block == NULL) {
			greedy_destroy(greedy);
			return PSR_ERR_MEMORY;
		}
	}
	*out = greedy;
	return PSR_OK;
}

static void finish(const struct greedy *greedy, struct greedy_result *result)
{
	memset(result, 0, sizeof *result);
	greedy_count(greedy, result);
}

int greedy_take_model(struct greedy **out, const struct psr_blocks *blocks, uint32_t resolution,
                      struct greedy_result *result, struct psr_error *err)
{
	uint32_t n_blocks[GREEDY_MOST_VIEWS] = { 0 }, n_samples[GREEDY_MOST_VIEWS] = { 0 };
	int rc;

	if (blocks->n_projections > GREEDY_MOST_VIEWS)
		return psr_fail(err, PSR_ERR_LIMIT, "a model of %u projections is over the limit of %d", blocks->n_projections,
		                GREEDY_MOST_VIEWS);
	for (uint32_t b = 0; b < blocks->n_blocks; b++) {
		if (!is_first_level(blocks, b))
			continue;
		n_blocks[blocks->block_projection[b]]++;
		n_samples[blocks->block_projection[b]] += (uint32_t)__builtin_popcountll(blocks->mask[b]);
	}
	rc = create(out, blocks->projection, blocks->n_projections, n_blocks, n_samples, resolution);
	if (rc != PSR_OK)
		return psr_fail(err, rc, "no memory for a sampling of %u blocks", blocks->n_blocks);
	for (uint32_t b = 0; b < blocks->n_blocks; b++) {
		uint64_t at = psr_blocks_attr_first(blocks, b);
		struct psr_place place;
		struct taken taken;

		if (!is_first_level(blocks, b))
			continue;
		psr_blocks_place(blocks, b, &place);
		taken = (struct taken){ blocks->block_projection[b], (int16_t)place.col, (int16_t)place.row,
			                    (blocks->flags[b] & PSR_BLOCK_TWO_SIDED) != 0, blocks->mask[b] };
		take_block(*out, &taken);
		for (uint64_t left = taken.mask; left != 0; left &= left - 1, at++)
			take_sample(*out, &taken, (unsigned)__builtin_ctzll(left), psr_place_depth(&place, blocks->depth[at]),
			            blocks->attr[at]);
	}
	finish(*out, result);
	return PSR_OK;
}

int greedy_take_draft(struct greedy **out, const struct draft *draft, unsigned n_projections, uint32_t resolution,
                      struct greedy_result *result, struct psr_error *err)
{
	uint32_t n_blocks[GREEDY_MOST_VIEWS] = { 0 }, n_samples[GREEDY_MOST_VIEWS] = { 0 };
	int rc;

	for (uint32_t b = 0; b < draft->n_blocks; b++) {
		n_blocks[draft->block[b].projection]++;
		n_samples[draft->block[b].projection] += (uint32_t)__builtin_popcountll(draft->block[b].mask);
	}
	rc = create(out, draft->projection, n_projections, n_blocks, n_samples, resolution);
	if (rc != PSR_OK)
		return psr_fail(err, rc, "no memory for a sampling of %u blocks", draft->n_blocks);
	for (uint32_t b = 0; b < draft->n_blocks; b++) {
		const struct draft_block *block = &draft->block[b];
		const struct taken taken = { block->projection, block->col, block->row, block->two_sided, block->mask };

		take_block(*out, &taken);
		for (uint64_t left = taken.mask; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);
			const struct draft_sample *sample = draft_sample(draft, block, s);

			take_sample(*out, &taken, s, sample->z, sample->attr);
		}
	}
	finish(*out, result);
	return PSR_OK;
}

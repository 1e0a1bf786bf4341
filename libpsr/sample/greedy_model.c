#include <stdlib.h>
#include <string.h>
#include "../base/mem.h"
#include "greedy_parts.h"

static void take_sample(struct greedy_view *view, const struct psr_blocks *blocks, uint32_t b, unsigned s, uint64_t at)
{
	const struct psr_projection *p = &view->projection;
	struct greedy_sample *sample = &view->sample[view->n_samples++];
	double pitch = greedy_row_pitch(GREEDY_EQUILATERAL), x, y;

	memset(sample, 0, sizeof *sample);
	sample->col = (int16_t)(PSR_BLOCK_SIDE * blocks->col[b] + (int)(s % PSR_BLOCK_SIDE));
	sample->row = (int16_t)(PSR_BLOCK_SIDE * blocks->row[b] + (int)(s / PSR_BLOCK_SIDE));
	sample->z = blocks->depth_bias[b] + blocks->depth_step[b] * (float)blocks->depth[at];
	sample->attr = blocks->attr[at];
	sample->two_sided = (blocks->flags[b] & PSR_BLOCK_TWO_SIDED) != 0;
	sample->is_kept = 1;
	x = (sample->col + (sample->row & 1) / 2.0) * (double)p->spacing;
	y = sample->row * pitch * (double)p->spacing;
	for (int k = 0; k < 3; k++)
		sample->position[k] = (float)(x * (double)p->axis[0][k] + y * (double)p->axis[1][k]
		                              + (double)sample->z * (double)p->axis[2][k]);
}

static void take_block(struct greedy_view *view, const struct psr_blocks *blocks, uint32_t b)
{
	struct greedy_block *block = &view->block[view->n_blocks++];
	uint64_t at = blocks->attr_first[b];

	*block = (struct greedy_block){ .col = blocks->col[b], .row = blocks->row[b], .first = view->n_samples,
		                            .n = (uint32_t)__builtin_popcountll(blocks->mask[b]), .is_kept = 1 };
	for (uint64_t left = blocks->mask[b]; left != 0; left &= left - 1)
		take_sample(view, blocks, b, (unsigned)__builtin_ctzll(left), at++);
}

static int make_room(struct greedy *greedy, const struct psr_blocks *blocks)
{
	for (int v = 0; v < greedy->n_views; v++) {
		struct greedy_view *view = &greedy->view[v];
		uint32_t n_blocks = 0, n_samples = 0;

		view->projection = blocks->projection[v];
		for (uint32_t b = 0; b < blocks->n_blocks; b++) {
			if (blocks->level[b] == 0 && blocks->block_projection[b] == v) {
				n_samples += (uint32_t)__builtin_popcountll(blocks->mask[b]);
				n_blocks++;
			}
		}
		view->sample = psr_alloc_array(n_samples, sizeof *view->sample);
		view->block = psr_alloc_array(n_blocks, sizeof *view->block);
		if (view->sample == NULL || view->block == NULL)
			return PSR_ERR_MEMORY;
	}
	return PSR_OK;
}

int greedy_take_model(struct greedy **out, const struct psr_blocks *blocks, uint32_t resolution,
                      struct greedy_result *result, struct psr_error *err)
{
	struct greedy *greedy;
	int rc;

	if (blocks->n_projections > GREEDY_MOST_VIEWS)
		return psr_fail(err, PSR_ERR_LIMIT, "a model of %u projections is over the limit of %d", blocks->n_projections,
		                GREEDY_MOST_VIEWS);
	greedy = calloc(1, sizeof *greedy);
	if (greedy == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a sampling");
	greedy->options.resolution = resolution;
	greedy->ds = 2.0 / resolution;
	greedy->side = PSR_BLOCK_SIDE;
	greedy->n_views = (int)blocks->n_projections;
	rc = make_room(greedy, blocks);
	if (rc != PSR_OK) {
		greedy_destroy(greedy);
		return psr_fail(err, rc, "no memory for a sampling of %u blocks", blocks->n_blocks);
	}
	for (uint32_t b = 0; b < blocks->n_blocks; b++)
		if (blocks->level[b] == 0)
			take_block(&greedy->view[blocks->block_projection[b]], blocks, b);
	memset(result, 0, sizeof *result);
	greedy_count(greedy, result);
	*out = greedy;
	return PSR_OK;
}

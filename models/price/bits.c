#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "model/blocks.h"
#include "price.h"

#define NORMAL_BITS 15
#define DEPTH_BITS 16
#define BEHIND 64 /* depths that a model's array has beyond its last */

static int copy(struct psr_model **out, const struct psr_model *model, const struct psr_blocks *blocks,
                struct psr_error *err)
{
	return psr_model_create(out, psr_model_info(model), blocks, psr_model_presets(model), err);
}

/* An index without its low bits, and then zeros, is the triangle in the middle of the one that is meant. */
int price_normal_bits(struct psr_model **out, const struct psr_model *model, unsigned n_bits, struct psr_error *err)
{
	struct psr_blocks blocks = *psr_model_blocks(model);
	const uint64_t dropped = (UINT64_C(1) << (NORMAL_BITS - n_bits)) - 1;
	uint64_t *attr = psr_alloc_array(blocks.n_samples, sizeof *attr);
	int rc;

	if (attr == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a model with fewer bits");
	for (uint64_t i = 0; i < blocks.n_samples; i++)
		attr[i] = blocks.attr[i] & ~dropped;
	blocks.attr = attr;
	rc = copy(out, model, &blocks, err);
	psr_free(attr);
	return rc;
}

/* The middle of the steps that are no longer told apart; depths are relative to 32768. */
int price_depth_bits(struct psr_model **out, const struct psr_model *model, unsigned n_bits, struct psr_error *err)
{
	struct psr_blocks blocks = *psr_model_blocks(model);
	const unsigned dropped = (1u << (DEPTH_BITS - n_bits)) - 1;
	uint16_t *depth = psr_alloc_array(blocks.n_samples + BEHIND, sizeof *depth);
	int rc;

	if (depth == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a model with fewer bits");
	for (uint64_t i = 0; i < blocks.n_samples; i++)
		depth[i] = (uint16_t)((blocks.depth[i] & ~dropped) + (dropped + 1) / 2);
	memset(depth + blocks.n_samples, 0, BEHIND * sizeof *depth);
	blocks.depth = depth;
	rc = copy(out, model, &blocks, err);
	psr_free(depth);
	return rc;
}

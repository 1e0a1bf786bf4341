#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"
#include "draft.h"
#include "psr/error.h"

void draft_fini(struct draft *draft)
{
	free(draft->block);
	free(draft->sample);
	memset(draft, 0, sizeof *draft);
}

void draft_project(const struct draft *draft, const struct draft_block *block, unsigned s, double p[3])
{
	double spacing = draft_spacing(draft, block);
	int row = block->row + (int)(s / PSR_BLOCK_SIDE);

	p[0] = (block->col + (int)(s % PSR_BLOCK_SIDE) + (row & 1) / 2.0) * spacing;
	p[1] = row * 0.86602540378443864676 * spacing;
	p[2] = (double)draft_sample(draft, block, s)->z;
}

void draft_position(const struct draft *draft, const struct draft_block *block, unsigned s, float position[3])
{
	double p[3], inner[3];

	draft_project(draft, block, s, p);
	projection_inner(&draft->projection[block->projection], p[0], p[1], p[2], inner);
	v3f_set(position, (float)inner[0], (float)inner[1], (float)inner[2]);
}

static int reserve(struct draft *draft, uint64_t n_blocks, uint64_t n_samples)
{
	if (n_blocks > UINT32_MAX / 2 || n_samples > UINT32_MAX / 2)
		return PSR_ERR_LIMIT;
	if (n_blocks > draft->block_capacity) {
		struct draft_block *block = realloc(draft->block, n_blocks * sizeof *block);

		if (block == NULL)
			return PSR_ERR_MEMORY;
		draft->block = block;
		draft->block_capacity = (uint32_t)n_blocks;
	}
	if (n_samples > draft->sample_capacity) {
		struct draft_sample *sample = realloc(draft->sample, n_samples * sizeof *sample);

		if (sample == NULL)
			return PSR_ERR_MEMORY;
		draft->sample = sample;
		draft->sample_capacity = (uint32_t)n_samples;
	}
	return PSR_OK;
}

static uint32_t count_kept(const struct sheets *all)
{
	uint32_t n = 0;

	for (unsigned i = 0; i < N_PROJECTIONS; i++)
		for (uint32_t p = 0; p < all[i].n_patches; p++)
			n += all[i].patch[p].kept != 0;
	return n;
}

/* Sets block_of[i][p], the number of a patch's block. */
static void add_blocks(struct draft *draft, const struct sheets *all, uint32_t *const *block_of)
{
	for (unsigned i = 0; i < N_PROJECTIONS; i++) {
		const struct sheets *sheets = &all[i];

		for (uint32_t p = 0; p < sheets->n_patches; p++) {
			const struct patch *patch = &sheets->patch[p];
			struct draft_block *block = &draft->block[draft->n_blocks];
			uint32_t k = draft->n_samples;

			if (patch->kept == 0)
				continue;
			*block = (struct draft_block){ .projection = (uint16_t)i, .col = (int16_t)(PSR_BLOCK_SIDE * patch->col),
				                           .row = (int16_t)(PSR_BLOCK_SIDE * patch->row),
				                           .level = (uint8_t)draft->n_levels, .mask = patch->kept, .part = patch->kept,
				                           .first = k };
			for (uint64_t left = patch->kept; left != 0; left &= left - 1, k++) {
				const struct sheet_sample *sample = &sheets->sample[p][__builtin_ctzll(left)];

				draft->sample[k] = (struct draft_sample){ sample->z, sample->surface, 0, PSR_OPAQUE };
			}
			draft->n_samples = k;
			block_of[i][p] = draft->n_blocks++;
		}
	}
}

static void set_attributes(struct draft *draft, const struct kept *kept, uint32_t *const *block_of)
{
	for (uint32_t i = 0; i < kept->n; i++) {
		const struct kept_sample *sample = &kept->sample[i];
		struct draft_block *block = &draft->block[block_of[sample->projection][sample->patch]];

		block->two_sided |= sample->two_sided;
		block->traits |= sample->traits;
		struct draft_sample *to = &draft->sample[draft_sample(draft, block, sample->sample) - draft->sample];

		to->attr = sample->attr;
		to->opacity = sample->opacity;
	}
}

static int has_sheer(const struct draft *draft, uint32_t first)
{
	uint8_t any = 0;

	for (uint32_t i = first; i < draft->n_blocks; i++)
		any |= draft->block[i].traits;
	return (any & PSR_BLOCK_SHEER) != 0;
}

/* Gives samples of a block these traits: makes a block of them, unless they are all that it has. */
static void split_off(struct draft *draft, uint32_t i, uint64_t part, uint8_t traits)
{
	struct draft_block *block = &draft->block[i], *to = block;

	if (part == 0)
		return;
	if (part != block->part) {
		to = &draft->block[draft->n_blocks++];
		*to = *block;
		to->part = part;
		block->part &= ~part;
	}
	to->traits |= traits;
}

/* Splits each block from `first` on whose samples are sheer or thin in part into up to three, which together have the
 * same samples. */
static int part_sheer(struct draft *draft, const struct kept *kept, uint32_t *const *block_of, uint32_t first)
{
	uint32_t n_blocks = draft->n_blocks - first;
	uint64_t (*part)[2] = psr_alloc_array(n_blocks, sizeof *part); /* glass, then thin */
	int rc = part != NULL ? reserve(draft, (uint64_t)draft->n_blocks + 2 * (uint64_t)n_blocks, 0) : PSR_ERR_MEMORY;

	if (rc == PSR_OK)
		memset(part, 0, n_blocks * sizeof *part);
	for (uint32_t i = 0; rc == PSR_OK && i < kept->n; i++) {
		const struct kept_sample *sample = &kept->sample[i];
		const int is_thin = (sample->traits & PSR_BLOCK_THIN) != 0;

		if ((sample->traits & PSR_BLOCK_SHEER) != 0)
			part[block_of[sample->projection][sample->patch] - first][is_thin] |= UINT64_C(1) << sample->sample;
	}
	for (uint32_t i = 0; rc == PSR_OK && i < n_blocks; i++) {
		draft->block[first + i].traits &= (uint8_t)~(PSR_BLOCK_SHEER | PSR_BLOCK_THIN);
		split_off(draft, first + i, part[i][0], PSR_BLOCK_SHEER);
		split_off(draft, first + i, part[i][1], PSR_BLOCK_SHEER | PSR_BLOCK_THIN);
	}
	psr_free(part);
	return rc;
}

int draft_add(struct draft *draft, const struct sheets *sheets, const struct kept *kept)
{
	uint32_t *block_of[N_PROJECTIONS] = { NULL }, first = draft->n_blocks;
	int rc = reserve(draft, (uint64_t)draft->n_blocks + count_kept(sheets), (uint64_t)draft->n_samples + kept->n);

	for (int i = 0; rc == PSR_OK && i < N_PROJECTIONS; i++) {
		block_of[i] = psr_alloc_array(sheets[i].n_patches, sizeof **block_of);
		rc = block_of[i] == NULL ? PSR_ERR_MEMORY : PSR_OK;
	}
	if (rc == PSR_OK) {
		add_blocks(draft, sheets, block_of);
		set_attributes(draft, kept, block_of);
		rc = has_sheer(draft, first) ? part_sheer(draft, kept, block_of, first) : PSR_OK;
		draft->n_levels++;
	}
	for (int i = 0; i < N_PROJECTIONS; i++)
		psr_free(block_of[i]);
	return rc;
}

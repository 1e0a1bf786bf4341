#include <math.h>
#include <stdlib.h>
#include "../base/mem.h"
#include "draft.h"
#include "psr/error.h"

/* Blocks that are together as deep as a patch may be are joined, and no deeper ones: their spheres would hold little
 * else than air. */
#define JOIN_STEPS SHEET_PATCH_STEPS

struct piece {
	struct draft_block block;
	float low, high; /* depths of what its group needs */
	uint32_t to;     /* which block of its place it becomes a part of */
};

static void make_piece(const struct draft *draft, const struct draft_block *block, struct piece *piece)
{
	*piece = (struct piece){ .block = *block, .low = INFINITY, .high = -INFINITY };
	for (uint64_t left = block->part; left != 0; left &= left - 1) {
		float z = draft_sample(draft, block, (unsigned)__builtin_ctzll(left))->z;

		piece->low = z < piece->low ? z : piece->low;
		piece->high = z > piece->high ? z : piece->high;
	}
}

static int compare_places(const struct draft_block *a, const struct draft_block *b)
{
	if (a->level != b->level)
		return a->level < b->level ? -1 : 1;
	if (a->group != b->group)
		return a->group < b->group ? -1 : 1;
	if (a->projection != b->projection)
		return a->projection < b->projection ? -1 : 1;
	if (a->row != b->row)
		return a->row < b->row ? -1 : 1;
	if (a->col != b->col)
		return a->col < b->col ? -1 : 1;
	return (int)a->two_sided - (int)b->two_sided;
}

static int compare_pieces(const void *a, const void *b)
{
	const struct piece *x = a, *y = b;
	int order = compare_places(&x->block, &y->block);

	if (order != 0)
		return order;
	if (x->low != y->low)
		return x->low < y->low ? -1 : 1;
	return x->block.first != y->block.first ? (x->block.first < y->block.first ? -1 : 1)
	                                        : x->block.part < y->block.part ? -1 : x->block.part > y->block.part;
}

/* Pieces of one place from the lowest on, each into the first block that has room for it and stays shallow; these go to
 * `block`, without samples. */
static uint32_t join_place(const struct draft *draft, struct piece *piece, uint32_t n, struct draft_block *block)
{
	const float spacing = draft->projection[piece->block.projection].spacing * (float)(1u << piece->block.level);
	uint32_t n_blocks = 0;

	for (uint32_t i = 0; i < n; i++) {
		uint32_t k = 0, first = 0;

		for (; k < n_blocks; k++) {
			for (first = 0; piece[first].to != k; first++)
				;
			if ((block[k].mask & piece[i].block.part) == 0 && piece[i].high - piece[first].low <= JOIN_STEPS * spacing)
				break;
		}
		piece[i].to = k;
		if (k == n_blocks) {
			block[n_blocks] = piece[i].block;
			block[n_blocks++].mask = 0;
		}
		block[k].mask |= piece[i].block.part;
	}
	return n_blocks;
}

/* Returns where the samples of the next block go. */
static uint32_t copy_samples(const struct draft *draft, const struct piece *piece, uint32_t to,
                             struct draft_block *block, struct draft_sample *sample, uint32_t first)
{
	block->part = block->mask;
	block->first = first;
	for (uint64_t left = block->mask; left != 0; left &= left - 1) {
		unsigned s = (unsigned)__builtin_ctzll(left);
		uint32_t i = 0;

		while (piece[i].to != to || (piece[i].block.part >> s & 1) == 0)
			i++;
		sample[first++] = *draft_sample(draft, &piece[i].block, s);
	}
	return first;
}

static void join_pieces(struct draft *draft, struct piece *piece, struct draft_block *block,
                        struct draft_sample *sample)
{
	uint32_t n_blocks = 0, n_samples = 0;

	for (uint32_t i = 0, n; i < draft->n_blocks; i += n) {
		uint32_t n_joined;

		for (n = 1; i + n < draft->n_blocks && compare_places(&piece[i].block, &piece[i + n].block) == 0; n++)
			;
		n_joined = join_place(draft, &piece[i], n, &block[n_blocks]);
		for (uint32_t k = 0; k < n_joined; k++, n_blocks++)
			n_samples = copy_samples(draft, &piece[i], k, &block[n_blocks], sample, n_samples);
	}
	free(draft->block);
	free(draft->sample);
	draft->block = block;
	draft->sample = sample;
	draft->block_capacity = draft->n_blocks;
	draft->n_blocks = n_blocks;
	draft->n_samples = draft->sample_capacity = n_samples;
}

int draft_join(struct draft *draft)
{
	struct piece *piece = psr_alloc_array(draft->n_blocks, sizeof *piece);
	struct draft_block *block = malloc(draft->n_blocks * sizeof *block);
	struct draft_sample *sample;
	uint64_t n_samples = 0;

	for (uint32_t i = 0; i < draft->n_blocks; i++)
		n_samples += (uint64_t)__builtin_popcountll(draft->block[i].part);
	if (n_samples > UINT32_MAX) {
		psr_free(piece);
		free(block);
		return PSR_ERR_LIMIT;
	}
	sample = malloc(n_samples * sizeof *sample);
	if (piece == NULL || block == NULL || sample == NULL) {
		psr_free(piece);
		free(block);
		free(sample);
		return PSR_ERR_MEMORY;
	}
	for (uint32_t i = 0; i < draft->n_blocks; i++)
		make_piece(draft, &draft->block[i], &piece[i]);
	qsort(piece, draft->n_blocks, sizeof *piece, compare_pieces);
	join_pieces(draft, piece, block, sample);
	psr_free(piece);
	return PSR_OK;
}

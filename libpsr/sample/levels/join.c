#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include "base/mem.h"
#include "draft.h"
#include "psr/error.h"

/* Joined blocks are no deeper than a patch: their spheres would hold mostly air. */
#define JOIN_STEPS SHEET_PATCH_STEPS
#define NONE UINT32_MAX

/* A window of the lattice, and its samples. */
struct window {
	int low[2], high[2]; /* columns and rows, */
	float near, far;     /* and depths: there are samples from the one to the other */
	int col, row;        /* where it begins; row is even */
	uint64_t mask;
};

/* The samples of a block that a group needs, and the window of all pieces joined to this one. */
struct piece {
	struct draft_block block;
	struct window window;
	uint32_t next;       /* the next joined piece; NONE ends the list */
	uint8_t is_joined;   /* to another */
};

static uint64_t moved(uint64_t mask, int cols, int rows)
{
	int by = PSR_BLOCK_SIDE * rows + cols;

	return by < 0 ? mask >> -by : mask << by;
}

static void make_piece(const struct draft *draft, const struct draft_block *block, struct piece *piece)
{
	struct window *w = &piece->window;

	*piece = (struct piece){ .block = *block, .next = NONE };
	*w = (struct window){ { INT_MAX, INT_MAX }, { INT_MIN, INT_MIN }, INFINITY, -INFINITY, block->col, block->row,
		                  block->part };
	for (uint64_t left = block->part; left != 0; left &= left - 1) {
		int s = __builtin_ctzll(left), at[2] = { block->col + s % PSR_BLOCK_SIDE, block->row + s / PSR_BLOCK_SIDE };
		float z = draft_sample(draft, block, (unsigned)s)->z;

		for (int k = 0; k < 2; k++) {
			w->low[k] = at[k] < w->low[k] ? at[k] : w->low[k];
			w->high[k] = at[k] > w->high[k] ? at[k] : w->high[k];
		}
		w->near = z < w->near ? z : w->near;
		w->far = z > w->far ? z : w->far;
	}
}

static int compare_lattices(const struct draft_block *a, const struct draft_block *b)
{
	const int kinds = PSR_BLOCK_SHEER | PSR_BLOCK_THIN;

	if (a->level != b->level)
		return a->level < b->level ? -1 : 1;
	if (a->group != b->group)
		return a->group < b->group ? -1 : 1;
	if (a->projection != b->projection)
		return a->projection < b->projection ? -1 : 1;
	if (a->two_sided != b->two_sided)
		return (int)a->two_sided - (int)b->two_sided;
	return (a->traits & kinds) - (b->traits & kinds);
}

static int compare_pieces(const void *a, const void *b)
{
	const struct piece *x = a, *y = b;
	int order = compare_lattices(&x->block, &y->block);

	if (order != 0)
		return order;
	for (int k = 1; k >= 0; k--)
		if (x->window.low[k] != y->window.low[k])
			return x->window.low[k] < y->window.low[k] ? -1 : 1;
	if (x->window.near != y->window.near)
		return x->window.near < y->window.near ? -1 : 1;
	return x->block.first != y->block.first ? (x->block.first < y->block.first ? -1 : 1)
	                                        : x->block.part < y->block.part ? -1 : x->block.part > y->block.part;
}

/* Makes one window for two without a common lattice point, unless it is too deep. */
static int fit(const struct window *a, const struct window *b, float spacing, struct window *both)
{
	uint64_t mask;

	both->near = a->near < b->near ? a->near : b->near;
	both->far = a->far > b->far ? a->far : b->far;
	for (int k = 0; k < 2; k++) {
		both->low[k] = a->low[k] < b->low[k] ? a->low[k] : b->low[k];
		both->high[k] = a->high[k] > b->high[k] ? a->high[k] : b->high[k];
	}
	both->col = both->low[0];
	both->row = both->low[1] - (both->low[1] & 1);
	if (both->high[0] - both->col >= PSR_BLOCK_SIDE || both->high[1] - both->row >= PSR_BLOCK_SIDE
	    || both->far - both->near > JOIN_STEPS * spacing)
		return 0;
	mask = moved(a->mask, a->col - both->col, a->row - both->row);
	both->mask = moved(b->mask, b->col - both->col, b->row - both->row);
	if ((both->mask & mask) != 0)
		return 0;
	both->mask |= mask;
	return 1;
}

static float size2_of(const struct window *w, float spacing)
{
	float x = (float)(w->high[0] - w->low[0]) * spacing, y = (float)(w->high[1] - w->low[1]) * 0.8660254f * spacing;
	float z = w->far - w->near;

	return x * x + y * y + z * z;
}

/* Returns the piece after i on its lattice that makes the smallest window with it, or NONE. */
static uint32_t find_best(const struct piece *piece, uint32_t i, uint32_t n, float spacing, struct window *best)
{
	float least = INFINITY;
	uint32_t found = NONE;

	for (uint32_t k = i + 1; k < n && piece[k].window.low[1] < piece[i].window.low[1] + PSR_BLOCK_SIDE; k++) {
		struct window both;

		if (piece[k].is_joined || !fit(&piece[i].window, &piece[k].window, spacing, &both))
			continue;
		if (size2_of(&both, spacing) < least) {
			least = size2_of(&both, spacing);
			*best = both;
			found = k;
		}
	}
	return found;
}

/* Joins to each piece, from the lowest row on, others as long as any fit. */
static void join_lattice(struct piece *piece, uint32_t n, float spacing)
{
	for (uint32_t i = 0; i < n; i++) {
		uint32_t last = i, k;
		struct window best;

		while (!piece[i].is_joined && (k = find_best(piece, i, n, spacing, &best)) != NONE) {
			piece[k].is_joined = 1;
			piece[i].window = best;
			piece[last].next = k;
			last = k;
		}
	}
}

/* Moves a window, which begins in an even row, so that its middle is nearest to the middle of the samples' box. Samples
 * that fit one window fit the moved one, too. */
static void center_window(struct window *w)
{
	int low = INT_MAX, high = INT_MIN, col, row; /* in half columns: odd rows lie half a column on */

	for (uint64_t left = w->mask; left != 0; left &= left - 1) {
		int s = __builtin_ctzll(left), at = 2 * (w->col + s % PSR_BLOCK_SIDE) + (s / PSR_BLOCK_SIDE & 1);

		low = at < low ? at : low;
		high = at > high ? at : high;
	}
	col = (int)floor((low + high - 15) / 4.0 + 0.5);
	row = 2 * (int)floor((w->low[1] + w->high[1] - 7) / 4.0 + 0.5);
	w->mask = moved(w->mask, w->col - col, w->row - row);
	w->col = col;
	w->row = row;
}

/* Returns the first sample of the next block. */
static uint32_t copy_samples(const struct draft *draft, const struct piece *piece, uint32_t i,
                             struct draft_block *block, struct draft_sample *sample, uint32_t first)
{
	struct window w = piece[i].window;

	center_window(&w);
	*block = piece[i].block;
	block->col = (int16_t)w.col;
	block->row = (int16_t)w.row;
	block->mask = block->part = w.mask;
	block->first = first;
	for (uint64_t left = w.mask; left != 0; left &= left - 1) {
		int s = __builtin_ctzll(left), of;
		uint32_t k = i;

		for (;; k = piece[k].next) {
			const struct draft_block *own = &piece[k].block;

			of = s + PSR_BLOCK_SIDE * (w.row - own->row) + w.col - own->col;
			if ((moved(own->part, own->col - w.col, own->row - w.row) >> s & 1) != 0)
				break;
		}
		sample[first++] = *draft_sample(draft, &piece[k].block, (unsigned)of);
		block->traits |= piece[k].block.traits;
	}
	return first;
}

static void join_pieces(struct draft *draft, struct piece *piece, struct draft_block *block,
                        struct draft_sample *sample)
{
	uint32_t n_blocks = 0, n_samples = 0;

	for (uint32_t i = 0, n; i < draft->n_blocks; i += n) {
		const struct draft_block *one = &piece[i].block;

		for (n = 1; i + n < draft->n_blocks && compare_lattices(one, &piece[i + n].block) == 0; n++)
			;
		join_lattice(&piece[i], n, draft->projection[one->projection].spacing * (float)(1u << one->level));
		for (uint32_t k = 0; k < n; k++)
			if (!piece[i + k].is_joined)
				n_samples = copy_samples(draft, &piece[i], k, &block[n_blocks++], sample, n_samples);
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

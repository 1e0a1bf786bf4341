#include <stdlib.h>
#include "base/mem.h"
#include "parts.h"

struct key {
	int block_row, block_col, row, col;
	uint32_t index;
};

static int floor_div(int a, int b)
{
	return a >= 0 ? a / b : -((b - 1 - a) / b);
}

static int compare_keys(const void *a, const void *b)
{
	const struct key *x = a, *y = b;

	if (x->block_row != y->block_row)
		return x->block_row < y->block_row ? -1 : 1;
	if (x->block_col != y->block_col)
		return x->block_col < y->block_col ? -1 : 1;
	if (x->row != y->row)
		return x->row < y->row ? -1 : 1;
	return (x->col > y->col) - (x->col < y->col);
}

static int is_same_block(const struct key *a, const struct key *b)
{
	return a->block_row == b->block_row && a->block_col == b->block_col;
}

static void make_blocks(struct greedy_view *view, const struct key *key, struct greedy_sample *sorted, int side)
{
	view->n_blocks = 0;
	for (uint32_t i = 0; i < view->n_samples; i++) {
		sorted[i] = view->sample[key[i].index];
		sorted[i].is_kept = 0;
		if (i == 0 || !is_same_block(&key[i], &key[i - 1]))
			view->block[view->n_blocks++] = (struct greedy_block){ .col = (int16_t)(side * key[i].block_col),
				                                                   .row = (int16_t)(side * key[i].block_row),
				                                                   .first = i };
		view->block[view->n_blocks - 1].n++;
	}
}

int greedy_divide(struct greedy_view *view, int side)
{
	struct key *key = psr_alloc_array(view->n_samples, sizeof *key);
	struct greedy_sample *sorted = psr_alloc_array(view->n_samples, sizeof *sorted);
	uint32_t n_blocks = 0;

	psr_free(view->block);
	view->block = NULL;
	if (key == NULL || sorted == NULL)
		goto failed;
	for (uint32_t i = 0; i < view->n_samples; i++) {
		const struct greedy_sample *sample = &view->sample[i];

		key[i] = (struct key){ floor_div(sample->row, side), floor_div(sample->col, side), sample->row, sample->col,
			                   i };
	}
	qsort(key, view->n_samples, sizeof *key, compare_keys);
	for (uint32_t i = 0; i < view->n_samples; i++)
		n_blocks += i == 0 || !is_same_block(&key[i], &key[i - 1]);
	view->block = psr_alloc_array(n_blocks, sizeof *view->block);
	if (view->block == NULL)
		goto failed;
	make_blocks(view, key, sorted, side);
	psr_free(view->sample);
	psr_free(key);
	view->sample = sorted;
	return PSR_OK;
failed:
	psr_free(key);
	psr_free(sorted);
	view->n_blocks = 0;
	return PSR_ERR_MEMORY;
}

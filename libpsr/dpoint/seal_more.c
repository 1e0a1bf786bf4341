/* Candidates that were left out, in the way of rays. */
#include <stdlib.h>
#include <string.h>
#include "choice.h"
#include "seal.h"

struct keeping {
	const struct dpoint_cover *cover;
	uint8_t *is_due;    /* by cell: open, and none of the candidates that come is over it */
	uint32_t *n_before; /* how many open cells come before each place of the cover's order */
};

static size_t count_due(const struct keeping *k, uint32_t candidate)
{
	const struct cell_tree *tree = k->cover->tree;
	size_t n = 0;

	for (uint32_t i = 0; i < k->cover->n[candidate]; i++) {
		const struct cell_node *node = &tree->node[k->cover->list[candidate][i]];

		for (uint32_t c = node->begin; c < node->end; c++)
			n += k->is_due[tree->order[c]];
	}
	return n;
}

/* The same before any candidate came. */
static size_t count_open(const struct keeping *k, uint32_t candidate)
{
	size_t n = 0;

	for (uint32_t i = 0; i < k->cover->n[candidate]; i++) {
		const struct cell_node *node = &k->cover->tree->node[k->cover->list[candidate][i]];

		n += k->n_before[node->end] - k->n_before[node->begin];
	}
	return n;
}

static void mark_done(struct keeping *k, uint32_t candidate)
{
	const struct cell_tree *tree = k->cover->tree;

	for (uint32_t i = 0; i < k->cover->n[candidate]; i++) {
		const struct cell_node *node = &tree->node[k->cover->list[candidate][i]];

		for (uint32_t c = node->begin; c < node->end; c++)
			k->is_due[tree->order[c]] = 0;
	}
}

static void keep(struct keeping *k, struct dpoint_choice *choice, struct heap *heap)
{
	for (uint32_t i = 0; i < k->cover->n_candidates; i++) {
		const size_t n = choice->is_kept[i] ? 0 : count_open(k, i);

		if (n > 0)
			heap->entry[heap->n++] = (struct heap_entry){ (float)n, i };
	}
	heap_make(heap);
	while (heap->n > 0) {
		const uint32_t i = heap->entry[0].candidate;
		const float n = (float)count_due(k, i);

		if (n > 0 && n < heap->entry[0].key) {
			heap_lower(heap, n);
			continue;
		}
		heap_pop(heap);
		if (n == 0)
			continue;
		choice->is_kept[i] = 1;
		choice->n_kept++;
		mark_done(k, i);
	}
}

int keep_over_open(struct dpoint_choice *choice, const struct dpoint_cover *cover, const uint8_t *is_open)
{
	struct keeping k = { cover, malloc(cover->n_cells), malloc((cover->n_cells + 1) * sizeof *k.n_before) };
	struct heap heap = { malloc((cover->n_candidates + 1) * sizeof *heap.entry), 0 };
	const int is_there = k.is_due != NULL && k.n_before != NULL && heap.entry != NULL;
	uint32_t n = 0;

	if (is_there) {
		memcpy(k.is_due, is_open, cover->n_cells);
		for (size_t e = 0; e < cover->n_cells; e++) {
			k.n_before[e] = n;
			n += is_open[cover->tree->order[e]];
		}
		k.n_before[cover->n_cells] = n;
		keep(&k, choice, &heap);
	}
	free(k.is_due);
	free(k.n_before);
	free(heap.entry);
	return is_there ? PSR_OK : PSR_ERR_MEMORY;
}

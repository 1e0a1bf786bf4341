#include "choice.h"

#include <stdlib.h>
#include <string.h>

static void sift_down(struct heap *heap, size_t i)
{
	const struct heap_entry moved = heap->entry[i];

	for (;;) {
		size_t child = 2 * i + 1;

		if (child >= heap->n)
			break;
		if (child + 1 < heap->n && heap_is_above(&heap->entry[child + 1], &heap->entry[child]))
			child++;
		if (!heap_is_above(&heap->entry[child], &moved))
			break;
		heap->entry[i] = heap->entry[child];
		i = child;
	}
	heap->entry[i] = moved;
}

void heap_make(struct heap *heap)
{
	for (size_t i = heap->n / 2; i-- > 0;)
		sift_down(heap, i);
}

void heap_pop(struct heap *heap)
{
	heap->entry[0] = heap->entry[--heap->n];
	if (heap->n > 0)
		sift_down(heap, 0);
}

void heap_lower(struct heap *heap, float key)
{
	heap->entry[0].key = key;
	sift_down(heap, 0);
}

/* ---- how often cells are covered ---- */

int tally_init(struct tally *tally, const struct dpoint_cover *cover)
{
	const size_t n = cover->tree != NULL ? cover->tree->n_nodes : 1;

	tally->cover = cover;
	tally->own = calloc(n, sizeof *tally->own);
	tally->least = calloc(n, sizeof *tally->least);
	return tally->own != NULL && tally->least != NULL ? PSR_OK : PSR_ERR_MEMORY;
}

void tally_fini(struct tally *tally)
{
	free(tally->own);
	free(tally->least);
}

void tally_add(struct tally *tally, uint32_t candidate, int by)
{
	for (uint32_t k = 0; k < tally->cover->n[candidate]; k++) {
		uint32_t i = tally->cover->list[candidate][k];

		tally->own[i] += (uint32_t)by;
		tally->least[i] += (uint32_t)by;
		while (i > 0) {
			const uint32_t up = (i - 1) / 2, a = tally->least[2 * up + 1], b = tally->least[2 * up + 2];
			const uint32_t least = tally->own[up] + (a < b ? a : b);

			if (least == tally->least[up])
				break;
			tally->least[up] = least;
			i = up;
		}
	}
}

/* Returns the least of a path below a node. */
static uint32_t sum_below(struct tally *tally, size_t i)
{
	uint32_t a = 0, b = 0;

	if (!cell_node_is_leaf(&tally->cover->tree->node[i])) {
		a = sum_below(tally, 2 * i + 1);
		b = sum_below(tally, 2 * i + 2);
	}
	return tally->least[i] = tally->own[i] + (a < b ? a : b);
}

void tally_add_all(struct tally *tally)
{
	const struct dpoint_cover *cover = tally->cover;

	for (uint32_t i = 0; i < cover->n_candidates; i++)
		for (uint32_t k = 0; k < cover->n[i]; k++)
			tally->own[cover->list[i][k]]++;
	if (cover->tree != NULL)
		sum_below(tally, 0);
}

int tally_has(const struct tally *tally, uint32_t candidate, uint32_t n)
{
	for (uint32_t k = 0; k < tally->cover->n[candidate]; k++) {
		uint32_t i = tally->cover->list[candidate][k], least = tally->least[i];

		while (i > 0 && least < n) {
			i = (i - 1) / 2;
			least += tally->own[i];
		}
		if (least < n)
			return 0;
	}
	return 1;
}

static size_t holes_below(const struct tally *tally, size_t i)
{
	const struct cell_node *node = &tally->cover->tree->node[i];

	if (tally->least[i] > 0 || tally->own[i] > 0)
		return 0;
	if (cell_node_is_leaf(node))
		return node->part != DPOINT_BEYOND;
	return holes_below(tally, 2 * i + 1) + holes_below(tally, 2 * i + 2);
}

size_t tally_holes(const struct tally *tally)
{
	return tally->cover->tree != NULL ? holes_below(tally, 0) : tally->cover->n_cells;
}

/* ---- what is kept ---- */

int choice_init(struct dpoint_choice *choice, struct heap *heap, struct tally *tally, const struct dpoint_cover *cover)
{
	int rc = tally_init(tally, cover);

	memset(choice, 0, sizeof *choice);
	choice->is_kept = calloc(cover->n_candidates + 1, 1);
	heap->n = 0;
	heap->entry = malloc((cover->n_candidates + 1) * sizeof *heap->entry);
	return choice->is_kept != NULL && heap->entry != NULL ? rc : PSR_ERR_MEMORY;
}

void choice_fini(struct heap *heap, struct tally *tally)
{
	free(heap->entry);
	tally_fini(tally);
}

void choice_prune(struct dpoint_choice *choice, struct heap *heap, struct tally *tally)
{
	for (heap_make(heap); heap->n > 0; heap_pop(heap)) {
		const uint32_t i = heap->entry[0].candidate;

		if (choice->is_kept[i] && tally_has(tally, i, 2)) {
			choice->is_kept[i] = 0;
			tally_add(tally, i, -1);
		}
	}
}

void choice_finish(struct dpoint_choice *choice, const struct tally *tally)
{
	choice->n_kept = 0;
	for (size_t i = 0; i < tally->cover->n_candidates; i++)
		choice->n_kept += choice->is_kept[i];
	choice->n_holes = tally_holes(tally);
}

void dpoint_choice_fini(struct dpoint_choice *choice)
{
	free(choice->is_kept);
	memset(choice, 0, sizeof *choice);
}

/* Few candidates that cover all cells: a front sweeps over the surface, what became superfluous is pruned, and some are
 * exchanged for fewer. */
#include <math.h>
#include <stdlib.h>
#include "base/radix.h"
#include "choice.h"

/* What is not covered yet. Cells weigh the less, the more cells the largest of their candidates covers: so a weight is
 * a part of a candidate, whatever the cells' size. */
struct open {
	const struct dpoint_cover *cover;
	double *weight; /* of the open cells of a node */
};

static void sum_up(double *weight, const struct cell_tree *tree, size_t i)
{
	if (cell_node_is_leaf(&tree->node[i]))
		return;
	sum_up(weight, tree, 2 * i + 1);
	sum_up(weight, tree, 2 * i + 2);
	weight[i] = weight[2 * i + 1] + weight[2 * i + 2];
}

static void weigh_below(double *weight, const struct cell_tree *tree, size_t i, double most)
{
	most = fmax(most, weight[i]);
	if (cell_node_is_leaf(&tree->node[i])) {
		weight[i] = most > 0 ? 1 / most : 0;
		return;
	}
	weigh_below(weight, tree, 2 * i + 1, most);
	weigh_below(weight, tree, 2 * i + 2, most);
}

static int open_init(struct open *open, const struct dpoint_cover *cover)
{
	open->cover = cover;
	open->weight = calloc(cover->tree != NULL ? cover->tree->n_nodes : 1, sizeof *open->weight);
	if (open->weight == NULL)
		return PSR_ERR_MEMORY;
	if (cover->tree == NULL)
		return PSR_OK;
	for (uint32_t i = 0; i < cover->n_candidates; i++) {
		const double size = (double)dpoint_cover_size(cover, i);

		for (uint32_t k = 0; k < cover->n[i]; k++)
			open->weight[cover->list[i][k]] = fmax(open->weight[cover->list[i][k]], size);
	}
	weigh_below(open->weight, cover->tree, 0, 0);
	sum_up(open->weight, cover->tree, 0);
	return PSR_OK;
}

static float open_gain(const struct open *open, uint32_t candidate)
{
	double gain = 0;

	for (uint32_t k = 0; k < open->cover->n[candidate]; k++)
		gain += open->weight[open->cover->list[candidate][k]];
	return (float)gain;
}

/* Nodes are closed once, so all of this takes as long as there are nodes. */
static void close_below(double *weight, const struct cell_tree *tree, size_t i)
{
	if (weight[i] == 0)
		return;
	weight[i] = 0;
	if (!cell_node_is_leaf(&tree->node[i])) {
		close_below(weight, tree, 2 * i + 1);
		close_below(weight, tree, 2 * i + 2);
	}
}

/* A node's weight is the sum of its children's, not a difference: so it becomes 0 exactly. */
static void open_close(struct open *open, uint32_t candidate)
{
	for (uint32_t k = 0; k < open->cover->n[candidate]; k++) {
		uint32_t i = open->cover->list[candidate][k];

		if (open->weight[i] == 0)
			continue;
		close_below(open->weight, open->cover->tree, i);
		while (i > 0) {
			i = (i - 1) / 2;
			open->weight[i] = open->weight[2 * i + 1] + open->weight[2 * i + 2];
		}
	}
}

/* ---- the front ---- */

/* Candidates by the nodes that are in their lists, and leaves in the order of the sweep. */
struct front {
	size_t *first;       /* of each node's candidates */
	uint32_t *candidate;
	struct radix_entry *leaf; /* the value is a node */
	float *gain;         /* of candidates: an upper bound, as gains only fall */
};

static int front_init(struct front *front, const struct dpoint_cover *cover)
{
	const size_t n_nodes = cover->tree != NULL ? cover->tree->n_nodes : 0;
	size_t total = 0, sum = 0;

	for (size_t i = 0; i < cover->n_candidates; i++)
		total += cover->n[i];
	front->first = calloc(n_nodes + 2, sizeof *front->first);
	front->candidate = malloc((total + 1) * sizeof *front->candidate);
	front->leaf = malloc((2 * cover->n_cells + 1) * sizeof *front->leaf);
	front->gain = malloc((cover->n_candidates + 1) * sizeof *front->gain);
	if (front->first == NULL || front->candidate == NULL || front->leaf == NULL || front->gain == NULL)
		return PSR_ERR_MEMORY;
	/* Counted two places later, each node's first one stands one place later while it is filled. */
	for (uint32_t i = 0; i < cover->n_candidates; i++)
		for (uint32_t k = 0; k < cover->n[i]; k++)
			front->first[cover->list[i][k] + 2]++;
	for (size_t i = 1; i < n_nodes + 2; i++)
		front->first[i] = sum += front->first[i];
	for (uint32_t i = 0; i < cover->n_candidates; i++)
		for (uint32_t k = 0; k < cover->n[i]; k++)
			front->candidate[front->first[cover->list[i][k] + 1]++] = i;
	return PSR_OK;
}

static void front_fini(struct front *front)
{
	free(front->first);
	free(front->candidate);
	free(front->leaf);
	free(front->gain);
}

static void list_leaves(struct radix_entry *leaf, const struct cell_tree *tree, size_t i)
{
	const struct cell_node *node = &tree->node[i];

	if (cell_node_is_leaf(node)) {
		leaf[node->begin].value = (uint32_t)i;
		return;
	}
	list_leaves(leaf, tree, 2 * i + 1);
	list_leaves(leaf, tree, 2 * i + 2);
}

/* Sweeps along the axis of the longest side. */
static void sort_leaves(struct radix_entry *leaf, const struct cell_tree *tree, const struct cell_node *all)
{
	float low[3] = { INFINITY, INFINITY, INFINITY }, high[3] = { -INFINITY, -INFINITY, -INFINITY };
	int axis = 0;

	list_leaves(leaf, tree, 0);
	for (uint32_t i = 0; i < all->end; i++)
		for (int k = 0; k < 3; k++) {
			const float x = tree->ball[leaf[i].value].middle[k];

			low[k] = x < low[k] ? x : low[k];
			high[k] = x > high[k] ? x : high[k];
		}
	for (int k = 0; k < 3; k++)
		axis = high[k] - low[k] > high[axis] - low[axis] ? k : axis;
	for (uint32_t i = 0; i < all->end; i++) {
		const uint32_t node = leaf[i].value;

		leaf[i].key = (uint64_t)radix_of_float(tree->ball[node].middle[axis]) << 32 | (UINT32_MAX - node);
	}
	radix_sort(leaf, all->end);
}

/* Returns the candidate of the greatest gain among those that cover the leaf, or UINT32_MAX. */
static uint32_t best_at(struct front *front, const struct open *open, size_t leaf)
{
	uint32_t best = UINT32_MAX;
	float most = 0;

	for (size_t node = leaf;; node = (node - 1) / 2) {
		for (size_t k = front->first[node]; k < front->first[node + 1]; k++) {
			const uint32_t i = front->candidate[k];

			if (front->gain[i] <= most)
				continue;
			front->gain[i] = open_gain(open, i);
			if (front->gain[i] > most) {
				most = front->gain[i];
				best = i;
			}
		}
		if (node == 0)
			return best;
	}
}

static void advance(struct dpoint_choice *choice, struct front *front, struct tally *tally, struct open *open)
{
	const struct dpoint_cover *cover = tally->cover;

	if (cover->tree == NULL)
		return;
	sort_leaves(front->leaf, cover->tree, &cover->tree->node[0]);
	for (uint32_t i = 0; i < cover->n_candidates; i++)
		front->gain[i] = open_gain(open, i);
	for (size_t c = 0; c < cover->n_cells; c++) {
		const uint32_t leaf = front->leaf[c].value;
		const uint32_t best = open->weight[leaf] > 0 ? best_at(front, open, leaf) : UINT32_MAX;

		if (best == UINT32_MAX)
			continue;
		choice->is_kept[best] = 1;
		tally_add(tally, best, 1);
		open_close(open, best);
	}
}

int dpoint_choose(struct dpoint_choice *choice, const struct dpoint_cover *cover)
{
	struct heap heap;
	struct tally tally;
	struct open open = { NULL, NULL };
	struct front front = { NULL, NULL, NULL, NULL };
	int rc = choice_init(choice, &heap, &tally, cover);

	if (rc == PSR_OK)
		rc = open_init(&open, cover);
	if (rc == PSR_OK)
		rc = front_init(&front, cover);
	if (rc == PSR_OK) {
		advance(choice, &front, &tally, &open);
		for (uint32_t i = 0; i < cover->n_candidates; i++)
			if (choice->is_kept[i])
				heap.entry[heap.n++] = (struct heap_entry){ -(float)dpoint_cover_size(cover, i), i };
		choice_prune(choice, &heap, &tally);
		rc = choice_swap(choice, cover);
	}
	if (rc == PSR_OK)
		choice_finish(choice, &tally); /* swapping leaves no cell open, so the tally's holes are its holes */
	front_fini(&front);
	free(open.weight);
	choice_fini(&heap, &tally);
	return rc;
}

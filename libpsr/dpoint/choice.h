/* Shared by the ways to choose candidates: a heap, and how often cells are covered. */
#ifndef PSR_DPOINT_CHOICE_H
#define PSR_DPOINT_CHOICE_H

#include "cell_tree.h"

struct heap_entry {
	float key;
	uint32_t candidate;
};

/* The greatest key is on top; of equal ones the lowest candidate. */
struct heap {
	struct heap_entry *entry;
	size_t n;
};

static inline int heap_is_above(const struct heap_entry *a, const struct heap_entry *b)
{
	return a->key != b->key ? a->key > b->key : a->candidate < b->candidate;
}

void heap_make(struct heap *heap);
void heap_pop(struct heap *heap);              /* the heap is not empty */
void heap_lower(struct heap *heap, float key); /* gives the top a lower key */

/* How often cells are covered, by nodes of the cover's tree: a candidate counts where its list says. */
struct tally {
	const struct dpoint_cover *cover;
	uint32_t *own;   /* how many candidates have this node in their lists */
	uint32_t *least; /* own, and the least of all paths from here down to a cell */
};

int tally_init(struct tally *tally, const struct dpoint_cover *cover); /* MEMORY; tally_fini() even then */
void tally_fini(struct tally *tally);
void tally_add(struct tally *tally, uint32_t candidate, int by); /* by: 1 or -1 */
void tally_add_all(struct tally *tally); /* each candidate of the cover, to none */

/* Returns whether each cell of the candidate is covered by at least n candidates. */
int tally_has(const struct tally *tally, uint32_t candidate, uint32_t n);

/* Counts the cells that no candidate covers. */
size_t tally_holes(const struct tally *tally);

/* Keeps no candidate; the heap is empty, with room for all candidates. MEMORY; the caller calls choice_fini() even
 * then. */
int choice_init(struct dpoint_choice *choice, struct heap *heap, struct tally *tally, const struct dpoint_cover *cover);
void choice_fini(struct heap *heap, struct tally *tally);

/* Leaves out kept candidates whose cells are all covered by others, the lowest key first. */
void choice_prune(struct dpoint_choice *choice, struct heap *heap, struct tally *tally);

/* Exchanges kept candidates for others that cover what these cover alone, as long as it saves points. All cells that
 * were covered stay so. MEMORY. */
int choice_swap(struct dpoint_choice *choice, const struct dpoint_cover *cover);

/* Counts what is kept, and holes. */
void choice_finish(struct dpoint_choice *choice, const struct tally *tally);

#endif

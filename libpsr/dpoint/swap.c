/* Exchanges: a candidate that was left out for kept ones that it makes superfluous. */
#include <stdlib.h>
#include <string.h>
#include "base/random.h"
#include "choice.h"

#define LEAST_GAIN 150 /* a turn that saves less than one of so many is the last */

/* How many kept candidates are over a cell, and the sum of their indices, which tells the one that is alone. */
struct over {
	uint32_t n, sum;
};

/* over: by cell, in the order of the tree. By candidate: over how many cells a kept one is alone, and how many of these
 * are `lost` to the one that is looked at. */
struct swapping {
	const struct dpoint_cover *cover;
	uint8_t *is_kept;
	struct over *over;
	uint32_t *alone, *lost;
	uint32_t *owner; /* kept ones that the one that is looked at may replace */
	size_t n_owners;
	uint64_t seed;
};

static const struct cell_node *node_of(const struct swapping *s, uint32_t candidate, uint32_t k)
{
	return &s->cover->tree->node[s->cover->list[candidate][k]];
}

static void keep(struct swapping *s, uint32_t candidate)
{
	s->is_kept[candidate] = 1;
	s->alone[candidate] = 0;
	for (uint32_t k = 0; k < s->cover->n[candidate]; k++)
		for (uint32_t c = node_of(s, candidate, k)->begin, end = node_of(s, candidate, k)->end; c < end; c++) {
			if (s->over[c].n == 0)
				s->alone[candidate]++;
			else if (s->over[c].n == 1)
				s->alone[s->over[c].sum]--;
			s->over[c].n++;
			s->over[c].sum += candidate;
		}
}

/* The candidate is alone nowhere. */
static void leave(struct swapping *s, uint32_t candidate)
{
	s->is_kept[candidate] = 0;
	for (uint32_t k = 0; k < s->cover->n[candidate]; k++)
		for (uint32_t c = node_of(s, candidate, k)->begin, end = node_of(s, candidate, k)->end; c < end; c++) {
			s->over[c].n--;
			s->over[c].sum -= candidate;
			if (s->over[c].n == 1)
				s->alone[s->over[c].sum]++;
		}
}

/* Lists the kept ones whose cells the candidate covers, as far as they are alone there. */
static void find_owners(struct swapping *s, uint32_t candidate)
{
	size_t n = 0;

	s->n_owners = 0;
	for (uint32_t k = 0; k < s->cover->n[candidate]; k++)
		for (uint32_t c = node_of(s, candidate, k)->begin, end = node_of(s, candidate, k)->end; c < end; c++)
			if (s->over[c].n == 1 && s->lost[s->over[c].sum]++ == 0)
				s->owner[s->n_owners++] = s->over[c].sum;
	for (size_t i = 0; i < s->n_owners; i++) {
		const uint32_t owner = s->owner[i];

		if (s->lost[owner] == s->alone[owner])
			s->owner[n++] = owner;
		s->lost[owner] = 0;
	}
	s->n_owners = n;
}

/* One for one saves nothing, but what comes of it others may. So half of these are made, at random. Returns how many
 * points less there are. */
static size_t swap(struct swapping *s, uint32_t candidate)
{
	size_t n_left = 0;

	find_owners(s, candidate);
	if (s->n_owners == 0 || (s->n_owners == 1 && random_below(&s->seed, 2) == 0))
		return 0;
	keep(s, candidate);
	for (size_t i = 0; i < s->n_owners; i++)
		if (s->alone[s->owner[i]] == 0) {
			leave(s, s->owner[i]);
			n_left++;
		}
	return n_left - 1; /* the first of them is superfluous in any case */
}

static size_t swap_all(struct swapping *s)
{
	size_t n_less = 0;

	for (uint32_t i = 0; i < s->cover->n_candidates; i++)
		n_less += s->is_kept[i] ? 0 : swap(s, i);
	for (uint32_t i = 0; i < s->cover->n_candidates; i++)
		if (s->is_kept[i] && s->alone[i] == 0) {
			leave(s, i);
			n_less++;
		}
	return n_less;
}

int choice_swap(struct dpoint_choice *choice, const struct dpoint_cover *cover)
{
	const size_t n = cover->n_candidates;
	struct swapping s = { cover, choice->is_kept, .seed = 1 };
	int is_there;

	s.over = calloc(cover->n_cells + 1, sizeof *s.over);
	s.alone = calloc(n + 1, sizeof *s.alone);
	s.lost = calloc(n + 1, sizeof *s.lost);
	s.owner = malloc((n + 1) * sizeof *s.owner);
	is_there = s.over != NULL && s.alone != NULL && s.lost != NULL && s.owner != NULL;
	if (is_there) {
		size_t n_kept = 0, n_less;

		for (uint32_t i = 0; i < n; i++)
			if (choice->is_kept[i]) {
				keep(&s, i);
				n_kept++;
			}
		do {
			n_less = swap_all(&s);
			n_kept -= n_less;
		} while (n_less > n_kept / LEAST_GAIN);
	}
	free(s.over);
	free(s.alone);
	free(s.lost);
	free(s.owner);
	return is_there ? PSR_OK : PSR_ERR_MEMORY;
}

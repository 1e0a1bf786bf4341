#include "facets.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/array.h"
#include "base/radix.h"
#include "psr/error.h"

#define LEAF 4

int facets_add(struct facets *facets, const float a[3], const float b[3], const float c[3])
{
	struct facet *facet;

	if (!ARRAY_ROOM(facets->facet, facets->n, facets->room))
		return PSR_ERR_MEMORY;
	facet = &facets->facet[facets->n++];
	memcpy(facet->corner[0], a, sizeof facet->corner[0]);
	memcpy(facet->corner[1], b, sizeof facet->corner[1]);
	memcpy(facet->corner[2], c, sizeof facet->corner[2]);
	return PSR_OK;
}

void facets_fini(struct facets *facets)
{
	free(facets->facet);
	free(facets->node);
	memset(facets, 0, sizeof *facets);
}

/* ---- order ---- */

/* Sixteen bits an axis of the middle, -1..1. */
static uint64_t morton_of(const struct facet *facet)
{
	uint64_t morton = 0;

	for (int k = 0; k < 3; k++) {
		const float middle = (facet->corner[0][k] + facet->corner[1][k] + facet->corner[2][k]) / 3;
		const uint64_t x = (uint64_t)(fminf(fmaxf(middle * 0.5f + 0.5f, 0), 0.99999f) * 65536);

		for (int bit = 0; bit < 16; bit++)
			morton |= (x >> bit & 1) << (3 * bit + k);
	}
	return morton;
}

static void grow(struct facet_box *box, const float low[3], const float high[3])
{
	for (int k = 0; k < 3; k++) {
		box->low[k] = fminf(box->low[k], low[k]);
		box->high[k] = fmaxf(box->high[k], high[k]);
	}
}

static void bound(const struct facets *facets, size_t i, size_t begin, size_t end)
{
	struct facet_box *box = &facets->node[i];
	const size_t half = begin + (end - begin) / 2;

	*box = (struct facet_box){ { INFINITY, INFINITY, INFINITY }, { -INFINITY, -INFINITY, -INFINITY } };
	if (end - begin <= LEAF) {
		for (size_t f = begin; f < end; f++)
			for (int c = 0; c < 3; c++)
				grow(box, facets->facet[f].corner[c], facets->facet[f].corner[c]);
		return;
	}
	bound(facets, 2 * i + 1, begin, half);
	bound(facets, 2 * i + 2, half, end);
	grow(box, facets->node[2 * i + 1].low, facets->node[2 * i + 1].high);
	grow(box, facets->node[2 * i + 2].low, facets->node[2 * i + 2].high);
}

int facets_sort(struct facets *facets)
{
	struct radix_entry *entry = facets->n <= UINT32_MAX ? malloc((2 * facets->n + 1) * sizeof *entry) : NULL;
	struct facet *sorted = malloc((facets->n + 1) * sizeof *sorted);
	size_t n_nodes = 1;

	free(facets->node);
	for (size_t leaves = LEAF; leaves < facets->n; leaves *= 2)
		n_nodes = 2 * n_nodes + 1;
	facets->node = malloc(n_nodes * sizeof *facets->node);
	if (entry == NULL || sorted == NULL || facets->node == NULL) {
		free(entry);
		free(sorted);
		return PSR_ERR_MEMORY;
	}
	for (size_t i = 0; i < facets->n; i++)
		entry[i] = (struct radix_entry){ morton_of(&facets->facet[i]), (uint32_t)i };
	radix_sort(entry, facets->n);
	for (size_t i = 0; i < facets->n; i++)
		sorted[i] = facets->facet[entry[i].value];
	free(entry);
	free(facets->facet);
	facets->facet = sorted;
	facets->room = facets->n + 1;
	bound(facets, 0, 0, facets->n);
	return PSR_OK;
}

/* ---- search ---- */

struct search {
	const struct facets *facets;
	const struct facet_box *box;
	int (*fn)(const struct facet *facet, size_t n, void *userdata);
	void *userdata;
};

static int search_below(const struct search *s, size_t i, size_t begin, size_t end)
{
	const struct facet_box *a = &s->facets->node[i], *b = s->box;
	const size_t half = begin + (end - begin) / 2;
	int rc;

	for (int k = 0; k < 3; k++)
		if (!(a->low[k] <= b->high[k] && a->high[k] >= b->low[k]))
			return 0;
	if (end - begin <= LEAF)
		return s->fn(&s->facets->facet[begin], end - begin, s->userdata);
	rc = search_below(s, 2 * i + 1, begin, half);
	return rc == 0 ? search_below(s, 2 * i + 2, half, end) : rc;
}

int facets_search(const struct facets *facets, const struct facet_box *box,
                  int (*fn)(const struct facet *facet, size_t n, void *userdata), void *userdata)
{
	const struct search s = { facets, box, fn, userdata };

	return facets->n > 0 ? search_below(&s, 0, 0, facets->n) : 0;
}

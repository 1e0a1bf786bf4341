#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/array.h"
#include "psr/error.h"
#include "sheet_patch.h"

#define SIDE PSR_BLOCK_SIDE

static int root_of(struct block_hits *h, int i)
{
	while (h->hit[i].parent != i) {
		h->hit[i].parent = h->hit[h->hit[i].parent].parent;
		i = h->hit[i].parent;
	}
	return i;
}

/* Joins each hit of a lattice point with its neighbour's nearest in depth, if they may be one surface. */
static void join(struct block_hits *h, int a, int b, float reach)
{
	for (int i = h->first_of[a]; i < h->first_of[a + 1]; i++) {
		int nearest = -1;
		float least = reach;

		for (int k = h->first_of[b]; k < h->first_of[b + 1]; k++) {
			float d = fabsf(h->hit[k].z - h->hit[i].z);

			if (d <= least && h->hit[k].two_sided == h->hit[i].two_sided) {
				least = d;
				nearest = k;
			}
		}
		if (nearest >= 0) {
			int p = root_of(h, i), q = root_of(h, nearest);

			if (p < q)
				h->hit[q].parent = (uint16_t)p;
			else
				h->hit[p].parent = (uint16_t)q;
		}
	}
}

static void connect(struct block_hits *h, float reach)
{
	for (int r = 0; r < SIDE; r++) {
		for (int c = 0; c < SIDE; c++) {
			int s = SIDE * r + c, left = c - 1 + (r & 1);

			if (c + 1 < SIDE)
				join(h, s, s + 1, reach);
			if (r + 1 < SIDE && left >= 0)
				join(h, s, SIDE * (r + 1) + left, reach);
			if (r + 1 < SIDE && left + 1 < SIDE)
				join(h, s, SIDE * (r + 1) + left + 1, reach);
		}
	}
}

static int has_room(struct patch_row *row)
{
	uint32_t capacity = row->capacity;

	return ARRAY_ROOM(row->patch, row->n, capacity) && ARRAY_ROOM(row->sample, row->n, row->capacity);
}

struct sheet {
	uint64_t mask;
	float low, high;
	uint16_t root;
	uint8_t two_sided;
};

static void list_sheets(struct block_hits *h, struct sheet *sheet, int *n_sheets)
{
	int16_t number[SHEET_HITS];

	*n_sheets = 0;
	for (int i = 0; i < h->n; i++) {
		int root = root_of(h, i);
		const struct block_hit *hit = &h->hit[i];
		struct sheet *s;

		if (root == i) {
			number[i] = (int16_t)*n_sheets;
			sheet[(*n_sheets)++] = (struct sheet){ .low = hit->z, .high = hit->z, .root = (uint16_t)i,
				                                   .two_sided = hit->two_sided };
		}
		s = &sheet[number[root]];
		s->low = hit->z < s->low ? hit->z : s->low;
		s->high = hit->z > s->high ? hit->z : s->high;
		s->mask |= UINT64_C(1) << hit->at;
	}
}

static int compare_sheets(const void *a, const void *b)
{
	const struct sheet *x = a, *y = b;

	return x->low != y->low ? (x->low < y->low ? -1 : 1) : (int)x->root - (int)y->root;
}

/* A sheet may pass over a lattice point twice (a spiral): such hits start a patch of their own. */
static int add_hit(struct patch_row *row, uint32_t first, const struct block_hit *hit, uint32_t wanted)
{
	uint64_t bit = UINT64_C(1) << hit->at;
	uint32_t p = wanted;

	if ((row->patch[p].mask & bit) != 0)
		for (p = first; p < row->n && ((row->patch[p].mask & bit) != 0 || row->patch[p].two_sided != hit->two_sided);
		     p++)
			;
	if (p == row->n) {
		if (!has_room(row))
			return PSR_ERR_MEMORY;
		row->patch[p] = row->patch[wanted];
		row->patch[p].mask = row->patch[p].first = 0;
		memset(row->sample[p], 0, sizeof row->sample[p]);
		row->n++;
	}
	patch_put(&row->patch[p], hit->at, hit->z);
	row->patch[p].first |= hit->is_first ? bit : 0;
	row->sample[p][hit->at] = (struct sheet_sample){ hit->z, hit->surface };
	return PSR_OK;
}

int patch_row_add(struct patch_row *row, struct block_hits *h, int col, int block_row, float step)
{
	struct sheet sheet[SHEET_HITS];
	float low[SHEET_HITS], high[SHEET_HITS];
	uint16_t patch_of[SHEET_HITS];
	uint32_t first = row->n;
	int n_sheets;

	connect(h, SHEET_STEPS * step);
	list_sheets(h, sheet, &n_sheets);
	qsort(sheet, (size_t)n_sheets, sizeof *sheet, compare_sheets);
	for (int i = 0; i < n_sheets; i++) {
		uint32_t p = first;

		/* Returns the first patch with room for the whole sheet that stays shallow. */
		for (; p < row->n; p++) {
			float top = sheet[i].high > high[p - first] ? sheet[i].high : high[p - first];
			float bottom = sheet[i].low < low[p - first] ? sheet[i].low : low[p - first];

			if ((row->patch[p].mask & sheet[i].mask) == 0 && row->patch[p].two_sided == sheet[i].two_sided
			    && top - bottom <= SHEET_PATCH_STEPS * step)
				break;
		}
		if (p == row->n) {
			if (!has_room(row))
				return PSR_ERR_MEMORY;
			memset(&row->patch[p], 0, sizeof row->patch[p]);
			memset(row->sample[p], 0, sizeof row->sample[p]);
			row->patch[p].col = (int16_t)col;
			row->patch[p].row = (int16_t)block_row;
			row->patch[p].two_sided = sheet[i].two_sided;
			low[p - first] = sheet[i].low;
			high[p - first] = sheet[i].high;
			row->n++;
		}
		low[p - first] = sheet[i].low < low[p - first] ? sheet[i].low : low[p - first];
		high[p - first] = sheet[i].high > high[p - first] ? sheet[i].high : high[p - first];
		/* Reserves the places; the hits follow. */
		row->patch[p].mask |= sheet[i].mask;
		patch_of[sheet[i].root] = (uint16_t)(p - first);
	}
	for (uint32_t p = first; p < row->n; p++)
		row->patch[p].mask = 0;
	for (int i = 0; i < h->n; i++)
		if (add_hit(row, first, &h->hit[i], first + patch_of[root_of(h, i)]) != PSR_OK)
			return PSR_ERR_MEMORY;
	return PSR_OK;
}

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "../base/vec.h"
#include "draft.h"
#include "psr/error.h"

#define LEAST_GROUP 131072 /* samples of the finest level */
#define MOST_GROWTH 1.25   /* of the number of coarse blocks, by those that groups share */
#define CELLS 4 /* that a coarse pixel is wide */
#define REACH 3 /* cells: beyond this no sample covers a place ([G] 4.3: the farthest corner of a pixel is 0.71 of one away) */
#define MOST_PARTS 64 /* groups that can share a block of a coarse level */

struct place {
	float center[3];
	uint32_t block, n_samples;
	int axis; /* to compare by */
};

static int compare_places(const void *a, const void *b)
{
	const struct place *x = a, *y = b;
	float p = x->center[x->axis], q = y->center[y->axis];

	return p != q ? (p < q ? -1 : 1) : x->block < y->block ? -1 : x->block > y->block;
}

/* Halves along the longest side of the box of the centres, until a part is small enough. */
static void cut(struct draft *draft, struct place *place, uint32_t n, uint32_t most)
{
	float min[3] = { INFINITY, INFINITY, INFINITY }, max[3] = { -INFINITY, -INFINITY, -INFINITY };
	uint32_t n_samples = 0;
	int axis = 0;

	for (uint32_t i = 0; i < n; i++)
		n_samples += place[i].n_samples;
	if (n_samples <= most) {
		for (uint32_t i = 0; i < n; i++)
			draft->block[place[i].block].group = draft->n_groups;
		draft->n_groups++;
		return;
	}
	for (uint32_t i = 0; i < n; i++) {
		for (int k = 0; k < 3; k++) {
			min[k] = fminf(min[k], place[i].center[k]);
			max[k] = fmaxf(max[k], place[i].center[k]);
		}
	}
	for (int k = 1; k < 3; k++)
		axis = max[k] - min[k] > max[axis] - min[axis] ? k : axis;
	for (uint32_t i = 0; i < n; i++)
		place[i].axis = axis;
	qsort(place, n, sizeof *place, compare_places);
	cut(draft, place, n / 2, most);
	cut(draft, place + n / 2, n - n / 2, most);
}

static void center_of(const struct draft *draft, const struct draft_block *block, float center[3])
{
	float n = (float)__builtin_popcountll(block->part);

	v3f_set(center, 0, 0, 0);
	for (uint64_t left = block->part; left != 0; left &= left - 1) {
		float p[3];

		draft_position(draft, block, (unsigned)__builtin_ctzll(left), p);
		v3f_add_scaled(center, center, 1 / n, p);
	}
}

static int cut_finest(struct draft *draft, uint32_t n, uint32_t most)
{
	struct place *place = malloc((n != 0 ? n : 1) * sizeof *place);

	if (place == NULL)
		return PSR_ERR_MEMORY;
	for (uint32_t i = 0; i < n; i++) {
		place[i].block = i;
		place[i].n_samples = (uint32_t)__builtin_popcountll(draft->block[i].part);
		center_of(draft, &draft->block[i], place[i].center);
	}
	draft->n_groups = 0;
	cut(draft, place, n, most);
	free(place);
	return PSR_OK;
}

/* Which groups have fine samples in each cell of a quarter of a pixel of a coarse level: points of a cover, one a group and cell. */
static int map_groups(struct cover *map, const struct draft *draft, uint32_t n_finest)
{
	for (uint32_t b = 0; b < n_finest; b++) {
		const struct draft_block *block = &draft->block[b];

		for (uint64_t left = block->mask; left != 0; left &= left - 1) {
			struct cover_point point = { .patch = block->group };
			uint32_t i;
			int at[3];

			draft_position(draft, block, (unsigned)__builtin_ctzll(left), point.position);
			for (int k = 0; k < 3; k++)
				at[k] = (int)floor((double)point.position[k] / map->ds);
			for (i = cover_cell(map, at); i != COVER_NONE && map->point[i].patch != block->group; i = map->point[i].next)
				;
			if (i == COVER_NONE && cover_add(map, &point) != PSR_OK)
				return PSR_ERR_MEMORY;
		}
	}
	return PSR_OK;
}

struct parts {
	uint32_t group[MOST_PARTS];
	uint64_t part[MOST_PARTS];
	int n, is_full;
};

static void add_part(struct parts *parts, uint32_t group, unsigned s)
{
	int i = 0;

	while (i < parts->n && parts->group[i] != group)
		i++;
	if (i == MOST_PARTS) {
		parts->is_full = 1;
		return;
	}
	if (i == parts->n) {
		parts->group[parts->n] = group;
		parts->part[parts->n++] = 0;
	}
	parts->part[i] |= UINT64_C(1) << s;
}

/* From p to the nearest place of a point's cell. */
static double distance2(const struct cover *map, const struct cover_point *point, const float p[3])
{
	double sum = 0;

	for (int k = 0; k < 3; k++) {
		double low = floor((double)point->position[k] / map->ds) * map->ds, x = (double)p[k];
		double away = x < low ? low - x : x > low + map->ds ? x - low - map->ds : 0;

		sum += away * away;
	}
	return sum;
}

/* All groups with a cell within reach of a sample. */
static void find_groups(const struct cover *map, const float p[3], double reach, unsigned s, struct parts *parts)
{
	uint32_t first[COVER_MOST_AROUND];
	int n_cells = cover_around(map, p, reach, first);

	for (int c = 0; c < n_cells; c++)
		for (uint32_t i = first[c]; i != COVER_NONE; i = map->point[i].next)
			if (distance2(map, &map->point[i], p) <= reach * reach)
				add_part(parts, map->point[i].patch, s);
}

struct blocks {
	struct draft_block *block;
	uint32_t n, capacity, most;
	int is_over; /* there would be more */
};

static int add_block(struct blocks *blocks, const struct draft_block *block)
{
	if (blocks->n == blocks->most) {
		blocks->is_over = 1;
		return PSR_OK;
	}
	if (blocks->n == blocks->capacity) {
		uint32_t capacity = blocks->capacity != 0 ? blocks->capacity + blocks->capacity / 2 : 1024;
		struct draft_block *grown = realloc(blocks->block, capacity * sizeof *grown);

		if (grown == NULL)
			return PSR_ERR_MEMORY;
		blocks->block = grown;
		blocks->capacity = capacity;
	}
	blocks->block[blocks->n++] = *block;
	return PSR_OK;
}

static int split_block(struct blocks *blocks, const struct draft *draft, const struct draft_block *block,
                       const struct cover *map)
{
	struct parts parts = { .n = 0 };

	for (uint64_t left = block->mask; left != 0; left &= left - 1) {
		unsigned s = (unsigned)__builtin_ctzll(left);
		int n = parts.n;
		float p[3];

		draft_position(draft, block, s, p);
		find_groups(map, p, REACH * map->ds, s, &parts);
		if (n == 0 && parts.n == 0)
			find_groups(map, p, 2 * REACH * map->ds, s, &parts);
	}
	blocks->is_over |= parts.is_full;
	for (int i = 0; i < parts.n; i++) {
		struct draft_block part = *block;

		part.group = parts.group[i];
		part.part = parts.part[i];
		if (add_block(blocks, &part) != PSR_OK)
			return PSR_ERR_MEMORY;
	}
	return PSR_OK;
}

static int split_level(struct blocks *blocks, const struct draft *draft, unsigned level, uint32_t n_finest)
{
	struct cover map;
	int rc = cover_init(&map, draft->ds * (double)(1u << level) / CELLS);

	if (rc == PSR_OK)
		rc = map_groups(&map, draft, n_finest);
	for (uint32_t b = n_finest; rc == PSR_OK && !blocks->is_over && b < draft->n_blocks; b++)
		if (draft->block[b].level == level)
			rc = split_block(blocks, draft, &draft->block[b], &map);
	cover_fini(&map);
	return rc;
}

/* The blocks of all levels, for groups of at most so many samples. */
static int make_blocks(struct blocks *blocks, struct draft *draft, uint32_t n_finest, uint32_t most)
{
	int rc = cut_finest(draft, n_finest, most);

	blocks->n = 0;
	blocks->is_over = 0;
	blocks->most = n_finest + (uint32_t)(MOST_GROWTH * (double)(draft->n_blocks - n_finest));
	for (uint32_t b = 0; rc == PSR_OK && b < (draft->n_groups == 1 ? draft->n_blocks : n_finest); b++)
		rc = add_block(blocks, &draft->block[b]);
	for (unsigned level = 1; rc == PSR_OK && draft->n_groups > 1 && level < draft->n_levels; level++)
		rc = split_level(blocks, draft, level, n_finest);
	return rc;
}

int draft_group(struct draft *draft)
{
	struct blocks blocks = { .block = NULL };
	uint32_t n_finest = 0;
	int rc = PSR_OK;

	while (n_finest < draft->n_blocks && draft->block[n_finest].level == 0)
		n_finest++;
	/* One group shares nothing. */
	for (uint32_t most = LEAST_GROUP; rc == PSR_OK; most = most < UINT32_MAX / 2 ? 2 * most : UINT32_MAX) {
		rc = make_blocks(&blocks, draft, n_finest, most);
		if (!blocks.is_over)
			break;
	}
	if (rc != PSR_OK) {
		free(blocks.block);
		return rc;
	}
	free(draft->block);
	draft->block = blocks.block;
	draft->n_blocks = blocks.n;
	draft->block_capacity = blocks.capacity;
	return PSR_OK;
}

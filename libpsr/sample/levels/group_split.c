#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include "base/array.h"
#include "base/cell.h"
#include "base/grid.h"
#include "group.h"
#include "psr/error.h"

#define CELLS 4 /* that a coarse pixel is wide */
#define REACH 3 /* cells: no sample farther away covers a place ([G] 4.3: a pixel's corner is 0.71 pixels away) */
#define FAR 4   /* for samples with nothing in REACH: moved ones are half a pixel off */

/* Which groups have fine samples in each cell of a coarse level. */
struct map {
	struct grid grid;
	struct mapped {
		float position[3]; /* of one of them */
		uint32_t group, next;
	} *mapped;
	uint32_t n, capacity;
};

static int map_group(struct map *map, uint32_t group, const float p[3])
{
	uint32_t i;
	int at[3];

	cell_of(p, map->grid.width, at);
	i = grid_first(&map->grid, at);
	while (i != GRID_NONE && map->mapped[i].group != group)
		i = map->mapped[i].next;
	if (i != GRID_NONE)
		return PSR_OK;
	if (!ARRAY_ROOM(map->mapped, map->n, map->capacity))
		return PSR_ERR_MEMORY;
	map->mapped[map->n] = (struct mapped){ { p[0], p[1], p[2] }, group, GRID_NONE };
	if (grid_put(&map->grid, p, map->n, &map->mapped[map->n].next) != PSR_OK)
		return PSR_ERR_MEMORY;
	map->n++;
	return PSR_OK;
}

static int map_groups(struct map *map, const struct draft *draft, const struct group_blocks *finest, uint32_t n)
{
	for (uint32_t b = 0; b < n; b++) {
		const struct draft_block *block = &finest->block[b];

		for (uint64_t left = block->part; left != 0; left &= left - 1) {
			float p[3];

			draft_position(draft, block, (unsigned)__builtin_ctzll(left), p);
			if (map_group(map, block->group, p) != PSR_OK)
				return PSR_ERR_MEMORY;
		}
	}
	return PSR_OK;
}

/* Which samples of a coarse block each group around it needs; at the coarsest level there may be hundreds of groups. */
struct part {
	uint32_t group;
	uint64_t mask;
};

struct parts {
	struct part *part;
	uint32_t n, capacity;
};

static int add_part(struct parts *parts, uint32_t group, unsigned s)
{
	uint32_t i = 0;

	while (i < parts->n && parts->part[i].group != group)
		i++;
	if (!ARRAY_ROOM(parts->part, i, parts->capacity))
		return PSR_ERR_MEMORY;
	if (i == parts->n)
		parts->part[parts->n++] = (struct part){ group, 0 };
	parts->part[i].mask |= UINT64_C(1) << s;
	return PSR_OK;
}

/* Returns the distance from p to the nearest place of the cell that holds a position. */
static double distance2(double width, const float position[3], const float p[3])
{
	double sum = 0;

	for (int k = 0; k < 3; k++) {
		double low = floor((double)position[k] / width) * width, x = (double)p[k];
		double away = x < low ? low - x : x > low + width ? x - low - width : 0;

		sum += away * away;
	}
	return sum;
}

/* Finds all groups with a cell within reach of a sample; returns how many cells, or MEMORY. */
static int find_groups(const struct map *map, const float p[3], double reach, unsigned s, struct parts *parts)
{
	uint32_t first[GRID_MOST_AROUND];
	int n_cells = grid_around(&map->grid, p, reach, first), n = 0;

	for (int c = 0; c < n_cells; c++) {
		for (uint32_t i = first[c]; i != GRID_NONE; i = map->mapped[i].next) {
			if (distance2(map->grid.width, map->mapped[i].position, p) > reach * reach)
				continue;
			if (add_part(parts, map->mapped[i].group, s) != PSR_OK)
				return PSR_ERR_MEMORY;
			n++;
		}
	}
	return n;
}

static int split_block(struct group_blocks *blocks, const struct draft *draft, const struct draft_block *block,
                       const struct map *map, struct parts *parts)
{
	int rc = PSR_OK;

	parts->n = 0;
	for (uint64_t left = block->part; rc == PSR_OK && left != 0; left &= left - 1) {
		unsigned s = (unsigned)__builtin_ctzll(left);
		float p[3];
		int n;

		draft_position(draft, block, s, p);
		n = find_groups(map, p, REACH * map->grid.width, s, parts);
		if (n == 0)
			n = find_groups(map, p, FAR * map->grid.width, s, parts);
		rc = n < 0 ? n : PSR_OK;
	}
	for (uint32_t i = 0; rc == PSR_OK && i < parts->n; i++) {
		struct draft_block part = *block;

		part.group = parts->part[i].group;
		part.part = parts->part[i].mask;
		rc = group_add(blocks, &part);
	}
	return rc;
}

struct split {
	const struct draft *draft;
	const struct map *map;
	uint32_t first, end; /* blocks */
	struct group_blocks *chunk;
	int *rc;
	uint32_t most;    /* blocks of them all; */
	atomic_uint n;    /* once there are more, the rest is skipped */
};

#define CHUNK 256

static void split_chunk(int i, void *userdata)
{
	struct split *split = userdata;
	uint32_t first = split->first + (uint32_t)i * CHUNK, end = split->end - first < CHUNK ? split->end : first + CHUNK;
	struct parts parts = { NULL, 0, 0 };

	for (uint32_t b = first; b < end && split->rc[i] == PSR_OK && atomic_load(&split->n) <= split->most; b++)
		split->rc[i] = split_block(&split->chunk[i], split->draft, &split->draft->block[b], split->map, &parts);
	atomic_fetch_add(&split->n, split->chunk[i].n);
	free(parts.part);
}

/* Blocks first..end - 1, of one level, by all threads, into their order. */
static int split_blocks(struct group_blocks *blocks, struct split *split, struct psr_pool *pool)
{
	int n = (int)((split->end - split->first + CHUNK - 1) / CHUNK), rc = PSR_OK;

	split->chunk = calloc((size_t)n + 1, sizeof *split->chunk);
	split->rc = calloc((size_t)n + 1, sizeof *split->rc);
	if (split->chunk == NULL || split->rc == NULL)
		rc = PSR_ERR_MEMORY;
	for (int i = 0; rc == PSR_OK && i < n; i++)
		split->chunk[i].most = UINT32_MAX;
	if (rc == PSR_OK)
		psr_pool_for(pool, n, split_chunk, split);
	for (int i = 0; split->chunk != NULL && i < n; i++) {
		rc = rc != PSR_OK ? rc : split->rc[i];
		for (uint32_t k = 0; rc == PSR_OK && k < split->chunk[i].n; k++)
			rc = group_add(blocks, &split->chunk[i].block[k]);
		free(split->chunk[i].block);
	}
	free(split->chunk);
	free(split->rc);
	return rc;
}

int group_split(struct group_blocks *blocks, const struct draft *draft, unsigned level, uint32_t n_finest,
                uint32_t n_pieces, struct psr_pool *pool)
{
	struct map map = { .n = 0 };
	struct split split = { .draft = draft, .map = &map, .first = n_finest, .most = blocks->most - blocks->n };
	int rc = grid_init(&map.grid, draft->ds * (double)(1u << level) / CELLS);

	while (split.first < draft->n_blocks && draft->block[split.first].level < level)
		split.first++;
	for (split.end = split.first; split.end < draft->n_blocks && draft->block[split.end].level == level;)
		split.end++;
	if (rc == PSR_OK)
		rc = map_groups(&map, draft, blocks, n_pieces);
	if (rc == PSR_OK)
		rc = split_blocks(blocks, &split, pool);
	free(map.mapped);
	grid_fini(&map.grid);
	return rc;
}

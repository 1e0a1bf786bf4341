#include <math.h>
#include <stdlib.h>
#include "base/array.h"
#include "base/vec.h"
#include "group.h"
#include "psr/error.h"

#define LEAST_GROUP 131072 /* samples of the finest level */
#define MOST_GROWTH 1.25   /* of the number of blocks, by shared ones */

/* Deeper blocks are cut sample by sample: where needles are dense, groups of whole blocks would reach far into each
 * other, and every coarse sample would be in ten of them. */
#define WHOLE_STEPS 10
#define WHOLE PSR_BLOCK_SAMPLES

struct place {
	float center[3];
	uint32_t block, group;
	uint8_t sample, n_samples; /* sample: WHOLE of a whole block */
	uint8_t axis;              /* to compare by */
};

static int compare_owners(const struct place *x, const struct place *y)
{
	return x->block != y->block ? (x->block < y->block ? -1 : 1) : (int)x->sample - (int)y->sample;
}

static int compare_places(const struct place *x, const struct place *y)
{
	float p = x->center[x->axis], q = y->center[y->axis];

	return p != q ? (p < q ? -1 : 1) : compare_owners(x, y);
}

static int compare_groups(const void *a, const void *b)
{
	const struct place *x = a, *y = b;

	if (x->block == y->block && x->group != y->group)
		return x->group < y->group ? -1 : 1;
	return compare_owners(x, y);
}

static void swap_places(struct place *a, struct place *b)
{
	struct place kept = *a;

	*a = *b;
	*b = kept;
}

/* Hoare's quickselect: the first `middle` places come to the front. */
static void part_places(struct place *place, uint32_t n, uint32_t middle)
{
	while (n > 1) {
		uint32_t low = 0, high = n - 1;
		const struct place pivot = place[(n - 1) / 2];

		for (;;) {
			while (compare_places(&place[low], &pivot) < 0)
				low++;
			while (compare_places(&place[high], &pivot) > 0)
				high--;
			if (low >= high)
				break;
			swap_places(&place[low++], &place[high--]);
		}
		if (middle <= high) {
			n = high + 1;
		} else {
			place += high + 1;
			middle -= high + 1;
			n -= high + 1;
		}
		if (middle == 0)
			break;
	}
}

/* Halves along the longest side of the centres' box until a part is small enough. */
static void cut(struct draft *draft, struct place *place, uint32_t n, uint32_t most)
{
	float min[3] = { INFINITY, INFINITY, INFINITY }, max[3] = { -INFINITY, -INFINITY, -INFINITY };
	uint64_t n_samples = 0;
	uint8_t axis = 0;

	for (uint32_t i = 0; i < n; i++) {
		n_samples += place[i].n_samples;
		for (int k = 0; k < 3; k++) {
			min[k] = fminf(min[k], place[i].center[k]);
			max[k] = fmaxf(max[k], place[i].center[k]);
		}
	}
	if (n_samples <= most) {
		for (uint32_t i = 0; i < n; i++)
			place[i].group = draft->n_groups;
		draft->n_groups++;
		return;
	}
	for (uint8_t k = 1; k < 3; k++)
		axis = max[k] - min[k] > max[axis] - min[axis] ? k : axis;
	for (uint32_t i = 0; i < n; i++)
		place[i].axis = axis;
	part_places(place, n, n / 2);
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

static int is_whole(const struct draft *draft, const struct draft_block *block)
{
	float low = INFINITY, high = -INFINITY;

	for (uint64_t left = block->part; left != 0; left &= left - 1) {
		float z = draft_sample(draft, block, (unsigned)__builtin_ctzll(left))->z;

		low = fminf(low, z);
		high = fmaxf(high, z);
	}
	return high - low <= WHOLE_STEPS * draft->projection[block->projection].spacing;
}

/* Whole blocks and single samples; returns how many. place may be NULL. */
static uint32_t list_places(const struct draft *draft, uint32_t n_finest, struct place *place)
{
	uint32_t n = 0;

	for (uint32_t b = 0; b < n_finest; b++) {
		const struct draft_block *block = &draft->block[b];

		if (is_whole(draft, block)) {
			if (place != NULL) {
				place[n] = (struct place){ .block = b, .sample = WHOLE };
				place[n].n_samples = (uint8_t)__builtin_popcountll(block->part);
				center_of(draft, block, place[n].center);
			}
			n++;
			continue;
		}
		for (uint64_t left = block->part; left != 0; left &= left - 1, n++) {
			if (place == NULL)
				continue;
			place[n] = (struct place){ .block = b, .sample = (uint8_t)__builtin_ctzll(left), .n_samples = 1 };
			draft_position(draft, block, place[n].sample, place[n].center);
		}
	}
	return n;
}

int group_add(struct group_blocks *blocks, const struct draft_block *block)
{
	if (blocks->n == blocks->most) {
		blocks->is_over = 1;
		return PSR_OK;
	}
	if (!ARRAY_ROOM(blocks->block, blocks->n, blocks->capacity))
		return PSR_ERR_MEMORY;
	blocks->block[blocks->n++] = *block;
	return PSR_OK;
}

/* A block for each group with some of a finest block, in the order of these. */
static int cut_finest(struct group_blocks *blocks, struct draft *draft, uint32_t n_finest, uint32_t most)
{
	uint32_t n = list_places(draft, n_finest, NULL);
	struct place *place = malloc(((size_t)n + 1) * sizeof *place);
	int rc = PSR_OK;

	if (place == NULL)
		return PSR_ERR_MEMORY;
	list_places(draft, n_finest, place);
	draft->n_groups = 0;
	cut(draft, place, n, most);
	qsort(place, n, sizeof *place, compare_groups);
	for (uint32_t i = 0; rc == PSR_OK && i < n;) {
		struct draft_block piece = draft->block[place[i].block];
		uint32_t first = i;

		piece.group = place[i].group;
		if (place[i].sample != WHOLE)
			piece.part = 0;
		for (; i < n && place[i].block == place[first].block && place[i].group == piece.group; i++)
			piece.part |= place[i].sample != WHOLE ? UINT64_C(1) << place[i].sample : 0;
		rc = group_add(blocks, &piece);
	}
	free(place);
	return rc;
}

/* Makes the blocks of all levels, for groups of at most so many samples. */
static int make_blocks(struct group_blocks *blocks, struct draft *draft, uint32_t n_finest, uint32_t most,
                       struct psr_pool *pool)
{
	uint32_t n_pieces;
	int rc;

	blocks->n = 0;
	blocks->is_over = 0;
	blocks->most = (uint32_t)(MOST_GROWTH * (double)draft->n_blocks);
	rc = cut_finest(blocks, draft, n_finest, most);
	n_pieces = blocks->n;
	for (uint32_t b = n_finest; rc == PSR_OK && draft->n_groups == 1 && b < draft->n_blocks; b++)
		rc = group_add(blocks, &draft->block[b]);
	for (unsigned level = 1; rc == PSR_OK && draft->n_groups > 1 && !blocks->is_over && level < draft->n_levels;
	     level++)
		rc = group_split(blocks, draft, level, n_finest, n_pieces, pool);
	return rc;
}

int draft_group(struct draft *draft, struct psr_pool *pool)
{
	struct group_blocks blocks = { .block = NULL };
	uint32_t n_finest = 0;
	int rc = PSR_OK;

	while (n_finest < draft->n_blocks && draft->block[n_finest].level == 0)
		n_finest++;
	/* A single group shares nothing. */
	for (uint32_t most = LEAST_GROUP; rc == PSR_OK; most = most < UINT32_MAX / 2 ? 2 * most : UINT32_MAX) {
		rc = make_blocks(&blocks, draft, n_finest, most, pool);
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

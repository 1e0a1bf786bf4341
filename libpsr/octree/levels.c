#include <stdlib.h>
#include "levels.h"

/* The bits of c below bit j, counted; rows of 256 by the preprocessor. */
#define BIT(c, b) ((c) >> (b) & 1)
#define COUNT(c) (BIT(c, 0) + BIT(c, 1) + BIT(c, 2) + BIT(c, 3) + BIT(c, 4) + BIT(c, 5) + BIT(c, 6) + BIT(c, 7))
#define RANK(j, c) COUNT((c) & ((1 << (j)) - 1))
#define RANK4(j, c) RANK(j, c), RANK(j, (c) + 1), RANK(j, (c) + 2), RANK(j, (c) + 3)
#define RANK16(j, c) RANK4(j, c), RANK4(j, (c) + 4), RANK4(j, (c) + 8), RANK4(j, (c) + 12)
#define RANK64(j, c) RANK16(j, c), RANK16(j, (c) + 16), RANK16(j, (c) + 32), RANK16(j, (c) + 48)
#define RANK256(j) { RANK64(j, 0), RANK64(j, 64), RANK64(j, 128), RANK64(j, 192) }

const uint8_t octree_rank[8][256] = { RANK256(0), RANK256(1), RANK256(2), RANK256(3),
	                                  RANK256(4), RANK256(5), RANK256(6), RANK256(7) };

void octree_levels_fini(struct octree_levels *levels)
{
	for (int l = 0; l < OCTREE_MOST_LEVELS; l++) {
		free(levels->at[l].code);
		free(levels->at[l].first);
		levels->at[l] = (struct octree_level){ 0 };
	}
}

int octree_level_put(struct octree_level *level, uint8_t code)
{
	const uint32_t n = level->n;

	if (n == level->room) {
		const uint32_t room = n + n / 2 + 64;
		uint8_t *codes = realloc(level->code, room);
		uint32_t *first;

		if (codes == NULL)
			return 0;
		level->code = codes;
		first = realloc(level->first, (size_t)room * sizeof *first);
		if (first == NULL)
			return 0;
		level->first = first;
		level->room = room;
	}
	level->first[n] = n == 0 ? 0 : level->first[n - 1] + octree_count(level->code[n - 1]);
	level->code[n] = code;
	level->n = n + 1;
	return 1;
}

int octree_level_reserve(struct octree_level *level, uint32_t n)
{
	uint8_t *codes = malloc(n);
	uint32_t *first = malloc((size_t)n * sizeof *first);

	free(level->code);
	free(level->first);
	*level = (struct octree_level){ .room = n, .code = codes, .first = first };
	if (codes == NULL || first == NULL)
		return 0;
	codes[0] = 0;
	return 1;
}

void octree_level_finish(struct octree_level *level, uint32_t n)
{
	uint32_t child = 0;

	for (uint32_t i = 0; i < n; i++) {
		level->first[i] = child;
		child += octree_count(level->code[i]);
	}
	level->n = n;
}

/* ---- walking with neighbours ---- */

struct walk {
	const struct octree_levels *levels;
	int level;
	void (*visit)(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata);
	void *userdata;
};

/* What children there are of a node and its neighbours. */
struct family {
	uint32_t first[OCTREE_NEAR];
	uint8_t code[OCTREE_NEAR];
};

/* Finds the neighbours of octant j. It is constant, so that the compiler knows which of the parent's neighbours holds
 * each, and as which octant. */
static inline __attribute__((always_inline)) void find_near(struct octree_near *near, const struct family *family,
                                                            unsigned j)
{
#pragma GCC unroll 27
	for (unsigned k = 0; k < OCTREE_NEAR; k++) {
		const unsigned x = (j & 1) + k % 3 + 1, y = (j >> 1 & 1) + k / 3 % 3 + 1, z = (j >> 2) + k / 9 + 1;
		const unsigned from = x / 2 + 3 * (y / 2) + 9 * (z / 2), octant = (x & 1) | (y & 1) << 1 | (z & 1) << 2;
		const unsigned code = family->code[from];
		const uint32_t none = (code >> octant & 1) - 1u; /* all bits, or none */

		near->at[k] = (family->first[from] + octree_rank[octant][code]) | none;
	}
}

static void descend(const struct walk *walk, int depth, uint32_t node, uint64_t path, const struct octree_near *near)
{
	const struct octree_level *level = &walk->levels->at[depth];
	struct family family;
	uint32_t child;

	if (depth == walk->level) {
		walk->visit(node, path, near, walk->userdata);
		return;
	}
	for (int k = 0; k < OCTREE_NEAR; k++) {
		const uint32_t is_there = -(uint32_t)(near->at[k] != OCTREE_NONE), at = near->at[k] & is_there; /* no branch */

		family.code[k] = (uint8_t)(level->code[at] & is_there);
		family.first[k] = level->first[at] & is_there;
	}
	child = family.first[OCTREE_SELF];
#pragma GCC unroll 8
	for (unsigned j = 0; j < 8; j++) {
		struct octree_near around;

		if (!(family.code[OCTREE_SELF] >> j & 1))
			continue;
		find_near(&around, &family, j);
		descend(walk, depth + 1, child++, path << 3 | j, &around);
	}
}

static uint32_t find_root(const struct octree_levels *levels, uint64_t path)
{
	uint32_t low = 0, high = levels->n_roots;

	while (low < high) {
		const uint32_t middle = low + (high - low) / 2;

		if (levels->root[middle] < path)
			low = middle + 1;
		else
			high = middle;
	}
	return low < levels->n_roots && levels->root[low] == path ? low : OCTREE_NONE;
}

void octree_levels_walk(const struct octree_levels *levels, int level,
                        void (*visit)(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata),
                        void *userdata)
{
	struct walk walk = { .levels = levels, .level = level, .visit = visit, .userdata = userdata };

	for (uint32_t i = 0; i < levels->n_roots; i++) {
		struct octree_near near;
		uint32_t at[3];

		octree_place(levels->root[i], at);
		for (uint32_t k = 0; k < OCTREE_NEAR; k++) {
			/* One below 0 wraps to what no root has. */
			const uint32_t place[3] = { at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1 };
			const int is_inside = (place[0] | place[1] | place[2]) >> 21 == 0;

			near.at[k] = is_inside ? find_root(levels, octree_path(place)) : OCTREE_NONE;
		}
		descend(&walk, 0, i, levels->root[i], &near);
	}
}

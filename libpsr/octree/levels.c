#include <stdlib.h>
#include "levels.h"

/* Tables by the preprocessor. The bits of c below bit j, counted, in rows of 256: */
#define BIT(c, b) ((c) >> (b) & 1)
#define COUNT(c) (BIT(c, 0) + BIT(c, 1) + BIT(c, 2) + BIT(c, 3) + BIT(c, 4) + BIT(c, 5) + BIT(c, 6) + BIT(c, 7))
#define RANK(c, j) COUNT((c) & ((1 << (j)) - 1))
#define ROW4(of, c, j) of(c, j), of((c) + 1, j), of((c) + 2, j), of((c) + 3, j)
#define ROW16(of, c, j) ROW4(of, c, j), ROW4(of, (c) + 4, j), ROW4(of, (c) + 8, j), ROW4(of, (c) + 12, j)
#define ROW64(of, c, j) ROW16(of, c, j), ROW16(of, (c) + 16, j), ROW16(of, (c) + 32, j), ROW16(of, (c) + 48, j)
#define ROW256(of, j) { ROW64(of, 0, j), ROW64(of, 64, j), ROW64(of, 128, j), ROW64(of, 192, j) }

const uint8_t octree_rank[8][256] = { ROW256(RANK, 0), ROW256(RANK, 1), ROW256(RANK, 2), ROW256(RANK, 3),
	                                  ROW256(RANK, 4), ROW256(RANK, 5), ROW256(RANK, 6), ROW256(RANK, 7) };

/* Bits 0 to 7 at 0, 1, 4, 5, 16, 17, 20 and 21. */
#define CUBE(c, unused) ((uint64_t)(((c) & 3) | ((c) & 12) << 2 | ((c) & 48) << 12 | ((c) & 192) << 14))
const uint64_t octree_cube[256] = ROW256(CUBE, 0);

/* Of neighbour k, along an axis: 0, 1 or 2. */
#define X(k) ((k) % 3)
#define Y(k) ((k) / 3 % 3)
#define Z(k) ((k) / 9)
#define ROW3(of, k, j) of(k, j), of((k) + 1, j), of((k) + 2, j)
#define ROW9(of, k, j) ROW3(of, k, j), ROW3(of, (k) + 3, j), ROW3(of, (k) + 6, j)
#define ROW27(of, j) { ROW9(of, 0, j), ROW9(of, 9, j), ROW9(of, 18, j) }

/* Octant j of a node is at 2 and 3 of three nodes' children along an axis. */
#define AT(k, j, axis, bit) (axis(k) + 1 + ((j) >> (bit) & 1))
#define KIN(k, j) ((AT(k, j, X, 0) / 2 + 3 * (AT(k, j, Y, 1) / 2) + 9 * (AT(k, j, Z, 2) / 2)) << 3 \
                   | (AT(k, j, X, 0) & 1) | (AT(k, j, Y, 1) & 1) << 1 | (AT(k, j, Z, 2) & 1) << 2)
#define SAME(k, unused) ((k) << 3)
const uint8_t octree_kin[9][OCTREE_NEAR] = { ROW27(KIN, 0), ROW27(KIN, 1), ROW27(KIN, 2), ROW27(KIN, 3), ROW27(KIN, 4),
	                                         ROW27(KIN, 5), ROW27(KIN, 6), ROW27(KIN, 7), ROW27(SAME, 0) };

#define SIDE(k, unused) ((X(k) == 0 ? 0xaa : X(k) == 2 ? 0x55 : 0xff) & (Y(k) == 0 ? 0xcc : Y(k) == 2 ? 0x33 : 0xff) \
                         & (Z(k) == 0 ? 0xf0 : Z(k) == 2 ? 0x0f : 0xff))
#define TURN(k, unused) ((64 + 21 + 2 * (X(k) - 1) + 8 * (Y(k) - 1) + 32 * (Z(k) - 1)) % 64)
const uint8_t octree_side[OCTREE_NEAR] = ROW27(SIDE, 0), octree_turn[OCTREE_NEAR] = ROW27(TURN, 0);

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

/* Returns 3x3x3 bits of a cube of 4x4x4, from one on, beside each other. */
static inline uint32_t window_of(uint64_t cube, unsigned corner)
{
	const uint64_t w = cube >> corner;
	const uint64_t planes = (w & 0x000700070007u) | (w >> 1 & 0x003800380038u) | (w >> 2 & 0x01c001c001c0u);

	return (uint32_t)((planes & 0x1ff) | (planes >> 7 & 0x3fe00) | (planes >> 14 & 0x7fc0000));
}

static void descend(const struct walk *walk, int depth, uint32_t node, uint64_t path, const struct octree_near *near)
{
	const struct octree_level *level = &walk->levels->at[depth];
	struct octree_family family;
	uint64_t there = 0, before = 0; /* children */
	unsigned own;

	if (depth == walk->level) {
		walk->visit(node, path, near, walk->userdata);
		return;
	}
	for (uint32_t left = near->there; left != 0; left &= left - 1) {
		const unsigned k = (unsigned)__builtin_ctz(left);
		const uint32_t at = octree_near_at(near, k);
		const unsigned code = level->code[at];
		const uint64_t cube = octree_cube_of(code, k);

		family.code[k] = (uint8_t)code;
		family.first[k] = level->first[at];
		there |= cube;
		before |= cube & -(uint64_t)(near->before >> k & 1);
	}
	own = family.code[OCTREE_SELF];
	for (unsigned left = own, n = 0; left != 0; left &= left - 1, n++) {
		const unsigned j = (unsigned)__builtin_ctz(left), corner = octree_corner(j);
		const uint64_t siblings = octree_cube_of(own & ((1u << j) - 1), OCTREE_SELF);
		const struct octree_near around = { .there = window_of(there, corner),
			                                .before = window_of(before | siblings, corner),
			                                .family = &family, .octant = j };

		descend(walk, depth + 1, family.first[OCTREE_SELF] + n, path << 3 | j, &around);
	}
}

/* Returns the index of a root; their number if there is none. */
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
	return low < levels->n_roots && levels->root[low] == path ? low : levels->n_roots;
}

void octree_levels_walk(const struct octree_levels *levels, int level,
                        void (*visit)(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata),
                        void *userdata)
{
	struct walk walk = { .levels = levels, .level = level, .visit = visit, .userdata = userdata };

	for (uint32_t i = 0; i < levels->n_roots; i++) {
		struct octree_family family = { .code = { 0 } };
		struct octree_near near = { .family = &family, .octant = 8 };
		uint32_t at[3];

		octree_place(levels->root[i], at);
		for (uint32_t k = 0; k < OCTREE_NEAR; k++) {
			/* One below 0 wraps to what no root has. */
			const uint32_t place[3] = { at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1 };
			const int is_inside = (place[0] | place[1] | place[2]) >> 21 == 0;

			family.first[k] = is_inside ? find_root(levels, octree_path(place)) : levels->n_roots;
			near.there |= (uint32_t)(family.first[k] < levels->n_roots) << k;
			near.before |= (uint32_t)(family.first[k] < i) << k;
		}
		descend(&walk, 0, i, levels->root[i], &near);
	}
}

/* Lists of words and cells to lower, of many blocks. Computing them before storing overlaps the latencies of several
 * blocks. Stores take turns among the four quarters of the list: successive samples often fall into one pixel, where a
 * store would wait for the one before. */
#ifndef PSR_SIMD_WARP_LIST_H
#define PSR_SIMD_WARP_LIST_H

#include "block.h"
#include "veil.h"

#define LIST 512
struct words {
	_Alignas(64) uint64_t word[LIST + 16];
	_Alignas(64) uint32_t at[LIST + 16];
	uint32_t n;
};
struct cells {
	_Alignas(64) uint32_t z[LIST + 16];
	_Alignas(64) uint32_t at[LIST + 16];
	uint32_t n, level;
};

/* The veils of the words, and how a block's samples become both. */
struct veils {
	_Alignas(64) uint32_t veil[LIST + 16];
	const float *bits;
	const uint8_t *opacity; /* of its first sample */
	uint64_t n_ahead;       /* samples of the model from that one on: vectors may read opacities of later blocks */
	float area, half;       /* half: from the corner of a square to its sample */
	int32_t side;           /* of all squares in the list */
};

#define LOWER(type, base, value, i)                     \
	do {                                                \
		type *at = &(base)[list->at[i]];                \
		const type own = list->value[i], there = *at;   \
		*at = own < there ? own : there;                \
	} while (0)
#define LOWER_ALL(type, base, value)                    \
	do {                                                \
		const uint32_t part = list->n / 4;              \
		for (uint32_t i = 0; i < part; i++) {           \
			LOWER(type, base, value, i);                \
			LOWER(type, base, value, i + part);         \
			LOWER(type, base, value, i + 2 * part);     \
			LOWER(type, base, value, i + 3 * part);     \
		}                                               \
		for (uint32_t i = 4 * part; i < list->n; i++)   \
			LOWER(type, base, value, i);                \
		list->n = 0;                                    \
	} while (0)

static inline void lower_words(uint64_t *base, struct words *list)
{
	LOWER_ALL(uint64_t, base, word);
}

/* Depths are above 0, so that they compare as integers. */
static inline void lower_cells(const struct warp_target *t, struct cells *list)
{
	uint32_t *base = (uint32_t *)t->cells[list->level].z;

	LOWER_ALL(uint32_t, base, z);
}

#undef LOWER
#undef LOWER_ALL

/* Blocks prepared together, to overlap their cache misses. */
#define BLOCKS 16

/* Prefetches the samples' depths and, where some may face away, attributes. */
static inline void make_blocks(struct warp_block *blocks, const struct warp_target *t, const struct bin_entry *entry,
                               uint32_t n)
{
	for (uint32_t i = 0; i < n; i++) {
		struct warp_block *b = &blocks[i];

		warp_block_make(b, &t->instance[entry[i].instance], entry[i].slot);
		for (uint32_t k = 0; k < PSR_BLOCK_SAMPLES; k += 64 / sizeof *b->depth)
			__builtin_prefetch(b->depth + k);
		for (uint32_t k = 0; entry[i].is_mixed && k < PSR_BLOCK_SAMPLES; k += 64 / sizeof *b->attr)
			__builtin_prefetch(b->attr + k);
	}
}

/* Lists a block's words, and either cells or, if `veils` is not NULL, veils. */
typedef void list_block_fn(struct words *words, struct cells *cells, struct veils *veils, const struct warp_target *t,
                           const struct bin_entry *entry, const struct warp_block *block);

/* The warp, given a function that lists a block; both lists have room for a block at each call. */
static inline __attribute__((always_inline)) uint64_t warp_by(list_block_fn *list_block,
                                                              const struct warp_target *target,
                                                              const struct bin_entry *entry, uint32_t n)
{
	struct words words;
	struct cells cells;
	struct warp_block blocks[BLOCKS];
	uint64_t n_inside = 0;

	words.n = cells.n = cells.level = 0;
	for (uint32_t e = 0; e < n; e++) {
		if (e % BLOCKS == 0)
			make_blocks(blocks, target, entry + e, n - e < BLOCKS ? n - e : BLOCKS);
		if (words.n > LIST - PSR_BLOCK_SAMPLES) {
			n_inside += words.n;
			lower_words(target->word, &words);
		}
		if (entry[e].level && (entry[e].level != cells.level || cells.n > LIST - PSR_BLOCK_SAMPLES)) {
			lower_cells(target, &cells);
			cells.level = entry[e].level;
		}
		list_block(&words, &cells, NULL, target, &entry[e], &blocks[e % BLOCKS]);
	}
	n_inside += words.n;
	lower_words(target->word, &words);
	lower_cells(target, &cells);
	return n_inside;
}

#endif

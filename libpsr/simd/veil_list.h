/* Veils, given a function that lists a block's samples; see warp_list.h. */
#ifndef PSR_SIMD_VEIL_LIST_H
#define PSR_SIMD_VEIL_LIST_H

#include "warp_list.h"

#define SQUARE_SHIFT 16 /* places of squares are in rows of 2^16 */

static inline void hang_points(const struct veil_layer *layer, const struct words *words, const struct veils *veils)
{
	const uint32_t part = words->n / 4;

	for (uint32_t i = 0; i < part; i++)
		for (uint32_t k = i; k < 4 * part; k += part)
			veil_add(layer, words->at[k], words->word[k], veils->veil[k]);
	for (uint32_t i = 4 * part; i < words->n; i++)
		veil_add(layer, words->at[i], words->word[i], veils->veil[i]);
}

/* Places count from the first corner whose square reaches the tile. */
typedef void hang_squares_fn(const struct warp_target *t, const struct veil_layer *layer, const struct words *words,
                             const struct veils *veils);

/* The corner of a listed square, from the tile's. Places count from the first corner whose square reaches the tile. */
static inline int32_t square_x(uint32_t at, int32_t side)
{
	return (int32_t)(at & ((1u << SQUARE_SHIFT) - 1)) - side + 1;
}

static inline int32_t square_y(uint32_t at, int32_t side)
{
	return (int32_t)(at >> SQUARE_SHIFT) - side + 1;
}

static inline void hang_squares(const struct warp_target *t, const struct veil_layer *layer, const struct words *words,
                                const struct veils *veils)
{
	const int32_t side = veils->side;

	for (uint32_t i = 0; i < words->n; i++)
		veil_add_square(layer, t, square_x(words->at[i], side), square_y(words->at[i], side), side, words->word[i],
		                veils->veil[i]);
}

/* Begins squares of another side. */
static inline void begin_side(struct veils *veils, struct warp_target *corners, const struct warp_target *t,
                              int32_t side)
{
	corners->x0 = t->x0 - side + 1;
	corners->y0 = t->y0 - side + 1;
	corners->stride = side == 1 ? t->stride : 1u << SQUARE_SHIFT;
	veils->half = 0.5f * (float)(side - 1);
	veils->side = side;
}

/* Prefetches what make_blocks() does, and opacities. */
static inline void make_veiled(struct warp_block *blocks, const struct warp_target *t, const struct veil_entry *entry,
                               uint32_t n)
{
	struct bin_entry bin[BLOCKS];

	for (uint32_t i = 0; i < n; i++)
		bin[i] = (struct bin_entry){ .slot = entry[i].slot, .instance = entry[i].instance };
	make_blocks(blocks, t, bin, n);
	for (uint32_t i = 0; i < n; i++) {
		const struct psr_blocks *b = t->instance[entry[i].instance].blocks;

		__builtin_prefetch(b->opacity + (blocks[i].attr - b->attr));
	}
}

static inline __attribute__((always_inline)) void veil_by(list_block_fn *list_block, hang_squares_fn *squares,
                                                          const struct warp_target *target,
                                                          const struct veil_layer *layer,
                                                          const struct veil_entry *entry, uint32_t n)
{
	struct warp_target corners = *target; /* where a square's corner may be */
	struct warp_block blocks[BLOCKS];
	struct words words;
	struct veils veils;

	words.n = 0;
	veils.bits = layer->bits;
	begin_side(&veils, &corners, target, 1);
	for (uint32_t e = 0;; e++) {
		if (e == n || entry[e].side != veils.side || words.n > LIST - PSR_BLOCK_SAMPLES) {
			if (veils.side == 1)
				hang_points(layer, &words, &veils);
			else
				squares(target, layer, &words, &veils);
			words.n = 0;
		}
		if (e == n)
			return;
		const struct bin_entry bin = { .slot = entry[e].slot, .instance = entry[e].instance };
		const struct psr_blocks *b = target->instance[bin.instance].blocks;
		const struct warp_block *block = &blocks[e % BLOCKS];

		if (e % BLOCKS == 0)
			make_veiled(blocks, target, entry + e, n - e < BLOCKS ? n - e : BLOCKS);
		if (entry[e].side != veils.side)
			begin_side(&veils, &corners, target, entry[e].side);
		veils.area = entry[e].area;
		veils.opacity = b->opacity + (block->attr - b->attr);
		veils.n_ahead = b->n_samples - (uint64_t)(block->attr - b->attr);
		list_block(&words, NULL, &veils, &corners, &bin, block);
	}
}

#endif

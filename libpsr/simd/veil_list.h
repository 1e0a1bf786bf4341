/* Veils, given a function that lists a block's samples; see warp_list.h. */
#ifndef PSR_SIMD_VEIL_LIST_H
#define PSR_SIMD_VEIL_LIST_H

#include "warp_list.h"

#define SQUARE_SHIFT 16 /* places of squares are in rows of 2^16 */

static inline void hang_points(const struct veil_layer *layer, struct words *words, const struct veils *veils)
{
	const uint32_t part = words->n / 4;

	for (uint32_t i = 0; i < part; i++)
		for (uint32_t k = i; k < 4 * part; k += part)
			veil_add(layer, words->at[k], words->word[k], veils->veil[k]);
	for (uint32_t i = 4 * part; i < words->n; i++)
		veil_add(layer, words->at[i], words->word[i], veils->veil[i]);
	words->n = 0;
}

/* Places count from the first corner whose square reaches the tile. */
static inline void hang_squares(const struct warp_target *t, const struct veil_layer *layer, struct words *words,
                                const struct veils *veils, int32_t side)
{
	for (uint32_t i = 0; i < words->n; i++) {
		const int32_t x = (int32_t)(words->at[i] & ((1u << SQUARE_SHIFT) - 1));
		const int32_t y = (int32_t)(words->at[i] >> SQUARE_SHIFT);

		veil_add_square(layer, t, x - side + 1, y - side + 1, side, words->word[i], veils->veil[i]);
	}
	words->n = 0;
}

static inline void hang(const struct warp_target *t, const struct veil_layer *layer, struct words *words,
                        const struct veils *veils, int32_t side)
{
	if (side == 1)
		hang_points(layer, words, veils);
	else
		hang_squares(t, layer, words, veils, side);
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

static inline __attribute__((always_inline)) void veil_by(list_block_fn *list_block, const struct warp_target *target,
                                                          const struct veil_layer *layer,
                                                          const struct veil_entry *entry, uint32_t n)
{
	struct warp_target corners = *target; /* where a square's corner may be */
	struct warp_block blocks[BLOCKS];
	struct words words;
	struct veils veils;
	int32_t side = 1;

	words.n = 0;
	veils.bits = layer->bits;
	veils.half = 0;
	for (uint32_t e = 0; e < n; e++) {
		const struct bin_entry bin = { .slot = entry[e].slot, .instance = entry[e].instance };
		const struct psr_blocks *b = target->instance[bin.instance].blocks;
		const struct warp_block *block = &blocks[e % BLOCKS];

		if (e % BLOCKS == 0)
			make_veiled(blocks, target, entry + e, n - e < BLOCKS ? n - e : BLOCKS);
		if (entry[e].side != side || words.n > LIST - PSR_BLOCK_SAMPLES) {
			hang(target, layer, &words, &veils, side);
			side = entry[e].side;
			corners.x0 = target->x0 - side + 1;
			corners.y0 = target->y0 - side + 1;
			corners.stride = side == 1 ? target->stride : 1u << SQUARE_SHIFT;
			veils.half = 0.5f * (float)(side - 1);
		}
		veils.area = entry[e].area;
		veils.opacity = b->opacity + (block->attr - b->attr);
		list_block(&words, NULL, &veils, &corners, &bin, block);
	}
	hang(target, layer, &words, &veils, side);
}

#endif

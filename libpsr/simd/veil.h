/* Veils: what samples that are narrower than their cell hang before the opaque picture. */
#ifndef PSR_SIMD_VEIL_H
#define PSR_SIMD_VEIL_H

#include "base/maths.h"
#include "warp.h"

/* A veil is how many times a sample halves the light from behind, in steps of 2^-16. The veils of a pixel add up, in
 * any order. Rows of a tile's pixels are as far apart as its target's. */
struct veil_layer {
	const float *before; /* by pixel: z' of the opaque surface, which hides samples behind it */
	uint64_t *word;      /* by pixel: the nearest sample's, */
	uint32_t *veil;      /* and the sum of all, at most VEIL_MOST */
	const float *bits;   /* by opacity, 0..PSR_OPAQUE: the veil of a sample of area 1, at most 2^28 */
};
#define VEIL_MOST (24u << 16) /* nothing is left of 16 bits of light */

/* A block whose samples hang veils. */
struct veil_entry {
	uint32_t slot;
	uint16_t instance;
	uint16_t side; /* of the square of pixels about each sample, 1..VEIL_MOST_SIDE */
	float area;    /* the veil of each of its pixels, in those of a sample of area 1; 0..4 */
};
#define VEIL_MOST_SIDE ((1 << PSR_MAX_DEPTH_LEVEL) + 2)

/* Hangs the veils of samples that lie beyond near_z and before the opaque surface. Uses neither words nor cells of the
 * target. */
typedef void veil_fn(const struct warp_target *target, const struct veil_layer *layer, const struct veil_entry *entry,
                     uint32_t n);

static inline void veil_add(const struct veil_layer *layer, uint32_t at, uint64_t word, uint32_t veil)
{
	const int is_before = psr_word_z(word) < layer->before[at];
	const uint64_t own = is_before ? word : PSR_WORD_EMPTY, there = layer->word[at];
	const uint32_t sum = layer->veil[at] + (is_before ? veil : 0);

	layer->word[at] = own < there ? own : there;
	layer->veil[at] = sum < VEIL_MOST ? sum : VEIL_MOST;
}

/* Adds a veil to the pixels of a square, as far as they are in the tile. (x, y): its corner, from the tile's. */
static inline void veil_add_square(const struct veil_layer *layer, const struct warp_target *t, int32_t x, int32_t y,
                                   int32_t side, uint64_t word, uint32_t veil)
{
	const int32_t x0 = x > 0 ? x : 0, x1 = x + side < t->x1 - t->x0 ? x + side : t->x1 - t->x0;
	const int32_t y0 = y > 0 ? y : 0, y1 = y + side < t->y1 - t->y0 ? y + side : t->y1 - t->y0;

	for (int32_t row = y0; row < y1; row++)
		for (int32_t column = x0; column < x1; column++)
			veil_add(layer, (uint32_t)row * t->stride + (uint32_t)column, word, veil);
}

#endif

/* Thin: things that are narrower than a sample's cell, such as needles and wires, cover a pixel in part. */
#ifndef PSR_RENDER_THIN_H
#define PSR_RENDER_THIN_H

#include "sheer_tile.h"

/* A veil is how many times a sample halves the light from behind, in steps of 2^-16. The veils of a pixel add up, in
 * any order. */
struct thin_layer {
	const float *before; /* by pixel: z' of the opaque surface, which hides samples behind it */
	uint64_t *word;      /* by pixel: the nearest sample's, */
	uint32_t *veil;      /* and the sum of all */
	const float *bits;   /* by opacity: the veil of a disc as wide as a pixel */
};
#define THIN_MOST_VEIL (24u << 16) /* nothing is left of 16 bits of light */

static inline void thin_add(const struct thin_layer *layer, uint32_t at, uint64_t word, uint32_t veil)
{
	const uint32_t sum = layer->veil[at] + veil;

	if (!(psr_float_from_bits((uint32_t)(word >> 32)) < layer->before[at]))
		return;
	layer->word[at] = word < layer->word[at] ? word : layer->word[at];
	layer->veil[at] = sum < THIN_MOST_VEIL ? sum : THIN_MOST_VEIL;
}

/* Moves glass behind thin things in entries of a tile. Returns the first one of glass. */
uint32_t thin_end(const struct plan *plan, const struct bins *bins, uint32_t begin, uint32_t end);

/* Finds the light of the thin things in a tile that shows no layer yet. The nearest lends its colour to all behind
 * it. */
void thin_draw(struct sheer_tile *l, const struct sheer_drawing *d, const struct sheer_area *area,
               const struct warp_target *target, const struct sheer_entries *entries);

#endif

/* Discs in a tile, of the splats of blocks and of leaves. */
#ifndef PSR_RENDER_SPLAT_DISC_H
#define PSR_RENDER_SPLAT_DISC_H

#include "sheer.h"
#include "splat.h"

/* Steps by which a disc's rim counts as further away, so that a pixel shows the disc whose centre is nearest to it.
 * Measured. */
#define RIM_DEPTH 1.0f

struct splat_target {
	const struct simd *simd;
	const struct plan *plan;
	const struct warp_target *tile;
	struct sheer_list *list; /* takes the discs instead of words, or NULL */
	const struct veil_layer *veils; /* does, or NULL, */
	float area;                     /* with so many times an opacity's veil */
	const struct splat_offcuts *offcuts;
	unsigned cut_below; /* as of splat_into */
};

/* Draws an entry's discs, which are placed, as words. Those of coarse levels cover so many pixels that each asks
 * whether the frame is to end. */
void splat_words(const struct splat_target *t, const struct discs *discs, uint64_t mask, unsigned level);

/* Draws the discs of a cube's leaves (splat_cubes.c). */
void splat_cube(const struct splat_target *t, const struct bin_entry *entry);

#endif

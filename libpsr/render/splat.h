/* Splats: samples as discs, for refinement ([B] 3). */
#ifndef PSR_RENDER_SPLAT_H
#define PSR_RENDER_SPLAT_H

#include "gaps.h"
#include "warp.h"

/* As warp_tile, with a disc around each sample: in its projection's plane, tilted onto the surface's, and large enough
 * to meet its neighbours'. Cells are those of the samples, for splat_close; blocks that need none get cells of two
 * pixels. */
struct warp_counts splat_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                              struct psr_zstack *stack, uint32_t tile, uint32_t clean);

/* Lists the discs of a block, as far as they are in the tile, instead of drawing them. */
struct sheer_list;
void splat_list(const struct plan *plan, const struct bin_entry *entry, const struct warp_target *target,
                struct sheer_list *list);

/* How much further away a block's discs count at their rims than in their planes, in z': a step of its lattice. */
float splat_rim(const struct plan_instance *in, uint32_t block);

/* Pixels of a picture that lie well inside of the object in its plain frame. The frame being drawn is a window of the
 * picture with 2^pass pixels along the side of each; its pixel (0, 0) is (left, top). */
struct inside {
	const uint8_t *is_inside; /* width in a row */
	uint32_t width, left, top;
	unsigned pass;
};

/* Closes holes between discs in rows y0..y1-1, after gaps_rows: sets their weights to 0 and marks their bricks. Returns
 * how many pixels it closes, of two kinds. Pixels inside of the object (inside; NULL: unknown) that lie behind samples
 * in each of the 3 x 3 cells around them by more than their level's threshold, or are empty and have something in two
 * opposite directions within a cell, or 64 pixels, where cells are wider than two pixels of the picture. And pixels,
 * empty or behind by more than level 1's threshold, with one surface within a cell, or some pixels, in each of eight
 * directions. */
uint32_t splat_close(const struct plan *plan, const struct psr_zstack *stack, const struct inside *inside, uint32_t y0,
                     uint32_t y1, const struct gaps_map *map);

#endif

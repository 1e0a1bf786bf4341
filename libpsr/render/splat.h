/* Splats: samples as discs, for refinement ([B] 3). */
#ifndef PSR_RENDER_SPLAT_H
#define PSR_RENDER_SPLAT_H

#include "gaps.h"
#include "warp.h"

/* Of a disc, in steps of the lattice: no point of an equilateral lattice is further than 1/sqrt(3) from a sample. */
#define SPLAT_RADIUS 0.6f

/* Draws a tile like warp_tile, with a disc around each sample. A disc lies on the surface and meets those of its
 * neighbours. Cells are those of the samples, for splat_close; blocks of level 0 get cells of two pixels. */
struct warp_counts splat_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                              struct psr_zstack *stack, uint32_t tile, uint32_t clean);

/* Lists the discs of a block inside the tile. */
struct sheer_list;
void splat_list(const struct plan *plan, const struct bin_entry *entry, const struct warp_target *target,
                struct sheer_list *list);

/* Adds the veils of the discs of a block inside the tile, each `area` times its opacity's. */
struct veil_layer;
void splat_veil(const struct plan *plan, const struct bin_entry *entry, const struct warp_target *target,
                const struct veil_layer *layer, float area);

/* Returns the depth in z' added at the rims of a block's discs: a step of its lattice. */
float splat_rim(const struct plan_instance *in, uint32_t block);

/* The pixels of a plain frame that lie well inside the object. The frame being drawn is a window of a finer picture,
 * which has 2^pass x 2^pass pixels a plain one; the window's pixel (0, 0) is (left, top) there. */
struct inside {
	const uint8_t *is_inside; /* 1 if inside; `width` a row */
	uint32_t width, left, top;
	unsigned pass;
};

/* Closes holes between discs in rows y0..y1-1, after gaps_rows: sets their weights to 0 and marks their bricks. Returns
 * how many pixels it closes. It closes three kinds:
 * - a narrow crack inside the object, behind samples in all 3 x 3 cells around it by more than their level's threshold;
 * - where a cell is wider than two plain pixels, any such pixel inside the object, narrow or not, and any empty one
 *   between samples in two opposite directions, at most a cell or 64 pixels away;
 * - anywhere, a pixel that one surface encloses in eight directions, at most a cell or 8 pixels away, and that is
 *   empty or behind it by more than level 1's threshold.
 * inside may be NULL: then only the third kind. */
uint32_t splat_close(const struct plan *plan, const struct psr_zstack *stack, const struct inside *inside, uint32_t y0,
                     uint32_t y1, const struct gaps_map *map);

#endif

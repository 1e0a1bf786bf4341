/* Splats: samples as discs, for refinement ([B] 3). */
#ifndef PSR_RENDER_SPLAT_H
#define PSR_RENDER_SPLAT_H

#include "gaps.h"
#include "warp.h"
#include "simd/discs.h"
#include "simd/holes.h"

/* Pixels where something was cut off a disc: a bit a pixel, the lowest first. */
struct splat_offcuts {
	uint8_t *bits;
	uint32_t stride; /* bytes a row */
};

/* Where a tile is drawn. */
struct splat_into {
	const struct psr_zstack *stack;
	uint32_t clean; /* bits of parts that need no clearing */
	struct splat_offcuts offcuts;
	unsigned cut_below; /* discs of this level and coarser ones are not cut */
};

/* Draws a tile like warp_tile, with a disc around each sample. A disc lies on the surface and meets those of its
 * neighbours; of some levels it is cut where its block has no sample next to it (splat_cut.h). Cells are those of the
 * samples, for splat_close; blocks of level 0 get cells of two pixels. Clears and marks the tile's offcuts, of an empty
 * tile too. */
struct warp_counts splat_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                              const struct splat_into *into, uint32_t tile);

/* Lists the discs of a block inside the tile. */
struct sheer_list;
void splat_list(const struct simd *simd, const struct plan *plan, const struct bin_entry *entry,
                const struct warp_target *target, struct sheer_list *list);

/* Adds the veils of the discs of a block inside the tile, each `area` times its opacity's. */
struct veil_layer;
void splat_veil(const struct simd *simd, const struct plan *plan, const struct bin_entry *entry,
                const struct warp_target *target, const struct veil_layer *layer, float area);

/* Returns the depth in z' added at the rims of a block's discs: a step of its lattice. */
float splat_rim(const struct plan_instance *in, uint32_t block);

/* The pixels of a plain frame that lie well inside the object. The frame being drawn is a window of a finer picture,
 * which has 2^pass x 2^pass pixels a plain one; the window's pixel (0, 0) is (left, top) there. */
struct inside {
	const uint8_t *is_inside; /* 1 if inside; `width` a row */
	uint32_t width, left, top;
	unsigned pass;
};

/* A picture of splats. */
struct splat_picture {
	const struct simd *simd;
	const struct plan *plan;
	const struct psr_zstack *stack;
	const struct inside *inside;  /* NULL: unknown */
	struct splat_offcuts offcuts; /* bits NULL: nothing was cut off */
};

/* Closes holes between discs in rows y0..y1-1, after gaps_rows: sets their weights to 0 and marks their bricks. Returns
 * how many pixels it closes. It closes four kinds:
 * - a narrow crack inside the object, behind samples in all 3 x 3 cells around it by more than their level's threshold;
 * - where a cell is wider than two plain pixels, any such pixel inside the object, narrow or not, and any empty one
 *   between samples in two opposite directions, at most a cell or 64 pixels away;
 * - anywhere, a pixel that one surface encloses in eight directions, at most a cell or 8 pixels away, and that is
 *   empty or behind it by more than level 1's threshold;
 * - anywhere, a pixel of an offcut behind places of one surface on both sides, a cell apart at most: along two lines,
 *   or one where the surface is steep, or the pixel is empty and inside the object.
 * Without picture->inside no pixel is known to be inside. */
uint32_t splat_close(const struct splat_picture *picture, uint32_t y0, uint32_t y1, const struct gaps_map *map);

#endif

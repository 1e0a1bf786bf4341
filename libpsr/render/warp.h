/* Warp: samples to words and cells of the z-buffer, tile by tile ([G] 7.1). */
#ifndef PSR_RENDER_WARP_H
#define PSR_RENDER_WARP_H

#include "bands.h"
#include "zbuffer.h"

struct warp_counts {
	uint64_t n_inside;   /* samples that fell into the tile and do not face away */
	uint32_t n_occluded; /* blocks skipped because the tile hides them */
	int with_occlusion;
};

/* Where a tile is drawn. */
struct warp_into {
	const struct psr_zstack *stack; /* cells, and words unless there is `own` */
	uint32_t clean;                 /* bits of parts that need no clearing */
	uint64_t *own;                  /* WARP_OWN_WORDS, or NULL */
	struct ewa_sum *sum;            /* of the picture; of plans with EWA splats */
};

/* Warps entries of any representations: each run of one by its kernel. */
uint64_t warp_entries(const struct simd *simd, const struct plan *plan, const struct warp_target *target,
                      const struct bin_entry *entry, uint32_t n);

/* Clears a tile, and draws its blocks; some of them if the frame is cancelled. */
struct warp_counts warp_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                             const struct warp_into *into, uint32_t tile);

/* Whether the warp leaves out what it finds hidden in a tile of n blocks, cubes or groups: then it draws the tile from
 * near to far. */
int warp_looks(const struct plan *plan, uint32_t n);

/* Clears a band that is a part of its tile, and draws it. */
struct warp_counts warp_band(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                             const struct warp_into *into, const struct band *band);

/* Draws the blocks `begin` .. `end` - 1 of the bins into a cleared tile from near to far, skipping blocks that the tile
 * already hides. */
struct warp_counts warp_near_to_far(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                                    const struct warp_target *target, uint32_t begin, uint32_t end);

#endif

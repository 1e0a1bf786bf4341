/* Samples and leaves as discs, for refinement: those of one block or cube, by lane. */
#ifndef PSR_SIMD_DISCS_H
#define PSR_SIMD_DISCS_H

#include "warp.h"

/* Of a disc, in steps of the lattice: no point of an equilateral lattice is further than 1/sqrt(3) from a sample. */
#define DISC_RADIUS 0.6f
#define DISCS 64

struct discs {
	uint64_t mask; /* lanes that have a disc: samples of the block, leaves of the cube */
	uint32_t id;   /* of lane 0; those of others follow */
	float most;    /* pixels: discs that reach further shrink */
	float rim;     /* how far a disc's rim is behind its plane: a pixel shows the disc whose centre is nearest to it */
	float at[3][DISCS];        /* centre: u, v, z' */
	float radius[2][3][DISCS]; /* two conjugate radii in the picture, and how z' rises along them */
	float share[2][DISCS];     /* of blocks: the part of the full radius along the lattice's rows and across them */
	/* Of discs_place: p = across[0] . d, q = across[1] . d are a pixel's place in units of the radii; the pixels that
	 * the disc may cover. */
	float across[2][2][DISCS];
	int32_t x0[DISCS], y0[DISCS], x1[DISCS], y1[DISCS];
};

/* Finds the discs of a block's samples that are beyond near_z and do not face away: mask, id, at, radius and share. */
typedef void discs_of_block_fn(struct discs *discs, const struct warp_target *target, const struct bin_entry *entry);

/* From mask, most, at and radius: shrinks radii, and finds what discs cover of the tile. */
typedef void discs_place_fn(struct discs *discs, const struct warp_target *target);

/* Draws the discs of the lanes of `mask`: the words of the pixels whose centres they cover keep the nearest. A disc may
 * miss the pixel of its own centre: discs meet their neighbours', and that pixel would widen every edge. */
typedef void discs_draw_fn(const struct warp_target *target, const struct discs *discs, uint64_t mask);

#endif

/* Rows of a tile of discs, before holes between discs are closed. */
#ifndef PSR_SIMD_HOLES_H
#define PSR_SIMD_HOLES_H

#include "tile.h"
#include "zstack.h"

#define HOLES_REACH 8 /* pixels, a power of two: how far from a hole its enclosing surface may be */
#define HOLES_CELLS (TILE_WIDTH / 2)

/* A tile's row of cells of a level. */
struct hole_cells {
	float limit[HOLES_CELLS];     /* a greater depth is behind samples of all cells around */
	uint8_t is_near[HOLES_CELLS]; /* a block of this level has samples in the cell or beside it */
	int has_any;
};

/* Properties of the pixels in a row of a tile. */
struct hole_row {
	uint8_t is_between[TILE_WIDTH]; /* something nearer, by more than a threshold, is within reach left and right */
	uint8_t is_covered[TILE_WIDTH]; /* samples in all cells around are nearer */
	uint8_t level[TILE_WIDTH];      /* of the coarsest cells around; 0: none */
};

/* Fills in n pixels from x on of a row whose words begin at `row` and are `width`. levels: bit k: cells[k] has some.
 * scale, offset: of the threshold. */
typedef void holes_fn(struct hole_row *to, const struct hole_cells *cells, uint32_t levels, const uint64_t *row,
                      uint32_t width, uint32_t x, uint32_t n, float scale, float offset);

#endif

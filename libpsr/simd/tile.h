/* Tiles, the unit of work of the warp, and their parts. */
#ifndef PSR_SIMD_TILE_H
#define PSR_SIMD_TILE_H

#include <stdint.h>

#define TILE_WIDTH 256  /* a tile's words fit L2 with room to spare */
#define TILE_HEIGHT 128 /* a multiple of the coarsest cell: every cell belongs to one tile */

/* The renderer tracks empty pixels by part of a tile. */
#define PART_WIDTH 128
#define PART_HEIGHT 32
#define ALL_PARTS ((1u << TILE_HEIGHT / PART_HEIGHT * (TILE_WIDTH / PART_WIDTH)) - 1)

/* The bit of the part at pixel (x, y) of a tile. */
static inline uint32_t part_bit(uint32_t x, uint32_t y)
{
	return 1u << (y / PART_HEIGHT * (TILE_WIDTH / PART_WIDTH) + x / PART_WIDTH);
}

/* How far the bits of rows from y on are above those of the tile's first ones. */
static inline uint32_t part_shift(uint32_t y)
{
	return y / PART_HEIGHT * (TILE_WIDTH / PART_WIDTH);
}

#endif

/* Bands: rows of a tile, drawn by a thread. Most tiles are one band; of differential points one tile may have most of a
 * picture. */
#ifndef PSR_RENDER_BANDS_H
#define PSR_RENDER_BANDS_H

#include "bins.h"

#define BANDS_MOST (TILE_HEIGHT / PART_HEIGHT) /* of a tile: words are known to be empty by part */

struct band {
	uint32_t tile;
	uint16_t y0, y1; /* rows of the tile; 0 and TILE_HEIGHT where it is whole */
};

/* Lists the bands of all tiles, those of most entries first. A tile is cut that would keep one of the threads longer
 * than its share. levels: bit mask of depth buffers; cells of a tile belong to all of its rows. Returns how many there
 * are, at most BANDS_MOST a tile. */
uint32_t bands_make(struct band *out, const struct plan *plan, const struct bins *bins, uint32_t levels, int n_threads);

#endif

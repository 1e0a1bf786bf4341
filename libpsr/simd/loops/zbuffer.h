/* The hierarchical z-buffer of a tile ([G] 7.2): clearing it, cells from words, greatest depths. */
#include <math.h>
#include <string.h>
#include "simd/warp.h"

/* Whether `bits` has the part at pixel (x, y) of the tile. */
static inline int is_part(uint32_t bits, int32_t x, int32_t y)
{
	return bits && bits & part_bit((uint32_t)x, (uint32_t)y);
}

static void warp_clear(const struct warp_target *t, uint32_t levels)
{
	const int32_t width = t->x1 - t->x0, height = t->y1 - t->y0;

	for (int32_t y = 0; y < height; y++) {
		uint64_t *word = t->word + (size_t)y * t->stride;

		for (int32_t x0 = 0; x0 < width; x0 += PART_WIDTH) {
			const int32_t x1 = x0 + PART_WIDTH < width ? x0 + PART_WIDTH : width;

			if (is_part(t->clean, x0, y))
				continue;
			for (int32_t x = x0; x < x1; x++)
				word[x] = PSR_WORD_EMPTY;
		}
	}
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		if (!(levels >> k & 1))
			continue;
		const struct warp_cells *c = &t->cells[k];
		for (int32_t y = (c->y0 >> k) + 1; y <= c->y1 >> k; y++) {
			float *z = c->z + (size_t)y * c->stride;

			for (int32_t x = (c->x0 >> k) + 1; x <= c->x1 >> k; x++)
				z[x] = INFINITY;
		}
	}
}

static inline void halve(uint32_t *restrict to, const uint32_t *restrict from, int32_t n)
{
	for (int32_t i = 0; i < n; i++)
		to[i] = from[2 * i] < from[2 * i + 1] ? from[2 * i] : from[2 * i + 1];
}

static void warp_cells(const struct warp_target *t, int level)
{
	const struct warp_cells *c = &t->cells[level];
	const int32_t width = t->x1 - t->x0, side = 1 << level, n = (width + side - 1) >> level;
	const uint32_t empty = (uint32_t)(PSR_WORD_EMPTY >> 32);
	uint32_t *cells = (uint32_t *)c->z;

	for (int32_t y = c->y0; y < c->y1; y += side) {
		uint32_t column[2][TILE_WIDTH];

		for (int32_t x = 0; x < TILE_WIDTH; x++)
			column[0][x] = empty;
		for (int32_t v = y > t->y0 ? y : t->y0; v < y + side && v < t->y1; v++) {
			const uint64_t *word = t->word + (size_t)(v - t->y0) * t->stride;

			for (int32_t x0 = 0; x0 < width; x0 += PART_WIDTH) {
				const int32_t x1 = x0 + PART_WIDTH < width ? x0 + PART_WIDTH : width;

				if (is_part(t->bare, x0, v - t->y0))
					continue;
				for (int32_t x = x0; x < x1; x++) {
					const uint32_t z = (uint32_t)(word[x] >> 32);

					column[0][x] = z < column[0][x] ? z : column[0][x];
				}
			}
		}
		for (int k = 1; k <= level; k++)
			halve(column[k & 1], column[~k & 1], TILE_WIDTH >> k);
		uint32_t *row = cells + (size_t)((y >> level) + 1) * c->stride + 1;
		for (int32_t x = c->x0 >> level; x < c->x1 >> level; x++)
			row[x] = empty;
		memcpy(row + (t->x0 >> level), column[level & 1], (size_t)n * sizeof *row);
	}
}

static void warp_far(const struct warp_target *t, uint32_t far[FAR_CELLS])
{
	for (int32_t y = t->y0; y < t->y1; y += FAR_SIDE) {
		const int32_t y1 = y + FAR_SIDE < t->y1 ? y + FAR_SIDE : t->y1, n = t->x1 - t->x0;
		uint32_t *to = far + (y - t->y0) / FAR_SIDE * (TILE_WIDTH / FAR_SIDE), column[TILE_WIDTH] = { 0 };

		for (int32_t v = y; v < y1; v++) {
			const uint64_t *word = t->word + (size_t)(v - t->y0) * t->stride;

			for (int32_t x = 0; x < n; x++) {
				const uint32_t z = (uint32_t)(word[x] >> 32);

				column[x] = column[x] > z ? column[x] : z;
			}
		}
		for (int32_t x = 0; x < TILE_WIDTH / FAR_SIDE; x++) {
			uint32_t most = 0;

			for (int32_t i = 0; i < FAR_SIDE; i++)
				most = column[FAR_SIDE * x + i] > most ? column[FAR_SIDE * x + i] : most;
			to[x] = most;
		}
	}
}

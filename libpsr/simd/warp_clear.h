/* Plain loops, which the compiler turns into vectors; compiled once for each ISA. */
#include <math.h>
#include "simd/simd.h"

static void warp_clear(const struct warp_target *t, uint32_t levels)
{
	for (int32_t y = t->y0; y < t->y1; y++) {
		uint64_t *word = t->word + (size_t)y * t->stride;
		for (int32_t x = t->x0; x < t->x1; x++)
			word[x] = PSR_WORD_EMPTY;
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

static void warp_far(const struct warp_target *t, uint32_t far[TILE_HEIGHT / FAR_SIDE * (TILE_WIDTH / FAR_SIDE)])
{
	for (int32_t y = t->y0; y < t->y1; y += FAR_SIDE) {
		const int32_t y1 = y + FAR_SIDE < t->y1 ? y + FAR_SIDE : t->y1, n = t->x1 - t->x0;
		uint32_t *to = far + (y - t->y0) / FAR_SIDE * (TILE_WIDTH / FAR_SIDE), column[TILE_WIDTH] = { 0 };
		for (int32_t v = y; v < y1; v++) {
			const uint64_t *word = t->word + (size_t)v * t->stride + (size_t)t->x0;
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

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

/* Which pixels of a row may be holes between discs. */
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "simd/holes.h"

#define HOLES_REACHED (TILE_WIDTH + 2 * HOLES_REACH)

static inline void holes_between(uint8_t *is_between, const float *z, float scale, float offset)
{
	float nearest[HOLES_REACHED]; /* of HOLES_REACH pixels from this one on */
	uint32_t left = HOLES_REACHED;

	memcpy(nearest, z, sizeof nearest);
	for (uint32_t step = 1; step < HOLES_REACH; step *= 2) {
		left -= step;
		for (uint32_t i = 0; i < left; i++)
			nearest[i] = nearest[i] < nearest[i + step] ? nearest[i] : nearest[i + step];
	}
	for (uint32_t i = 0; i < TILE_WIDTH; i++) {
		const float before = nearest[i], behind = nearest[i + HOLES_REACH + 1];
		const float farther = before > behind ? before : behind;

		is_between[i] = farther * scale + offset < z[i + HOLES_REACH];
	}
}

static inline void holes_double(float *restrict to, const float *restrict from, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++)
		to[2 * i] = to[2 * i + 1] = from[i];
}

static inline void holes_cover(int32_t *restrict is_covered, int32_t *restrict level, const struct hole_cells *cells,
                               int k, const float *restrict z)
{
	const uint32_t n = TILE_WIDTH >> k;
	float limit[2][TILE_WIDTH], near[2][TILE_WIDTH]; /* by cell, then by pixel */

	for (uint32_t c = 0; c < n; c++) {
		limit[k & 1][c] = psr_choose(cells->is_near[c], cells->limit[c], INFINITY);
		near[k & 1][c] = psr_where(cells->is_near[c], 1);
	}
	for (int f = k; f > 0; f--) {
		holes_double(limit[~f & 1], limit[f & 1], TILE_WIDTH >> f);
		holes_double(near[~f & 1], near[f & 1], TILE_WIDTH >> f);
	}
	for (uint32_t c = 0; c < TILE_WIDTH; c++) {
		is_covered[c] |= limit[0][c] < z[c];
		level[c] = near[0][c] > 0 ? k : level[c];
	}
}

static void holes(struct hole_row *to, const struct hole_cells *cells, uint32_t levels, const uint64_t *row,
                  uint32_t width, uint32_t x, uint32_t n, float scale, float offset)
{
	const uint32_t first = x ? 0 : HOLES_REACH, beyond = width - x;
	const uint32_t end = beyond < n + HOLES_REACH ? beyond + HOLES_REACH : n + 2 * HOLES_REACH;
	const uint64_t *word = row + x;
	float z[HOLES_REACHED];
	int32_t is_covered[TILE_WIDTH], level[TILE_WIDTH];

	for (uint32_t i = 0; i < HOLES_REACHED; i++)
		z[i] = INFINITY;
	for (uint32_t i = first; i < end; i++)
		z[i] = psr_float_from_bits((uint32_t)(word[(ptrdiff_t)i - HOLES_REACH] >> 32));
	holes_between(to->is_between, z, scale, offset);
	memset(is_covered, 0, sizeof is_covered);
	memset(level, 0, sizeof level);
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++)
		if (levels >> k & 1)
			holes_cover(is_covered, level, &cells[k], k, z + HOLES_REACH);
	for (uint32_t c = 0; c < TILE_WIDTH; c++) {
		to->is_covered[c] = (uint8_t)is_covered[c];
		to->level[c] = (uint8_t)level[c];
	}
}

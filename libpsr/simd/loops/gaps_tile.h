/* What the ways to find gaps share: the depths of a piece of the picture, and rows of cells spread over pixels. */
#ifndef PSR_SIMD_LOOPS_GAPS_TILE_H
#define PSR_SIMD_LOOPS_GAPS_TILE_H

#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "simd/gaps.h"

#define GAPS_MARGIN 4 /* pixels around a piece that are read with it */
#define GAPS_ROWS (GAPS_BRICK + 2 * GAPS_MARGIN)
#define GAPS_STRIDE (GAPS_WIDTH + 32) /* the margin on each side, and aligned rows */
#define GAPS_LEFT 16
#define MAX_SPREAD (GAPS_WIDTH + 2 * (1 << PSR_MAX_DEPTH_LEVEL))
#define SPREAD_RUN 16 /* values repeated together: arrays have room for one run more */

/* Depths of a piece of the picture and of its margin, +inf outside of the picture. Loops cover all GAPS_WIDTH
 * columns. */
struct gaps_tile {
	_Alignas(64) float z[GAPS_ROWS][GAPS_STRIDE];
	int32_t has_samples[GAPS_ROWS]; /* by row, with what of its margin was loaded: at least a pixel on each side */
	uint32_t x0, y0, width, height;
};

/* Row y of the piece, -GAPS_MARGIN <= y < height + GAPS_MARGIN, at the piece's first pixel. */
static inline const float *gaps_row(const struct gaps_tile *tile, int32_t y)
{
	return &tile->z[y + GAPS_MARGIN][GAPS_LEFT];
}

/* Loads `margin` pixels around the piece. */
static void load_depths(struct gaps_tile *tile, const struct psr_zstack *stack, uint32_t margin)
{
	const uint32_t left = tile->x0 ? margin : 0, after = stack->width - tile->x0 - tile->width;
	const uint32_t n = left + tile->width + (after < margin ? after : margin);

	for (uint32_t i = GAPS_MARGIN - margin; i < tile->height + GAPS_MARGIN + margin; i++) {
		float *row = tile->z[i], *z = row + GAPS_LEFT - left;
		int32_t has_samples = 0;
		const int is_inside = tile->y0 + i >= GAPS_MARGIN && tile->y0 + i < stack->height + GAPS_MARGIN;

		for (uint32_t x = 0; x < GAPS_LEFT; x++)
			row[x] = INFINITY;
		for (uint32_t x = is_inside ? GAPS_LEFT - left + n : GAPS_LEFT; x < GAPS_STRIDE; x++)
			row[x] = INFINITY;
		if (is_inside) {
			const uint64_t *word = psr_zstack_row(stack, tile->y0 + i - GAPS_MARGIN) + tile->x0 - left;

			for (uint32_t x = 0; x < n; x++) {
				z[x] = psr_float_from_bits((uint32_t)(word[x] >> 32));
				has_samples |= z[x] < INFINITY;
			}
		}
		tile->has_samples[i] = has_samples;
	}
}

static inline void repeat(float *to, const float *from, uint32_t n)
{
	typedef float run __attribute__((vector_size(4 * SPREAD_RUN)));

	for (uint32_t first = 0; first < n; first += SPREAD_RUN) {
		run values, twice;

		memcpy(&values, from + first, sizeof values);
		twice = __builtin_shufflevector(values, values, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7);
		memcpy(to + 2 * first, &twice, sizeof twice);
		twice = __builtin_shufflevector(values, values, 8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13, 14, 14, 15, 15);
		memcpy(to + 2 * first + SPREAD_RUN, &twice, sizeof twice);
	}
}

/* Repeats each of n values 2^k times. */
static void spread(float *to, const float *from, uint32_t n, int k)
{
	float some[2][MAX_SPREAD / 2 + 2 * SPREAD_RUN];

	for (; k > 1; k--, n *= 2) {
		float *twice = some[k & 1];

		repeat(twice, from, n);
		from = twice;
	}
	repeat(to, from, n);
}

#endif

/* Shared by pull and push: rows of cells, FILL_BLOCK coarser ones at a time. Loops have a constant length, for
 * vectors. */
#ifndef PSR_SIMD_LOOPS_FILL_ROWS_H
#define PSR_SIMD_LOOPS_FILL_ROWS_H

#include <math.h>
#include <stddef.h>
#include <string.h>
#include "base/maths.h"
#include "simd/fill.h"

/* Cells 2x and 2x + 1, the former in the lower half. Assumes little-endian bytes. */
static inline uint32_t pair_at(const uint16_t *values, uint32_t x)
{
	uint32_t pair;

	memcpy(&pair, values + 2 * x, sizeof pair);
	return pair;
}

/* value * share >> 8 for a share of 0..256, in 16-bit arithmetic. */
static inline uint16_t part_of(uint16_t value, uint16_t share)
{
	const uint16_t all = (uint16_t)-(share >> 8), factor = (uint16_t)(share << 8);

	return (uint16_t)((value & all) | (uint16_t)((uint32_t)value * factor >> 16));
}

/* A copy of the last cells of a row, padded to a whole block. */
struct block_row {
	uint16_t r[2 * FILL_BLOCK + 2], g[2 * FILL_BLOCK + 2], b[2 * FILL_BLOCK + 2], weight[2 * FILL_BLOCK + 2];
	float z[2 * FILL_BLOCK + 2];
};

static inline void copy_values(uint16_t *to, const uint16_t *from, uint32_t n, uint16_t outside)
{
	for (uint32_t i = 0; i < 2 * FILL_BLOCK + 2; i++)
		to[i] = outside;
	memcpy(to, from, n * sizeof *to);
}

/* The row from its cell x on. */
static inline struct fill_row row_from(struct fill_row row, ptrdiff_t x)
{
	return (struct fill_row){ row.r + x, row.g + x, row.b + x, row.weight + x, row.z + x, NULL };
}

/* Copies n weights and depths from cell x on, and pads them with whole cells. */
static inline void copy_weights(struct block_row *to, const struct fill_row *from, uint32_t x, uint32_t n)
{
	copy_values(to->weight, from->weight + x, n, GAPS_WHOLE);
	memset(to->z, 0, sizeof to->z);
	memcpy(to->z, from->z + x, n * sizeof *to->z);
}

#endif

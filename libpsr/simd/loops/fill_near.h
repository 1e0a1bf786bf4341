/* How far filled pixels are from samples (decision 0164). */
#ifndef PSR_SIMD_LOOPS_FILL_NEAR_H
#define PSR_SIMD_LOOPS_FILL_NEAR_H

#include <math.h>
#include <stddef.h>
#include <string.h>
#include "base/maths.h"
#include "simd/fill.h"

#define FAR_RUN 16 /* values together */

static inline float nearer(float apart, float own, float z)
{
	const float d = fabsf(own - z);

	return d < apart ? d : apart;
}

/* Sets which of n values are far; returns whether any is. */
static inline int32_t find_far(int32_t *is_far, const float *z, const float *above, const float *beside,
                               const float *below, uint32_t n, float scale, float offset)
{
	int32_t is_any = 0;

	for (uint32_t i = 0; i < n; i++) {
		float least = INFINITY;

		least = nearer(least, above[i], z[i]);
		least = nearer(least, above[i + 1], z[i]);
		least = nearer(least, above[i + 2], z[i]);
		least = nearer(least, beside[i], z[i]);
		least = nearer(least, beside[i + 1], z[i]);
		least = nearer(least, beside[i + 2], z[i]);
		least = nearer(least, below[i], z[i]);
		least = nearer(least, below[i + 1], z[i]);
		least = nearer(least, below[i + 2], z[i]);
		is_far[i] = !(least <= scale * z[i] + offset) & (z[i] < INFINITY);
		is_any |= is_far[i];
	}
	return is_any;
}

static uint32_t fill_far(uint16_t *restrict far, const float *restrict z, const float *const own[3], uint32_t n,
                         float scale, float offset)
{
	const float *const above = own[0] - 1, *const beside = own[1] - 1, *const below = own[2] - 1;
	uint32_t n_far = 0;

	for (uint32_t x = 0, run; x < n; x += run) {
		int32_t is_far[FAR_RUN], is_any;

		run = n - x < FAR_RUN ? n - x : FAR_RUN;
		is_any = run == FAR_RUN
		             ? find_far(is_far, z + x, above + x, beside + x, below + x, FAR_RUN, scale, offset)
		             : find_far(is_far, z + x, above + x, beside + x, below + x, run, scale, offset);
		for (uint32_t i = 0; i < run && is_any; i++)
			if (is_far[i])
				far[n_far++] = (uint16_t)(x + i);
	}
	return n_far;
}

static void fill_own(float *restrict own, const uint64_t *restrict word, const uint16_t *restrict weight, uint32_t n)
{
	for (uint32_t x = 0; x < n; x++) {
		const uint32_t none = weight[x] == 0 ? UINT32_MAX : 0;

		own[x] = psr_float_from_bits((uint32_t)(word[x] >> 32) | none);
	}
}

/* ---- squares, a row at a time ---- */

#define SIDE    (2 * FILL_SQUARE + 1)
#define COLUMNS 8 /* one more, which does not count */

typedef float columns __attribute__((vector_size(4 * COLUMNS)));
typedef int32_t columns_if __attribute__((vector_size(4 * COLUMNS))); /* of a comparison: -1 or 0 */
_Static_assert(SIDE == 7, "as the next has");

static const columns_if column_x = { -3, -2, -1, 0, 1, 2, 3, 4 };

#define NONE       (INFINITY - (columns){ 0 })
#define PICK(if_, a, b) ((columns)(((columns_if)(if_) & (columns_if)(a)) | (~(columns_if)(if_) & (columns_if)(b))))
#define LEAST(a, b) PICK((a) < (b), a, b)
#define FOLD(distance2, along, n, ...)                                                    \
	do {                                                                                  \
		const columns other2 = __builtin_shufflevector(distance2, distance2, __VA_ARGS__); \
		const columns other_along = __builtin_shufflevector(along, along, __VA_ARGS__);    \
                                                                                          \
		distance2 = LEAST(other2, distance2);                                             \
		along = LEAST(other_along, along);                                                \
		n += __builtin_shufflevector(n, n, __VA_ARGS__);                                  \
	} while (0)
#define ALONG(from, apart) ((columns)((columns_if)((apart) * (from)->steep) & INT32_MAX))

static inline void row_at(columns *row, const float *own)
{
	memcpy(row, own - FILL_SQUARE, sizeof *row);
}

static struct fill_beside fill_beside(const struct fill_from *from, const float *own, ptrdiff_t stride, int reach)
{
	const columns dx = __builtin_convertvector(column_x, columns);
	const columns_if counts = (column_x >= -reach) & (column_x <= reach);
	columns distance2 = NONE, along = NONE;
	columns_if n = { 0 }; /* below 0 */

	for (int v = -reach; v <= reach; v++) {
		const float dy = (float)v;
		columns z;

		row_at(&z, own + v * stride);
		const columns apart = z - from->z, shift = apart * from->wider, off = ALONG(from, apart);
		const columns x = dx + shift * (from->x + dx), y = dy + shift * (from->y + dy);
		const columns_if is_some = (z < NONE) & counts;
		const columns all2 = PICK(is_some, x * x + y * y + off * off, NONE), some = PICK(is_some, off, NONE);

		distance2 = LEAST(all2, distance2);
		along = LEAST(some, along);
		n += is_some;
	}
	FOLD(distance2, along, n, 4, 5, 6, 7, 0, 1, 2, 3);
	FOLD(distance2, along, n, 2, 3, 0, 1, 6, 7, 4, 5);
	FOLD(distance2, along, n, 1, 0, 3, 2, 5, 4, 7, 6);
	return (struct fill_beside){ (uint32_t)-n[0], distance2[0], along[0] };
}

static struct fill_place fill_pick(const struct fill_from *from, const float *own, ptrdiff_t stride, int reach,
                                   float along)
{
	const columns_if counts = (column_x >= -reach) & (column_x <= reach);
	columns_if least = INT32_MAX - (columns_if){ 0 }; /* of squares of distances aside, then of places */
	int32_t key = INT32_MAX;

	for (int v = -reach; v <= reach; v++) {
		const columns_if place = column_x + FILL_SQUARE + SIDE * (v + FILL_SQUARE);
		const columns_if mine = place + SIDE * SIDE * (column_x * column_x + v * v);
		columns z;

		row_at(&z, own + v * stride);
		const columns_if is_it = (ALONG(from, z - from->z) == along) & counts & (mine < least);

		least = (is_it & mine) | (~is_it & least);
	}
	for (int i = 0; i < COLUMNS; i++)
		key = least[i] < key ? least[i] : key;
	key %= SIDE * SIDE;
	return (struct fill_place){ key % SIDE - FILL_SQUARE, key / SIDE - FILL_SQUARE };
}

#undef NONE
#undef PICK
#undef LEAST
#undef FOLD
#undef ALONG
#undef SIDE
#undef COLUMNS

#endif

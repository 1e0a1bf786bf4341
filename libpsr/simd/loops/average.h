/* Means of sub-pixels: of columns first, then halved from column to column. */
#include <math.h>
#include <stddef.h>
#include "base/root.h"
#include "simd/average.h"

static inline uint64_t average_square(uint16_t root)
{
	const uint32_t one = root;

	return one * one;
}

/* 16-bit linear light of sums of 2^shares squares. These are below 2^32, so that sums of 2^10 take 42 bits, and 16 more
 * on the way. */
static inline void average_out(uint16_t *light, const uint64_t *sum, uint32_t n, unsigned shares)
{
	const uint32_t bits = PSR_ROOT_BITS + shares;

	for (uint32_t i = 0; i < n; i++) {
		const uint64_t mean = ((sum[i] << 16) - sum[i] + (UINT64_C(1) << (bits - 1))) >> bits;

		light[i] = (uint16_t)(mean < 65535 ? mean : 65535);
	}
}

static void average_light(uint16_t *light, const uint16_t *root, uint32_t stride, uint32_t n, unsigned pass)
{
	const uint32_t side = 1u << pass, n_columns = n << pass;
	uint64_t sum[AVERAGE_MOST];

	for (uint32_t i = 0; i < n_columns; i++)
		sum[i] = 0;
	for (uint32_t j = 0; j < side; j++)
		for (uint32_t i = 0; i < n_columns; i++)
			sum[i] += average_square(root[(size_t)j * stride + i]);
	for (uint32_t left = n_columns; left > n; left /= 2)
		for (uint32_t i = 0; i < left / 2; i++)
			sum[i] = sum[2 * i] + sum[2 * i + 1];
	average_out(light, sum, n, 2 * pass);
}

static void average_around(uint16_t *light, const uint16_t *const row[4], uint32_t n, int is_first, int is_last)
{
	const int32_t first = is_first ? 0 : -1, end = (int32_t)(2 * n) + (is_last ? 0 : 1);
	const uint16_t *a = row[0], *b = row[1], *c = row[2], *d = row[3];
	uint64_t column[AVERAGE_MOST + 2], sum[AVERAGE_MOST / 2];

	for (int32_t i = first; i < end; i++)
		column[i + 1] = 15 * (average_square(b[i]) + average_square(c[i])) + (average_square(a[i]) + average_square(d[i]));
	column[0] = is_first ? column[1] : column[0];
	column[2 * n + 1] = is_last ? column[2 * n] : column[2 * n + 1];
	for (uint32_t i = 0; i < n; i++)
		sum[i] = 15 * (column[2 * i + 1] + column[2 * i + 2]) + (column[2 * i] + column[2 * i + 3]);
	average_out(light, sum, n, 10);
}

static void average_depth(float *depth, const float *from, uint32_t stride, uint32_t n, unsigned pass)
{
	const uint32_t side = 1u << pass, n_columns = n << pass;
	float nearest[AVERAGE_MOST];

	for (uint32_t i = 0; i < n_columns; i++)
		nearest[i] = INFINITY;
	for (uint32_t j = 0; j < side; j++)
		for (uint32_t i = 0; i < n_columns; i++) {
			const float z = from[(size_t)j * stride + i];

			nearest[i] = z < nearest[i] ? z : nearest[i];
		}
	for (uint32_t left = n_columns; left > n; left /= 2)
		for (uint32_t i = 0; i < left / 2; i++)
			nearest[i] = nearest[2 * i + 1] < nearest[2 * i] ? nearest[2 * i + 1] : nearest[2 * i];
	for (uint32_t i = 0; i < n; i++)
		depth[i] = nearest[i];
}

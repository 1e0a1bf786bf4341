/* Means of sub-pixels: of columns first, then halved from column to column. */
#include <math.h>
#include <stddef.h>
#include "base/root.h"
#include "simd/average.h"

/* Squares are below 2^32, so sums of 256 take 40 bits, and 16 more on the way to 16-bit linear light. */
static void average_light(uint16_t *light, const uint16_t *root, uint32_t stride, uint32_t n, unsigned pass)
{
	const uint32_t side = 1u << pass, n_columns = n << pass, bits = PSR_ROOT_BITS + 2 * pass;
	uint64_t sum[AVERAGE_MOST];

	for (uint32_t i = 0; i < n_columns; i++)
		sum[i] = 0;
	for (uint32_t j = 0; j < side; j++)
		for (uint32_t i = 0; i < n_columns; i++) {
			const uint32_t one = root[(size_t)j * stride + i];

			sum[i] += one * one;
		}
	for (uint32_t left = n_columns; left > n; left /= 2)
		for (uint32_t i = 0; i < left / 2; i++)
			sum[i] = sum[2 * i] + sum[2 * i + 1];
	for (uint32_t i = 0; i < n; i++) {
		const uint64_t mean = ((sum[i] << 16) - sum[i] + (UINT64_C(1) << (bits - 1))) >> bits;

		light[i] = (uint16_t)(mean < 65535 ? mean : 65535);
	}
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

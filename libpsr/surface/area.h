/* Primitives by their areas: sum[i] is that of all up to and with primitive i. */
#ifndef PSR_SURFACE_AREA_H
#define PSR_SURFACE_AREA_H

#include <stdint.h>

struct level;

/* Of the level's n_prims triangles and discs, in inner units. */
void area_sum(const struct level *level, uint32_t n_prims, double *sum);

/* The primitive that holds x, 0 <= x < sum[n - 1], n > 0: a random one by area if x is random. */
static inline uint32_t area_find(const double *sum, uint32_t n, double x)
{
	uint32_t low = 0, high = n - 1;

	while (low < high) {
		uint32_t middle = low + (high - low) / 2;

		if (sum[middle] > x)
			high = middle;
		else
			low = middle + 1;
	}
	return low;
}

#endif

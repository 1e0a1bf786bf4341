#include <math.h>
#include <stdlib.h>
#include "base/mem.h"
#include "compare.h"

#define WINDOW 32 /* pixels */

/* A pixel that only one picture shows differs more than any that both show. */
static double value_of(const float *map, size_t i, double for_infinite)
{
	return isfinite(map[i]) ? (double)map[i] : for_infinite;
}

static double greatest_finite(const float *map, size_t n)
{
	double most = 0;

	for (size_t i = 0; i < n; i++)
		if (isfinite(map[i]) && (double)map[i] > most)
			most = (double)map[i];
	return most;
}

/* Sums of squares over all pixels above and to the left, with a row and a column of zeros before them. */
static void sum_up(double *sums, const float *map, const uint32_t size[2], double for_infinite)
{
	const size_t stride = (size_t)size[0] + 1;

	for (size_t x = 0; x <= size[0]; x++)
		sums[x] = 0;
	for (size_t y = 1; y <= size[1]; y++) {
		double row = 0;

		sums[y * stride] = 0;
		for (size_t x = 1; x <= size[0]; x++) {
			const double v = value_of(map, (y - 1) * size[0] + x - 1, for_infinite);

			row += v * v;
			sums[y * stride + x] = sums[(y - 1) * stride + x] + row;
		}
	}
}

static void find_window(struct compare_box *box, const double *sums, const uint32_t size[2])
{
	const uint32_t width = size[0] < WINDOW ? size[0] : WINDOW, height = size[1] < WINDOW ? size[1] : WINDOW;
	const size_t stride = (size_t)size[0] + 1;
	double most = -1;

	for (uint32_t y = 0; y + height <= size[1]; y++)
		for (uint32_t x = 0; x + width <= size[0]; x++) {
			const double *top = sums + y * stride + x, *bottom = top + height * stride;
			const double sum = bottom[width] - bottom[0] - top[width] + top[0];

			if (sum > most) {
				most = sum;
				*box = (struct compare_box){ x, y, width, height };
			}
		}
}

static void shrink(struct compare_box *box, const float *map, uint32_t width, double for_infinite)
{
	const struct compare_box all = *box;
	uint32_t low[2] = { UINT32_MAX, UINT32_MAX }, high[2] = { 0, 0 };
	double most = 0;

	for (int is_marking = 0; is_marking < 2; is_marking++)
		for (uint32_t y = all.y; y < all.y + all.height; y++)
			for (uint32_t x = all.x; x < all.x + all.width; x++) {
				const double v = value_of(map, (size_t)y * width + x, for_infinite);

				if (!is_marking) {
					most = fmax(most, v);
				} else if (v > 0 && v >= most / 2) {
					low[0] = x < low[0] ? x : low[0];
					low[1] = y < low[1] ? y : low[1];
					high[0] = x > high[0] ? x : high[0];
					high[1] = y > high[1] ? y : high[1];
				}
			}
	*box = (struct compare_box){ 0 };
	if (most > 0)
		*box = (struct compare_box){ low[0], low[1], high[0] - low[0] + 1, high[1] - low[1] + 1 };
}

int compare_worst(struct compare_box *box, const float *map, const uint32_t size[2], struct psr_error *err)
{
	const size_t n = (size_t)size[0] * size[1];
	const double greatest = greatest_finite(map, n), for_infinite = greatest > 0 ? 2 * greatest : 1;
	double *sums = psr_alloc_array(((size_t)size[0] + 1) * ((size_t)size[1] + 1), sizeof *sums);

	if (sums == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to compare pictures of %ux%u", size[0], size[1]);
	sum_up(sums, map, size, for_infinite);
	find_window(box, sums, size);
	shrink(box, map, size[0], for_infinite);
	psr_free(sums);
	return PSR_OK;
}

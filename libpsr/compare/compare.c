#include "compare.h"
#include <math.h>
#include <stdlib.h>

double compare_psnr(const uint8_t *rgb, const uint8_t *reference, const uint8_t *covered, uint64_t n_pixels)
{
	uint64_t sum = 0, n = 0;

	for (uint64_t i = 0; i < n_pixels; i++) {
		if (covered != NULL && !covered[i])
			continue;
		for (int c = 0; c < 3; c++) {
			const int d = rgb[3 * i + (uint64_t)c] - reference[3 * i + (uint64_t)c];

			sum += (uint64_t)(d * d);
		}
		n += 3;
	}
	return sum ? 10 * log10(255.0 * 255.0 * (double)n / (double)sum) : INFINITY;
}

static int most_codes(const uint8_t *a, const uint8_t *b)
{
	int most = 0;

	for (int c = 0; c < 3; c++)
		most = abs(a[c] - b[c]) > most ? abs(a[c] - b[c]) : most;
	return most;
}

double compare_off(const uint8_t *rgb, const uint8_t *reference, uint64_t n_pixels, unsigned codes)
{
	uint64_t n_off = 0;

	for (uint64_t i = 0; i < n_pixels; i++)
		n_off += most_codes(rgb + 3 * i, reference + 3 * i) > (int)codes;
	return n_pixels != 0 ? (double)n_off / (double)n_pixels : 0;
}

double compare_depth_rmse(const float *depth, const float *reference, uint64_t n_pixels)
{
	double sum = 0, least = INFINITY, most = -INFINITY;
	uint64_t n_both = 0, n_one = 0;

	for (uint64_t i = 0; i < n_pixels; i++) {
		const double a = (double)depth[i], b = (double)reference[i];

		if (isfinite(b)) {
			least = fmin(least, b);
			most = fmax(most, b);
		}
		if (isfinite(a) && isfinite(b)) {
			sum += (a - b) * (a - b);
			n_both++;
		} else if (isfinite(a) || isfinite(b)) {
			n_one++;
		}
	}
	if (n_both + n_one == 0)
		return 0;
	if (n_one > 0) {
		if (!(most > least))
			return INFINITY;
		sum += (double)n_one * (most - least) * (most - least);
	}
	return sqrt(sum / (double)(n_both + n_one));
}

void compare_map_color(float *map, const uint8_t *rgb, const uint8_t *reference, uint64_t n_pixels)
{
	for (uint64_t i = 0; i < n_pixels; i++)
		map[i] = (float)most_codes(rgb + 3 * i, reference + 3 * i);
}

void compare_map_depth(float *map, const float *depth, const float *reference, uint64_t n_pixels)
{
	for (uint64_t i = 0; i < n_pixels; i++)
		map[i] = isfinite(depth[i]) != isfinite(reference[i]) ? INFINITY
		         : isfinite(depth[i])                         ? fabsf(depth[i] - reference[i])
		                                                      : 0;
}

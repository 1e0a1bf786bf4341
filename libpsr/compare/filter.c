#include "filter.h"
#include <assert.h>
#include <math.h>
#include <stddef.h>

void filter_gaussian(struct filter *filter, double sigma, int radius)
{
	double weight[2 * FILTER_MOST_RADIUS + 1], sum = 0;

	assert(radius >= 0 && radius <= FILTER_MOST_RADIUS);
	filter->radius = radius;
	for (int i = -radius; i <= radius; i++)
		sum += weight[i + radius] = exp(-i * i / (2 * sigma * sigma));
	for (int i = 0; i <= 2 * radius; i++)
		filter->weight[i] = (float)(weight[i] / sum);
}

static int64_t clamp(int64_t at, int64_t n)
{
	return at < 0 ? 0 : at >= n ? n - 1 : at;
}

void filter_run(float *out, const float *in, const struct filter_plane *plane, const struct filter *across,
                const struct filter *down)
{
	const int64_t width = plane->width, height = plane->height;

	for (int64_t y = 0; y < height; y++)
		for (int64_t x = 0; x < width; x++) {
			float sum = 0;

			for (int i = -across->radius; i <= across->radius; i++)
				sum += across->weight[i + across->radius] * in[y * width + clamp(x + i, width)];
			plane->scratch[y * width + x] = sum;
		}
	for (int64_t y = 0; y < height; y++)
		for (int64_t x = 0; x < width; x++) {
			float sum = 0;

			for (int i = -down->radius; i <= down->radius; i++)
				sum += down->weight[i + down->radius] * plane->scratch[clamp(y + i, height) * width + x];
			out[y * width + x] = sum;
		}
}

/* Separable filters of planes of floats. */
#ifndef PSR_COMPARE_FILTER_H
#define PSR_COMPARE_FILTER_H

#include <stdint.h>

#define FILTER_MOST_RADIUS 10

struct filter {
	int radius; /* 0..FILTER_MOST_RADIUS */
	float weight[2 * FILTER_MOST_RADIUS + 1];
};

/* Makes a Gaussian whose weights have the sum 1. sigma: pixels. */
void filter_gaussian(struct filter *filter, double sigma, int radius);

/* Filters a plane of width x height by `across` along its rows, and by `down` along its columns; outside of the plane
 * is its nearest pixel. `out` and `scratch` are planes of their own. */
struct filter_plane {
	uint32_t width, height;
	float *scratch;
};
void filter_run(float *out, const float *in, const struct filter_plane *plane, const struct filter *across,
                const struct filter *down);

#endif

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/srgb.h"
#include "measure.h"

#define RAYS 4 /* along the side of a pixel */

static int largest_difference(const uint8_t *a, const uint8_t *b)
{
	int most = 0;
	for (int c = 0; c < 3; c++) {
		int d = abs(a[c] - b[c]);
		most = d > most ? d : most;
	}
	return most;
}

/* Returns the difference from the most similar truth of the 3x3 neighbourhood; -1 unless all nine pixels have a
 * depth. */
static int difference_at(const uint8_t *rgb, const uint8_t *truth, const float *depth, uint32_t width, uint32_t x,
                         uint32_t y)
{
	const uint8_t *own = rgb + 3 * ((size_t)y * width + x);
	int least = 255;
	for (uint32_t j = y - 1; j <= y + 1; j++)
		for (uint32_t i = x - 1; i <= x + 1; i++) {
			size_t at = (size_t)j * width + i;
			int d;
			if (!isfinite(depth[at]))
				return -1;
			d = largest_difference(own, truth + 3 * at);
			least = d < least ? d : least;
		}
	return least;
}

static void add_up(struct psr_color_accuracy *out, const uint8_t *rgb, const uint8_t *truth, const float *depth,
                   uint32_t width, uint32_t height)
{
	uint64_t sum = 0;
	memset(out, 0, sizeof *out);
	for (uint32_t y = 1; y + 1 < height; y++)
		for (uint32_t x = 1; x + 1 < width; x++) {
			int d = difference_at(rgb, truth, depth, width, x, y);
			if (d < 0)
				continue;
			out->n_compared++;
			out->n_wrong += d > PSR_COLOR_WRONG;
			sum += (uint64_t)d;
		}
	out->mean = out->n_compared ? (double)sum / (double)out->n_compared : 0;
}

/* Averages the rays of each pixel in linear light; takes the depth of one of them, infinite if any meets nothing,
 * or a colour that is not steady. */
static void average(const float *ray_depth, const uint8_t (*ray_color)[4], float *depth, uint8_t *rgb,
                    uint32_t width, uint32_t height)
{
	for (size_t i = 0; i < (size_t)width * height; i++) {
		size_t first = (i / width * width * RAYS + i % width) * RAYS;
		float sum[3] = { 0 };
		for (size_t k = 0; k < RAYS * RAYS; k++) {
			size_t at = first + k / RAYS * RAYS * width + k % RAYS;
			if (k == 0 || !isfinite(ray_depth[at]))
				depth[i] = ray_depth[at];
			if (ray_color[at][3] > PSR_COLOR_WRONG)
				depth[i] = INFINITY;
			for (int c = 0; c < 3; c++)
				sum[c] += psr_srgb_to_linear[ray_color[at][c]];
		}
		for (int c = 0; c < 3; c++)
			rgb[3 * i + (size_t)c] = psr_linear_to_srgb(sum[c] / (RAYS * RAYS));
	}
}

int psr_accuracy_measure_color(struct psr_color_accuracy *out, const struct psr_truth_shot *shot, const uint8_t *rgb,
                               struct psr_error *err)
{
	const uint32_t width = shot->width, height = shot->height;
	size_t n = (size_t)width * height;
	float *depth = psr_alloc_array(n, sizeof *depth), *ray_depth = psr_alloc_array(n, RAYS * RAYS * sizeof *ray_depth);
	uint8_t *color = psr_alloc_array(n, 3), (*ray_color)[4] = psr_alloc_array(n, RAYS * RAYS * sizeof *ray_color);
	int rc;
	if (depth == NULL || color == NULL || ray_depth == NULL || ray_color == NULL)
		rc = psr_fail(err, PSR_ERR_MEMORY, "no memory to measure %ux%u pixels", width, height);
	else
		rc = psr_truth_draw(shot, RAYS, ray_depth, NULL, ray_color, err);
	if (rc == PSR_OK) {
		average(ray_depth, ray_color, depth, color, width, height);
		add_up(out, rgb, color, depth, width, height);
	}
	psr_free(depth);
	psr_free(color);
	psr_free(ray_depth);
	psr_free(ray_color);
	return rc;
}

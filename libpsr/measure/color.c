#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "../base/mem.h"
#include "psr/measure.h"

static int largest_difference(const uint8_t *a, const uint8_t *b)
{
	int most = 0;

	for (int c = 0; c < 3; c++) {
		int d = abs(a[c] - b[c]);

		most = d > most ? d : most;
	}
	return most;
}

/* Difference from the most similar truth of the 3x3 neighbourhood; -1 unless all nine pixels are of the object. */
static int difference_at(const uint8_t *rgb, const uint8_t *truth, const float *depth, uint32_t width, uint32_t x, uint32_t y)
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

int psr_accuracy_measure_color(struct psr_color_accuracy *out, struct psr_truth *truth, const struct psr_camera *camera,
                               uint32_t width, uint32_t height, const uint8_t *rgb, int n_threads, struct psr_error *err)
{
	size_t n = (size_t)width * height;
	float *depth = psr_alloc_array(n, sizeof *depth);
	uint8_t *color = psr_alloc_array(n, 3);
	int rc;

	if (depth == NULL || color == NULL)
		rc = psr_fail(err, PSR_ERR_MEMORY, "no memory to measure %ux%u pixels", width, height);
	else
		rc = psr_truth_draw(truth, camera, width, height, 1, n_threads, depth, NULL, color, err);
	if (rc == PSR_OK)
		add_up(out, rgb, color, depth, width, height);
	psr_free(depth);
	psr_free(color);
	return rc;
}

#include "base/mem.h"
#include "compare.h"
#include "filter.h"

#define SIGMA 1.5
#define RADIUS 5
#define C1 (0.01 * 255 * 0.01 * 255)
#define C2 (0.03 * 255 * 0.03 * 255)

enum { A, B, AA, BB, AB, SCRATCH, N_PLANES };

static float luma(const uint8_t *rgb)
{
	return 0.299f * (float)rgb[0] + 0.587f * (float)rgb[1] + 0.114f * (float)rgb[2];
}

static int radius_for(uint32_t side)
{
	const uint32_t most = (side - 1) / 2;

	return most < RADIUS ? (int)most : RADIUS;
}

static double similarity(float *const plane[N_PLANES], size_t i)
{
	const double a = (double)plane[A][i], b = (double)plane[B][i];
	const double var_a = (double)plane[AA][i] - a * a, var_b = (double)plane[BB][i] - b * b;
	const double both = (double)plane[AB][i] - a * b;

	return (2 * a * b + C1) * (2 * both + C2) / ((a * a + b * b + C1) * (var_a + var_b + C2));
}

/* The five means a window needs, of the whole picture. `in` has room for a plane. */
static void filter_means(float *const plane[N_PLANES], float *in, const uint8_t *rgb, const uint8_t *reference,
                         const struct filter_plane *size)
{
	const size_t n = (size_t)size->width * size->height;
	struct filter across, down;

	filter_gaussian(&across, SIGMA, radius_for(size->width));
	filter_gaussian(&down, SIGMA, radius_for(size->height));
	for (int k = A; k <= AB; k++) {
		for (size_t i = 0; i < n; i++) {
			const float a = luma(rgb + 3 * i), b = luma(reference + 3 * i);

			in[i] = k == A ? a : k == B ? b : k == AA ? a * a : k == BB ? b * b : a * b;
		}
		filter_run(plane[k], in, size, &across, &down);
	}
}

int compare_ssim(double *out, const uint8_t *rgb, const uint8_t *reference, const uint32_t size[2],
                 struct psr_error *err)
{
	const size_t n = (size_t)size[0] * size[1];
	const uint32_t rx = (uint32_t)radius_for(size[0]), ry = (uint32_t)radius_for(size[1]);
	float *memory = psr_alloc_array(n, (N_PLANES + 1) * sizeof *memory), *plane[N_PLANES];
	double sum = 0;
	uint64_t n_windows = 0;

	if (memory == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to compare pictures of %ux%u", size[0], size[1]);
	for (size_t k = 0; k < N_PLANES; k++)
		plane[k] = memory + k * n;
	filter_means(plane, memory + N_PLANES * n, rgb, reference,
	             &(struct filter_plane){ size[0], size[1], plane[SCRATCH] });
	for (uint32_t y = ry; y + ry < size[1]; y++)
		for (uint32_t x = rx; x + rx < size[0]; x++) {
			sum += similarity(plane, (size_t)y * size[0] + x);
			n_windows++;
		}
	*out = sum / (double)n_windows;
	psr_free(memory);
	return PSR_OK;
}

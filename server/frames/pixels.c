#include <assert.h>
#include <math.h>
#include <string.h>
#include "pixels.h"

int pixels_are_all(const uint8_t *one, const uint8_t *pixels, size_t n, size_t pixel_bytes)
{
	/* All pixels equal one if the first does, and each equals the one before. */
	return memcmp(pixels, one, pixel_bytes) == 0 && memcmp(pixels, pixels + pixel_bytes, (n - 1) * pixel_bytes) == 0;
}

void pixels_depth_range(double *least, double *most, const float *z, size_t n)
{
	float min = INFINITY, max = -INFINITY;

	for (size_t i = 0; i < n; i++) {
		min = z[i] < min ? z[i] : min;
		max = z[i] > max && z[i] < INFINITY ? z[i] : max;
	}
	*least = (double)min;
	*most = (double)max;
}

void pixels_nearest(float *out, const float *upper, const float *lower, uint32_t width)
{
	for (uint32_t x = 0; x < width; x += 2) {
		const uint32_t right = x + 1 < width ? x + 1 : x;
		const float a = upper[x] < upper[right] ? upper[x] : upper[right];
		const float b = lower[x] < lower[right] ? lower[x] : lower[right];

		out[x / 2] = a < b ? a : b;
	}
}

/* Inlined once for each size, which leaves plain moves. */
static inline void enlarge_row(uint8_t *out, const uint8_t *in, uint32_t width, size_t pixel, uint32_t scale)
{
	for (uint32_t x = 0; x < width; x++)
		for (uint32_t k = 0; k < scale; k++)
			memcpy(out + ((size_t)x * scale + k) * pixel, in + x * pixel, pixel);
}

void pixels_enlarge(uint8_t *out, const uint8_t *in, uint32_t width, uint32_t height, size_t pixel_bytes,
                    uint32_t scale)
{
	const size_t row = width * pixel_bytes, large = row * scale;

	for (uint32_t y = 0; y < height; y++, in += row, out += scale * large) {
		switch (pixel_bytes) {
		case 1: enlarge_row(out, in, width, 1, scale); break;
		case 2: enlarge_row(out, in, width, 2, scale); break;
		case 3: enlarge_row(out, in, width, 3, scale); break;
		case 4: enlarge_row(out, in, width, 4, scale); break;
		case 6: enlarge_row(out, in, width, 6, scale); break;
		case 8: enlarge_row(out, in, width, 8, scale); break;
		default: assert(!"pixels have 1, 2, 3, 4, 6 or 8 bytes");
		}
		for (uint32_t k = 1; k < scale; k++)
			memcpy(out + k * large, out, large);
	}
}

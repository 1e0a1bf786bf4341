/* Pixels of strips, written: into a picture, into the linear picture of a fill, and depths. */
#ifndef PSR_SIMD_STRIP_WRITE_H
#define PSR_SIMD_STRIP_WRITE_H

#include <string.h>
#include "base/maths.h"
#include "strip_parts.h"

static inline void write_linear(const struct strip *strip, const struct strip_target *target, uint32_t n)
{
	const uint16_t *const from[3] = { strip->r, strip->g, strip->b };
	uint16_t *const to[3] = { target->r, target->g, target->b };
	const struct strip_pixels *p = strip->pixels;
	const size_t first = (size_t)p->y * target->width + p->x0;

	for (int c = 0; c < 3; c++) {
		uint16_t row[STRIP];

		for (uint32_t x = 0; x < n; x++)
			row[x] = target->background[c];
		for (uint32_t i = 0; i < p->n; i++)
			row[p->x[i]] = from[c][i];
		for (uint32_t x = 0; x < n; x += STRIP_BRICK)
			if (target->wants[x / STRIP_BRICK])
				memcpy(to[c] + first + x, row + x, 2 * (n - x < STRIP_BRICK ? n - x : STRIP_BRICK));
	}
}

static inline void strip_write(const struct strip *strip, const struct strip_target *target, uint32_t n)
{
	const struct strip_pixels *p = strip->pixels;

	if (target->rgb) {
		const uint16_t *empty = target->background;
		uint8_t *to = target->rgb + 3 * ((size_t)p->y * target->width + p->x0);
		uint32_t pixel[STRIP];

		for (uint32_t x = 0; x < n; x++)
			pixel[x] = pixel_of(target->srgb, empty[0], empty[1], empty[2]);
		for (uint32_t i = 0; i < p->n; i++)
			pixel[p->x[i]] = pixel_of(target->srgb, strip->r[i], strip->g[i], strip->b[i]);
		for (uint32_t x = 0; x + 1 < n; x++) /* writes a byte of the next pixel, too */
			memcpy(to + 3 * (size_t)x, &pixel[x], 4);
		memcpy(to + 3 * (size_t)(n - 1), &pixel[n - 1], 3);
	}
	if (target->wants)
		write_linear(strip, target, n);
}

static inline void depth_row(float *depth, const uint64_t *word, uint32_t n, int exponent)
{
	float factor[2];

	psr_power_factors(factor, exponent);
	for (uint32_t i = 0; i < n; i++)
		depth[i] = psr_float_from_bits((uint32_t)(word[i] >> 32)) * factor[0] * factor[1];
}

#endif

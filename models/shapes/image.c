#include "image.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/random.h"

static double mix(double a, double b, double t)
{
	return a + (b - a) * t;
}

static void put_color(uint8_t *rgb, uint32_t a, uint32_t b, double t)
{
	t = t < 0 ? 0 : t > 1 ? 1 : t;
	for (int k = 0; k < 3; k++)
		rgb[k] = (uint8_t)(mix(a >> (16 - 8 * k) & 255, b >> (16 - 8 * k) & 255, t) + 0.5);
}

static double lattice(uint64_t seed, uint32_t x, uint32_t y)
{
	uint64_t state = seed ^ (uint64_t)x << 40 ^ (uint64_t)y << 20;

	return random_in(&state, 0, 1);
}

/* Value noise with nx x ny knots, which repeats: u and v in [0, 1). */
static double noise(uint64_t seed, double u, double v, uint32_t nx, uint32_t ny)
{
	double x = u * nx, y = v * ny;
	uint32_t i = (uint32_t)x, j = (uint32_t)y;
	double s = x - i, t = y - j;

	s = s * s * (3 - 2 * s);
	t = t * t * (3 - 2 * t);
	return mix(mix(lattice(seed, i % nx, j % ny), lattice(seed, (i + 1) % nx, j % ny), s),
	           mix(lattice(seed, i % nx, (j + 1) % ny), lattice(seed, (i + 1) % nx, (j + 1) % ny), s), t);
}

static double wood_tone(uint64_t seed, double u, double v)
{
	double ring = 5 * u + 0.9 * noise(seed, u, v, 3, 2), wave = ring - floor(ring);

	/* a year's ring darkens slowly and ends at once, pores are short and dark */
	wave = wave < 0.8 ? wave / 0.8 : (1 - wave) / 0.2;
	return 0.5 * (1 - wave * wave) + 0.3 * noise(seed + 1, u, v, 64, 4) + 0.2 * noise(seed + 2, u, v, 16, 3);
}

uint8_t *image_wood(uint32_t size, uint32_t dark, uint32_t light, uint64_t seed)
{
	uint8_t *rgb = malloc((size_t)3 * size * size);

	for (uint32_t i = 0; rgb != NULL && i < size * size; i++)
		put_color(rgb + 3 * i, dark, light, wood_tone(seed, (double)(i % size) / size, (double)(i / size) / size));
	return rgb;
}

uint8_t *image_checker(uint32_t size, uint32_t a, uint32_t b)
{
	uint8_t *rgb = malloc((size_t)3 * size * size);

	for (uint32_t i = 0; rgb != NULL && i < size * size; i++)
		put_color(rgb + 3 * i, a, b, (i % size * 2 / size ^ i / size * 2 / size) & 1);
	return rgb;
}

uint8_t *image_planks(uint32_t size, uint32_t wood, uint32_t seam, uint64_t seed)
{
	uint8_t *rgb = malloc((size_t)3 * size * size);

	for (uint32_t i = 0; rgb != NULL && i < size * size; i++) {
		uint32_t x = i % size, plank = x * 4 / size, at = x - plank * size / 4;
		double u = (double)x / size, v = (double)(i / size) / size;
		double tone = 0.3 * lattice(seed, plank, 0) + 0.35 * noise(seed + 1, u, v, 64, 4);

		put_color(rgb + 3 * i, wood, seam, at < size / 64 ? 1 : 0.5 * tone);
	}
	return rgb;
}

uint8_t *image_leaf(uint32_t size, uint32_t blade, uint32_t vein)
{
	uint8_t *rgb = malloc((size_t)3 * size * size);

	for (uint32_t i = 0; rgb != NULL && i < size * size; i++) {
		double u = fabs((i % size + 0.5) / size - 0.5), v = (i / size + 0.5) / size;
		double side = 9 * (v - 0.7 * u), away = fabs(side - floor(side + 0.5)) / 9, rib = 0.022 * (1.2 - v);
		double t = u < rib ? 1 : away < 0.008 * (1 - 1.6 * u) ? 0.6 : 0.15 * noise(3, u, v, 16, 16);

		put_color(rgb + 3 * i, blade, vein, t);
	}
	return rgb;
}

/* --- PNG -------------------------------------------------------------------------------------------------------- */

/* A deflate block stores up to 65535 bytes. */
static uint32_t png_rows(uint32_t size)
{
	return 65535 / (3 * size + 1);
}

static uint32_t png_data(uint32_t size)
{
	uint32_t blocks = (size + png_rows(size) - 1) / png_rows(size);

	return 2 + 5 * blocks + size * (3 * size + 1) + 4;
}

size_t image_png_bytes(uint32_t size)
{
	return (size_t)8 + 25 + 12 + png_data(size) + 12;
}

static void put_be32(uint8_t *out, uint32_t v)
{
	for (int k = 0; k < 4; k++)
		out[k] = (uint8_t)(v >> (24 - 8 * k));
}

static uint32_t crc32_of(const uint8_t *bytes, size_t n)
{
	uint32_t crc = UINT32_MAX;

	for (size_t i = 0; i < n; i++) {
		crc ^= bytes[i];
		for (int k = 0; k < 8; k++)
			crc = crc >> 1 ^ (0xedb88320u & -(crc & 1));
	}
	return ~crc;
}

/* Completes a chunk whose n bytes of data stand at out + 8 already. Returns the end of the chunk. */
static uint8_t *put_chunk(uint8_t *out, const char type[4], uint32_t n)
{
	put_be32(out, n);
	memcpy(out + 4, type, 4);
	put_be32(out + 8 + n, crc32_of(out + 4, (size_t)n + 4));
	return out + 12 + n;
}

static void put_rows(uint8_t *out, uint32_t size, const uint8_t *rgb)
{
	uint32_t a = 1, b = 0, per_block = png_rows(size), row_bytes = 3 * size + 1;

	*out++ = 0x78;
	*out++ = 0x01;
	for (uint32_t row = 0; row < size; row++) {
		if (row % per_block == 0) {
			uint32_t rows = size - row < per_block ? size - row : per_block, n = rows * row_bytes;

			*out++ = row + rows == size;
			*out++ = (uint8_t)n;
			*out++ = (uint8_t)(n >> 8);
			*out++ = (uint8_t)~n;
			*out++ = (uint8_t)(~n >> 8);
		}
		*out = 0; /* no filter */
		memcpy(out + 1, rgb + (size_t)row * 3 * size, (size_t)3 * size);
		for (uint32_t i = 0; i < row_bytes; i++) {
			a = (a + *out++) % 65521;
			b = (b + a) % 65521;
		}
	}
	put_be32(out, b << 16 | a);
}

void image_png(uint8_t *out, uint32_t size, const uint8_t *rgb)
{
	static const uint8_t form[5] = { 8, 2, 0, 0, 0 };

	memcpy(out, "\x89PNG\r\n\x1a\n", 8);
	out += 8;
	put_be32(out + 8, size);
	put_be32(out + 12, size);
	memcpy(out + 16, form, sizeof form);
	out = put_chunk(out, "IHDR", 13);
	put_rows(out + 8, size, rgb);
	out = put_chunk(out, "IDAT", png_data(size));
	put_chunk(out, "IEND", 0);
}

#include <assert.h>
#include <stddef.h>
#include "wire.h"

/* Byte differences in place; bytes form a single plane. */
static void filter_bytes(uint8_t *out, const uint8_t *in, size_t row, uint32_t height, unsigned c)
{
	for (uint32_t y = 0; y < height; y++, in += row, out += row) {
		for (unsigned i = 0; i < c; i++)
			out[i] = (uint8_t)(in[i] - (y ? *(in + i - row) : 0));
		for (size_t i = c; i < row; i++)
			out[i] = (uint8_t)(in[i] - in[i - c]);
	}
}

static void unfilter_bytes(uint8_t *out, const uint8_t *in, size_t row, uint32_t height, unsigned c)
{
	for (uint32_t y = 0; y < height; y++, in += row, out += row) {
		for (unsigned i = 0; i < c; i++)
			out[i] = (uint8_t)(in[i] + (y ? *(out + i - row) : 0));
		for (size_t i = c; i < row; i++)
			out[i] = (uint8_t)(in[i] + out[i - c]);
	}
}

static inline uint64_t load(const uint8_t *p, unsigned b)
{
	uint64_t v = 0;

#pragma GCC unroll 8
	for (unsigned i = 0; i < b; i++)
		v |= (uint64_t)p[i] << 8 * i;
	return v;
}

static inline void store(uint8_t *p, uint64_t v, unsigned b)
{
#pragma GCC unroll 8
	for (unsigned i = 0; i < b; i++)
		p[i] = (uint8_t)(v >> 8 * i);
}

/* Moves byte k of component i to k * n + i of the row. Inlined once for each b, which leaves plain loads. */
static inline void split(uint8_t *out, uint64_t d, size_t n, unsigned b)
{
#pragma GCC unroll 8
	for (unsigned k = 0; k < b; k++)
		out[k * n] = (uint8_t)(d >> 8 * k);
}

static inline uint64_t join(const uint8_t *in, size_t n, unsigned b)
{
	uint64_t d = 0;

#pragma GCC unroll 8
	for (unsigned k = 0; k < b; k++)
		d |= (uint64_t)in[k * n] << 8 * k;
	return d;
}

/* n components of b bytes a row, c a pixel. */
static inline void filter_wide(uint8_t *out, const uint8_t *in, size_t n, uint32_t height, unsigned c, unsigned b)
{
	for (uint32_t y = 0; y < height; y++, in += n * b, out += n * b) {
		for (size_t i = 0; i < c; i++)
			split(out + i, load(in + i * b, b) - (y ? load(in + i * b - n * b, b) : 0), n, b);
		for (size_t i = c; i < n; i++)
			split(out + i, load(in + i * b, b) - load(in + (i - c) * b, b), n, b);
	}
}

static inline void unfilter_wide(uint8_t *out, const uint8_t *in, size_t n, uint32_t height, unsigned c, unsigned b)
{
	for (uint32_t y = 0; y < height; y++, in += n * b, out += n * b) {
		for (size_t i = 0; i < c; i++)
			store(out + i * b, join(in + i, n, b) + (y ? load(out + i * b - n * b, b) : 0), b);
		for (size_t i = c; i < n; i++)
			store(out + i * b, join(in + i, n, b) + load(out + (i - c) * b, b), b);
	}
}

void psr_filter_rows(uint8_t *out, const uint8_t *in, uint32_t width, uint32_t height, unsigned n_components,
                     unsigned component_bytes)
{
	size_t n = (size_t)width * n_components;

	switch (component_bytes) {
	case 1: filter_bytes(out, in, n, height, n_components); break;
	case 2: filter_wide(out, in, n, height, n_components, 2); break;
	case 4: filter_wide(out, in, n, height, n_components, 4); break;
	case 8: filter_wide(out, in, n, height, n_components, 8); break;
	default: assert(!"components have 1, 2, 4 or 8 bytes");
	}
}

void psr_unfilter_rows(uint8_t *out, const uint8_t *in, uint32_t width, uint32_t height, unsigned n_components,
                       unsigned component_bytes)
{
	size_t n = (size_t)width * n_components;

	switch (component_bytes) {
	case 1: unfilter_bytes(out, in, n, height, n_components); break;
	case 2: unfilter_wide(out, in, n, height, n_components, 2); break;
	case 4: unfilter_wide(out, in, n, height, n_components, 4); break;
	case 8: unfilter_wide(out, in, n, height, n_components, 8); break;
	default: assert(!"components have 1, 2, 4 or 8 bytes");
	}
}

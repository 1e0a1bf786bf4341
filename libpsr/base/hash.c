#include <assert.h>
#include <xxhash.h>
#include "hash.h"
#include "psr/frame.h"

#define MAX_STRIPS (PSR_MAX_SIDE / HASH_STRIP_ROWS)

uint64_t hash_strip(const void *pixels, size_t n_bytes)
{
	return XXH64(pixels, n_bytes, 0);
}

uint64_t hash_join(const uint64_t *strip, size_t n)
{
	uint8_t bytes[8 * MAX_STRIPS];

	assert(n <= MAX_STRIPS);
	for (size_t i = 0; i < 8 * n; i++)
		bytes[i] = (uint8_t)(strip[i / 8] >> 8 * (i % 8));
	return XXH64(bytes, 8 * n, 0);
}

uint64_t hash_plane(const void *pixels, size_t row_bytes, uint32_t height)
{
	uint64_t strip[MAX_STRIPS];
	size_t n = 0;

	for (uint32_t y = 0; y < height; y += HASH_STRIP_ROWS) {
		const uint32_t rows = height - y < HASH_STRIP_ROWS ? height - y : HASH_STRIP_ROWS;

		strip[n++] = hash_strip((const uint8_t *)pixels + y * row_bytes, rows * row_bytes);
	}
	return hash_join(strip, n);
}

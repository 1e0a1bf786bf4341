/* Numbers of cubic cells, and their hash: the last step of MurmurHash3 (Appleby 2011), which uses all bits, so that
 * cells in a row of any direction spread over the table. */
#ifndef PSR_BASE_CELL_H
#define PSR_BASE_CELL_H

#include <stddef.h>
#include <stdint.h>

/* Rounds down a double that fits an int. As fast as truncation; floor() takes a dozen instructions before SSE4.1. */
static inline int cell_floor(double x)
{
	int i = (int)x;

	return i - (x < i);
}

/* 21 bits of each coordinate. */
static inline uint64_t cell_key(int x, int y, int z)
{
	return (uint64_t)(x & 0x1fffff) | (uint64_t)(y & 0x1fffff) << 21 | (uint64_t)(z & 0x1fffff) << 42;
}

/* n: a power of two. */
static inline size_t cell_place(uint64_t key, size_t n)
{
	key ^= key >> 33;
	key *= UINT64_C(0xff51afd7ed558ccd);
	key ^= key >> 33;
	key *= UINT64_C(0xc4ceb9fe1a85ec53);
	key ^= key >> 33;
	return (size_t)key & (n - 1);
}

#endif

/* Cubic cells of space, and their keys in tables. */
#ifndef PSR_BASE_CELL_H
#define PSR_BASE_CELL_H

#include <math.h>
#include <stdint.h>

/* Rounds down a double that fits an int. As fast as truncation; floor() takes a dozen instructions before SSE4.1. */
static inline int cell_floor(double x)
{
	int i = (int)x;

	return i - (x < i);
}

/* Finds the cell of this width that holds p. */
static inline void cell_of(const float p[3], double width, int at[3])
{
	for (int k = 0; k < 3; k++)
		at[k] = cell_floor((double)p[k] / width);
}

/* Packs 21 bits of each coordinate. */
static inline uint64_t cell_key(int x, int y, int z)
{
	return (uint64_t)(x & 0x1fffff) | (uint64_t)(y & 0x1fffff) << 21 | (uint64_t)(z & 0x1fffff) << 42;
}

/* Returns the axis along which n is longest, and its sign: 1 to 6; 0 if n has no direction. */
static inline unsigned cell_facing(const float n[3])
{
	unsigned axis = 0;

	for (unsigned k = 1; k < 3; k++)
		axis = fabsf(n[k]) > fabsf(n[axis]) ? k : axis;
	return n[axis] != 0 ? 1 + 2 * axis + (n[axis] < 0) : 0;
}

/* Packs a cell and the axis that something in it faces: 20 bits a coordinate; the topmost bit is 0. */
static inline uint64_t cell_facing_key(const int at[3], unsigned facing)
{
	uint64_t key = facing;

	for (int k = 0; k < 3; k++)
		key = key << 20 | (uint64_t)(at[k] & 0xfffff);
	return key;
}

#endif

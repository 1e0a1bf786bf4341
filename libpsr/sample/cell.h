/* Where a cell's number goes in a table: all of its bits count, so that cells in a row of any direction spread
 * (the last step of MurmurHash3, Appleby 2011). */
#ifndef PSR_SAMPLE_CELL_H
#define PSR_SAMPLE_CELL_H

#include <stddef.h>
#include <stdint.h>

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

/* The subdivided sphere of directions: quantised normals, triangles of the visibility masks, projections.
 *
 * The sphere is cut into octants, and each spherical triangle into four by the midpoints of its sides ([G] 5.1):
 * six levels give 32,768 triangles, whose centres are the unit vectors that samples can have as normals ([G] table
 * 5.1). The index is nested: 3 bits of octant, then 2 bits a level, and child 0 is the one in the middle, so that
 * dropping low bits gives the index of the enclosing triangle ([B] 4.1) and `index >> 8` is one of the 128
 * triangles of [G] 6.3.
 *
 *   octant bits: 1 for x < 0, 2 for y < 0, 4 for z < 0 (a zero counts as positive)
 *   corners of an octant's triangle: a = (+-1,0,0), b = (0,+-1,0), c = (0,0,+-1)
 *   children: 0 = (bc, ca, ab), 1 = (a, ab, ca), 2 = (ab, b, bc), 3 = (ca, bc, c), where ab is the midpoint of a and b
 *
 * Only additions, multiplications, true division and sqrt in double: the same table on every machine. */
#ifndef PSR_BASE_DIRECTION_H
#define PSR_BASE_DIRECTION_H

#include <stdint.h>

#define PSR_DIRECTIONS 32768
#define PSR_MASK_TRIANGLES 128
#define PSR_PROJECTIONS 32

/* Returns the index of the triangle that holds v, which may have any length. A vector with NaN or of length 0 gives
 * 0. */
uint16_t psr_direction_encode(const float v[3]);

/* Returns the unit vectors by index: PSR_DIRECTIONS rows, made on first use (thread-safe), never freed. */
const float (*psr_direction_table(void))[3];

/* Returns the same vectors in one word each: x, y and z as integers of 16 bits, 32,767 times as long, x lowest. */
const uint64_t *psr_direction_words(void);

/* Returns the same vectors as integers of 10 bits, 511 times as long, x lowest: no component is off by more than
 * 1/1022. */
const uint32_t *psr_direction_tens(void);

/* Computes the centre (normalised sum of the corners) of triangle `index` of the sphere subdivided `level` times
 * (0..6): index < 8 * 4^level. The 32 projections of [G] 5.1 are level 1, the 128 triangles of [G] 6.3 level 2. */
void psr_direction_center(int level, unsigned index, double v[3]);

/* Computes the corners of the same triangle, each of unit length. */
void psr_direction_corners(int level, unsigned index, double corner[3][3]);

/* Makes a right-handed orthonormal basis whose z is `dir` (unit length): rows x, y, z. The lattices of projections use
 * it. */
void psr_direction_basis(const double dir[3], double basis[3][3]);

#endif

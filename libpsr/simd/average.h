/* Pixels of refined pictures: the means of their sub-pixels, 2^pass a side. */
#ifndef PSR_SIMD_AVERAGE_H
#define PSR_SIMD_AVERAGE_H

#include <stdint.h>

#define AVERAGE_MOST 2048 /* sub-pixels a row of a call */

/* 16-bit linear light of the roots of base/root.h: light is clamped when it is averaged, so that highlights smaller than
 * a pixel keep what they send. Of n pixels with sub-pixels `stride` values from a row to the next; n << pass is at most
 * AVERAGE_MOST. */
typedef void average_light_fn(uint16_t *light, const uint16_t *root, uint32_t stride, uint32_t n, unsigned pass);

/* The same of pass 1 with the sub-pixels around: along rows and columns, of 32 shares the pixel's own two have 15 and
 * those before and behind one. row: the four rows, at the pixels' own first column; is_first, is_last: there is no
 * column before the first pixel, behind the last one, and their own is taken twice. */
typedef void average_around_fn(uint16_t *light, const uint16_t *const row[4], uint32_t n, int is_first, int is_last);

/* The least of the depths of sub-pixels, as of average_light. */
typedef void average_depth_fn(float *depth, const float *from, uint32_t stride, uint32_t n, unsigned pass);

#endif

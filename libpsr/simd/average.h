/* Pixels of refined pictures: the means of their sub-pixels, 2^pass a side. */
#ifndef PSR_SIMD_AVERAGE_H
#define PSR_SIMD_AVERAGE_H

#include <stdint.h>

#define AVERAGE_MOST 2048 /* sub-pixels a row of a call */

/* Sub-pixels of n pixels: `stride` values from a row to the next. n << pass is at most AVERAGE_MOST. */
/* 16-bit linear light of the roots of base/root.h: light is clamped when it is averaged, so that highlights smaller than a
 * pixel keep what they send. */
typedef void average_light_fn(uint16_t *light, const uint16_t *root, uint32_t stride, uint32_t n, unsigned pass);
/* The least of their depths. */
typedef void average_depth_fn(float *depth, const float *from, uint32_t stride, uint32_t n, unsigned pass);

#endif

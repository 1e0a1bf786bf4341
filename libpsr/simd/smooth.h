/* Kernel of anti-aliasing ([G] 9.1.1). */
#ifndef PSR_SIMD_SMOOTH_H
#define PSR_SIMD_SMOOTH_H

#include <stdint.h>
#include "zstack.h"

#define SMOOTH_WIDTH 256

#define SMOOTH_REACH 3 /* pixels around one that it depends on */

/* A finished picture, and its smoothed copy. How near a pixel is, 1 / z' in perspective and -z' else, is linear on a
 * plane. A pixel less near than scale * nearness - offset of another lies behind it, unless the surface falls as much
 * there: by half of that a pixel, over the two pixels on either side of the step. So planes that light and eye graze
 * are one surface. */
struct smooth_target {
	const uint8_t *from; /* sRGB, 3 bytes a pixel */
	uint8_t *to;
	const float *depth;  /* z', +inf where nothing is */
	uint32_t width, height;
	int perspective;
	float scale, offset;
	/* Where in its pixel the sample lies whose colour a pixel has, or PSR_PLACE_NONE; NULL: nobody knows. */
	const uint8_t *place;
};

/* The places of a row of words with PSR_PLACE_BITS; PSR_PLACE_NONE where a word is empty, or its pixel's weight below a
 * half. */
typedef void smooth_places_fn(uint8_t *place, const uint64_t *word, const uint16_t *weight, uint32_t n);

/* Smooths the pixels x0 <= x < x1, y0 <= y < y1, x1 at most SMOOTH_WIDTH more. Within a surface a pixel p becomes (4 p
 * + sum of its four neighbours) / 8; a neighbour of another surface counts as p. At an edge, neighbours behind show
 * through: e eighths of their mean, where e is 2 for each side neighbour and 1 for each diagonal one, at most 6, and
 * side neighbours count twice in the mean. Neighbours in front do not count. Means are of squared codes. Returns how
 * many pixels have a neighbour behind.
 *
 * With places, p becomes the mean of samples of its surface in the pixel and the eight around it, weighed by a
 * quadratic B-spline of how far they lie from the pixel's middle along each axis; a 64th of a whole one's weight is the
 * mean above, which is all there is where no sample is near. */
typedef uint32_t smooth_fn(const struct smooth_target *target, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1);

#endif

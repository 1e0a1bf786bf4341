/* Kernel of anti-aliasing ([G] 9.1.1). */
#ifndef PSR_SIMD_SMOOTH_H
#define PSR_SIMD_SMOOTH_H

#include <stdint.h>

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
};

/* Smooths the pixels x0 <= x < x1, y0 <= y < y1, x1 at most SMOOTH_WIDTH more. Within a surface a pixel p becomes (4 p
 * + sum of its four neighbours) / 8; a neighbour of another surface counts as p. At an edge, neighbours behind show
 * through: e eighths of their mean, where e is 2 for each side neighbour and 1 for each diagonal one, at most 6, and
 * side neighbours count twice in the mean. Neighbours in front do not count. Means are of squared codes. Returns how
 * many pixels have a neighbour behind. */
typedef uint32_t smooth_fn(const struct smooth_target *target, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1);

#endif

/* Loops over the pixels of a plane, for the codec. */
#ifndef PSRD_PIXELS_H
#define PSRD_PIXELS_H

#include <stddef.h>
#include <stdint.h>

/* Returns whether n >= 1 pixels of so many bytes all equal one. */
int pixels_are_all(const uint8_t *one, const uint8_t *pixels, size_t n, size_t pixel_bytes);

/* Finds the range of the finite depths; least > most if there are none. */
void pixels_depth_range(double *least, double *most, const float *z, size_t n);

/* Takes the nearer of each 2x2 pixels of two rows; at an odd width the last one has two. */
void pixels_nearest(float *out, const float *upper, const float *lower, uint32_t width);

/* Writes each pixel scale x scale times. `out` has room for them all. */
void pixels_enlarge(uint8_t *out, const uint8_t *in, uint32_t width, uint32_t height, size_t pixel_bytes,
                    uint32_t scale);

#endif

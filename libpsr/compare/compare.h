/* How far a picture is from another one of the same size: metrics of colours and of depths, and where the two differ
 * most. Pictures have rows from the top down without gaps, 3 bytes of sRGB a pixel; depths are +inf in empty pixels. */
#ifndef PSR_COMPARE_COMPARE_H
#define PSR_COMPARE_COMPARE_H

#include <stdint.h>
#include "psr/error.h"

/* Returns the peak signal to noise ratio, in dB, of the sRGB codes of the pixels that are covered (not 0; NULL: of all
 * pixels); +inf if they are the same. */
double compare_psnr(const uint8_t *rgb, const uint8_t *reference, const uint8_t *covered, uint64_t n_pixels);

/* Returns the share, 0..1, of pixels that differ by more than `codes` in a channel. */
double compare_off(const uint8_t *rgb, const uint8_t *reference, uint64_t n_pixels, unsigned codes);

/* Returns the root of the mean square of the difference of depths, in their unit, over the pixels that one of the two
 * shows. A pixel that only one shows counts as the whole range of the reference's depths. 0 where neither shows any;
 * +inf where the reference shows none or has no range, and the other has pixels that it lacks. */
double compare_depth_rmse(const float *depth, const float *reference, uint64_t n_pixels);

/* Computes the structural similarity (Wang, Bovik, Sheikh, Simoncelli 2004) of the luma: the mean over all windows that
 * are within the picture, Gaussian of 1.5 pixels and 11x11; along a side below 11 pixels the window is the largest odd
 * one that fits. 1: the same. MEMORY. */
int compare_ssim(double *out, const uint8_t *rgb, const uint8_t *reference, const uint32_t size[2],
                 struct psr_error *err);

/* Computes the mean of the difference that people see when they flip between the two pictures: LDR-FLIP (Andersson,
 * Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild 2020) at 67 pixels a degree, as of a monitor 0.7 m wide with
 * 3840 pixels, 0.7 m away. 0: the same, 1: as different as can be. MEMORY. */
int compare_flip(double *out, const uint8_t *rgb, const uint8_t *reference, const uint32_t size[2],
                 struct psr_error *err);

/* Fill a map with how much each pixel differs: codes of the channel that differs most; depth, where +inf is a pixel
 * that only one shows. */
void compare_map_color(float *map, const uint8_t *rgb, const uint8_t *reference, uint64_t n_pixels);
void compare_map_depth(float *map, const float *depth, const float *reference, uint64_t n_pixels);

/* Finds where a map is worst: within the window of 32x32 pixels whose sum of squares is greatest, the box around all
 * values of at least half of the greatest one there. width 0: the map is 0 everywhere. MEMORY. */
struct compare_box {
	uint32_t x, y, width, height; /* pixels, from the top left */
};
int compare_worst(struct compare_box *box, const float *map, const uint32_t size[2], struct psr_error *err);

#endif

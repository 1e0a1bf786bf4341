/* Where samples fall in a picture, in numbers of 64 bits and more (the x87's 80-bit format where there is one), and how
 * far a frame's floats may be from it. Include after cmocka.h. */
#ifndef TESTS_HARD_EXACT_H
#define TESTS_HARD_EXACT_H

#include "psr/render.h"

/* Whether long double has the 64 bits that the bounds count on; prints a sentence where it has not. */
int exact_is_there(void);

/* The bounds, with e = 2^-24, half of the spacing of floats next to 1.
 *
 * The kernels compute x', y' and z' of a sample as (row + col) + depth * unit ([G] 7.6): row, col and unit are rounded
 * from doubles, then come a product and two sums. Each of the three terms goes through at most three roundings, so each
 * of the results is within
 *
 *	e (3 |row| + 3 |col| + 3 |depth unit|) + D
 *
 * of the exact one. D is what the doubles are off by: fewer than 64 roundings of 2^-53 of terms of (focal + half) L at
 * most, where L adds up the magnitudes of all lengths that make a place; and the focal length's own error, as
 * psr_sincos() has 1e-15.
 *
 * u = x' / z' takes a division, a product and their roundings: it is within (Ex + |u| Ez) / (z' - Ez) + 3 e |u|. */
struct exact_place {
	long double u, v, z;             /* pixels, and z' in world units */
	long double off_u, off_v, off_z; /* what a frame's are within; off_u and off_v are infinite where z' may be 0 */
};

/* Places a sample of a scene's block; slots count the blocks of all instances. */
void exact_place(struct exact_place *out, const struct psr_scene *scene, uint32_t width, uint32_t height,
                 uint32_t slot, uint32_t sample);

/* Whether the place is within its bounds of a pixel's border, so that it may fall on either side. */
int exact_is_at_border(const struct exact_place *at);

struct exact_counts {
	uint64_t n_samples, n_inside; /* of all, those that surely are in the picture, beyond the near plane */
	uint64_t n_unsure;            /* at a border of pixels or at the near plane within their bounds */
	uint64_t n_drawn;             /* pixels */
};

/* Draws the scene, whose models have one level and two-sided blocks, and compares its words with exact places. A
 * pixel's word is of a sample whose exact place is in that pixel, grown by the bound, and has its exact depth within
 * the bound. A sample whose place is in a pixel, shrunk by the bound, is there or behind what is there. The count of
 * samples in the report is within what is unsure. Fails the test otherwise. */
struct exact_counts exact_check(const struct psr_scene *scene, uint32_t width, uint32_t height);

#endif

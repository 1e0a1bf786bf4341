/* Kernels of filling gaps: pull and push ([G] 4.7, appendix). */
#ifndef PSR_SIMD_FILL_H
#define PSR_SIMD_FILL_H

#include "gaps.h"

#define FILL_WIDTH 256 /* most parents of pixels in one fill_push_picture */

/* Cells side by side. Colours are premultiplied with the weight, except in the picture itself. Outside of the picture z
 * is NaN, which every comparison rejects, and the weight GAPS_WHOLE. */
struct fill_row {
	uint16_t *r, *g, *b, *weight; /* a pointer is NULL where the kernel does not use it */
	float *z;
	uint8_t *near; /* bit 2 j + i: child i of row j counts: it has a weight, and is not behind the others */
};

/* Computes weights, depths and `near` of cells to[0..n-1] from cells upper[0..2n-1] and lower[0..2n-1]: of children
 * with a weight, those count that are not beyond scale * z + offset of the nearest. Returns the least weight. */
typedef uint16_t fill_pull_weights_fn(const struct fill_row *to, const struct fill_row *upper,
                                      const struct fill_row *lower, uint32_t n, float scale, float offset);

/* Computes the colours of cells that have `near` from their children's colours and weights. */
typedef void fill_pull_colors_fn(const struct fill_row *to, const struct fill_row *upper, const struct fill_row *lower,
                                 uint32_t n, int is_picture);

#define FILL_BLOCK 16 /* parents that a push handles together */

/* The parents of a row of cells, n of them, and their neighbours above or below. own[-1] and own[n] count, too. Parents
 * beyond scale * z + offset of the nearest of three do not count. */
struct fill_parents {
	struct fill_row own, beside;
	uint32_t n;
	float scale, offset;
};

/* Makes cells to[0..2n-1] whole that are not, where their parents and those neighbours are. Depths change where the
 * weight was below a half. */
typedef void fill_push_fn(const struct fill_row *to, const struct fill_parents *parents);

/* Pixels that become whole: their places in the row, the weights that they had, and their new colours and depths. */
#define FILL_PLACES (2 * FILL_WIDTH + 2 * FILL_BLOCK) /* one block more than can be listed */
struct fill_places {
	uint32_t n_filled; /* with no weight before, and now a finite depth */
	uint16_t at[FILL_PLACES], weight[FILL_PLACES], r[FILL_PLACES], g[FILL_PLACES], b[FILL_PLACES];
	float z[FILL_PLACES]; /* interpolated, for any weight */
};

/* As fill_push, for pixels, in `was`: changes weights alone, and ignores z. Handles block i of FILL_BLOCK parents if
 * left[i] has `bit`; clears the bit once all of the block's pixels are whole. Lists the pixels that become whole, and
 * returns how many; elements beyond them are undefined. */
typedef uint32_t fill_push_picture_fn(struct fill_places *places, uint32_t *left, uint32_t bit,
                                      const struct fill_row *was, const struct fill_parents *parents);

/* Lists which of n values z, finite ones, are farther than scale * z + offset from all values of three rows that are
 * the nearest to it, own[k][-1] to own[k][1] at the first; NaN are none. Returns how many; elements of `far` beyond them
 * are undefined. */
typedef uint32_t fill_far_fn(uint16_t *far, const float *z, const float *const own[3], uint32_t n, float scale,
                             float offset);

/* Where a pixel of depth z is: x and y in pixels from where the view axis meets the picture. */
struct fill_from {
	float x, y, z;
	float wider; /* the factor from another z' to how much wider pixels are there, 0 if orthographic; */
	float steep; /* from a difference in z' to pixels */
};

/* What is in a square of pixels around it, distances in its pixels. */
struct fill_beside {
	uint32_t n;      /* how many have a finite z' */
	float distance2; /* the square of the nearest one's in space, INFINITY without any */
	float along;     /* the least along the view axis, of any; INFINITY without any */
};

#define FILL_SQUARE 3 /* most pixels to each side */

/* Looks at the square of pixels up to `reach` to each side of that at `own`, in rows of `stride`; reads, and ignores,
 * others up to FILL_SQUARE to the left and one more to the right. */
typedef struct fill_beside fill_beside_fn(const struct fill_from *from, const float *own, ptrdiff_t stride, int reach);

/* Finds the pixel of the square, from the middle, that is `along` off along the view axis, of equal ones the least
 * aside, of these the first; there is one. */
struct fill_place {
	int x, y;
};
typedef struct fill_place fill_pick_fn(const struct fill_from *from, const float *own, ptrdiff_t stride, int reach,
                                       float along);

/* Reads z' from n words of pixels of any weight; NAN for those of none. */
typedef void fill_own_fn(float *own, const uint64_t *word, const uint16_t *weight, uint32_t n);

/* Reads z' from n words. */
typedef void fill_depths_fn(float *z, const uint64_t *word, uint32_t n);

#endif

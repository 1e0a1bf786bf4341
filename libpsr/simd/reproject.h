/* Kernels of late warping (client/lib/reproject.h): a received picture to cells, and cells to another camera's picture.
 *
 * The form of depth, `d`, is 1 / z' in perspective and z' in an orthographic picture; 0 where no surface is. Points of
 * a plane have a d that is linear in pixels. */
#ifndef PSR_SIMD_REPROJECT_H
#define PSR_SIMD_REPROJECT_H

#include <stdint.h>

#define REPROJECT_SIDE 8     /* pixels of the largest cell */
#define REPROJECT_MARGIN 0.25f /* source pixels that a cell is drawn larger on each side, which closes cracks */

/* How far two values of d, of which `most` is the greater, may lie apart: scale * most + offset. */
struct reproject_limit {
	float scale, offset;
};

/* A received picture. Planes have `stride` elements a row, which is a multiple of REPROJECT_SIDE above the width, and a
 * multiple of REPROJECT_SIDE rows above the height; d is 0 in the elements beyond the picture. */
struct reproject_source {
	uint32_t width, height, stride;
	float *d;
	uint32_t *texel; /* red | green << 8 | blue << 16 | is_whole << 24: this pixel, and those to the right, below and
	                  * diagonally below, are one surface */
	struct reproject_limit surface; /* of neighbours on one surface */
	struct reproject_limit plane;   /* of a pixel and the plane of its cell */
};

/* A square of pixels with d = `d` + dx (x - cx) + dy (y - cy), where (cx, cy) is its middle; pixel centres are at
 * +0.5. */
struct reproject_cell {
	float d, dx, dy;
	uint32_t place; /* its left column | top row << 14 | log2 of its side << 28 */
};

/* d from z'; 0 for a z' outside of 1 / REPROJECT_FAR .. REPROJECT_FAR, and NaN. So sums of some hundred are finite. */
#define REPROJECT_FAR 1e30f
typedef void reproject_depths_fn(float *d, const float *z, uint32_t n, int is_inverse);

/* Row y of texels. */
typedef void reproject_texels_fn(const struct reproject_source *source, const uint8_t *rgb, uint32_t y);

/* Joins the pixels of rows y .. y + REPROJECT_SIDE - 1 to cells, from left to right, as large as `plane` lets them be.
 * Returns how many; there is room for one a pixel. */
typedef uint32_t reproject_fit_fn(const struct reproject_source *source, uint32_t y, struct reproject_cell *cell);

/* From the received picture to the drawn one: (X, Y, W, N) = x of_x + y of_y + of_one + d of_d is at pixel (X/W, Y/W),
 * visible where W > 0, and the greatest key N/W is the nearest: 1/z', or -z' if it is drawn orthographically. Columns
 * are of finite or any other values: cells whose results are not finite are left out. */
struct reproject_warp {
	float of_x[4], of_y[4], of_one[4], of_d[4];
	uint32_t width, height; /* of the drawn picture */
	float most_key;         /* of the near distance */
};

/* Pixels x0 <= x < x1, y0 <= y < y1 of the drawn picture; x0 == x1 if there are none. */
struct reproject_box {
	uint16_t x0, x1, y0, y1;
};

/* The pixels that each cell can reach. None for cells whose middle is behind the eye, that face away from it, or of
 * which a corner is more than 8 times as near as the middle. */
typedef void reproject_bound_fn(struct reproject_box *box, const struct reproject_warp *warp,
                                const struct reproject_cell *cell, uint32_t n);

/* A rectangle of the drawn picture. Rows have `stride` elements, REPROJECT_SIDE of them at least beyond the rectangle,
 * which kernels may write. */
#define REPROJECT_EMPTY (-INFINITY)
struct reproject_tile {
	uint32_t x0, x1, y0, y1, stride;
	float *key;    /* greatest so far; REPROJECT_EMPTY where nothing is */
	uint32_t *at;  /* its place in the received picture: x | y << 16, in parts of 2^-bits pixels */
	unsigned bits; /* 2..7 */
};

#define REPROJECT_LIST 64

/* Draws n <= REPROJECT_LIST cells into the tile, the first of those with equal keys wins; box[i] is the one of cell[i],
 * not empty. Returns how many pixels it looked at. */
typedef uint64_t reproject_cells_fn(const struct reproject_tile *tile, const struct reproject_warp *warp,
                                    const struct reproject_cell *cell, const struct reproject_box *box, uint32_t n);

/* Colours of n pixels: interpolated where the four pixels around a place are one surface, else those of the nearest;
 * `background` where the key is REPROJECT_EMPTY. Writes 3 n bytes; reads 7 keys and places beyond n. */
typedef void reproject_look_fn(uint8_t *rgb, const struct reproject_source *source, const struct reproject_tile *tile,
                               uint32_t first, uint32_t n, const uint8_t background[3]);

#endif

/* What the files of late warping share. */
#ifndef PSR_CLIENT_LIB_REPROJECT_INSIDE_H
#define PSR_CLIENT_LIB_REPROJECT_INSIDE_H

#include <stddef.h>
#include "reproject.h"
#include "simd/simd.h"

#define REPROJECT_CHUNK 256    /* cells that are passed over together */
#define REPROJECT_MOST_SLOPE 8 /* of one surface: depth from pixel to pixel, in pixels (of its distance) */

struct reproject_range {              /* lines that the cells of a chunk reach: first <= line < end */
	uint16_t first, end;
};

/* Rows of cells, eight rows of pixels each, have room for a cell a pixel, and a range for each REPROJECT_CHUNK. */
struct psr_reproject {
	const struct simd *simd;
	struct psr_camera camera;
	uint8_t background[3];
	int is_taken;
	struct reproject_source source;
	size_t n_elements;      /* of a plane of source, and of cell and box */
	struct reproject_cell *cell;
	struct reproject_box *box;
	struct reproject_range *range;
	uint32_t *n_cells;      /* of each row */
	uint32_t n_rows, cells_a_row, ranges_a_row;
	void *scratch;          /* a tile for each thread */
	size_t scratch_bytes;
};

static inline uint32_t reproject_round_up(uint32_t n, uint32_t by)
{
	return (n + by - 1) / by * by;
}

/* ---- reproject.c ---- */

/* A picture of colours that psr can have; `what` names it. ARG, LIMIT. */
int reproject_check_size(const struct psr_frame *frame, const char *what, struct psr_error *err);

/* World units a pixel, at distance 1 in perspective. */
double reproject_footprint(const struct psr_camera *camera, uint32_t height);

/* So many pixels, of d. */
struct reproject_limit reproject_limit_of(const struct psr_camera *camera, uint32_t height, double pixels);

/* ---- reproject_map.c ---- */

/* The map from the picture taken last to the pixels of `to`. */
void reproject_map(struct reproject_warp *warp, const struct psr_reproject *r, const struct psr_camera *camera,
                   const struct psr_frame *to);

/* ---- reproject_fill.c ---- */

/* A row or column of the drawn picture, from rim to rim. */
struct reproject_line {
	const struct reproject_source *source;
	const float *key;    /* step elements apart, as `at` */
	const uint32_t *at;
	uint8_t *rgb;        /* of the first pixel; the next one is rgb_step bytes away */
	size_t step, rgb_step;
	uint32_t n;
	unsigned bits;
	struct reproject_limit surface; /* of keys of neighbours on one surface */
};

struct reproject_counts {
	uint64_t covered, filled; /* pixels */
};

/* Gives colour to the pixels without a key between two of which the received picture has no background, and between a
 * surface of its rim and the rim of the drawn one. Adds to the counts. */
void reproject_fill(const struct reproject_line *line, struct reproject_counts *counts);

#endif

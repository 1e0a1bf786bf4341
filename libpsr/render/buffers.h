/* The memory of a picture while it is drawn. */
#ifndef PSR_RENDER_BUFFERS_H
#define PSR_RENDER_BUFFERS_H

#include "gaps.h"
#include "plan.h"
#include "shade.h"
#include "splat.h"
#include "warp.h"

struct buffers {
	struct psr_zstack stack;
	uint16_t *rgb[3], *weight; /* linear colours by channel, and weights, of each pixel */
	uint8_t *bricks;           /* 1: gaps marked the brick */
	struct splat_offcuts offcuts; /* of plans with splats */
	struct ewa_sum *sum;       /* of plans with EWA splats */
	size_t sum_size;
	struct band *band;          /* what the warp's threads draw */
	struct warp_counts *warp;   /* of each band */
	struct gaps_counts *gaps;   /* by row of bricks, */
	struct shade_counts *shade; /* like this */
	/* By part of the picture, 1: an earlier frame of the same layout left its words empty. If all parts of a tile are
	 * clean, so are its cells. */
	uint8_t *is_clean;
	/* The layout that is_clean belongs to. */
	const void *clean_pixels;
	uint32_t clean_width, clean_height, clean_levels;
	void *pixels; /* words, levels, colours, weights, bricks and offcuts */
	size_t pixels_size;
	void *counters; /* the others */
	size_t counters_size;
};

/* Lays out the picture of a plan with the z-buffer levels of a bit mask. */
int buffers_prepare(struct buffers *buffers, const struct plan *plan, uint32_t levels);

/* After a picture that was drawn in part: nothing is clean. */
void buffers_forget(struct buffers *buffers);
void buffers_clear(struct buffers *buffers);

/* Rows of bricks, and the end of one in pixels. */
static inline uint32_t n_brick_rows(const struct plan *plan)
{
	return (plan->height + BRICK - 1) / BRICK;
}

static inline uint32_t brick_row_end(const struct plan *plan, uint32_t row)
{
	const uint32_t end = (row + 1) * BRICK;

	return end < plan->height ? end : plan->height;
}

#endif

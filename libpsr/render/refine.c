#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/srgb.h"
#include "render/render.h"

/* Windows begin at multiples of the coarsest cell, so that cells are those of the whole picture, and of what is drawn a
 * margin is not used: holes that reach across a window's border are filled from both of its sides. */
#define WINDOW_WIDTH 2048
#define WINDOW_HEIGHT 1024
#define MARGIN 64
#define STEP_X (WINDOW_WIDTH - 2 * MARGIN)
#define STEP_Y (WINDOW_HEIGHT - 2 * MARGIN)
_Static_assert(STEP_X % (1 << PSR_MAX_DEPTH_LEVEL) == 0 && STEP_Y % (1 << PSR_MAX_DEPTH_LEVEL) == 0,
               "cells stay where they are");
_Static_assert(MARGIN % (1 << PSR_MAX_PASS) == 0, "a pixel is in one window");

struct psr_refiner {
	struct psr_renderer *renderer;
	uint8_t *rgb; /* of a window, and its depths behind them */
	float *depth;
	uint8_t srgb[65536];   /* of 16-bit linear light */
	uint16_t linear[256];
};

/* A window's part of the frame: pixels, and the first one's first sub-pixel in the window. */
struct part {
	const struct psr_refiner *refiner;
	struct psr_frame *frame;
	uint32_t x0, x1, y0, left, top, stride;
	unsigned pass;
};

int psr_refiner_create(struct psr_refiner **out, struct psr_renderer *renderer)
{
	const size_t area = (size_t)WINDOW_WIDTH * WINDOW_HEIGHT;
	struct psr_refiner *r = calloc(1, sizeof *r);
	if (!r)
		return PSR_ERR_MEMORY;
	r->renderer = renderer;
	r->depth = psr_alloc_array(area, sizeof *r->depth + 3);
	if (!r->depth) {
		free(r);
		return PSR_ERR_MEMORY;
	}
	r->rgb = (uint8_t *)(r->depth + area);
	for (int i = 0; i < 65536; i++)
		r->srgb[i] = psr_linear_to_srgb((float)i / 65535.0f);
	for (int i = 0; i < 256; i++)
		r->linear[i] = (uint16_t)(psr_srgb_to_linear[i] * 65535.0f + 0.5f);
	*out = r;
	return PSR_OK;
}

void psr_refiner_destroy(struct psr_refiner *r)
{
	if (!r)
		return;
	psr_free(r->depth);
	free(r);
}

uint64_t psr_refiner_bytes(const struct psr_refiner *r)
{
	return sizeof *r + (uint64_t)WINDOW_WIDTH * WINDOW_HEIGHT * (sizeof *r->depth + 3);
}

static void average_row(int row, void *userdata)
{
	const struct part *part = userdata;
	const struct psr_refiner *r = part->refiner;
	const uint32_t side = 1u << part->pass, y = part->y0 + (uint32_t)row;
	const uint32_t half = 1u << (2 * part->pass - 1);
	for (uint32_t x = part->x0; x < part->x1; x++) {
		const size_t first =
			(size_t)(part->top + (uint32_t)row * side) * part->stride + part->left + (x - part->x0) * side;
		const size_t at = (size_t)y * part->frame->width + x;
		uint32_t sum[3] = { half, half, half };
		for (uint32_t j = 0; j < side; j++) {
			const uint8_t *rgb = r->rgb + 3 * (first + (size_t)j * part->stride);
			for (uint32_t i = 0; i < side; i++)
				for (int c = 0; c < 3; c++)
					sum[c] += r->linear[rgb[3 * i + (uint32_t)c]];
		}
		for (int c = 0; c < 3; c++)
			part->frame->rgb[3 * at + (size_t)c] = r->srgb[sum[c] >> 2 * part->pass];
		if (!part->frame->depth)
			continue;
		float nearest = INFINITY;
		for (uint32_t j = 0; j < side; j++)
			for (uint32_t i = 0; i < side; i++) {
				const float z = r->depth[first + (size_t)j * part->stride + i];
				nearest = z < nearest ? z : nearest;
			}
		part->frame->depth[at] = nearest;
	}
}

static void add_report(struct psr_report *sum, const struct psr_report *one, unsigned pass)
{
	for (int s = 0; s < PSR_N_STAGES; s++) {
		sum->ns[s] += one->ns[s];
		sum->count[s] += one->count[s];
	}
	sum->n_blocks = one->n_blocks;
	sum->n_samples = one->n_samples;
	sum->n_blocks_drawn += one->n_blocks_drawn;
	sum->n_samples_drawn += one->n_samples_drawn;
	sum->n_covered += one->n_covered;
	sum->n_filled += one->n_filled;
	sum->levels |= one->levels;
	sum->n_clamped += one->n_clamped;
	for (int e = 0; e < PSR_N_EFFECTS; e++) {
		if (one->effect[e].why == PSR_WHY_RAN || sum->effect[e].why != PSR_WHY_RAN)
			sum->effect[e].why = one->effect[e].why;
		sum->effect[e].count += one->effect[e].count;
	}
	sum->error_bound = fmax(sum->error_bound, ldexp(one->error_bound, -(int)pass));
}

/* Draws the window of column i and row j of windows, and averages what of it is used. */
static int draw_window(struct psr_refiner *r, const struct psr_scene *scene, const struct psr_settings *settings,
                       unsigned pass, uint32_t i, uint32_t j, struct psr_pool *pool, struct psr_frame *frame,
                       struct psr_error *err)
{
	const uint32_t width = settings->width << pass, height = settings->height << pass;
	const uint32_t left = i * STEP_X, top = j * STEP_Y;
	const int is_last_x = width - left <= WINDOW_WIDTH, is_last_y = height - top <= WINDOW_HEIGHT;
	struct psr_settings window = *settings;
	window.with_splats = 1;
	window.is_smooth = 0;
	window.window = (struct psr_window){ width, height, (int32_t)left, (int32_t)top };
	window.width = is_last_x ? width - left : WINDOW_WIDTH;
	window.height = is_last_y ? height - top : WINDOW_HEIGHT;

	struct psr_frame fine = { .width = window.width,
		                      .height = window.height,
		                      .rgb = r->rgb,
		                      .depth = frame->depth ? r->depth : NULL };
	const int rc = psr_render(r->renderer, scene, &window, pool, &fine, err);
	if (rc)
		return rc;
	const uint32_t from_x = i ? MARGIN : 0, to_x = is_last_x ? window.width : WINDOW_WIDTH - MARGIN;
	const uint32_t from_y = j ? MARGIN : 0, to_y = is_last_y ? window.height : WINDOW_HEIGHT - MARGIN;
	struct part part = {
		.refiner = r, .frame = frame, .pass = pass, .stride = window.width, .left = from_x, .top = from_y,
		.x0 = (left + from_x) >> pass, .x1 = (left + to_x) >> pass, .y0 = (top + from_y) >> pass,
	};
	psr_pool_for(pool, (int)((to_y - from_y) >> pass), average_row, &part);
	add_report(&frame->report, &fine.report, pass);
	return PSR_OK;
}

static uint32_t n_windows(uint32_t side, uint32_t window, uint32_t step)
{
	return side <= window ? 1 : 1 + (side - window + step - 1) / step;
}

int psr_refine(struct psr_refiner *r, const struct psr_scene *scene, const struct psr_settings *settings, unsigned pass,
               struct psr_pool *pool, psr_refine_cancelled_fn *is_cancelled, void *userdata, struct psr_frame *frame,
               struct psr_error *err)
{
	if (pass > PSR_MAX_PASS)
		return psr_fail(err, PSR_ERR_LIMIT, "there is no pass %u, only passes up to %d", pass, PSR_MAX_PASS);
	if (settings->window.picture_width)
		return psr_fail(err, PSR_ERR_ARG, "only whole pictures are refined");
	if (pass == 0 || settings->width == 0 || settings->height == 0 || settings->width > PSR_MAX_SIDE ||
	    settings->height > PSR_MAX_SIDE)
		return psr_render(r->renderer, scene, settings, pool, frame, err);
	if (frame->width != settings->width || frame->height != settings->height)
		return psr_fail(err, PSR_ERR_ARG, "the frame is of another size than the settings");
	if (frame->normal || frame->id || frame->block || frame->weight || frame->words)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "only colour and depth are refined, no other planes");
	const uint32_t n_x = n_windows(settings->width << pass, WINDOW_WIDTH, STEP_X);
	const uint32_t n_y = n_windows(settings->height << pass, WINDOW_HEIGHT, STEP_Y);
	memset(&frame->report, 0, sizeof frame->report);
	for (uint32_t j = 0; j < n_y; j++)
		for (uint32_t i = 0; i < n_x; i++) {
			if (is_cancelled && is_cancelled(userdata))
				return psr_fail(err, PSR_ERR_CANCELLED, "nobody waits for pass %u any more", pass);
			const int rc = draw_window(r, scene, settings, pass, i, j, pool, frame, err);
			if (rc)
				return rc;
		}
	return PSR_OK;
}

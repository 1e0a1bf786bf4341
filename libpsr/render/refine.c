#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/mem.h"
#include "base/srgb.h"
#include "fine.h"
#include "placed.h"
#include "refine.h"

/* Windows begin at multiples of the coarsest cell, so that their cells are those of the whole picture. Each draws a
 * margin and drops it, so that a hole across the border of the rest is filled from both of its sides. */
#define WINDOW_WIDTH 2048
#define WINDOW_HEIGHT 1024
#define MARGIN 64
#define STEP_X (WINDOW_WIDTH - 2 * MARGIN)
#define STEP_Y (WINDOW_HEIGHT - 2 * MARGIN)
#define WINDOW_PIXELS ((size_t)WINDOW_WIDTH * WINDOW_HEIGHT)
/* Pixels from the plain frame's edges, which are up to a sample's distance outside the silhouette, to its inside. A gap
 * between two things that the plain frame joins ends nearer to an edge. Measured: with two instead of four a wheel at
 * 256 pixels loses 1.7 dB. */
#define INSIDE 4
_Static_assert(STEP_X % (1 << PSR_MAX_DEPTH_LEVEL) == 0 && STEP_Y % (1 << PSR_MAX_DEPTH_LEVEL) == 0,
               "cells stay where they are");
_Static_assert(MARGIN % (1 << PSR_MAX_PASS) == 0, "a pixel is in one window");
_Static_assert(WINDOW_WIDTH <= AVERAGE_MOST, "its rows are averaged at once");

struct refiner {
	struct psr_renderer *renderer;
	float *depth;        /* of a window, */
	uint8_t *rgb;        /* and, of fine pictures, its colours; NULL before the first */
	struct surveyor *surveyor; /* of fine pictures; NULL before the first */
	uint8_t *is_inside; /* by pixel of the plain frame, then as much scratch */
	size_t inside_size;
	/* What is_inside was found for: the passes of a still share it. */
	int has_inside;
	struct placed placed;
	struct psr_camera camera;
	struct render_settings settings;
	const uint8_t *srgb;   /* of 16-bit linear light */
	uint32_t linear[256];  /* 16-bit linear light of sRGB */
};

/* A window's part of the frame: its pixels, the first sub-pixel of the first one in the window, and its size. */
struct part {
	const struct refiner *refiner;
	struct psr_frame *frame;
	struct wide_light light; /* of sub-pixels */
	const uint8_t *rgb;      /* instead, of those of a fine picture; else NULL */
	uint32_t x0, x1, y0, left, top, stride, height;
	unsigned pass;
};

/* A call of refiner_draw. */
struct still {
	struct refiner *refiner;
	const struct psr_scene *scene;
	const struct render_settings *settings;
	struct psr_pool *pool;
	struct psr_frame *frame;
	struct psr_error *err;
	unsigned pass; /* 1 of a fine picture */
	int is_fine;
};

struct erosion {
	uint8_t *is_inside, *scratch;
	uint32_t width, height;
};

int refiner_create(struct refiner **out, struct psr_renderer *renderer, struct psr_error *err)
{
	struct refiner *r = calloc(1, sizeof *r);

	if (r == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for refining a frame");
	r->renderer = renderer;
	r->depth = psr_alloc_array(WINDOW_PIXELS, sizeof *r->depth);
	if (r->depth == NULL) {
		free(r);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for refining a frame");
	}
	r->srgb = psr_srgb_of_16_bits();
	for (int code = 0; code < 256; code++)
		r->linear[code] = (uint32_t)((double)psr_srgb_to_linear[code] * 65535 + 0.5);
	*out = r;
	return PSR_OK;
}

void refiner_destroy(struct refiner *r)
{
	if (r == NULL)
		return;
	psr_free(r->depth);
	psr_free(r->rgb);
	surveyor_destroy(r->surveyor);
	psr_free_huge(r->is_inside, r->inside_size);
	placed_clear(&r->placed);
	free(r);
}

uint64_t refiner_bytes(const struct refiner *r)
{
	return sizeof *r + WINDOW_PIXELS * (sizeof *r->depth + (r->rgb != NULL ? 3 : 0)) + r->inside_size
	       + (r->surveyor != NULL ? surveyor_bytes() : 0) + placed_bytes(&r->placed);
}

uint64_t refiner_most_bytes(uint64_t n_pixels)
{
	return sizeof(struct refiner) + surveyor_bytes() + WINDOW_PIXELS * (sizeof(float) + 3) + 2 * n_pixels;
}

uint64_t refiner_window(uint32_t width, uint32_t height, unsigned pass)
{
	const uint64_t w = (uint64_t)width << pass, h = (uint64_t)height << pass;

	return (w < WINDOW_WIDTH ? w : WINDOW_WIDTH) * (h < WINDOW_HEIGHT ? h : WINDOW_HEIGHT);
}

static int are_equal(const uint8_t *top, const uint8_t *bottom)
{
	return memcmp(top, bottom, 6) == 0 && memcmp(top, top + 3, 3) == 0;
}

/* The means of the 2x2 colours of n pixels of a fine picture, which smoothing has clamped. */
static void average_codes(uint8_t *to, const struct part *part, size_t first, uint32_t n)
{
	const uint8_t *top = part->rgb + 3 * first, *bottom = top + 3 * (size_t)part->stride;
	const uint32_t *linear = part->refiner->linear;
	const uint8_t *srgb = part->refiner->srgb;

	for (uint32_t x = 0; x < n; x++, to += 3, top += 6, bottom += 6) {
		if (are_equal(top, bottom)) {
			memcpy(to, top, 3);
			continue;
		}
		for (size_t c = 0; c < 3; c++)
			to[c] = srgb[(linear[top[c]] + linear[top[c + 3]] + linear[bottom[c]] + linear[bottom[c + 3]] + 2) >> 2];
	}
}

/* Four points a pixel are few for its mean: those around it tell of it, too (decision 0150). */
static void average_around(uint16_t *light, const struct part *part, uint32_t row, uint32_t n, uint32_t channel)
{
	const uint16_t *root = part->light.channel[channel] + part->left;
	const uint32_t top = part->top + 2 * row, above = top > 0 ? top - 1 : 0;
	const uint32_t below = top + 2 < part->height ? top + 2 : top + 1;
	const uint16_t *const rows[4] = { root + (size_t)above * part->stride, root + (size_t)top * part->stride,
		                              root + (size_t)(top + 1) * part->stride, root + (size_t)below * part->stride };

	renderer_simd(part->refiner->renderer)->average_around(light, rows, n, part->left == 0,
	                                                       part->left + 2 * n >= part->stride);
}

static void average_row(int row, void *userdata)
{
	const struct part *part = userdata;
	const struct simd *simd = renderer_simd(part->refiner->renderer);
	const uint32_t y = part->y0 + (uint32_t)row, n = part->x1 - part->x0, side = 1u << part->pass;
	const size_t first = (size_t)(part->top + (uint32_t)row * side) * part->stride + part->left;
	const size_t at = (size_t)y * part->frame->width + part->x0;
	uint16_t light[WINDOW_WIDTH];

	if (part->rgb != NULL)
		average_codes(part->frame->rgb + 3 * at, part, first, n);
	for (uint32_t c = 0; part->rgb == NULL && part->frame->rgb != NULL && c < 3; c++) {
		if (part->pass == 1)
			average_around(light, part, (uint32_t)row, n, c);
		else
			simd->average_light(light, part->light.channel[c] + first, part->stride, n, part->pass);
		for (uint32_t x = 0; x < n; x++)
			part->frame->rgb[3 * (at + x) + c] = part->refiner->srgb[light[x]];
	}
	if (part->frame->depth != NULL)
		simd->average_depth(part->frame->depth + at, part->refiner->depth + first, part->stride, n, part->pass);
}

static int loop(const struct still *still, int n, void (*fn)(int i, void *userdata), void *userdata)
{
	const int rc = psr_pool_for_until(still->pool, &still->settings->cancel, n, fn, userdata);

	return rc ? render_cancelled(still->err) : PSR_OK;
}

/* Draws the window in column i and row j, and averages it without its margin. */
static int draw_window(const struct still *still, uint32_t i, uint32_t j)
{
	const struct refiner *r = still->refiner;
	const struct render_settings *settings = still->settings;
	struct psr_frame *frame = still->frame;
	const unsigned pass = still->pass;
	const int is_wide = frame->rgb != NULL && !still->is_fine;
	const uint32_t width = settings->width << pass, height = settings->height << pass;
	const uint32_t left = i * STEP_X, top = j * STEP_Y;
	const int is_last_x = width - left <= WINDOW_WIDTH, is_last_y = height - top <= WINDOW_HEIGHT;
	struct render_settings window = *settings;
	struct psr_frame fine;

	window.with_splats = !still->is_fine;
	window.with_ewa = still->is_fine && settings->with_ewa;
	window.smooth = still->is_fine ? PSR_SMOOTH_EDGES : PSR_SMOOTH_NONE;
	window.is_wide = is_wide;
	window.window = (struct psr_window){ width, height, (int32_t)left, (int32_t)top };
	window.width = is_last_x ? width - left : WINDOW_WIDTH;
	window.height = is_last_y ? height - top : WINDOW_HEIGHT;

	fine = (struct psr_frame){ .width = window.width,
		                       .height = window.height,
		                       .rgb = frame->rgb != NULL && still->is_fine ? r->rgb : NULL,
		                       .depth = frame->depth != NULL ? r->depth : NULL };
	const struct inside inside = { r->is_inside, settings->width, left, top, pass };
	renderer_set_inside(r->renderer, still->is_fine ? NULL : &inside);
	const int rc = renderer_draw(r->renderer, still->scene, &window, still->pool, &fine, still->err);
	renderer_set_inside(r->renderer, NULL);
	if (rc)
		return rc;
	const uint32_t from_x = i ? MARGIN : 0, to_x = is_last_x ? window.width : WINDOW_WIDTH - MARGIN;
	const uint32_t from_y = j ? MARGIN : 0, to_y = is_last_y ? window.height : WINDOW_HEIGHT - MARGIN;
	struct part part = {
		.refiner = r, .frame = frame, .light = renderer_light(r->renderer), .rgb = fine.rgb, .pass = pass,
		.stride = window.width, .height = window.height, .left = from_x, .top = from_y,
		.x0 = (left + from_x) >> pass, .x1 = (left + to_x) >> pass, .y0 = (top + from_y) >> pass,
	};
	frame_report_add(&frame->report, &fine.report, pass);
	return loop(still, (int)((to_y - from_y) >> pass), average_row, &part);
}

/* Erodes n pixels that lie `step` apart: one stays 1 if all within INSIDE of it are 1. Pixels beyond the picture do not
 * count. */
static void erode(uint8_t *to, const uint8_t *from, uint32_t n, size_t step)
{
	uint32_t n_whole = 0; /* length of the run of 1 that ends here */

	for (uint32_t x = 0; x < n + INSIDE; x++) {
		n_whole = x >= n || from[x * step] ? n_whole + 1 : 0;
		if (x >= INSIDE)
			to[(x - INSIDE) * step] = n_whole >= (x < 2 * INSIDE ? x + 1 : 2 * INSIDE + 1);
	}
}

static void erode_row(int y, void *userdata)
{
	const struct erosion *e = userdata;
	const size_t first = (size_t)y * e->width;

	erode(e->scratch + first, e->is_inside + first, e->width, 1);
}

static void erode_column(int x, void *userdata)
{
	const struct erosion *e = userdata;

	erode(e->is_inside + x, e->scratch + x, e->height, e->width);
}

/* Whether the outlines of two frames of one scene and camera are the same. */
static int same_outline(const struct render_settings *a, const struct render_settings *b)
{
	return a->width == b->width && a->height == b->height && a->spacing_px == b->spacing_px
	       && a->cull_tests == b->cull_tests && a->is_full == b->is_full && a->with_splats == b->with_splats
	       && a->with_ewa == b->with_ewa && a->gap_threshold == b->gap_threshold && a->gap_method == b->gap_method
	       && a->cell_bias == b->cell_bias;
}

/* Notes what a still's is_inside depends on. *has_changed: it differs from what was noted before. */
static int note_still(const struct still *still, int *has_changed)
{
	const struct psr_camera *camera = &still->scene->camera;
	struct refiner *r = still->refiner;
	const int rc = placed_note(&r->placed, still->scene, has_changed);

	*has_changed |= !placed_same_camera(&r->camera, camera) || !same_outline(&r->settings, still->settings);
	r->camera = *camera;
	r->settings = *still->settings;
	return rc;
}

/* Finds the pixels well inside the plain frame's object, where a pass shows no background between discs. */
static int find_inside(const struct still *still)
{
	struct refiner *r = still->refiner;
	const struct render_settings *settings = still->settings;
	const size_t area = (size_t)settings->width * settings->height;
	const uint64_t start = clock_ns();
	struct erosion erosion;
	int has_changed;

	int rc = settings_validate(settings, still->err);
	if (rc == PSR_OK)
		rc = psr_scene_validate(still->scene, still->err);
	if (rc)
		return rc;
	rc = note_still(still, &has_changed);
	if (rc == PSR_OK && r->has_inside && !has_changed)
		return PSR_OK;
	r->has_inside = 0;
	if (rc == PSR_OK)
		r->is_inside = psr_grow_huge(r->is_inside, &r->inside_size, 2 * area);
	if (rc || r->is_inside == NULL)
		return psr_fail(still->err, PSR_ERR_MEMORY, "no memory for a picture of %ux%u", settings->width,
		                settings->height);
	rc = renderer_outline(r->renderer, still->scene, settings, still->pool, r->is_inside, still->err);
	erosion = (struct erosion){ r->is_inside, r->is_inside + area, settings->width, settings->height };
	if (rc == PSR_OK)
		rc = loop(still, (int)settings->height, erode_row, &erosion);
	if (rc == PSR_OK)
		rc = loop(still, (int)settings->width, erode_column, &erosion);
	r->has_inside = rc == PSR_OK;
	still->frame->report.ns[PSR_STAGE_GAPS] += clock_ns() - start;
	return rc;
}

static int prepare(const struct still *still)
{
	struct refiner *r = still->refiner;

	if (!still->is_fine)
		return find_inside(still);
	if (r->rgb == NULL && still->frame->rgb != NULL)
		r->rgb = psr_alloc_array(WINDOW_PIXELS, 3);
	return r->rgb != NULL || still->frame->rgb == NULL
	               ? PSR_OK : psr_fail(still->err, PSR_ERR_MEMORY, "no memory for a fine picture");
}

/* Instead of a fine picture. */
static int draw_smooth(const struct still *still)
{
	struct render_settings smooth = *still->settings;

	smooth.smooth = PSR_SMOOTH_EDGES;
	const int rc = renderer_draw(still->refiner->renderer, still->scene, &smooth, still->pool, still->frame, still->err);

	effect_note(&still->frame->report, PSR_EFFECT_FINE, PSR_WHY_VOID, 0);
	return rc;
}

static uint32_t n_windows(uint32_t side, uint32_t window, uint32_t step)
{
	return side <= window ? 1 : 1 + (side - window + step - 1) / step;
}

int refiner_draw(struct refiner *r, const struct psr_scene *scene, const struct render_settings *settings,
                 struct psr_pool *pool, struct psr_frame *frame, struct psr_error *err)
{
	const int is_fine = settings->pass == 0 && settings->smooth == PSR_SMOOTH_FINE;
	const unsigned pass = is_fine ? 1 : settings->pass;
	const struct still still = { r, scene, settings, pool, frame, err, pass, is_fine };
	int rc;

	if (pass > PSR_MAX_PASS)
		return psr_fail(err, PSR_ERR_LIMIT, "there is no pass %u, only passes up to %d", pass, PSR_MAX_PASS);
	if (settings->window.picture_width)
		return psr_fail(err, PSR_ERR_ARG, "only whole pictures are refined");
	if (pass == 0 || settings->width == 0 || settings->height == 0 || settings->width > PSR_MAX_SIDE
	    || settings->height > PSR_MAX_SIDE)
		return renderer_draw(r->renderer, scene, settings, pool, frame, err);
	if (frame->width != settings->width || frame->height != settings->height)
		return psr_fail(err, PSR_ERR_ARG, "the frame is of another size than the settings");
	if (frame->normal != NULL || frame->id != NULL || frame->block != NULL || frame->weight != NULL
	    || frame->words != NULL || frame->bound != NULL)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "only colour and depth are refined, no other planes");
	if (is_fine) {
		int is_worth;

		rc = fine_is_worth(&is_worth, &r->surveyor, scene, settings, err);
		if (rc || !is_worth)
			return rc ? rc : draw_smooth(&still);
	}
	const uint32_t n_x = n_windows(settings->width << pass, WINDOW_WIDTH, STEP_X);
	const uint32_t n_y = n_windows(settings->height << pass, WINDOW_HEIGHT, STEP_Y);
	memset(&frame->report, 0, sizeof frame->report);
	for (int e = 0; e < PSR_N_EFFECTS; e++)
		frame->report.effect[e].why = PSR_WHY_NOTHING; /* until a window says otherwise */
	rc = prepare(&still);
	for (uint32_t j = 0; j < n_y; j++)
		for (uint32_t i = 0; i < n_x && rc == PSR_OK; i++)
			rc = draw_window(&still, i, j);
	effect_note(&frame->report, PSR_EFFECT_FINE, is_fine ? PSR_WHY_RAN : PSR_WHY_OFF,
	            (uint64_t)settings->width * settings->height);
	return rc;
}

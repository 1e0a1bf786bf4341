#include "reproject.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/pool.h"
#include "base/view.h"
#include "reproject_inside.h"

/* A pixel may be so far from its cell's plane, in pixels: 0.2 pixels aside after 3 degrees of orbit. */
#define OFF_PLANE 4

int psr_reproject_create(struct psr_reproject **out, struct psr_error *err)
{
	struct psr_reproject *r = calloc(1, sizeof *r);

	if (r == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for warping pictures");
	r->simd = simd_get();
	*out = r;
	return PSR_OK;
}

static void free_picture(struct psr_reproject *r)
{
	psr_free(r->source.d);
	psr_free(r->source.texel);
	psr_free(r->cell);
	psr_free(r->box);
	psr_free(r->range);
	psr_free(r->n_cells);
}

void psr_reproject_destroy(struct psr_reproject *r)
{
	if (r == NULL)
		return;
	free_picture(r);
	psr_free(r->scratch);
	free(r);
}

int reproject_check_size(const struct psr_frame *frame, const char *what, struct psr_error *err)
{
	if (frame->rgb == NULL)
		return psr_fail(err, PSR_ERR_ARG, "the %s picture has no colour", what);
	if (frame->width == 0 || frame->height == 0)
		return psr_fail(err, PSR_ERR_ARG, "the %s picture has %ux%u pixels: both sides need at least 1", what,
		                frame->width, frame->height);
	if (frame->width > PSR_MAX_SIDE || frame->height > PSR_MAX_SIDE
	    || (uint64_t)frame->width * frame->height > PSR_MAX_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "the %s picture has %ux%u pixels: a side has at most %d, all of it %u",
		                what, frame->width, frame->height, PSR_MAX_SIDE, PSR_MAX_PIXELS);
	return PSR_OK;
}

double reproject_footprint(const struct psr_camera *camera, uint32_t height)
{
	return camera->kind == PSR_CAMERA_PERSPECTIVE ? 2 * tan(camera->fov_y / 2) / height : camera->ortho_height / height;
}

struct reproject_limit reproject_limit_of(const struct psr_camera *camera, uint32_t height, double pixels)
{
	const float apart = (float)(pixels * reproject_footprint(camera, height));

	return camera->kind == PSR_CAMERA_PERSPECTIVE ? (struct reproject_limit){ .scale = apart }
	                                              : (struct reproject_limit){ .offset = apart };
}
/* ---- taking ---- */

/* Gives room for a picture of this size; what was taken before stays on failure, and goes on success. */
static int make_room(struct psr_reproject *r, uint32_t width, uint32_t height)
{
	struct psr_reproject to = *r;
	const uint32_t stride = reproject_round_up(width + 1, REPROJECT_SIDE);
	const uint32_t rows = reproject_round_up(height + 1, REPROJECT_SIDE);

	to.n_elements = (size_t)stride * rows;
	to.n_rows = rows / REPROJECT_SIDE;
	to.cells_a_row = stride * REPROJECT_SIDE;
	to.ranges_a_row = (to.cells_a_row + REPROJECT_CHUNK - 1) / REPROJECT_CHUNK;
	if (!r->is_taken || stride != r->source.stride || to.n_rows != r->n_rows) {
		to.source.d = psr_alloc_array(to.n_elements, sizeof *to.source.d);
		to.source.texel = psr_alloc_array(to.n_elements, sizeof *to.source.texel);
		to.cell = psr_alloc_array(to.n_elements, sizeof *to.cell);
		to.box = psr_alloc_array(to.n_elements, sizeof *to.box);
		to.range = psr_alloc_array((size_t)to.ranges_a_row * to.n_rows, sizeof *to.range);
		to.n_cells = psr_alloc_array(to.n_rows, sizeof *to.n_cells);
		if (to.source.d == NULL || to.source.texel == NULL || to.cell == NULL || to.box == NULL || to.range == NULL
		    || to.n_cells == NULL) {
			free_picture(&to);
			return PSR_ERR_MEMORY;
		}
		free_picture(r);
	}
	to.source.width = width;
	to.source.height = height;
	to.source.stride = stride;
	*r = to;
	return PSR_OK;
}

struct taking {
	struct psr_reproject *r;
	const struct psr_frame *picture;
};

static void take_depths(int row, void *userdata)
{
	const struct taking *t = userdata;
	const struct reproject_source *source = &t->r->source;
	const int is_inverse = t->r->camera.kind == PSR_CAMERA_PERSPECTIVE;

	for (uint32_t y = (uint32_t)row * REPROJECT_SIDE; y < ((uint32_t)row + 1) * REPROJECT_SIDE; y++) {
		const uint32_t n = y < source->height ? source->width : 0;
		float *d = source->d + (size_t)y * source->stride;

		t->r->simd->reproject_depths(d, t->picture->depth + (size_t)y * source->width, n, is_inverse);
		memset(d + n, 0, (source->stride - n) * sizeof *d);
	}
}

static void take_cells(int row, void *userdata)
{
	const struct taking *t = userdata;
	struct psr_reproject *r = t->r;
	const uint32_t first = (uint32_t)row * REPROJECT_SIDE;

	for (uint32_t y = first; y < first + REPROJECT_SIDE && y < r->source.height; y++)
		r->simd->reproject_texels(&r->source, t->picture->rgb + (size_t)3 * y * r->source.width, y);
	r->n_cells[row] = 0;
	if (first < r->source.height)
		r->n_cells[row] = r->simd->reproject_fit(&r->source, first, r->cell + (size_t)row * r->cells_a_row);
}

int psr_reproject_take(struct psr_reproject *r, const struct psr_frame *picture, const struct psr_camera *camera,
                       const uint8_t background[3], struct psr_pool *pool, struct psr_error *err)
{
	struct taking t = { r, picture };
	int code = reproject_check_size(picture, "received", err);

	if (code != PSR_OK)
		return code;
	if (picture->depth == NULL)
		return psr_fail(err, PSR_ERR_ARG, "the received picture has no depth");
	code = view_check_camera(camera, err);
	if (code != PSR_OK)
		return code;
	if (make_room(r, picture->width, picture->height) != PSR_OK)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to warp a picture of %ux%u pixels", picture->width,
		                picture->height);
	r->camera = *camera;
	memcpy(r->background, background, sizeof r->background);
	r->source.surface = reproject_limit_of(camera, picture->height, REPROJECT_MOST_SLOPE);
	r->source.plane = reproject_limit_of(camera, picture->height, OFF_PLANE);
	r->is_taken = 1;
	psr_pool_for(pool, (int)r->n_rows, take_depths, &t);
	psr_pool_for(pool, (int)r->n_rows, take_cells, &t);
	return PSR_OK;
}

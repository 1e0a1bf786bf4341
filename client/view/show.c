#include "show.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/vec.h"
#include "client/output/legend.h"
#include "lens.h"

struct view_show {
	struct psr_pool *pool;
	struct psr_reproject *reproject;
	struct link_picture *picture;
	struct psr_frame out;
	struct psr_camera camera; /* of what was drawn last */
	double take_ms;
	int is_stage;             /* the picture's colours are a stage's */
};

int view_show_create(struct view_show **out, int n_threads, struct psr_error *err)
{
	struct view_show *show = calloc(1, sizeof *show);
	int code;

	if (show == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a screen");
	code = psr_pool_create(&show->pool, n_threads, err);
	if (code == PSR_OK)
		code = psr_reproject_create(&show->reproject, err);
	if (code != PSR_OK) {
		view_show_destroy(show);
		return code;
	}
	*out = show;
	return PSR_OK;
}

void view_show_destroy(struct view_show *show)
{
	if (show == NULL)
		return;
	psr_reproject_destroy(show->reproject);
	psr_pool_destroy(show->pool);
	psr_frame_free(&show->out);
	link_release(show->picture);
	free(show);
}

const struct link_picture *view_show_picture(const struct view_show *show)
{
	return show->picture;
}

static int paint(struct link_picture *picture, const struct show *stage, struct psr_error *err)
{
	const uint32_t planes = show_planes(stage);
	const size_t n = 3 * (size_t)picture->frame.width * picture->frame.height;
	uint8_t *rgb;

	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (planes >> plane & 1 && psr_frame_plane(&picture->frame, plane) == NULL)
			return PSR_OK; /* it was asked for before the stage was */
	rgb = malloc(n);
	if (rgb == NULL || show_paint(stage, &picture->frame, &picture->begin, &picture->end, rgb) != PSR_OK) {
		free(rgb);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to paint a stage");
	}
	memcpy(picture->frame.rgb, rgb, n); /* a painter may read the colours of other pixels */
	free(rgb);
	return PSR_OK;
}

int view_show_take(struct view_show *show, struct link_picture *picture, const struct show *stage,
                   struct psr_error *err)
{
	const uint64_t start_ns = clock_ns();
	int code = stage != NULL ? paint(picture, stage, err) : PSR_OK;

	if (code == PSR_OK)
		code = psr_reproject_take(show->reproject, &picture->frame, &picture->camera, picture->begin.background,
		                          show->pool, err);
	if (code != PSR_OK) {
		link_release(picture);
		return code;
	}
	link_release(show->picture);
	show->picture = picture;
	show->is_stage = stage != NULL;
	show->take_ms = (double)(clock_ns() - start_ns) * 1e-6;
	return PSR_OK;
}

const struct psr_frame *view_show_draw(struct view_show *show, const struct psr_camera *camera, uint32_t width,
                                       uint32_t height, struct view_shown *shown, struct psr_error *err)
{
	memset(shown, 0, sizeof *shown);
	if (show->picture == NULL)
		return NULL;
	if (show->out.rgb == NULL || show->out.width != width || show->out.height != height) {
		psr_frame_free(&show->out);
		if (psr_frame_alloc(&show->out, width, height, 1u << PSR_PLANE_COLOR, err) != PSR_OK)
			return NULL;
	}
	if (psr_reproject_draw(show->reproject, camera, &show->out, show->pool, &shown->warp, err) != PSR_OK)
		return NULL;
	show->camera = *camera;
	shown->is_exact = shown->warp.is_copy;
	shown->take_ms = show->take_ms;
	return &show->out;
}

void view_show_legend(struct view_show *show, const struct link_scene *scene)
{
	const struct psr_msg_opened *model = scene != NULL && scene->n_models == 1 ? &scene->model[0].opened : NULL;
	const struct link_picture *picture = show->picture;
	struct legend legend;

	if (picture != NULL && show->out.rgb != NULL && !show->is_stage
	    && legend_find_of(&legend, (enum psr_color_by)picture->color_by, model, &picture->end))
		legend_draw(&legend, show->out.rgb, show->out.width, show->out.height);
}

/* ---- what is at a place ---- */

static int depth_at(const struct link_picture *picture, double x, double y, double *depth)
{
	const struct psr_frame *frame = &picture->frame;

	if (!(x >= 0 && x < frame->width && y >= 0 && y < frame->height) || frame->depth == NULL)
		return 0;
	*depth = (double)frame->depth[(size_t)y * frame->width + (size_t)x];
	return *depth > 0 && *depth < INFINITY;
}

/* Which pixel of the received picture the present camera sees there: what that pixel shows, seen from here, is nearer
 * to the place each time. Some steps are enough, as pictures are rarely far from the camera. */
static int find_source(const struct link_picture *picture, const struct lens *from, const struct lens *to,
                       const double at[2], double source[2])
{
	double depth, point[3], is[2];

	source[0] = at[0] * from->width / to->width;
	source[1] = at[1] * from->height / to->height;
	for (int step = 0; step < 8; step++) {
		if (!depth_at(picture, source[0], source[1], &depth))
			return 0;
		lens_point(from, source[0], source[1], depth, point);
		if (!lens_project(to, point, is, NULL))
			return 0;
		if (fabs(is[0] - at[0]) < 0.5 && fabs(is[1] - at[1]) < 0.5)
			return 1;
		source[0] += (at[0] - is[0]) * from->width / to->width;
		source[1] += (at[1] - is[1]) * from->height / to->height;
	}
	return depth_at(picture, source[0], source[1], &depth);
}

void view_show_probe(const struct view_show *show, double x, double y, struct view_probe *probe)
{
	const struct link_picture *picture = show->picture;
	const double at[2] = { x, y };
	double source[2], depth, is[2];
	struct lens from, to;

	memset(probe, 0, sizeof *probe);
	if (picture == NULL || show->out.rgb == NULL)
		return;
	lens_init(&from, &picture->camera, picture->frame.width, picture->frame.height);
	lens_init(&to, &show->camera, show->out.width, show->out.height);
	if (!find_source(picture, &from, &to, at, source) || !depth_at(picture, source[0], source[1], &depth))
		return;
	lens_point(&from, source[0], source[1], depth, probe->point);
	probe->has_surface = lens_project(&to, probe->point, is, &probe->depth);
}

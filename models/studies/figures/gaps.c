/* Figures 4.9, 7.2 and 9.3: ways to close gaps. */
#include <math.h>
#include <stdlib.h>
#include "base/maths.h"
#include "figures.h"
#include "base/srgb.h"

static void make_opaque(struct figure_shot *shot)
{
	shot->settings.gap_method = PSR_GAPS_OPAQUE;
}

static void make_bilinear(struct figure_shot *shot)
{
	shot->settings.gap_method = PSR_GAPS_BILINEAR;
}

int figure_gaps(struct study *study)
{
	static const struct figure_plan plan = {
		"gaps", NULL, { 2, 512, 4, figure_view, .n_views = FIGURE_VIEWS }, 256,
		{ { "dragon", NULL, { FIGURE_FIND, 0, 96, 96, 3 } } },
		{
			{ .label = "gaps are left", .draw = figure_draw_no_gaps },
			{ .label = "opaque squares", .change = make_opaque },
			{ .label = "bilinear coverage", .change = make_bilinear },
			{ .label = "closed depths" },
			{ .label = "closed depths, smooth", .change = figure_make_smooth },
		},
	};

	return figure_run(study, &plan);
}

static void take_threshold_away(struct figure_shot *shot)
{
	shot->settings.gap_threshold = 0;
}

int figure_threshold(struct study *study)
{
	static const struct figure_plan plan = {
		"threshold", NULL, { 2, 512, 4, figure_view, .n_views = FIGURE_VIEWS }, 256,
		{ { "toybird", NULL, { FIGURE_FIND, 0, 128, 128, 3 } } },
		{ { .label = "threshold 0", .change = take_threshold_away }, { .label = "threshold of 3 pixels" },
		  { .label = "the same, smooth", .change = figure_make_smooth } },
	};

	return figure_run(study, &plan);
}

/* ---- interfaces between levels ---- */

struct cover {
	float *closed, *greatest; /* weights: as they are, and by the greatest coverage of a level alone */
};

/* The level buffers, and by how much a cell of level k must be in front of a pixel to cover it. */
struct levels {
	const struct psr_zstack *stack;
	double scale[PSR_MAX_DEPTH_LEVEL + 1];
};

static int is_before(const struct levels *levels, int k, uint32_t i, uint32_t j, float z)
{
	const struct psr_zstack *stack = levels->stack;

	return (double)stack->level[k].z[(size_t)j * stack->level[k].width + i] * levels->scale[k] < (double)z;
}

static int covers(const struct levels *levels, int k, uint32_t i, uint32_t j, float z, int with_finer)
{
	const struct psr_zstack *stack = levels->stack;

	if (is_before(levels, k, i, j, z))
		return 1;
	for (uint32_t v = j ? 2 * j - 1 : 0; with_finer && v <= 2 * j && v < stack->level[k - 1].height; v++)
		for (uint32_t u = i ? 2 * i - 1 : 0; u <= 2 * i && u < stack->level[k - 1].width; u++)
			if (is_before(levels, k - 1, u, v, z))
				return 1;
	return 0;
}

static double coverage(const struct levels *levels, int k, uint32_t x, uint32_t y, float z, int with_finer)
{
	const double u = (x + 0.5) / (1 << k) + 0.5, v = (y + 0.5) / (1 << k) + 0.5;
	const uint32_t i = (uint32_t)u, j = (uint32_t)v;
	const double fu = u - i, fv = v - j;
	double sum = 0;

	for (uint32_t c = 0; c < 4; c++)
		if (covers(levels, k, i + (c & 1), j + (c >> 1), z, with_finer))
			sum += (c & 1 ? fu : 1 - fu) * (c >> 1 ? fv : 1 - fv);
	return sum;
}

static void find_weights(struct cover *cover, const struct psr_zstack *stack, const struct figure_shot *shot)
{
	const double focal = shot->settings.height / 2.0 / tan(shot->scene.camera.fov_y / 2);
	struct levels levels = { .stack = stack };

	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++)
		levels.scale[k] = 1 + shot->settings.gap_threshold * (1 << k) / 2 / focal;
	for (uint32_t y = 0; y < stack->height; y++)
		for (uint32_t x = 0; x < stack->width; x++) {
			const size_t at = (size_t)y * stack->width + x;
			const float z = psr_float_from_bits((uint32_t)(psr_zstack_row(stack, y)[x] >> 32));
			double greatest = 0, closed = 0;

			for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
				double one;

				if (!(stack->levels >> k & 1))
					continue;
				one = coverage(&levels, k, x, y, z, 0);
				greatest = fmax(greatest, one);
				if (one > 0 && one < 1 && k > 1 && (stack->levels >> (k - 1) & 1))
					one = coverage(&levels, k, x, y, z, 1);
				closed = fmax(closed, one);
			}
			cover->greatest[at] = (float)(1 - greatest);
			cover->closed[at] = (float)(1 - closed);
		}
}

/* Gives back to pixels the share that the greatest coverage would leave them of their own samples. */
static void open_interfaces(struct psr_frame *frame, const struct psr_frame *raw, const struct cover *cover)
{
	for (size_t at = 0; at < (size_t)frame->width * frame->width; at++) {
		const float share = (cover->greatest[at] - cover->closed[at]) / (1 - cover->closed[at]);

		if (!(cover->greatest[at] > cover->closed[at]))
			continue;
		for (size_t c = 3 * at; c < 3 * at + 3; c++) {
			const float own = psr_srgb_to_linear[raw->rgb[c]], filled = psr_srgb_to_linear[frame->rgb[c]];

			frame->rgb[c] = psr_linear_to_srgb(filled + share * (own - filled));
		}
		if (cover->greatest[at] >= 0.5f)
			frame->depth[at] = raw->depth[at];
	}
}

static int draw_open(struct psr_frame *frame, struct study *study, const struct figure_shot *shot)
{
	const size_t n = (size_t)frame->width * frame->width;
	struct cover cover = { malloc(n * sizeof(float)), malloc(n * sizeof(float)) };
	struct psr_frame raw = { .width = 0 };
	struct psr_zstack *stack;
	int rc = psr_frame_alloc(&raw, frame->width, frame->width, FIGURE_PLANES, study->err);

	if (rc == PSR_OK && (cover.closed == NULL || cover.greatest == NULL))
		rc = psr_fail(study->err, PSR_ERR_MEMORY, "no memory for weights");
	if (rc == PSR_OK)
		rc = renderer_warp(study->renderer, &shot->scene, &shot->settings, study->pool, &stack, study->err);
	if (rc == PSR_OK) {
		find_weights(&cover, stack, shot);
		rc = figure_draw_no_gaps(&raw, study, shot);
	}
	if (rc == PSR_OK)
		rc = figure_draw(frame, study, shot);
	if (rc == PSR_OK)
		open_interfaces(frame, &raw, &cover);
	psr_frame_free(&raw);
	free(cover.closed);
	free(cover.greatest);
	return rc;
}

static void cover_bilinearly(struct figure_shot *shot, const struct figure_model *model)
{
	(void)model;
	make_bilinear(shot);
}

int figure_interfaces(struct study *study)
{
	static const struct figure_plan plan = {
		"interfaces", NULL, { 1.8, 1024, 2, figure_view, .n_views = FIGURE_VIEWS, .prepare = cover_bilinearly }, 256,
		{ { "dragon", NULL, { FIGURE_FIND, 0, 64, 64, 4 } } },
		{ { .label = "the greatest coverage of a level", .draw = draw_open }, { .label = "both levels' cells counted" } },
	};

	return figure_run(study, &plan);
}

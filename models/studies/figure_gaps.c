/* Figures 4.9, 7.2 and 9.3: what is done about gaps. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "figures.h"
#include "base/srgb.h"

/* One model, one row of pictures. */
static int run(struct figures *figures, const char *name, const char *file, const struct figure_look *look,
               const struct figure_way *way, int n_ways)
{
	struct figure_model model;
	struct figure_sheet sheet;
	int rc = figure_model_load(&model, figures, name, NULL, 256);

	if (rc != PSR_OK)
		return rc;
	figure_sheet_init(&sheet, (uint32_t)n_ways + 1, &look->part);
	figure_score_print_head(name);
	rc = figure_compare(figures, &sheet, &model, look, way, n_ways);
	if (rc == PSR_OK)
		rc = figure_sheet_write(&sheet, figures, file);
	figure_sheet_drop(&sheet, 0);
	figure_model_fini(&model);
	return rc;
}

static int draw_opaque(struct figure_frame *frame, struct figures *figures, const struct figure_shot *shot)
{
	struct figure_shot other = *shot;

	other.scene.instance = &other.instance;
	other.settings.gap_method = PSR_GAPS_OPAQUE;
	return figure_draw(frame, figures, &other);
}

int figure_run_gaps(struct figures *figures)
{
	static const struct figure_way way[] = {
		{ "gaps are left", figure_draw_no_gaps, NULL },
		{ "opaque squares", draw_opaque, NULL },
		{ "bilinear coverage", figure_draw, NULL },
	};
	const struct figure_look look = { 2, 512, 512, 4, figure_view, FIGURE_VIEWS, { FIGURE_FIND, 0, 96, 96, 3 }, NULL };

	return run(figures, "dragon", "gaps", &look, way, sizeof way / sizeof *way);
}

static int draw_no_threshold(struct figure_frame *frame, struct figures *figures, const struct figure_shot *shot)
{
	struct figure_shot other = *shot;

	other.scene.instance = &other.instance;
	other.settings.gap_threshold = 0;
	return figure_draw(frame, figures, &other);
}

int figure_run_threshold(struct figures *figures)
{
	static const struct figure_way way[] = {
		{ "threshold 0", draw_no_threshold, NULL },
		{ "threshold of 3 pixels", figure_draw, NULL },
	};
	const struct figure_look look = { 2, 512, 512, 4, figure_view, FIGURE_VIEWS, { FIGURE_FIND, 0, 128, 128, 3 },
		                              NULL };

	return run(figures, "toybird", "threshold", &look, way, sizeof way / sizeof *way);
}

/* ---- interfaces between levels ---- */

struct cover {
	float *closed, *greatest; /* weights: as they are, and by the greatest coverage of a level alone */
};

static int is_before(const struct psr_zstack *stack, int k, uint32_t i, uint32_t j, float z, double scale)
{
	return (double)stack->level[k].z[(size_t)j * stack->level[k].width + i] * scale < (double)z;
}

static int covers(const struct psr_zstack *stack, int k, uint32_t i, uint32_t j, float z, const double *scale,
                  int with_finer)
{
	if (is_before(stack, k, i, j, z, scale[k]))
		return 1;
	for (uint32_t v = j ? 2 * j - 1 : 0; with_finer && v <= 2 * j && v < stack->level[k - 1].height; v++)
		for (uint32_t u = i ? 2 * i - 1 : 0; u <= 2 * i && u < stack->level[k - 1].width; u++)
			if (is_before(stack, k - 1, u, v, z, scale[k - 1]))
				return 1;
	return 0;
}

static double coverage(const struct psr_zstack *stack, int k, uint32_t x, uint32_t y, float z, const double *scale,
                       int with_finer)
{
	const double u = (x + 0.5) / (1 << k) + 0.5, v = (y + 0.5) / (1 << k) + 0.5;
	const uint32_t i = (uint32_t)u, j = (uint32_t)v;
	const double fu = u - i, fv = v - j;
	double sum = 0;

	for (uint32_t c = 0; c < 4; c++)
		if (covers(stack, k, i + (c & 1), j + (c >> 1), z, scale, with_finer))
			sum += (c & 1 ? fu : 1 - fu) * (c >> 1 ? fv : 1 - fv);
	return sum;
}

static void find_weights(struct cover *cover, const struct psr_zstack *stack, const struct figure_shot *shot)
{
	const double focal = shot->settings.height / 2.0 / tan(shot->scene.camera.fov_y / 2);
	double scale[PSR_MAX_DEPTH_LEVEL + 1];

	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++)
		scale[k] = 1 + shot->settings.gap_threshold * (1 << k) / 2 / focal;
	for (uint32_t y = 0; y < stack->height; y++)
		for (uint32_t x = 0; x < stack->width; x++) {
			const size_t at = (size_t)y * stack->width + x;
			const float z = psr_float_from_bits((uint32_t)(psr_zstack_row(stack, y)[x] >> 32));
			double greatest = 0, closed = 0;

			for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
				double one;

				if (!(stack->levels >> k & 1))
					continue;
				one = coverage(stack, k, x, y, z, scale, 0);
				greatest = fmax(greatest, one);
				if (one > 0 && one < 1 && k > 1 && (stack->levels >> (k - 1) & 1))
					one = coverage(stack, k, x, y, z, scale, 1);
				closed = fmax(closed, one);
			}
			cover->greatest[at] = (float)(1 - greatest);
			cover->closed[at] = (float)(1 - closed);
		}
}

/* Gives back to pixels what the greatest coverage would leave them of their own samples. */
static void open_interfaces(struct figure_frame *frame, const struct figure_frame *raw, const struct cover *cover)
{
	for (size_t at = 0; at < (size_t)frame->width * frame->height; at++) {
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

static int draw_open(struct figure_frame *frame, struct figures *figures, const struct figure_shot *shot)
{
	const size_t n = (size_t)frame->width * frame->height;
	struct cover cover = { malloc(n * sizeof(float)), malloc(n * sizeof(float)) };
	struct figure_frame raw = { .width = 0 };
	struct psr_zstack *stack;
	struct psr_report report;
	int rc = figure_frame_init(&raw, frame->width, frame->height, figures->err);

	if (rc == PSR_OK && (cover.closed == NULL || cover.greatest == NULL))
		rc = psr_fail(figures->err, PSR_ERR_MEMORY, "no memory for weights");
	if (rc == PSR_OK)
		rc = renderer_warp(figures->renderer, &shot->scene, &shot->settings, figures->study.pool, &stack, &report,
		              figures->err);
	if (rc == PSR_OK) {
		find_weights(&cover, stack, shot);
		rc = figure_draw_no_gaps(&raw, figures, shot);
	}
	if (rc == PSR_OK)
		rc = figure_draw(frame, figures, shot);
	if (rc == PSR_OK)
		open_interfaces(frame, &raw, &cover);
	figure_frame_fini(&raw);
	free(cover.closed);
	free(cover.greatest);
	return rc;
}

int figure_run_interfaces(struct figures *figures)
{
	static const struct figure_way way[] = {
		{ "the greatest coverage of a level", draw_open, NULL },
		{ "both levels' cells counted", figure_draw, NULL },
	};
	const struct figure_look look = { 1.8, 1024, 1024, 2, figure_view, FIGURE_VIEWS, { FIGURE_FIND, 0, 64, 64, 4 },
		                              NULL };

	return run(figures, "dragon", "interfaces", &look, way, sizeof way / sizeof *way);
}

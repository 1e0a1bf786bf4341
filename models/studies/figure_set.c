/* Figures 8.1, 9.1 and 9.4: the standard set, edges, and what is thin. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "figures.h"
#include "models/shapes/generators.h"
#include "base/srgb.h"

#define SET_MAGNIFICATION 0.9 /* so that none is cut off */
#define PASS 3

static int show_one(struct figures *figures, struct figure_sheet *sheet, const char *name)
{
	const struct figure_part whole = { 0, 0, 256, 256, 1 };
	struct figure_score score = { .n_met = 0 };
	struct figure_truth truth = { .width = 0 };
	struct figure_frame frame = { .width = 0 };
	struct figure_model model;
	struct figure_shot shot;
	int rc = figure_model_load(&model, figures, name, NULL, 256);

	if (rc != PSR_OK)
		return rc;
	rc = figure_frame_init(&frame, 256, 256, figures->err);
	for (int v = 0; rc == PSR_OK && v < FIGURE_VIEWS; v++) {
		figure_shot_init(&shot, &model, figure_view[v], SET_MAGNIFICATION, 256, 256);
		rc = figure_truth_draw(&truth, figures, &model, &shot, 4);
		if (rc == PSR_OK)
			rc = figure_draw(&frame, figures, &shot);
		if (rc == PSR_OK)
			rc = figure_score_add(&score, figures, &model, &shot, &frame, &truth);
		if (rc == PSR_OK && v == 0)
			rc = figure_sheet_add(sheet, frame.rgb, 256, &whole, figures->err);
	}
	if (rc == PSR_OK)
		figure_score_print(name, &score);
	figure_truth_fini(&truth);
	figure_frame_fini(&frame);
	figure_model_fini(&model);
	return rc;
}

int figure_run_set(struct figures *figures)
{
	const struct figure_part whole = { 0, 0, 256, 256, 1 };
	struct figure_sheet sheet;
	int rc = PSR_OK;

	figure_sheet_init(&sheet, 4, &whole);
	figure_score_print_head("model");
	for (size_t i = 0; rc == PSR_OK && i < n_generators; i++) {
		rc = show_one(figures, &sheet, generators[i].name);
		if (rc == PSR_OK && i + 1 == n_generators / 2)
			rc = figure_sheet_write(&sheet, figures, "set-1");
	}
	if (rc == PSR_OK)
		rc = figure_sheet_write(&sheet, figures, "set-2");
	figure_sheet_drop(&sheet, 0);
	return rc;
}

/* ---- edges ---- */

static void average(struct figure_frame *to, const struct figure_frame *fine)
{
	const uint32_t n = fine->width / to->width;

	for (size_t at = 0; at < (size_t)to->width * to->height; at++) {
		const size_t first = at / to->width * n * fine->width + at % to->width * n;
		float sum[3] = { 0, 0, 0 };

		to->depth[at] = INFINITY;
		for (uint32_t i = 0; i < n * n; i++) {
			const size_t from = first + i / n * fine->width + i % n;

			to->depth[at] = fminf(to->depth[at], fine->depth[from]);
			for (size_t c = 0; c < 3; c++)
				sum[c] += psr_srgb_to_linear[fine->rgb[3 * from + c]];
		}
		for (size_t c = 0; c < 3; c++)
			to->rgb[3 * at + c] = psr_linear_to_srgb(sum[c] / (float)(n * n));
	}
}

/* [G] 9.1.1: at double the resolution. */
static int draw_twice(struct figure_frame *frame, struct figures *figures, const struct figure_shot *shot)
{
	struct figure_shot other = *shot;
	struct figure_frame fine;
	int rc = figure_frame_init(&fine, 2 * frame->width, 2 * frame->height, figures->err);

	if (rc != PSR_OK)
		return rc;
	other.scene.instance = &other.instance;
	other.settings.width = fine.width;
	other.settings.height = fine.height;
	rc = figure_draw(&fine, figures, &other);
	if (rc == PSR_OK)
		average(frame, &fine);
	figure_frame_fini(&fine);
	return rc;
}

static int draw_smooth(struct figure_frame *frame, struct figures *figures, const struct figure_shot *shot)
{
	struct figure_shot other = *shot;

	other.scene.instance = &other.instance;
	other.scene.light = other.light;
	other.settings.is_smooth = 1;
	return figure_draw(frame, figures, &other);
}

/* The last pass but one of a still. */
static int draw_refined(struct figure_frame *frame, struct figures *figures, const struct figure_shot *shot)
{
	struct psr_frame to = { .width = frame->width, .height = frame->height, .rgb = frame->rgb, .depth = frame->depth };
	struct render_settings settings = shot->settings;
	struct refiner *refiner = NULL;
	int rc = refiner_create(&refiner, figures->renderer, figures->err);

	settings.pass = PASS;
	if (rc == PSR_OK)
		rc = refiner_draw(refiner, &shot->scene, &settings, figures->study.pool, &to, figures->err);
	refiner_destroy(refiner);
	return rc;
}

/* Rows of pictures, a model each. */
static int run(struct figures *figures, const char *const *name, const struct figure_part *part, int n_models,
               const char *file, struct figure_look look, const struct figure_way *way, int n_ways)
{
	struct figure_sheet sheet;
	struct figure_model model;
	int rc = PSR_OK;

	figure_sheet_init(&sheet, (uint32_t)n_ways + 1, part);
	for (int m = 0; rc == PSR_OK && m < n_models; m++) {
		rc = figure_model_load(&model, figures, name[m], NULL, 256);
		if (rc != PSR_OK)
			break;
		look.part = part[m];
		figure_score_print_head(name[m]);
		rc = figure_compare(figures, &sheet, &model, &look, way, n_ways);
		figure_model_fini(&model);
	}
	if (rc == PSR_OK)
		rc = figure_sheet_write(&sheet, figures, file);
	figure_sheet_drop(&sheet, 0);
	return rc;
}

int figure_run_edges(struct figures *figures)
{
	static const char *const name[] = { "chair", "toybird" };
	static const struct figure_part part[] = { { 0, 0, 128, 128, 2 }, { 0, 0, 128, 128, 2 } };
	static const struct figure_way way[] = {
		{ "one pass", figure_draw, NULL },
		{ "smooth", draw_smooth, NULL },
		{ "2x2 sub-pixels", draw_twice, NULL },
		{ "refined, pass 3", draw_refined, NULL },
	};
	const struct figure_look look = { .magnification = 0.5, .width = 128, .height = 128, .rays = 16,
		                              .view = figure_view, .n_views = FIGURE_VIEWS };

	return run(figures, name, part, 2, "edges", look, way, sizeof way / sizeof *way);
}

int figure_run_thin(struct figures *figures)
{
	static const char *const name[] = { "wheel", "plant", "pinetree" };
	static const struct figure_part part[] = { { 64, 64, 96, 96, 3 }, { 80, 60, 96, 96, 3 }, { 80, 80, 96, 96, 3 } };
	static const struct figure_way way[] = {
		{ "one pass", figure_draw, NULL },
		{ "refined, pass 3", draw_refined, NULL },
	};
	const struct figure_look look = { .magnification = 1, .width = 256, .height = 256, .rays = 8, .view = figure_view,
		                              .n_views = FIGURE_VIEWS };

	return run(figures, name, part, 3, "thin", look, way, sizeof way / sizeof *way);
}

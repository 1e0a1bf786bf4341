/* Figures 8.1, 9.1 and 9.4: the standard set, edges, and thin things. */
#include <math.h>
#include "base/srgb.h"
#include "figures.h"
#include "models/shapes/generators.h"

#define PASS 3

int figure_set(struct study *study)
{
	/* At a magnification at which none is cut off. */
	static const struct figure_look look = { 0.9, 256, 4, figure_view, .n_views = FIGURE_VIEWS,
		                                     .has_no_truth = 1 };
	static const struct figure_part whole = { 0, 0, 256, 256, 1 };
	struct figure_sheet sheet;
	int rc = PSR_OK;

	figure_sheet_init(&sheet, 4, &whole);
	figure_score_print_head("model");
	for (size_t i = 0; rc == PSR_OK && i < n_generators; i++) {
		const struct figure_way way[] = { { .label = generators[i].name }, { .label = NULL } };
		struct figure_model model;

		rc = figure_model_load(&model, study, generators[i].name, NULL, 256);
		if (rc == PSR_OK)
			rc = figure_compare(study, &sheet, &model, &look, &whole, way);
		figure_model_fini(&model);
		if (i + 1 == n_generators / 2)
			rc = figure_sheet_finish(&sheet, study, "set-1", rc);
	}
	return figure_sheet_finish(&sheet, study, "set-2", rc);
}

/* ---- edges ---- */

static void average(struct psr_frame *to, const struct psr_frame *fine)
{
	const uint32_t n = fine->width / to->width;

	for (size_t at = 0; at < (size_t)to->width * to->width; at++) {
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
static int draw_twice(struct psr_frame *frame, struct study *study, const struct figure_shot *shot)
{
	struct figure_shot other;
	struct psr_frame fine;
	int rc = psr_frame_alloc(&fine, 2 * frame->width, 2 * frame->width, FIGURE_PLANES, study->err);

	if (rc != PSR_OK)
		return rc;
	figure_shot_copy(&other, shot);
	other.settings.width = other.settings.height = fine.width;
	rc = figure_draw(&fine, study, &other);
	if (rc == PSR_OK)
		average(frame, &fine);
	psr_frame_free(&fine);
	return rc;
}

void figure_make_smooth(struct figure_shot *shot)
{
	shot->settings.smooth = 1;
}

/* The last pass but one of a still. */
static int draw_refined(struct psr_frame *frame, struct study *study, const struct figure_shot *shot)
{
	struct render_settings settings = shot->settings;
	struct refiner *refiner = NULL;
	int rc = refiner_create(&refiner, study->renderer, study->err);

	settings.pass = PASS;
	if (rc == PSR_OK)
		rc = refiner_draw(refiner, &shot->scene, &settings, study->pool, frame, study->err);
	refiner_destroy(refiner);
	return rc;
}

int figure_edges(struct study *study)
{
	static const struct figure_plan plan = {
		"edges", NULL, { 0.5, 128, 16, figure_view, .n_views = FIGURE_VIEWS }, 256,
		{ { "chair", NULL, { 0, 0, 128, 128, 2 } }, { "toybird", NULL, { 0, 0, 128, 128, 2 } } },
		{
			{ .label = "one pass" },
			{ .label = "smooth", .change = figure_make_smooth },
			{ .label = "2x2 sub-pixels", .draw = draw_twice },
			{ .label = "refined, pass 3", .draw = draw_refined },
		},
	};

	return figure_run(study, &plan);
}

int figure_thin(struct study *study)
{
	static const struct figure_plan plan = {
		"thin", NULL, { 1, 256, 8, figure_view, .n_views = FIGURE_VIEWS }, 256,
		{ { "wheel", NULL, { 64, 64, 96, 96, 3 } }, { "plant", NULL, { 80, 60, 96, 96, 3 } },
		  { "pinetree", NULL, { 80, 80, 96, 96, 3 } } },
		{ { .label = "one pass" }, { .label = "refined, pass 3", .draw = draw_refined } },
	};

	return figure_run(study, &plan);
}

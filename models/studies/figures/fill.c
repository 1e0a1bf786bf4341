/* Figure 4.11b: gaps before and after they are filled. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "figures.h"
#include "base/srgb.h"

#define SIDE 512
#define PIXELS ((size_t)SIDE * SIDE)
#define RAYS 4
#define MAGNIFICATION 2

struct filling {
	struct figure_model model;
	struct psr_frame before, after;
	struct figure_truth truth;
	struct figure_score score[3]; /* before, after, after and smooth */
	uint64_t n_samples, n_gaps;   /* pixels with a sample; whose weight is below 1 */
	uint8_t *weights;             /* as greys */
};

/* Paints how much pixels keep of their own samples; gaps are white. */
static void show_gaps(struct filling *f)
{
	for (size_t i = 0; i < PIXELS; i++) {
		const float weight = (float)f->after.weight[i] / 255;

		f->n_samples += isfinite(f->before.depth[i]) != 0;
		f->n_gaps += isfinite(f->before.depth[i]) && f->after.weight[i] < 255;
		memset(f->weights + 3 * i, f->after.weight[i], 3);
		if (f->after.weight[i] == 0)
			f->before.depth[i] = INFINITY;
		for (size_t c = 3 * i; c < 3 * i + 3; c++)
			f->before.rgb[c] = psr_linear_to_srgb(weight * psr_srgb_to_linear[f->before.rgb[c]] + 1 - weight);
	}
}

static int draw_view(struct study *study, struct filling *f, const double toward[3])
{
	struct figure_shot shot, smooth;
	int rc;

	figure_shot_init(&shot, &f->model, toward, MAGNIFICATION, SIDE);
	figure_shot_copy(&smooth, &shot);
	figure_make_smooth(&smooth);
	rc = figure_truth_draw(&f->truth, study, &f->model, &shot, RAYS);
	if (rc == PSR_OK)
		rc = figure_draw(&f->before, study, &smooth);
	if (rc == PSR_OK)
		rc = figure_score_add(&f->score[2], study, &f->model, &smooth, &f->before, &f->truth);
	if (rc == PSR_OK)
		rc = figure_draw(&f->after, study, &shot);
	if (rc == PSR_OK)
		rc = figure_draw_no_gaps(&f->before, study, &shot);
	if (rc == PSR_OK) {
		show_gaps(f);
		rc = figure_score_add(&f->score[0], study, &f->model, &shot, &f->before, &f->truth);
	}
	return rc == PSR_OK ? figure_score_add(&f->score[1], study, &f->model, &shot, &f->after, &f->truth) : rc;
}

static int show(struct study *study, const struct filling *f)
{
	const uint8_t *const cell[] = { f->before.rgb, f->weights, f->after.rgb, f->truth.rgb };
	struct figure_part part = { 0, 0, 80, 80, 3 };
	struct figure_sheet sheet;
	int rc = PSR_OK;

	figure_part_find(&part, f->before.rgb, f->after.rgb, &f->truth);
	figure_sheet_init(&sheet, 4, &part);
	for (int i = 0; rc == PSR_OK && i < 4; i++)
		rc = figure_sheet_add(&sheet, cell[i], SIDE, &part, study->err);
	return figure_sheet_finish(&sheet, study, "fill", rc);
}

int figure_fill(struct study *study)
{
	struct filling f = { .n_gaps = 0 };
	int rc = figure_model_load(&f.model, study, "toybird", NULL, 256);

	if (rc == PSR_OK)
		rc = psr_frame_alloc(&f.before, SIDE, SIDE, FIGURE_PLANES, study->err);
	if (rc == PSR_OK)
		rc = psr_frame_alloc(&f.after, SIDE, SIDE, FIGURE_PLANES | 1u << PSR_PLANE_WEIGHT, study->err);
	f.weights = malloc(3 * PIXELS);
	if (rc == PSR_OK && f.weights == NULL)
		rc = psr_fail(study->err, PSR_ERR_MEMORY, "no memory for weights");
	for (int v = FIGURE_VIEWS - 1; rc == PSR_OK && v >= 0; v--)
		rc = draw_view(study, &f, figure_view[v]);
	if (rc == PSR_OK)
		rc = show(study, &f);
	if (rc == PSR_OK) {
		figure_score_print_head("toybird");
		figure_score_print("before", &f.score[0]);
		figure_score_print("after", &f.score[1]);
		figure_score_print("after, smooth", &f.score[2]);
		printf("\n%.1f %% of the pixels that have a sample are gaps, wholly or in part.\n",
		       100.0 * (double)f.n_gaps / (double)f.n_samples);
	}
	free(f.weights);
	psr_frame_free(&f.before);
	psr_frame_free(&f.after);
	figure_truth_fini(&f.truth);
	figure_model_fini(&f.model);
	return rc;
}

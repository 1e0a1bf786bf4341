#include <stdlib.h>
#include <string.h>
#include "figures.h"

struct compared {
	struct figure_frame frame[FIGURE_MOST_WAYS]; /* of the view under way */
	struct figure_truth truth;
	struct figure_score score[FIGURE_MOST_WAYS];
	uint32_t first_cell;
	uint64_t gain;
};

/* Whether the view is to take the place of one that was shown before. */
static int is_better(struct compared *c, struct figure_part *part, const struct figure_look *look, int view, int n_ways)
{
	uint64_t gain;

	if (look->part.x != FIGURE_FIND)
		return view == 0;
	gain = figure_part_find(part, c->frame[0].rgb, c->frame[n_ways - 1].rgb, &c->truth);
	if (view > 0 && gain <= c->gain)
		return 0;
	c->gain = gain;
	return 1;
}

static int show(struct figures *figures, struct figure_sheet *sheet, struct compared *c, const struct figure_look *look,
                int view, int n_ways)
{
	struct figure_part part = look->part;
	int rc = PSR_OK;

	if (!is_better(c, &part, look, view, n_ways))
		return PSR_OK;
	figure_sheet_drop(sheet, c->first_cell);
	for (int w = 0; rc == PSR_OK && w < n_ways; w++)
		rc = figure_sheet_add(sheet, c->frame[w].rgb, look->width, &part, figures->err);
	if (rc == PSR_OK)
		rc = figure_sheet_add(sheet, c->truth.rgb, look->width, &part, figures->err);
	return rc;
}

static int compare_view(struct figures *figures, struct compared *c, const struct figure_model *model,
                        const struct figure_look *look, const double toward[3], const struct figure_way *way,
                        int n_ways)
{
	struct figure_shot shot;
	int rc;

	figure_shot_init(&shot, model, toward, look->magnification, look->width, look->height);
	if (look->prepare != NULL)
		look->prepare(&shot, model);
	rc = figure_truth_draw(&c->truth, figures, model, &shot, look->rays);
	for (int w = 0; rc == PSR_OK && w < n_ways; w++) {
		shot.instance.model = way[w].model != NULL ? way[w].model->model : model->model;
		rc = way[w].draw(&c->frame[w], figures, &shot);
		if (rc == PSR_OK)
			rc = figure_score_add(&c->score[w], figures, model, &shot, &c->frame[w], &c->truth);
	}
	return rc;
}

int figure_compare(struct figures *figures, struct figure_sheet *sheet, const struct figure_model *model,
                   const struct figure_look *look, const struct figure_way *way, int n_ways)
{
	struct compared c;
	int rc = PSR_OK;

	memset(&c, 0, sizeof c);
	c.first_cell = sheet->n_cells;
	for (int w = 0; rc == PSR_OK && w < n_ways; w++)
		rc = figure_frame_init(&c.frame[w], look->width, look->height, figures->err);
	for (int v = 0; rc == PSR_OK && v < look->n_views; v++) {
		rc = compare_view(figures, &c, model, look, look->view[v], way, n_ways);
		if (rc == PSR_OK)
			rc = show(figures, sheet, &c, look, v, n_ways);
	}
	for (int w = 0; rc == PSR_OK && w < n_ways; w++)
		figure_score_print(way[w].label, &c.score[w]);
	for (int w = 0; w < n_ways; w++)
		figure_frame_fini(&c.frame[w]);
	figure_truth_fini(&c.truth);
	return rc;
}

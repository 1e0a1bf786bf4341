#include "figures.h"

struct compared {
	struct psr_frame frame[FIGURE_MOST_WAYS]; /* of the view under way */
	struct figure_truth truth;
	struct figure_score score[FIGURE_MOST_WAYS];
	int n_ways;
	uint32_t first_cell;
	uint64_t gain;
};

/* Shows the first view, or the one that gains most, in place of the one before. */
static int show(struct study *study, struct figure_sheet *sheet, struct compared *c, const struct figure_look *look,
                struct figure_part part, int view)
{
	int rc = PSR_OK;

	if (part.x == FIGURE_FIND) {
		const uint64_t gain = figure_part_find(&part, c->frame[0].rgb, c->frame[c->n_ways - 1].rgb, &c->truth);

		if (view > 0 && gain <= c->gain)
			return PSR_OK;
		c->gain = gain;
	} else if (view > 0) {
		return PSR_OK;
	}
	figure_sheet_drop(sheet, c->first_cell);
	for (int w = 0; rc == PSR_OK && w < c->n_ways; w++)
		rc = figure_sheet_add(sheet, c->frame[w].rgb, look->side, &part, study->err);
	if (rc == PSR_OK && !look->has_no_truth)
		rc = figure_sheet_add(sheet, c->truth.rgb, look->side, &part, study->err);
	return rc;
}

static int compare_view(struct study *study, struct compared *c, const struct figure_model *model,
                        const struct figure_look *look, const double toward[3], const struct figure_way *way)
{
	struct figure_shot shot;
	int rc;

	figure_shot_init(&shot, model, toward, look->magnification, look->side);
	if (look->prepare != NULL)
		look->prepare(&shot, model);
	rc = figure_truth_draw(&c->truth, study, model, &shot, look->rays);
	for (int w = 0; rc == PSR_OK && w < c->n_ways; w++) {
		struct figure_shot changed;

		figure_shot_copy(&changed, &shot);
		if (way[w].model != NULL)
			changed.instance.model = way[w].model->model;
		if (way[w].change != NULL)
			way[w].change(&changed);
		rc = (way[w].draw != NULL ? way[w].draw : figure_draw)(&c->frame[w], study, &changed);
		if (rc == PSR_OK)
			rc = figure_score_add(&c->score[w], study, model, &shot, &c->frame[w], &c->truth);
	}
	return rc;
}

int figure_compare(struct study *study, struct figure_sheet *sheet, const struct figure_model *model,
                   const struct figure_look *look, const struct figure_part *part, const struct figure_way *way)
{
	struct compared c = { .first_cell = sheet->n_cells };
	int rc = PSR_OK;

	while (rc == PSR_OK && way[c.n_ways].label != NULL)
		rc = psr_frame_alloc(&c.frame[c.n_ways++], look->side, look->side, FIGURE_PLANES, study->err);
	for (int v = 0; rc == PSR_OK && v < look->n_views; v++) {
		rc = compare_view(study, &c, model, look, look->view[v], way);
		if (rc == PSR_OK)
			rc = show(study, sheet, &c, look, *part, v);
	}
	for (int w = 0; w < c.n_ways; w++) {
		if (rc == PSR_OK)
			figure_score_print(way[w].label, &c.score[w]);
		psr_frame_free(&c.frame[w]);
	}
	figure_truth_fini(&c.truth);
	return rc;
}

int figure_run(struct study *study, const struct figure_plan *plan)
{
	struct figure_sheet sheet;
	uint32_t n_ways = 0;
	int rc = PSR_OK;

	while (plan->way[n_ways].label != NULL)
		n_ways++;
	figure_sheet_init(&sheet, n_ways + 1, &plan->row[0].part);
	for (int i = 0; rc == PSR_OK && i < FIGURE_MOST_ROWS && plan->row[i].name != NULL; i++) {
		struct figure_model model;

		rc = figure_model_load(&model, study, plan->row[i].name, plan->row[i].make, plan->resolution);
		if (rc != PSR_OK)
			break;
		figure_score_print_head(plan->head != NULL ? plan->head : plan->row[i].name);
		rc = figure_compare(study, &sheet, &model, &plan->look, &plan->row[i].part, plan->way);
		figure_model_fini(&model);
	}
	return figure_sheet_finish(&sheet, study, plan->file, rc);
}

/* Figures 7.3 and 7.6: highlights, and samples that face away. */
#include <stdlib.h>
#include <string.h>
#include "figures.h"
#include "generators.h"
#include "surfaces.h"

static int run(struct figures *figures, const struct figure_model *model, const char *what, const char *file,
               const struct figure_look *look, const struct figure_way *way, int n_ways)
{
	struct figure_sheet sheet;
	int rc;

	figure_sheet_init(&sheet, (uint32_t)n_ways + 1, &look->part);
	figure_score_print_head(what);
	rc = figure_compare(figures, &sheet, model, look, way, n_ways);
	if (rc == PSR_OK)
		rc = figure_sheet_write(&sheet, figures, file);
	figure_sheet_fini(&sheet);
	return rc;
}

int figure_run_highlights(struct figures *figures)
{
	static const struct figure_way way[] = { { "teapot", figure_draw, NULL } };
	const struct figure_look look = { 1, 512, 512, 4, figure_view, FIGURE_VIEWS, { 96, 128, 320, 256, 1 }, NULL };
	struct figure_model model;
	int rc = figure_model_load(&model, figures, "teapot", NULL, 512);

	if (rc == PSR_OK) {
		rc = run(figures, &model, "model", "highlights", &look, way, 1);
		figure_model_fini(&model);
	}
	return rc;
}

/* ---- backs ---- */

#define SIDES 128

static void make_cylinder(struct shape *shape, int is_closed, int two_sided)
{
	const struct shape_material red = { "red", 0xb04030, 0, 0.6, two_sided }, blue = { "blue", 0x3050a0, 0, 0.6, two_sided };
	const uint32_t a = shape_material(shape, &red), b = shape_material(shape, &blue);
	struct surface_profile piece[6];
	uint32_t n = 0;

	if (is_closed)
		piece[n++] = surface_line(0, -0.8, 0.6, -0.8, 4, b);
	for (uint32_t i = 0; i < 4; i++)
		piece[n++] = surface_line(0.6, -0.8 + 0.4 * i, 0.6, -0.4 + 0.4 * i, 4, i % 2 ? a : b);
	if (is_closed)
		piece[n++] = surface_line(0.6, 0.8, 0, 0.8, 4, b);
	surface_lathe(shape, piece, n, SIDES);
}

static void make_closed(struct shape *shape)
{
	make_cylinder(shape, 1, 0);
}

static void make_closed_both(struct shape *shape)
{
	make_cylinder(shape, 1, 1);
}

static void make_open(struct shape *shape)
{
	make_cylinder(shape, 0, 0);
}

static void make_open_both(struct shape *shape)
{
	make_cylinder(shape, 0, 1);
}

int figure_run_backs(struct figures *figures)
{
	static const double above[FIGURE_VIEWS][3] = {
		{ 0.3, 0.35, 1 }, { 0.3, 0.9, 0.6 }, { 1, 0.2, 0.4 }, { -0.5, -0.6, 0.5 }, { -1, 0.5, -1 }, { 0.2, -1, -0.7 },
	};
	const struct figure_look close = { 4, 768, 768, 2, above, FIGURE_VIEWS, { FIGURE_FIND, 0, 64, 64, 5 }, NULL };
	const struct figure_look whole = { 1, 256, 256, 4, above + 1, 1, { 0, 0, 256, 256, 1 }, NULL };
	struct figure_model model[4];
	struct figure_way way[] = { { "closed: backs drawn as well", figure_draw, &model[1] }, { "closed: backs left out", figure_draw, NULL } };
	const struct figure_way both = { "open, seen from both sides", figure_draw, NULL }, one = { "open, backs left out", figure_draw, NULL };
	struct figure_sheet sheet;
	int rc;

	memset(model, 0, sizeof model);
	rc = figure_model_load(&model[0], figures, "cylinder", make_closed, 256);
	if (rc == PSR_OK)
		rc = figure_model_load(&model[1], figures, "cylinder-both", make_closed_both, 256);
	if (rc == PSR_OK)
		rc = figure_model_load(&model[2], figures, "tube", make_open, 256);
	if (rc == PSR_OK)
		rc = figure_model_load(&model[3], figures, "tube-both", make_open_both, 256);
	if (rc == PSR_OK)
		rc = run(figures, &model[0], "cylinder", "backs", &close, way, 2);
	figure_sheet_init(&sheet, 4, &whole.part);
	if (rc == PSR_OK)
		rc = figure_compare(figures, &sheet, &model[3], &whole, &both, 1);
	if (rc == PSR_OK)
		rc = figure_compare(figures, &sheet, &model[2], &whole, &one, 1);
	if (rc == PSR_OK)
		rc = figure_sheet_write(&sheet, figures, "backs-open");
	figure_sheet_fini(&sheet);
	for (int i = 0; i < 4; i++)
		figure_model_fini(&model[i]);
	return rc;
}

/* Figures 7.3, 7.4 and 7.6: highlights, shadows, and samples that face away. */
#include <stdlib.h>
#include <string.h>
#include "figures.h"
#include "models/shapes/generators.h"
#include "base/vec.h"
#include "models/shapes/surfaces.h"
#include "models/shapes/sweep.h"

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
	figure_sheet_drop(&sheet, 0);
	return rc;
}

/* Three balls, each glossier than the one before. */
static void make_balls(struct shape *shape)
{
	static const struct shape_material material[] = {
		{ "rubber", 0x2f6f50, 0, 0.6, 0 }, { "brass", 0xc8962f, 0.5, 0.4, 0 }, { "lacquer", 0xa02424, 0, 0.22, 0 },
	};
	static const double half[3] = { 0.6, 0.6, 0.6 };

	for (int i = 0; i < 3; i++) {
		const double center[3] = { 1.3 * (i - 1), 0, 0 };

		shape_material(shape, &material[i]);
		sweep_ball(shape, center, half, 96, 192);
	}
}

static void light_twice(struct figure_shot *shot, const struct figure_model *model)
{
	(void)model;
	shot->scene.n_lights = 2;
	shot->light[1] = shot->light[0];
	v3d_set(shot->light[0].color, 0.7, 0.7, 0.7);
	v3d_set(shot->light[1].color, 0.35, 0.4, 0.5);
	shot->light[1].direction[0] = -shot->light[1].direction[0];
}

int figure_run_highlights(struct figures *figures)
{
	static const double view[][3] = { { 0.2, 0.3, 1 }, { -0.2, -0.3, 1 }, { 0.1, 0.8, 0.5 } };
	static const struct figure_way way[] = { { "balls", figure_draw, NULL } };
	const struct figure_look look = { 0.9, 480, 480, 4, view, 3, { 0, 120, 480, 240, 1 }, light_twice };
	struct figure_model model;
	int rc = figure_model_load(&model, figures, "balls", make_balls, 480);

	if (rc == PSR_OK) {
		rc = run(figures, &model, "model", "highlights", &look, way, 1);
		figure_model_fini(&model);
	}
	return rc;
}

/* ---- shadows ---- */

static void make_floor(struct shape *shape)
{
	static const struct shape_material material = { "floor", 0xb8b4a8, 0, 0.8, 0 };
	static const double half[3] = { 2.1, 0.05, 1.6 }, turn[3][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } },
		move[3] = { 0.3, -0.05, 0 };
	uint32_t first;

	make_toybird(shape);
	first = shape->n_vertices;
	shape_material(shape, &material);
	surface_box(shape, half);
	shape_move(shape, first, turn, move);
}

/* [G] figure 7.4: two directional lights and a spot. */
static void light_stage(struct figure_shot *shot, const struct figure_model *model)
{
	static const double direction[3][3] = { { 0.6, -0.9, -0.5 }, { -0.8, -0.7, -0.2 }, { 0, -1, 0.25 } },
		color[3][3] = { { 0.45, 0.42, 0.36 }, { 0.2, 0.24, 0.32 }, { 0.9, 0.85, 0.6 } };

	shot->scene.n_lights = 3;
	for (int i = 0; i < 3; i++) {
		shot->light[i] = (struct psr_light){ .kind = i < 2 ? PSR_LIGHT_DIRECTIONAL : PSR_LIGHT_SPOT };
		shot->light[i].casts_shadow = 1;
		v3d_set(shot->light[i].direction, direction[i][0], direction[i][1], direction[i][2]);
		v3d_set(shot->light[i].color, color[i][0], color[i][1], color[i][2]);
	}
	v3d_set(shot->light[2].position, model->center[0], 4.5, -0.9);
	shot->light[2].inner = 0.2;
	shot->light[2].outer = 0.3;
}

static int draw_no_shadows(struct figure_frame *frame, struct figures *figures, const struct figure_shot *shot)
{
	struct figure_shot other = *shot;

	other.scene.instance = &other.instance;
	other.scene.light = other.light;
	for (int i = 0; i < 3; i++)
		other.light[i].casts_shadow = 0;
	return figure_draw(frame, figures, &other);
}

int figure_run_shadows(struct figures *figures)
{
	static const double view[][3] = { { 0.5, 0.7, 1 }, { -0.8, 0.6, 0.7 }, { 0.2, 1, 0.1 } };
	static const struct figure_way way[] = {
		{ "without shadows", draw_no_shadows, NULL },
		{ "with shadows", figure_draw, NULL },
	};
	const struct figure_look look = { 1, 384, 384, 4, view, 3, { 0, 64, 384, 256, 1 }, light_stage };
	struct figure_model model;
	int rc = figure_model_load(&model, figures, "stage", make_floor, 384);

	if (rc == PSR_OK) {
		rc = run(figures, &model, "three lights", "shadows", &look, way, 2);
		figure_model_fini(&model);
	}
	return rc;
}

/* ---- backs ---- */

#define SIDES 128

/* About as thin as samples are apart. */
static void make_coin_of(struct shape *shape, int two_sided)
{
	const struct shape_material red = { "red", 0xc04030, 0, 0.6, two_sided };
	const struct shape_material blue = { "blue", 0x3060c0, 0, 0.6, two_sided };
	const uint32_t a = shape_material(shape, &red), b = shape_material(shape, &blue);
	const struct surface_profile piece[] = {
		surface_line(0, -0.0035, 0.8, -0.0035, 4, b),
		surface_line(0.8, -0.0035, 0.8, 0.0035, 1, b),
		surface_line(0.8, 0.0035, 0, 0.0035, 4, a),
	};

	surface_lathe(shape, piece, sizeof piece / sizeof *piece, SIDES);
}

static void make_tube_of(struct shape *shape, int two_sided)
{
	const struct shape_material red = { "red", 0xb04030, 0, 0.6, two_sided };
	const struct shape_material blue = { "blue", 0x3050a0, 0, 0.6, two_sided };
	const uint32_t a = shape_material(shape, &red), b = shape_material(shape, &blue);
	struct surface_profile piece[4];

	for (uint32_t i = 0; i < 4; i++)
		piece[i] = surface_line(0.6, -0.8 + 0.4 * i, 0.6, -0.4 + 0.4 * i, 4, i % 2 ? a : b);
	surface_lathe(shape, piece, 4, SIDES);
}

static void make_coin(struct shape *shape)
{
	make_coin_of(shape, 0);
}

static void make_coin_both(struct shape *shape)
{
	make_coin_of(shape, 1);
}

static void make_tube(struct shape *shape)
{
	make_tube_of(shape, 0);
}

static void make_tube_both(struct shape *shape)
{
	make_tube_of(shape, 1);
}

/* Masks would cull most backs. */
static int draw_unculled(struct figure_frame *frame, struct figures *figures, const struct figure_shot *shot)
{
	struct figure_shot other = *shot;

	other.scene.instance = &other.instance;
	other.settings.cull_tests = 0;
	return figure_draw(frame, figures, &other);
}

int figure_run_backs(struct figures *figures)
{
	static const double above[FIGURE_VIEWS][3] = {
		{ 0.3, 0.35, 1 }, { 0.3, 0.9, 0.6 }, { 1, 0.2, 0.4 }, { -0.5, -0.6, 0.5 }, { -1, 0.5, -1 }, { 0.2, -1, -0.7 },
	};
	const struct figure_look close = { 3, 512, 512, 2, above, FIGURE_VIEWS, { FIGURE_FIND, 0, 176, 128, 2 }, NULL };
	const struct figure_look whole = { 1, 256, 256, 4, above + 1, 1, { 0, 0, 256, 256, 1 }, NULL };
	struct figure_model model[4];
	const struct figure_way way[] = {
		{ "coin, backs drawn as well", draw_unculled, &model[1] },
		{ "coin, backs left out", draw_unculled, NULL },
	};
	const struct figure_way both = { "tube that is two-sided", figure_draw, NULL };
	const struct figure_way one = { "tube that is one-sided", figure_draw, NULL };
	struct figure_sheet sheet;
	int rc;

	memset(model, 0, sizeof model);
	rc = figure_model_load(&model[0], figures, "coin", make_coin, 256);
	if (rc == PSR_OK)
		rc = figure_model_load(&model[1], figures, "coin-both", make_coin_both, 256);
	if (rc == PSR_OK)
		rc = figure_model_load(&model[2], figures, "tube", make_tube, 256);
	if (rc == PSR_OK)
		rc = figure_model_load(&model[3], figures, "tube-both", make_tube_both, 256);
	if (rc == PSR_OK)
		rc = run(figures, &model[0], "solid", "backs", &close, way, 2);
	figure_sheet_init(&sheet, 4, &whole.part);
	if (rc == PSR_OK)
		rc = figure_compare(figures, &sheet, &model[3], &whole, &both, 1);
	if (rc == PSR_OK)
		rc = figure_compare(figures, &sheet, &model[2], &whole, &one, 1);
	if (rc == PSR_OK)
		rc = figure_sheet_write(&sheet, figures, "backs-open");
	figure_sheet_drop(&sheet, 0);
	for (int i = 0; i < 4; i++)
		figure_model_fini(&model[i]);
	return rc;
}

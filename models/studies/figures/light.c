/* Figures 7.3, 7.4 and 7.6: highlights, shadows, and samples that face away. */
#include "base/vec.h"
#include "figures.h"
#include "models/shapes/generators.h"
#include "models/shapes/surfaces.h"
#include "models/shapes/sweep.h"

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

int figure_highlights(struct study *study)
{
	static const double view[][3] = { { 0.2, 0.3, 1 }, { -0.2, -0.3, 1 }, { 0.1, 0.8, 0.5 } };
	static const struct figure_plan plan = {
		"highlights", "model", { 0.9, 480, 4, view, .n_views = 3, .prepare = light_twice }, 480,
		{ { "balls", make_balls, { 0, 120, 480, 240, 1 } } }, { { .label = "balls" } },
	};

	return figure_run(study, &plan);
}

/* ---- shadows ---- */

static void make_floor(struct shape *shape)
{
	static const struct shape_material material = { "floor", 0xb8b4a8, 0, 0.8, 0 };
	static const double half[3] = { 2.1, 0.05, 1.6 }, move[3] = { 0.3, -0.05, 0 };
	uint32_t first;

	make_toybird(shape);
	first = shape->n_vertices;
	shape_material(shape, &material);
	surface_box(shape, half);
	shape_shift(shape, first, move);
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

static void take_shadows_away(struct figure_shot *shot)
{
	for (int i = 0; i < 3; i++)
		shot->light[i].casts_shadow = 0;
}

int figure_shadows(struct study *study)
{
	static const double view[][3] = { { 0.5, 0.7, 1 }, { -0.8, 0.6, 0.7 }, { 0.2, 1, 0.1 } };
	static const struct figure_plan plan = {
		"shadows", "three lights", { 1, 384, 4, view, .n_views = 3, .prepare = light_stage }, 384,
		{ { "stage", make_floor, { 0, 64, 384, 256, 1 } } },
		{ { .label = "without shadows", .change = take_shadows_away }, { .label = "with shadows" } },
	};

	return figure_run(study, &plan);
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

#define BOTH(name) \
	static void make_##name(struct shape *shape) { make_##name##_of(shape, 0); } \
	static void make_##name##_both(struct shape *shape) { make_##name##_of(shape, 1); }
BOTH(coin)
BOTH(tube)

/* Masks would cull most backs. */
static void take_culling_away(struct figure_shot *shot)
{
	shot->settings.cull_tests = 0;
}

int figure_backs(struct study *study)
{
	static const double above[FIGURE_VIEWS][3] = {
		{ 0.3, 0.35, 1 }, { 0.3, 0.9, 0.6 }, { 1, 0.2, 0.4 }, { -0.5, -0.6, 0.5 }, { -1, 0.5, -1 }, { 0.2, -1, -0.7 },
	};
	static const struct figure_look close = { 3, 512, 2, above, .n_views = FIGURE_VIEWS };
	static const struct figure_look whole = { 1, 256, 4, above + 1, .n_views = 1 };
	static const struct figure_part found = { FIGURE_FIND, 0, 176, 128, 2 }, all = { 0, 0, 256, 256, 1 };
	static const struct {
		const char *name;
		void (*make)(struct shape *);
	} source[] = { { "coin", make_coin }, { "coin-both", make_coin_both }, { "tube", make_tube },
		           { "tube-both", make_tube_both } };
	struct figure_model model[4] = { 0 };
	const struct figure_way coin[] = {
		{ .label = "coin, backs drawn as well", .change = take_culling_away, .model = &model[1] },
		{ .label = "coin, backs left out", .change = take_culling_away },
		{ .label = NULL },
	};
	static const struct figure_way both[] = { { .label = "tube that is two-sided" }, { .label = NULL } };
	static const struct figure_way one[] = { { .label = "tube that is one-sided" }, { .label = NULL } };
	struct figure_sheet sheet;
	int rc = PSR_OK;

	for (int i = 0; rc == PSR_OK && i < 4; i++)
		rc = figure_model_load(&model[i], study, source[i].name, source[i].make, 256);
	figure_sheet_init(&sheet, 3, &found);
	if (rc == PSR_OK) {
		figure_score_print_head("solid");
		rc = figure_compare(study, &sheet, &model[0], &close, &found, coin);
	}
	rc = figure_sheet_finish(&sheet, study, "backs", rc);
	figure_sheet_init(&sheet, 4, &all);
	if (rc == PSR_OK)
		rc = figure_compare(study, &sheet, &model[3], &whole, &all, both);
	if (rc == PSR_OK)
		rc = figure_compare(study, &sheet, &model[2], &whole, &all, one);
	rc = figure_sheet_finish(&sheet, study, "backs-open", rc);
	for (int i = 0; i < 4; i++)
		figure_model_fini(&model[i]);
	return rc;
}

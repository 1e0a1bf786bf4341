/* What each effect costs: two frames that differ by it alone, drawn in turn. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "child.h"
#include "effects.h"
#include "price.h"
#include "report.h"
#include "scene.h"
#include "model/blocks.h"

#define SIDE 1024
#define N_FRAMES 24
#define MOST_LIGHTS 16
#define MOST_INSTANCES 64 /* 8 x 8 */
#define MIDDLE (3 * 8 + 3)

enum kind { PLAIN, SHINY, TWO_SIDED, LEVEL_1, LEVEL_2, N_KINDS };
enum shadow { NO_SHADOW, KEPT_SHADOW, NEW_SHADOW };

struct look {
	enum kind kind;
	uint32_t n_lights;
	enum psr_light_kind light;
	enum shadow shadow;
	uint32_t n_small;        /* so many of an eighth of the size in the place of one */
	double zoom;             /* 0: 1 */
	unsigned without_tests;  /* enum psr_cull_test */
	int is_full, has_depth, is_smooth;
};

static const struct row {
	const char *group, *name;
	struct look with, without;
} rows[] = {
	{ "lights", "one directional light", { .n_lights = 1 }, { .n_lights = 0 } },
	{ "lights", "its highlight", { .n_lights = 1, .kind = SHINY }, { .n_lights = 1 } },
	{ "lights", "a second light", { .n_lights = 2 }, { .n_lights = 1 } },
	{ "lights", "lights 3 and 4 (a table from 3 on)", { .n_lights = 4 }, { .n_lights = 2 } },
	{ "lights", "lights 5 to 8", { .n_lights = 8 }, { .n_lights = 4 } },
	{ "lights", "lights 9 to 16", { .n_lights = 16 }, { .n_lights = 8 } },
	{ "lights", "highlights of lights 2 to 16", { .n_lights = 16, .kind = SHINY }, { .n_lights = 1, .kind = SHINY } },
	{ "lights", "one point light", { .n_lights = 1, .light = PSR_LIGHT_POINT }, { .n_lights = 0 } },
	{ "lights", "point lights 2 to 8", { .n_lights = 8, .light = PSR_LIGHT_POINT },
	  { .n_lights = 1, .light = PSR_LIGHT_POINT } },
	{ "lights", "one spot light", { .n_lights = 1, .light = PSR_LIGHT_SPOT }, { .n_lights = 0 } },
	{ "shadows", "a directional light's, kept", { .n_lights = 1, .shadow = KEPT_SHADOW }, { .n_lights = 1 } },
	{ "shadows", "a directional light's, new", { .n_lights = 1, .shadow = NEW_SHADOW }, { .n_lights = 1 } },
	{ "shadows", "a spot light's, kept", { .n_lights = 1, .light = PSR_LIGHT_SPOT, .shadow = KEPT_SHADOW },
	  { .n_lights = 1, .light = PSR_LIGHT_SPOT } },
	{ "shadows", "a point light's, kept", { .n_lights = 1, .light = PSR_LIGHT_POINT, .shadow = KEPT_SHADOW },
	  { .n_lights = 1, .light = PSR_LIGHT_POINT } },
	{ "instances", "a second, of an eighth of the size", { .n_lights = 1, .n_small = 2 },
	  { .n_lights = 1, .n_small = 1 } },
	{ "instances", "3 to 8", { .n_lights = 1, .n_small = 8 }, { .n_lights = 1, .n_small = 2 } },
	{ "instances", "9 to 64", { .n_lights = 1, .n_small = 64 }, { .n_lights = 1, .n_small = 8 } },
	{ "samples apart", "1.2 times nearer", { .n_lights = 1, .zoom = 1.2 }, { .n_lights = 1 } },
	{ "samples apart", "twice as far", { .n_lights = 1, .kind = LEVEL_1 }, { .n_lights = 1 } },
	{ "samples apart", "four times as far", { .n_lights = 1, .kind = LEVEL_2 }, { .n_lights = 1 } },
	{ "surfaces", "two-sided", { .n_lights = 1, .kind = TWO_SIDED }, { .n_lights = 1 } },
	{ "anti-aliasing", "smooth", { .n_lights = 1, .is_smooth = 1 }, { .n_lights = 1 } },
	{ "planes", "depth", { .n_lights = 1, .has_depth = 1 }, { .n_lights = 1 } },
	{ "not left out", "no cones", { .n_lights = 1, .without_tests = PSR_CULL_CONES }, { .n_lights = 1 } },
	{ "not left out", "no masks", { .n_lights = 1, .without_tests = PSR_CULL_MASKS }, { .n_lights = 1 } },
	{ "not left out", "no occlusion", { .n_lights = 1, .without_tests = PSR_CULL_OCCLUSION }, { .n_lights = 1 } },
	{ "not left out", "none of the three", { .n_lights = 1, .without_tests = PSR_CULL_ALL }, { .n_lights = 1 } },
	{ "not left out", "all effects, whatever is in view", { .n_lights = 1, .is_full = 1 }, { .n_lights = 1 } },
};
#define N_ROWS (sizeof rows / sizeof rows[0])

struct stage {
	const struct look *look;
	struct scene_film film;
	struct psr_model *model;
	struct psr_instance instance[MOST_INSTANCES];
	struct psr_light light[MOST_LIGHTS];
};

/* The model without highlights and back faces, or with one of them. */
static struct psr_model *variant(const struct psr_model *model, enum kind kind)
{
	const uint64_t gloss = UINT64_C(110) << 56 | UINT64_C(6) << 45; /* a smooth dielectric */
	struct psr_blocks blocks = *psr_model_blocks(model);
	uint8_t *flags = report_alloc(blocks.n_blocks, 1);
	uint64_t *attr = report_alloc(blocks.n_samples, sizeof *attr);
	struct psr_model *out;
	struct psr_error err;

	for (uint32_t i = 0; i < blocks.n_blocks; i++)
		flags[i] = (uint8_t)((blocks.flags[i] & ~PSR_BLOCK_TWO_SIDED) | (kind == TWO_SIDED ? PSR_BLOCK_TWO_SIDED : 0));
	for (uint64_t i = 0; i < blocks.n_samples; i++)
		attr[i] = (blocks.attr[i] & 0xffffffffff) | (kind == SHINY ? gloss : 0);
	blocks.flags = flags;
	blocks.attr = attr;
	if (psr_model_create(&out, psr_model_info(model), &blocks, NULL, &err) != PSR_OK)
		report_die("a variant of the model", err.text);
	free(flags);
	free(attr);
	return out;
}

static void set_lights(struct stage *stage, const struct scene_film *film)
{
	const struct psr_model_info *info = psr_model_info(film->model);

	for (uint32_t i = 0; i < stage->look->n_lights; i++) {
		const double turn = 2.4 * i, color = 1.0 / stage->look->n_lights;
		struct psr_light *light = &stage->light[i];

		*light = film->light;
		light->kind = stage->look->light;
		light->casts_shadow = stage->look->shadow != NO_SHADOW;
		for (int k = 0; k < 3; k++)
			light->color[k] = color;
		if (i > 0) {
			light->direction[0] = -cos(turn);
			light->direction[1] = -0.7;
			light->direction[2] = -sin(turn) - 1;
		}
		if (light->kind == PSR_LIGHT_DIRECTIONAL)
			continue;
		for (int k = 0; k < 3; k++)
			light->position[k] = (info->box_min[k] + info->box_max[k]) / 2 - 2 * info->scale * light->direction[k];
		light->outer = 0.6;
		light->inner = 0.5;
	}
}

static void scene(struct psr_scene *out, int frame, const void *userdata)
{
	struct stage *stage = (struct stage *)userdata;

	scene_film_frame(out, &stage->film, frame);
	out->instance = stage->instance;
	out->n_instances = stage->look->n_small > 0 ? stage->look->n_small : 1;
	out->light = stage->light;
	out->n_lights = stage->look->n_lights;
	if (stage->look->shadow == NEW_SHADOW)
		stage->light[0].direction[0] = 0.55 + 1e-4 * frame;
}

static void prepare(struct stage *stage, struct price_side *side, const struct look *look,
                    struct psr_model *const model[N_KINDS], const struct scene_film *film)
{
	stage->look = look;
	stage->film = *film;
	stage->film.zoom *= look->zoom > 0 ? look->zoom : 1;
	stage->film.model = stage->model = model[look->kind];
	if (look->n_small > 0) { /* all of the room is in the picture, and the first are in its middle */
		struct psr_instance grid[MOST_INSTANCES];

		stage->film.zoom = 1;
		memset(stage->film.aim, 0, sizeof stage->film.aim);
		scene_spread(grid, &stage->film, stage->model, MOST_INSTANCES);
		for (int i = 0; i < MOST_INSTANCES; i++)
			stage->instance[i] = grid[(i + MIDDLE) % MOST_INSTANCES];
	} else {
		stage->instance[0] = stage->film.instance;
		stage->instance[0].model = stage->model;
	}
	set_lights(stage, film);
	render_settings_default(&side->settings, SIDE, SIDE);
	side->settings.cull_tests &= ~look->without_tests;
	side->settings.is_full = look->is_full;
	side->settings.smooth = look->is_smooth;
	side->has_depth = look->has_depth;
	side->scene = scene;
	side->userdata = stage;
}

static void measure(struct price *price, const struct row *row, struct psr_model *const model[N_KINDS],
                    const struct scene_film *film, int n_threads)
{
	struct stage *stage = report_alloc(2, sizeof *stage);
	struct price_side with, without;

	prepare(&stage[0], &with, &row->with, model, film);
	prepare(&stage[1], &without, &row->without, model, film);
	price_measure(price, &with, &without, N_FRAMES, n_threads);
	free(stage);
}

static void print_row(const struct row *row, const struct price *one, const struct price *all)
{
	cJSON *item = report_add(report_array("effects"));
	double sum = 0;

	for (int s = 0; s < PSR_N_STAGES; s++)
		sum += one->stage_ms[s];
	printf("%-34s %8.2f %+8.2f %+6.0f %% | %8.2f %+8.2f %+6.0f %% |", row->name, one->ms, one->more_ms,
	       100 * one->more_ms / (one->ms - one->more_ms), all->ms, all->more_ms,
	       100 * all->more_ms / (all->ms - all->more_ms));
	report_text(item, "group", row->group);
	report_text(item, "effect", row->name);
	report_number(item, "ms_one", one->ms);
	report_number(item, "more_one", one->more_ms);
	report_number(item, "ms_all", all->ms);
	report_number(item, "more_all", all->more_ms);
	for (int s = 0; s < PSR_N_STAGES; s++) {
		printf(" %6.1f%%", 100 * one->stage_ms[s] / sum);
		report_number(item, psr_stage_name((enum psr_stage)s), one->stage_ms[s] / sum);
	}
	puts("");
	fflush(stdout);
}

static void print_head(const struct effects *effects, const struct scene_film *film)
{
	printf("What effects cost: the %s at %dx%d, half covered, %.2f pixels between samples; ms a frame, and how many more than "
	       "without\nthe effect: medians of %d pairs of frames, drawn in turn while the camera swings. Of one thread processor time,\n"
	       "and which part of it each stage takes.\n",
	       effects->name, SIDE, SIDE, film->magnification, N_FRAMES);
	printf("%-34s %26s | %20d threads |", "", "1 thread", effects->n_threads);
	for (int s = 0; s < PSR_N_STAGES; s++)
		printf(" %7s", psr_stage_name((enum psr_stage)s));
	puts("");
}

static const char *text_of(const cJSON *item, const char *name)
{
	return cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(item, name));
}

/* Bars, of which those beyond the ends are cut; numbers beside them are whole. */
#define LEAST_BAR (-10)
#define MOST_BAR 34

static void plot(const struct effects *effects)
{
	char path[4096];
	const char *argv[] = { "/usr/bin/env", "gnuplot", path, NULL };
	const cJSON *array = report_array("effects"), *item;
	struct child_use use;
	FILE *file;
	int at = 0;

	snprintf(path, sizeof path, "%s/effects.gnuplot", effects->out);
	file = fopen(path, "w");
	if (file == NULL)
		report_die(path, "cannot be written");
	const int n = cJSON_GetArraySize(array);

	fprintf(file, "set terminal pngcairo size 900,%d background 'white'\nset output '%s/effects.png'\n"
	        "set title 'the %s at %dx%d, 1 thread'\nset xlabel 'ms more than without'\n"
	        "set xrange [%d:%d]\nset yrange [%d:-1]\nset grid xtics\nset style fill solid 0.8\nunset key\nset ytics (",
	        120 + 20 * n, effects->out, effects->name, SIDE, SIDE, LEAST_BAR, MOST_BAR, n);
	cJSON_ArrayForEach(item, array) {
		fprintf(file, "%s\"%s: %s\" %d", at > 0 ? ", " : "", text_of(item, "group"), text_of(item, "effect"), at);
		at++;
	}
	fputs(")\nplot '-' using ($1/2):2:($1/2):(0.4) with boxxyerror linecolor rgb '#4070a0', "
	      "'-' using ($1):2:3 with labels left offset 0.5,0\n", file);
	for (int labels = 0; labels < 2; labels++) {
		at = 0;
		cJSON_ArrayForEach(item, array) {
			const double more = cJSON_GetNumberValue(cJSON_GetObjectItemCaseSensitive(item, "more_one"));
			const double shown = fmin(fmax(more, LEAST_BAR), MOST_BAR - 4);

			fprintf(file, "%.4f %d %+.2f\n", labels ? fmax(shown, 0) : shown, at++, more);
		}
		fputs("e\n", file);
	}
	if (fclose(file) != 0)
		report_die(path, "cannot be written");
	if (child_run(&use, argv) != 0)
		printf("\nNo picture: gnuplot is missing, or refuses %s\n", path);
}

void effects_prices(const struct effects *effects)
{
	static const struct scene_picture picture = { "", SIDE, SIDE, 0.5 };
	static const struct row base = { "frame", "ambient light only", { .n_lights = 0 }, { .n_lights = 0 } };
	struct psr_model *model[N_KINDS];
	struct scene_film film;
	struct price one, all;
	const char *group = "";

	for (int k = PLAIN; k <= TWO_SIDED; k++)
		model[k] = variant(effects->model, (enum kind)k);
	model[LEVEL_1] = scene_level(model[PLAIN], 1);
	model[LEVEL_2] = scene_level(model[PLAIN], 2);
	scene_film_init(&film, &picture, effects->model, effects->aim);
	print_head(effects, &film);
	measure(&one, &base, model, &film, 1);
	measure(&all, &base, model, &film, effects->n_threads);
	print_row(&base, &one, &all);
	for (size_t i = 0; i < N_ROWS; i++) {
		if (strcmp(group, rows[i].group) != 0)
			printf("%s\n", rows[i].group);
		group = rows[i].group;
		measure(&one, &rows[i], model, &film, 1);
		measure(&all, &rows[i], model, &film, effects->n_threads);
		print_row(&rows[i], &one, &all);
	}
	plot(effects);
	for (int k = PLAIN; k < N_KINDS; k++)
		psr_model_unref(model[k]);
}

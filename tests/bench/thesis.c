/* [G] 8 and 7.3.1 beside ours: the same sizes of pictures, models of the same names. */
#include <stdio.h>
#include "isolate.h"
#include "ours.h"
#include "parts.h"
#include "report.h"

#define SIDE 256
#define RADIANS (3.14159265358979323846 / 180)

/* [G] table 8.2, ms on a Pentium II of 333 MHz. */
enum { INIT, VISIBILITY, WARP, FIND_GAPS, SHADE, PULL, PUSH, TOTAL, N_COLUMNS };
static const struct {
	const char *name;
	double ms[N_COLUMNS];
} thesis[] = {
	{ "chair", { 9, 3, 44, 3, 14, 7, 2, 82 } },
	{ "dragon", { 10, 3, 36, 7, 18, 7, 3, 84 } },
	{ "gavel", { 9, 3, 38, 6, 20, 7, 2, 85 } },
	{ "kittyhawk", { 10, 5, 62, 8, 23, 7, 3, 118 } },
	{ "pencil", { 10, 1, 15, 5, 12, 7, 2, 52 } },
	{ "pinetree", { 9, 9, 226, 4, 25, 7, 2, 282 } },
	{ "plant", { 10, 7, 74, 9, 24, 7, 3, 134 } },
	{ "sailboat", { 9, 2, 33, 6, 18, 7, 2, 77 } },
	{ "table", { 10, 6, 52, 7, 21, 7, 3, 106 } },
	{ "teapot", { 10, 5, 55, 7, 25, 7, 2, 111 } },
	{ "top", { 9, 6, 61, 3, 21, 6, 2, 108 } },
	{ "toybird", { 10, 4, 50, 8, 23, 7, 3, 105 } },
	{ "tree", { 9, 11, 171, 6, 27, 7, 3, 234 } },
	{ "wheel", { 10, 8, 73, 4, 29, 6, 2, 132 } },
};
#define N_THESIS (sizeof thesis / sizeof thesis[0])

/* [G] 7.3.1, figure 7.4: two directional lights and a spot, without shadows; a map took 25 % of a frame. */
#define FIGURE_MS 204.0
#define NEW_MAP_SHARE 25
#define KEPT_MAP_SHARE 8
#define FIGURE_MODEL "teapot"

struct job {
	struct scene_film film;
	struct psr_light light[3];
	uint32_t n_lights; /* 0: the film's */
	enum { NO_SHADOWS, KEPT_MAPS, NEW_MAPS } shadows; /* new: lights move from frame to frame */
	int n_threads;
	struct ours_result one, all;
};

static void scene(struct psr_scene *out, int frame, const void *userdata)
{
	static struct psr_light light[3];
	const struct job *job = userdata;

	scene_film_frame(out, &job->film, frame);
	if (job->n_lights > 0) {
		for (uint32_t i = 0; i < job->n_lights; i++) {
			light[i] = job->light[i];
			light[i].casts_shadow = job->shadows != NO_SHADOWS;
			light[i].direction[0] += job->shadows == NEW_MAPS ? 0.001 * frame : 0;
		}
		out->light = light;
		out->n_lights = job->n_lights;
	}
}

static void draw(void *arg)
{
	struct job *job = arg;
	struct ours_settings settings = { .width = SIDE, .height = SIDE, .n_threads = 1, .least_ms = 150, .most_ms = 500,
		                              .n_frames = SCENE_FRAMES, .scene = scene, .userdata = job };

	ours_measure(&job->one, &settings, NULL);
	settings.n_threads = job->n_threads;
	ours_measure(&job->all, &settings, NULL);
}

static struct psr_model *film_of(struct job *job, const struct part *part, const char *name)
{
	static const struct scene_picture picture = { "256x256", SIDE, SIDE, 0 };
	static const double aim[3];
	struct psr_model *model;
	char source[4096];

	scene_standard(source, part->psr_model, part->models, name);
	model = scene_model(part->psr_model, part->models, name, source, SIDE);
	scene_film_init(&job->film, &picture, model, aim);
	scene_film_magnify(&job->film, 1);
	job->n_threads = part->n_threads;
	return model;
}

/* Our stages under the thesis's heads. */
static void columns(double ms[N_COLUMNS], const struct ours_result *r)
{
	ms[INIT] = r->stage_ms[PSR_STAGE_PLAN];
	ms[VISIBILITY] = r->stage_ms[PSR_STAGE_CULL];
	ms[WARP] = r->stage_ms[PSR_STAGE_WARP];
	ms[FIND_GAPS] = r->stage_ms[PSR_STAGE_GAPS];
	ms[SHADE] = r->stage_ms[PSR_STAGE_RESOLVE] + r->stage_ms[PSR_STAGE_SHADE];
	ms[PULL] = r->stage_ms[PSR_STAGE_FILL];
	ms[TOTAL] = r->ms;
}

void thesis_table(const struct part *part)
{
	static const int shown[] = { INIT, VISIBILITY, WARP, FIND_GAPS, SHADE, PULL, TOTAL };
	static const char *const head[] = { "init", "vis.", "warp", "gaps", "shade", "pull+push", "total" };
	const size_t n_shown = sizeof shown / sizeof shown[0];
	struct job *job = isolate_alloc(sizeof *job);

	printf("\n[G] table 8.2, ms at %dx%d, one light, a sample a pixel: ours on one thread, and the factor to 1998 (a "
	       "Pentium II\nof 333 MHz). Clearing buffers is init in the thesis and part of warp here; pull and push are "
	       "one stage here.\n%-9s |", SIDE, SIDE, "model");
	for (size_t c = 0; c < n_shown; c++)
		printf(" %15s", head[c]);
	printf(" | %d threads, factor\n", part->n_threads);
	for (size_t i = 0; i < N_THESIS; i++) {
		cJSON *item = report_add(report_array("table_8_2"));
		double ms[N_COLUMNS];
		struct psr_model *model = film_of(job, part, thesis[i].name);

		isolate_run(draw, job);
		columns(ms, &job->one);
		printf("%-9s |", thesis[i].name);
		report_text(item, "model", thesis[i].name);
		report_number(item, "samples_drawn", job->one.n_samples_drawn);
		for (size_t c = 0; c < n_shown; c++) {
			const double then = thesis[i].ms[shown[c]] + (shown[c] == PULL ? thesis[i].ms[PUSH] : 0);

			printf(" %7.3f %6.0f x", ms[shown[c]], report_ratio(then, ms[shown[c]]));
			report_number(item, head[c], ms[shown[c]]);
		}
		printf(" | %7.3f %6.0f x\n", job->all.ms, thesis[i].ms[TOTAL] / job->all.ms);
		report_number(item, "thesis_total", thesis[i].ms[TOTAL]);
		report_number(item, "total_all_threads", job->all.ms);
		psr_model_unref(model);
	}
	isolate_free(job, sizeof *job);
	fflush(stdout);
}

static void figure_row(struct job *job, cJSON *item, const char *what, uint32_t n_lights, int shadows)
{
	job->n_lights = n_lights;
	job->shadows = shadows;
	isolate_run(draw, job);
	printf("%-52s %10.3f %10.3f\n", what, job->one.ms, job->all.ms);
	report_number(item, what, job->one.ms);
}

void thesis_figure(const struct part *part)
{
	struct job *job = isolate_alloc(sizeof *job);
	struct psr_model *model = film_of(job, part, FIGURE_MODEL);
	const struct psr_model_info *info = psr_model_info(model);
	cJSON *item = report_object("figure_7_4");

	job->light[0] = job->film.light;
	job->light[1] = (struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { -0.9, -0.5, -0.3 },
		                                .color = { 0.5, 0.5, 0.5 } };
	job->light[2] = (struct psr_light){ .kind = PSR_LIGHT_SPOT, .direction = { 0, -1, 0 }, .color = { 0.8, 0.8, 0.8 },
		                                .inner = 15 * RADIANS, .outer = 25 * RADIANS };
	for (int k = 0; k < 3; k++)
		job->light[2].position[k] = (info->box_min[k] + info->box_max[k]) / 2 + (k == 1 ? 2 * info->scale : 0);
	printf("\n[G] figure 7.4: %s at %dx%d, ms; %.0f ms without shadows in 1998\n%-52s %10s %8d t. %s\n", FIGURE_MODEL, SIDE,
	       SIDE, FIGURE_MS, "", "1 thread", part->n_threads, "factor to 1998 on one thread");
	figure_row(job, item, "one directional light", 1, NO_SHADOWS);
	const double plain = job->one.ms;
	figure_row(job, item, "its shadow map kept", 1, KEPT_MAPS);
	const double kept = job->one.ms;
	figure_row(job, item, "a new map in each frame", 1, NEW_MAPS);
	const double share = job->one.stage_ms[PSR_STAGE_SHADOW] / job->one.ms;
	figure_row(job, item, "two directional lights and a spot", 3, NO_SHADOWS);
	printf("%80.0f x\n", FIGURE_MS / job->one.ms);
	figure_row(job, item, "with shadows, the maps kept", 3, KEPT_MAPS);
	figure_row(job, item, "with shadows, new maps in each frame", 3, NEW_MAPS);
	report_target("a new shadow map of one light", 100 * share, "% of the frame", REPORT_AT_MOST, NEW_MAP_SHARE);
	report_target("a shadow map that is kept", 100 * (kept - plain) / kept, "% of the frame", REPORT_AT_MOST, KEPT_MAP_SHARE);
	report_text(item, "model", FIGURE_MODEL);
	report_number(item, "thesis", FIGURE_MS);
	psr_model_unref(model);
	isolate_free(job, sizeof *job);
	fflush(stdout);
}

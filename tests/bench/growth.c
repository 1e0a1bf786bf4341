/* How time grows: with samples, pixels, lights, instances. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "isolate.h"
#include "base/vec.h"
#include "ours.h"
#include "parts.h"
#include "report.h"
#include "model/blocks.h"

#define SIDE 1024
#define FEWEST_SAMPLES 1e5
#define MOST_SAMPLES 64e6
#define GROWTH_FRAMES 8

struct job {
	struct scene_film film;
	struct psr_instance instance[PSR_MAX_INSTANCES];
	struct psr_light light[PSR_MAX_LIGHTS];
	uint32_t n_instances, n_lights;
	int n_threads;
	struct ours_result result;
};

static void scene(struct psr_scene *out, int frame, const void *userdata)
{
	const struct job *job = userdata;

	scene_film_frame(out, &job->film, frame);
	out->instance = job->instance;
	out->n_instances = job->n_instances;
	out->light = job->light;
	out->n_lights = job->n_lights;
}

static void draw(void *arg)
{
	struct job *job = arg;
	const struct ours_settings settings = {
		.width = job->film.picture.width, .height = job->film.picture.height, .n_threads = job->n_threads,
		.least_ms = 60, .most_ms = 500, .n_frames = GROWTH_FRAMES, .scene = scene, .userdata = job,
	};

	ours_measure(&job->result, &settings, NULL);
}

/* One instance and one light of a film of the model in a square picture. */
static void prepare(struct job *job, const struct part *part, struct psr_model *model, uint32_t side, double coverage)
{
	const struct scene_picture picture = { "", side, side, coverage };
	static const double aim[3];

	scene_film_init(&job->film, &picture, model, aim);
	job->n_instances = job->n_lights = 1;
	job->instance[0] = job->film.instance;
	job->light[0] = job->film.light;
	job->n_threads = part->n_threads;
}

/* n instances in the room of one. */
static void spread(struct job *job, const struct psr_model *model, uint32_t n)
{
	job->n_instances = n;
	scene_spread(job->instance, &job->film, model, n);
}

static cJSON *add(const char *series, double x, const struct job *job)
{
	cJSON *item = report_add(report_array(series));

	report_number(item, "x", x);
	report_number(item, "ms", job->result.ms);
	report_number(item, "samples", job->result.n_samples);
	report_number(item, "samples_drawn", job->result.n_samples_drawn);
	report_number(item, "pixels_covered", job->result.n_covered);
	for (int s = 0; s < PSR_N_STAGES; s++) {
		cJSON *stage = cJSON_AddObjectToObject(item, psr_stage_name((enum psr_stage)s));

		report_number(stage, "ms", job->result.stage_ms[s]);
		report_number(stage, "count", job->result.count[s]);
	}
	return item;
}

static double warp_ms(const struct ours_result *r)
{
	return r->stage_ms[PSR_STAGE_CULL] + r->stage_ms[PSR_STAGE_WARP];
}

/* n copies of one level of a model, and of the model with all levels from there on. */
static void sample_row(struct job *job, const struct part *part, struct psr_model *model, struct psr_model *single,
                       uint32_t n)
{
	cJSON *item;
	double samples;

	prepare(job, part, single, SIDE, 0);
	spread(job, single, n);
	isolate_run(draw, job);
	samples = job->result.n_samples;
	item = add("samples", samples, job);
	printf("%10.3f %8u | %9.2f %9.0f %9.2f |", samples / 1e6, n, job->result.ms,
	       report_ratio(job->result.count[PSR_STAGE_WARP], warp_ms(&job->result)) / 1e3,
	       job->result.ms * 1e6 / samples);
	if (model != NULL) {
		spread(job, model, n);
		isolate_run(draw, job);
		printf(" %9.2f %9.3f", job->result.ms, job->result.n_samples_drawn / 1e6);
		report_number(item, "ms_with_levels", job->result.ms);
		report_number(item, "samples_drawn_with_levels", job->result.n_samples_drawn);
	}
	puts("");
	fflush(stdout);
}

static uint64_t samples_of_level(const struct psr_model *model, unsigned level)
{
	const struct psr_blocks *b = psr_model_blocks(model);
	uint64_t n = 0;

	for (uint32_t i = 0; i < b->n_blocks; i++)
		n += psr_blocks_level(b, i) == level ? (uint64_t)__builtin_popcountll(b->mask[i]) : 0;
	return n;
}

static void samples(struct job *job, const struct part *part, struct psr_model *model)
{
	printf("\nSamples, at %dx%d: levels of the model alone, then copies of the finest in the room of one, and with all "
	       "levels\n", SIDE, SIDE);
	printf("%10s %8s | %9s %9s %9s | %9s %9s\n", "million", "copies", "one level", "warp", "ns a", "levels", "of them");
	printf("%10s %8s | %9s %9s %9s | %9s %9s\n", "samples", "", "ms", "Mpt/s", "sample", "ms", "drawn, M");
	for (unsigned level = psr_model_blocks(model)->n_levels; level-- > 0;) {
		const double n = (double)samples_of_level(model, level);
		struct psr_model *single;

		if (n < FEWEST_SAMPLES && level > 0)
			continue;
		single = scene_level(model, level);
		sample_row(job, part, level == 0 ? model : NULL, single, 1);
		for (uint32_t copies = 2; level == 0 && copies * n < MOST_SAMPLES * sqrt(2.0) && copies <= 256; copies *= 2)
			sample_row(job, part, model, single, copies);
		psr_model_unref(single);
	}
}

static void pixels(struct job *job, const struct part *part, struct psr_model *model)
{
	printf("\nPixels: the model half covers a square picture\n%6s | %9s %9s | %9s\n", "side", "Mpixel", "ms",
	       "ns a pixel");
	for (uint32_t side = 256; side <= 4096; side *= 2) {
		const double n = (double)side * side;

		prepare(job, part, model, side, 0.5);
		isolate_run(draw, job);
		add("pixels", n, job);
		printf("%6u | %9.3f %9.2f | %9.2f\n", side, n / 1e6, job->result.ms, job->result.ms * 1e6 / n);
		fflush(stdout);
	}
}

static void set_lights(struct job *job, enum psr_light_kind kind, uint32_t n)
{
	const struct psr_model_info *info = psr_model_info(job->film.model);

	job->n_lights = n;
	for (uint32_t i = 0; i < n; i++) {
		const double turn = 2.4 * i, color = 1.0 / n;

		job->light[i] = (struct psr_light){ .kind = kind, .color = { color, color, color },
			                                .direction = { -cos(turn), -0.7, -sin(turn) - 1 } };
		for (int k = 0; k < 3; k++)
			job->light[i].position[k] = (info->box_min[k] + info->box_max[k]) / 2
			                            - 2 * info->scale * job->light[i].direction[k];
	}
}

static void lights(struct job *job, const struct part *part, struct psr_model *model)
{
	printf("\nLights, at %dx%d, half covered\n%6s | %12s %12s\n", SIDE, SIDE, "lights", "directional", "point");
	prepare(job, part, model, SIDE, 0.5);
	for (uint32_t n = 0; n <= PSR_MAX_LIGHTS; n += n > 0 ? n : 1) {
		cJSON *item;

		set_lights(job, PSR_LIGHT_DIRECTIONAL, n);
		isolate_run(draw, job);
		item = add("lights", n, job);
		printf("%6u | %12.2f", n, job->result.ms);
		set_lights(job, PSR_LIGHT_POINT, n);
		isolate_run(draw, job);
		report_number(item, "ms_point", job->result.ms);
		printf(" %12.2f\n", job->result.ms);
		fflush(stdout);
	}
}

static void instances(struct job *job, const struct part *part, struct psr_model *model)
{
	printf("\nInstances of the teapot, at %dx%d, in the room of one\n%9s | %9s %12s %12s\n", SIDE, SIDE,
	       "instances", "ms", "samples, M", "drawn, M");
	prepare(job, part, model, SIDE, 0);
	for (uint32_t n = 1; n <= PSR_MAX_INSTANCES; n *= 4) {
		spread(job, model, n);
		isolate_run(draw, job);
		add("instances", n, job);
		printf("%9u | %9.2f %12.3f %12.3f\n", n, job->result.ms, job->result.n_samples / 1e6,
		       job->result.n_samples_drawn / 1e6);
		fflush(stdout);
	}
}

void growth_run(const struct part *part, const struct subject *subject)
{
	struct job *job = isolate_alloc(sizeof *job);
	struct psr_model *model = scene_model(part->psr_model, part->models, subject->file, subject->source,
	                                      subject->resolution[N_PICTURES - 1]);
	struct psr_model *small;
	char source[4096];

	printf("\nHow time grows: %s at %d, %d threads, nothing encoded\n", subject->name,
	       subject->resolution[N_PICTURES - 1], part->n_threads);
	samples(job, part, model);
	pixels(job, part, model);
	lights(job, part, model);
	psr_model_unref(model);
	scene_standard(source, part->psr_model, part->models, "teapot");
	small = scene_model(part->psr_model, part->models, "teapot", source, 256);
	instances(job, part, small);
	psr_model_unref(small);
	isolate_free(job, sizeof *job);
}

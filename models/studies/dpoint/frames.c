/* Frames of differential points beside those of blocks: time, bytes, and how far from the truth, where a highlight is. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/vec.h"
#include "measure/measure.h"
#include "model/points.h"
#include "model/tree.h"
#include "models/studies/tables/tables.h"
#include "render/stages.h"
#include "sample/dpoint/of_mesh.h"
#include "study_dpoint.h"

#define WIDTH 800    /* as in [K] 6 */
#define HEIGHT 600
#define PIXELS ((size_t)WIDTH * HEIGHT)
#define RAYS 4       /* along the side of a pixel */
#define TRIALS 9     /* frames of each representation, in turn; the median counts */
#define DISTANCE 4   /* of the eye, in radii */
#define ROUGHNESS 0.25f
#define N_SIZES 6

/* Pixels of the picture across a pixel that the models are for. */
static const double magnification[N_SIZES] = { 0.5, 1, 2, 4, 8, 16 };

enum { KB, KB_BLOCKS, FPS, FPS_BLOCKS, RATE, DB, DB_BLOCKS, BRIGHT, BRIGHT_BLOCKS, HOLES, LEAKS, WRONG_BLOCKS, N_COLUMNS };

static const struct study_column columns[N_COLUMNS] = {
	[KB] = { "kB", "kilobytes", 0 }, [KB_BLOCKS] = { "blocks", "blocks_kilobytes", 0 },
	[FPS] = { "fps", "frames_per_second", 0 }, [FPS_BLOCKS] = { "blocks", "blocks_frames_per_second", 0 },
	[RATE] = { "Mpt/s", "million_points_per_second", 1 }, [DB] = { "dB", "db", 2 },
	[DB_BLOCKS] = { "blocks", "blocks_db", 2 }, [BRIGHT] = { "bright", "bright_db", 2 },
	[BRIGHT_BLOCKS] = { "blocks", "blocks_bright_db", 2 }, [HOLES] = { "holes", "holes", 0 },
	[LEAKS] = { "leaks", "leaks_a_million", 0 }, [WRONG_BLOCKS] = { "blocks", "blocks_holes_and_leaks_a_million", 0 },
};

struct subject {
	struct study *study;
	const struct study_model *of;
	struct psr_source *source;
	struct psr_model *model[2]; /* of points, of blocks */
	struct psr_frame frame;
	struct psr_source_planes truth;
	double target[3];           /* the brightest place */
	int row;
};

struct stage {
	struct psr_scene scene;
	struct psr_instance instance;
	struct psr_light light;
};

static double *value(const struct subject *s, int column)
{
	return study_at(&s->study->table, s->row, 0, column);
}

static int make_points(struct subject *s)
{
	struct dpoint_build_options options;
	struct dpoint_build_report report;
	struct psr_model_info info = { .up = { 0, 1, 0 } };
	struct dpoint_set set;
	int rc;

	dpoint_build_options_default(&options, s->study->resolution);
	options.pool = s->study->pool;
	rc = dpoint_of_mesh(&set, &info, &report, s->of->mesh, &options, s->study->err);
	if (rc == PSR_OK)
		rc = psr_model_create_of(&s->model[0], &info, &(struct psr_model_parts){ .points = &set }, NULL, s->study->err);
	dpoint_set_fini(&set);
	return rc;
}

/* The picture is so high that a pixel is 2 / resolution radii of the model over the magnification. */
static void set_stage(struct stage *stage, const struct subject *s, double times)
{
	const double across = HEIGHT * 2.0 / s->study->resolution / times;
	const double away = DISTANCE * s->of->scale;
	struct psr_camera *camera = &stage->scene.camera;
	double toward[3] = { 0.5, 0.45, 1 };

	memset(stage, 0, sizeof *stage);
	v3d_normalize(toward, toward);
	v3d_set(camera->up, 0, 1, 0);
	memcpy(camera->target, times > 1 ? s->target : s->of->origin, sizeof camera->target);
	memcpy(camera->eye, s->of->origin, sizeof camera->eye);
	v3d_add_scaled(camera->eye, camera->eye, away, toward);
	camera->kind = PSR_CAMERA_PERSPECTIVE;
	camera->fov_y = 2 * atan(across / 2 / (DISTANCE - (times > 1)));
	stage->instance = (struct psr_instance){ .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	stage->light = (struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 0.3, -0.9, -0.7 },
		                               .color = { 1.5, 1.5, 1.5 } };
	v3d_set(stage->scene.ambient, 0.1, 0.1, 0.1);
	stage->scene.instance = &stage->instance;
	stage->scene.light = &stage->light;
	stage->scene.n_instances = stage->scene.n_lights = 1;
}

static int draw(const struct subject *s, struct stage *stage, int k, struct psr_frame *frame)
{
	struct render_settings settings;

	render_settings_default(&settings, WIDTH, HEIGHT);
	stage->instance.model = s->model[k];
	return renderer_draw(s->study->renderer, &stage->scene, &settings, s->study->pool, frame, s->study->err);
}

static int compare_doubles(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

static int put_times(const struct subject *s, struct stage *stage)
{
	struct psr_frame quiet = { .width = WIDTH, .height = HEIGHT, .rgb = s->frame.rgb };
	double time[2][TRIALS];

	for (int trial = -1; trial < TRIALS; trial++)
		for (int k = 0; k < 2; k++) {
			const uint64_t start = clock_ns();
			const int rc = draw(s, stage, k, &quiet);

			if (rc != PSR_OK)
				return rc;
			if (trial >= 0)
				time[k][trial] = (double)(clock_ns() - start) * 1e-9;
		}
	for (int k = 0; k < 2; k++)
		qsort(time[k], TRIALS, sizeof time[k][0], compare_doubles);
	*value(s, FPS) = 1 / time[0][TRIALS / 2];
	*value(s, FPS_BLOCKS) = 1 / time[1][TRIALS / 2];
	*value(s, RATE) = *value(s, FPS) * psr_model_point_set(s->model[0])->n_points * 1e-6;
	return PSR_OK;
}

static int luminance(const uint8_t *rgb)
{
	return 2 * rgb[0] + 5 * rgb[1] + rgb[2];
}

/* Decibels of the pixels that the truth has brighter than the middle between black and its brightest. */
static double bright_db(const struct subject *s)
{
	int most = 0;
	double sum = 0, n = 0;

	for (size_t i = 0; i < PIXELS; i++)
		most = s->truth.coverage[i] >= 1 && luminance(s->truth.rgb[i]) > most ? luminance(s->truth.rgb[i]) : most;
	for (size_t i = 0; i < PIXELS; i++) {
		if (s->truth.coverage[i] < 1 || 4 * luminance(s->truth.rgb[i]) < 3 * most)
			continue;
		for (int c = 0; c < 3; c++) {
			const double d = (double)s->frame.rgb[3 * i + (size_t)c] - s->truth.rgb[i][c];

			sum += d * d;
		}
		n += 3;
	}
	return 10 * log10(255.0 * 255.0 * n / sum);
}

static int put_errors(const struct subject *s, struct stage *stage)
{
	for (int k = 0; k < 2; k++) {
		struct psr_errors errors;
		struct psr_frame frame = s->frame;
		int rc = draw(s, stage, k, &frame);

		if (rc == PSR_OK)
			rc = psr_errors_measure(&errors, &frame, &s->truth, psr_model_info(s->model[k])->spacing, s->study->err);
		if (rc != PSR_OK)
			return rc;
		*value(s, k ? DB_BLOCKS : DB) = errors.psnr_inside;
		*value(s, k ? BRIGHT_BLOCKS : BRIGHT) = bright_db(s);
		if (k == 0) {
			*value(s, HOLES) = (double)errors.n_holes;
			*value(s, LEAKS) = 1e6 * (double)errors.n_leaks / (double)errors.n_inside;
		} else {
			*value(s, WRONG_BLOCKS) = 1e6 * (double)(errors.n_holes + errors.n_leaks) / (double)errors.n_inside;
		}
	}
	return PSR_OK;
}

static int draw_truth(struct subject *s, const struct stage *stage)
{
	const struct psr_source_shot shot = { s->source, &stage->scene, WIDTH, HEIGHT, RAYS, s->study->n_threads };

	return psr_source_draw(&shot, &s->truth, s->study->err);
}

/* The place of the brightest pixel. */
static int find_target(struct subject *s)
{
	const struct psr_camera *camera;
	double forward[3], right[3], down[3], pixel;
	struct stage stage;
	size_t best = 0;
	int rc;

	set_stage(&stage, s, 1);
	rc = draw_truth(s, &stage);
	for (size_t i = 0; i < PIXELS && rc == PSR_OK; i++)
		if (s->truth.coverage[i] >= 1 && (s->truth.coverage[best] < 1 ||
		                                  luminance(s->truth.rgb[i]) > luminance(s->truth.rgb[best])))
			best = i;
	camera = &stage.scene.camera;
	pixel = 2 * tan(camera->fov_y / 2) / HEIGHT;
	v3d_sub(forward, camera->target, camera->eye);
	v3d_normalize(forward, forward);
	v3d_cross(right, forward, camera->up);
	v3d_normalize(right, right);
	v3d_cross(down, forward, right);
	if (rc != PSR_OK)
		return rc;
	v3d_add_scaled(forward, forward, ((double)(best % WIDTH) + 0.5 - WIDTH / 2.0) * pixel, right);
	v3d_add_scaled(forward, forward, ((double)(best / WIDTH) + 0.5 - HEIGHT / 2.0) * pixel, down);
	memcpy(s->target, camera->eye, sizeof s->target);
	v3d_add_scaled(s->target, s->target, (double)s->truth.depth[best], forward);
	return PSR_OK;
}

static int run_model(struct subject *s)
{
	const struct study_model *model = s->of;
	int rc;

	for (uint32_t m = 0; m < model->mesh->n_materials; m++)
		model->mesh->material[m].roughness = ROUGHNESS;
	rc = psr_source_create(&s->source, model->mesh, s->study->err);
	if (rc == PSR_OK)
		rc = make_points(s);
	if (rc == PSR_OK)
		rc = study_build(&s->model[1], NULL, s->study, model);
	if (rc == PSR_OK)
		rc = find_target(s);
	for (int i = 0; i < N_SIZES && rc == PSR_OK; i++, s->row++) {
		struct stage stage;

		study_label(&s->study->table, s->row, "%.20s %g", model->name, magnification[i]);
		set_stage(&stage, s, magnification[i]);
		rc = draw_truth(s, &stage);
		if (rc == PSR_OK)
			rc = put_times(s, &stage);
		if (rc == PSR_OK)
			rc = put_errors(s, &stage);
		*value(s, KB) = (double)psr_model_bytes(s->model[0]) / 1e3;
		*value(s, KB_BLOCKS) = (double)psr_model_bytes(s->model[1]) / 1e3;
		study_step(s->study, model->name);
	}
	for (int k = 0; k < 2; k++)
		psr_model_unref(s->model[k]);
	psr_source_destroy(s->source);
	return rc;
}

int table_dpoint_frames(struct study *study)
{
	const struct study_form form = { "model, size", columns, N_COLUMNS };
	struct subject s = { .study = study };
	int rc = study_table_init(&study->table, form, study->n_models * N_SIZES, 1, study->err);

	study->total = study->n_models * N_SIZES;
	s.truth = (struct psr_source_planes){ .rgb = malloc(PIXELS * sizeof *s.truth.rgb),
		                                  .coverage = malloc(PIXELS * sizeof *s.truth.coverage),
		                                  .depth = malloc(PIXELS * sizeof *s.truth.depth),
		                                  .range = malloc(PIXELS * sizeof *s.truth.range) };
	if (rc == PSR_OK && (s.truth.rgb == NULL || s.truth.coverage == NULL || s.truth.depth == NULL || s.truth.range == NULL))
		rc = psr_fail(study->err, PSR_ERR_MEMORY, "no memory for pictures");
	if (rc == PSR_OK)
		rc = psr_renderer_create(&study->renderer, study->err);
	if (rc == PSR_OK)
		rc = psr_frame_alloc(&s.frame, WIDTH, HEIGHT, 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH, study->err);
	for (int m = 0; rc == PSR_OK && m < study->n_models; m++) {
		s.of = &study->model[m];
		s.source = NULL;
		s.model[0] = s.model[1] = NULL;
		rc = run_model(&s);
	}
	psr_frame_free(&s.frame);
	psr_renderer_destroy(study->renderer);
	free(s.truth.rgb);
	free(s.truth.coverage);
	free(s.truth.depth);
	free(s.truth.range);
	return rc;
}

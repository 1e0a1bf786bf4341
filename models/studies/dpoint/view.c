#include "view.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "base/vec.h"
#include "model/tree.h"
#include "render/stages.h"

#define WIDTH DPOINT_VIEW_WIDTH
#define HEIGHT DPOINT_VIEW_HEIGHT
#define PIXELS ((size_t)WIDTH * HEIGHT)
#define RAYS 4       /* along the side of a pixel */
#define TRIALS 9     /* frames of each way, in turn; the median counts */
#define DISTANCE 4   /* of the eye, in radii */

int dpoint_view_init(struct dpoint_view *view, struct study *study)
{
	*view = (struct dpoint_view){ .study = study };
	view->truth = (struct psr_source_planes){ .rgb = malloc(PIXELS * sizeof *view->truth.rgb),
		                                      .coverage = malloc(PIXELS * sizeof *view->truth.coverage),
		                                      .depth = malloc(PIXELS * sizeof *view->truth.depth),
		                                      .range = malloc(PIXELS * sizeof *view->truth.range) };
	if (view->truth.rgb == NULL || view->truth.coverage == NULL || view->truth.depth == NULL || view->truth.range == NULL)
		return psr_fail(study->err, PSR_ERR_MEMORY, "no memory for pictures");
	return psr_frame_alloc(&view->frame, WIDTH, HEIGHT, 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH, study->err);
}

void dpoint_view_fini(struct dpoint_view *view)
{
	psr_frame_free(&view->frame);
	psr_source_destroy(view->source);
	free(view->truth.rgb);
	free(view->truth.coverage);
	free(view->truth.depth);
	free(view->truth.range);
	memset(view, 0, sizeof *view);
}

int dpoint_view_table(struct dpoint_view *view, struct study *study, const struct dpoint_view_rows *rows, void *subject)
{
	int rc = study_table_init(&study->table, rows->form, study->n_models * rows->n, 1, study->err);

	*view = (struct dpoint_view){ .study = study };
	study->keep = NULL; /* of other materials than models of other studies */
	study->total = study->n_models * rows->n_steps;
	if (rc == PSR_OK)
		rc = psr_renderer_create(&study->renderer, study->err);
	if (rc == PSR_OK)
		rc = dpoint_view_init(view, study);
	for (int m = 0; rc == PSR_OK && m < study->n_models; m++)
		rc = rows->fill(subject, &study->model[m], rows->n * m);
	dpoint_view_fini(view);
	psr_renderer_destroy(study->renderer);
	return rc;
}

static void set_scene(struct dpoint_view *view, double across, int is_close)
{
	const struct study_model *of = view->of;
	struct psr_camera *camera = &view->scene.camera;
	double toward[3] = { 0.5, 0.45, 1 };

	memset(&view->scene, 0, sizeof view->scene);
	v3d_normalize(toward, toward);
	v3d_set(camera->up, 0, 1, 0);
	memcpy(camera->target, is_close ? view->target : of->origin, sizeof camera->target);
	memcpy(camera->eye, of->origin, sizeof camera->eye);
	v3d_add_scaled(camera->eye, camera->eye, DISTANCE * of->scale, toward);
	camera->kind = PSR_CAMERA_PERSPECTIVE;
	camera->fov_y = 2 * atan(across / 2 / (DISTANCE - is_close));
	view->instance = (struct psr_instance){ .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	view->light = (struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 0.3, -0.9, -0.7 },
		                              .color = { 1.5, 1.5, 1.5 } };
	v3d_set(view->scene.ambient, 0.1, 0.1, 0.1);
	view->scene.instance = &view->instance;
	view->scene.light = &view->light;
	view->scene.n_instances = view->scene.n_lights = 1;
}

static int draw(struct dpoint_view *view, const struct dpoint_way *way, struct psr_frame *frame)
{
	struct render_settings settings;
	struct psr_settings of_sub_pixels;

	if (way->pass > 0 || way->smooth != PSR_SMOOTH_NONE) {
		psr_settings_default(&of_sub_pixels, WIDTH, HEIGHT);
		of_sub_pixels.smooth = way->smooth;
		of_sub_pixels.pass = way->pass;
		view->instance.model = way->model;
		return psr_render(view->study->renderer, &view->scene, &of_sub_pixels, view->study->pool, frame,
		                  view->study->err);
	}
	render_settings_default(&settings, WIDTH, HEIGHT);
	settings.with_ewa = way->with_ewa;
	view->instance.model = way->model;
	return renderer_draw(view->study->renderer, &view->scene, &settings, view->study->pool, frame, view->study->err);
}

int dpoint_view_draw(struct dpoint_view *view, const struct dpoint_way *way)
{
	return draw(view, way, &view->frame);
}

static int draw_truth(struct dpoint_view *view)
{
	const struct psr_source_shot shot = { view->source, &view->scene, WIDTH, HEIGHT, RAYS, view->study->n_threads };

	view->instance.model = NULL;
	return psr_source_draw(&shot, &view->truth, view->study->err);
}

int dpoint_view_set(struct dpoint_view *view, double across, int is_close)
{
	set_scene(view, across, is_close);
	return draw_truth(view);
}

static int luminance(const uint8_t *rgb)
{
	return 2 * rgb[0] + 5 * rgb[1] + rgb[2];
}

/* The place of the brightest pixel. */
static void find_target(struct dpoint_view *view)
{
	const struct psr_camera *camera = &view->scene.camera;
	const struct psr_source_planes *truth = &view->truth;
	double forward[3], right[3], down[3], pixel;
	size_t best = 0;

	for (size_t i = 0; i < PIXELS; i++)
		if (truth->coverage[i] >= 1 && (truth->coverage[best] < 1 ||
		                                luminance(truth->rgb[i]) > luminance(truth->rgb[best])))
			best = i;
	pixel = 2 * tan(camera->fov_y / 2) / HEIGHT;
	v3d_sub(forward, camera->target, camera->eye);
	v3d_normalize(forward, forward);
	v3d_cross(right, forward, camera->up);
	v3d_normalize(right, right);
	v3d_cross(down, forward, right);
	v3d_add_scaled(forward, forward, ((double)(best % WIDTH) + 0.5 - WIDTH / 2.0) * pixel, right);
	v3d_add_scaled(forward, forward, ((double)(best / WIDTH) + 0.5 - HEIGHT / 2.0) * pixel, down);
	memcpy(view->target, camera->eye, sizeof view->target);
	v3d_add_scaled(view->target, view->target, (double)truth->depth[best], forward);
}

int dpoint_view_open(struct dpoint_view *view, const struct study_model *of, double across)
{
	int rc;

	for (uint32_t m = 0; m < of->mesh->n_materials; m++)
		of->mesh->material[m].roughness = DPOINT_VIEW_ROUGHNESS;
	view->of = of;
	psr_source_destroy(view->source);
	view->source = NULL;
	rc = psr_source_create(&view->source, of->mesh, view->study->err);
	if (rc == PSR_OK)
		rc = dpoint_view_set(view, across, 0);
	if (rc == PSR_OK)
		find_target(view);
	return rc;
}

static int compare_doubles(const void *a, const void *b)
{
	const double x = *(const double *)a, y = *(const double *)b;

	return (x > y) - (x < y);
}

int dpoint_view_time(double *fps, struct dpoint_view *view, const struct dpoint_way *way, int n)
{
	struct psr_frame quiet = { .width = WIDTH, .height = HEIGHT, .rgb = view->frame.rgb };
	double time[DPOINT_VIEW_MOST_WAYS][TRIALS];

	for (int trial = -1; trial < TRIALS; trial++)
		for (int k = 0; k < n; k++) {
			const uint64_t start = clock_ns();
			const int rc = draw(view, &way[k], &quiet);

			if (rc != PSR_OK)
				return rc;
			if (trial >= 0)
				time[k][trial] = (double)(clock_ns() - start) * 1e-9;
		}
	for (int k = 0; k < n; k++) {
		qsort(time[k], TRIALS, sizeof time[k][0], compare_doubles);
		fps[k] = 1 / time[k][TRIALS / 2];
	}
	return PSR_OK;
}

static double bright_db(const struct dpoint_view *view)
{
	int most = 0;
	double sum = 0, n = 0;

	for (size_t i = 0; i < PIXELS; i++)
		if (view->truth.coverage[i] >= 1 && luminance(view->truth.rgb[i]) > most)
			most = luminance(view->truth.rgb[i]);
	for (size_t i = 0; i < PIXELS; i++) {
		if (view->truth.coverage[i] < 1 || 4 * luminance(view->truth.rgb[i]) < 3 * most)
			continue;
		for (int c = 0; c < 3; c++) {
			const double d = (double)view->frame.rgb[3 * i + (size_t)c] - view->truth.rgb[i][c];

			sum += d * d;
		}
		n += 3;
	}
	return 10 * log10(255.0 * 255.0 * n / sum);
}

int dpoint_view_score(struct psr_errors *errors, double *bright, struct dpoint_view *view,
                      const struct dpoint_way *way)
{
	int rc = dpoint_view_draw(view, way);

	if (rc == PSR_OK)
		rc = psr_errors_measure(errors, &view->frame, &view->truth, psr_model_info(way->model)->spacing,
		                        view->study->err);
	if (rc == PSR_OK)
		*bright = bright_db(view);
	return rc;
}

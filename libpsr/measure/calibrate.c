#include "calibrate.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "ladder.h"
#include "measure.h"
#include "render/survey.h"

#define KINDS_TWICE (2 * LADDER_N_KINDS) /* views of one size: all kinds, without shadows and with */
#define RAYS 5                           /* along the side of a pixel */
#define SLOW_MS 100                      /* a frame that takes longer is drawn once */
#define LEAST_APART 1e-6

/* Models are seen at different sizes: multiples of 4, as scales have it. */
static const uint32_t sides[] = { 256, 128, 192 };
#define N_SIDES (sizeof sides / sizeof *sides)
#define MOST_SIDE 256

struct calibration {
	const struct psr_model *model;
	const struct calibrate_options *options;
	struct ladder_look look;
	struct psr_renderer *renderer;
	struct psr_pool *pool;
	struct surveyor *surveyor;
	struct psr_error *err;
	uint8_t rgb[3 * MOST_SIDE * MOST_SIDE];
};

/* Pixels of a smaller picture are squares of the whole one. */
static double rmse_of(const uint8_t *rgb, uint32_t scale, const struct ladder_view *view)
{
	const uint32_t width = view->width / scale;
	uint64_t sum = 0;

	for (uint32_t y = 0; y < view->height; y++)
		for (uint32_t x = 0; x < view->width; x++)
			for (uint32_t c = 0; c < 3; c++) {
				const size_t at = 3 * ((size_t)y * view->width + x) + c;
				const int d = rgb[3 * ((size_t)(y / scale) * width + x / scale) + c] - view->truth[at];

				sum += (uint64_t)(d * d);
			}
	return sqrt((double)sum / (3.0 * (double)(view->n_covered > 0 ? view->n_covered : 1)));
}

static int draw(struct calibration *c, struct psr_calibrated_fine *out, const struct ladder_view *view,
                const struct psr_scene *scene, int r)
{
	const struct psr_rung *rung = &psr_ladder[r];
	struct psr_frame frame = { .width = view->width / rung->scale, .height = view->height / rung->scale,
		                       .rgb = c->rgb };
	struct psr_settings settings;
	double ms = INFINITY;

	psr_settings_default(&settings, frame.width, frame.height);
	settings.spacing_px = rung->spacing_px;
	settings.smooth = rung->smooth;
	settings.pass = rung->pass;
	for (int i = 0; i < 3 && (i == 0 || ms < SLOW_MS); i++) {
		const uint64_t start = clock_ns();
		const int rc = psr_render(c->renderer, scene, &settings, c->pool, &frame, c->err);

		if (rc != PSR_OK)
			return rc;
		ms = fmin(ms, (double)(clock_ns() - start) * 1e-6);
	}
	out->rmse = (float)rmse_of(c->rgb, rung->scale, view);
	out->ms = (float)fmax(ms, 1e-6);
	if (r == PSR_RUNG_FINE && frame.report.effect[PSR_EFFECT_FINE].why != PSR_WHY_RAN)
		out->rmse = out->ms = 0;
	return PSR_OK;
}

static int see(struct calibration *c, struct psr_calibrated *out, const struct ladder_view *view,
               const struct psr_scene *scene)
{
	const double density = 1;
	struct survey survey;

	memset(out, 0, sizeof *out);
	if (survey_scene(&survey, c->surveyor, scene, view->width, view->height, &density, 1) <= 0)
		return psr_fail(c->err, PSR_ERR_LIMIT, "the model is too large to be calibrated");
	out->apart = (float)fmax(survey.apart, LEAST_APART);
	out->layers = (float)survey.layers;
	out->n_shadow_lights = view->light.casts_shadow != 0;
	return PSR_OK;
}

static int measure_view(struct calibration *c, struct psr_calibrated *out, struct psr_calibrated_fine *fine,
                        struct ladder_view *view)
{
	const struct psr_instance instance = { .model = c->model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_scene scene;
	int rc = ladder_view_trace(view, &c->look, RAYS, c->err);

	ladder_scene(&scene, view, &instance);
	if (rc == PSR_OK)
		rc = see(c, out, view, &scene);
	for (int r = 0, in_calb = 0; r < PSR_RUNGS && rc == PSR_OK; r++) {
		struct psr_calibrated_fine measured;

		rc = draw(c, &measured, view, &scene, r);
		if (rc == PSR_OK && r == PSR_RUNG_FINE) {
			*fine = measured;
		} else if (rc == PSR_OK) {
			out->rmse[in_calb] = measured.rmse;
			out->ms[in_calb++] = measured.ms;
		}
	}
	return rc;
}

static int measure(struct calibration *c, struct psr_calibrated *out, struct psr_calibrated_fine *fine)
{
	const struct calibrate_options *options = c->options;
	int rc = PSR_OK;

	for (uint32_t first = 0; first < options->n_views && rc == PSR_OK; first += KINDS_TWICE) {
		const uint32_t left = options->n_views - first, n = left < KINDS_TWICE ? left : KINDS_TWICE;
		struct ladder_view view[KINDS_TWICE] = { 0 };

		c->look.width = c->look.height = sides[first / KINDS_TWICE % N_SIDES];
		c->look.seed = options->seed + first;
		rc = ladder_views_make(view, n, &c->look, c->err);
		for (uint32_t i = 0; i < n; i++) {
			if (rc == PSR_OK)
				rc = measure_view(c, &out[first + i], &fine[first + i], &view[i]);
			ladder_view_fini(&view[i]);
			if (options->on_progress != NULL)
				options->on_progress("calibrate", first + i + 1, options->n_views, options->userdata);
		}
	}
	return rc;
}

int calibrate(struct psr_calibrated *view, struct psr_calibrated_fine *fine, const struct psr_model *model,
              const struct psr_mesh *mesh, const struct calibrate_options *options, struct psr_error *err)
{
	struct calibration *c = calloc(1, sizeof *c);
	int rc;

	if (c == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory to calibrate a model");
	c->model = model;
	c->options = options;
	c->err = err;
	c->look.info = psr_model_info(model);
	c->look.n_threads = options->n_threads;
	c->surveyor = surveyor_create();
	rc = c->surveyor != NULL && psr_pool_create(&c->pool, options->n_threads, NULL) == PSR_OK
	         ? PSR_OK
	         : psr_fail(err, PSR_ERR_MEMORY, "no memory to calibrate a model");
	if (rc == PSR_OK)
		rc = psr_renderer_create(&c->renderer, err);
	if (rc == PSR_OK)
		rc = psr_truth_create(&c->look.truth, mesh, err);
	if (rc == PSR_OK)
		rc = psr_source_create(&c->look.source, mesh, err);
	if (rc == PSR_OK)
		rc = measure(c, view, fine);
	psr_source_destroy(c->look.source);
	psr_truth_destroy(c->look.truth);
	psr_renderer_destroy(c->renderer);
	psr_pool_destroy(c->pool);
	surveyor_destroy(c->surveyor);
	free(c);
	return rc;
}

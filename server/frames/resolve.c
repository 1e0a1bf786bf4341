#include <math.h>
#include "model/blocks.h"
#include "model/calibration.h"
#include "render/fine.h"
#include "render/survey.h"
#include "resolve.h"

#define LEAST_APART 1e-6 /* as the modeller has it */

/* Of budgets 0 and 3. */
static struct psr_msg_settings settings_of(const struct psr_msg_frame *request)
{
	const struct psr_msg_settings settings = { .scale = 1, .spacing_px = 1 };

	return request->budget == PSR_WIRE_BUDGET_SETTINGS ? request->settings : settings;
}

int draw_is_sharp(const struct psr_msg_frame *request)
{
	const struct psr_msg_settings settings = settings_of(request);
	const int is_lossless = request->color_codec == PSR_CODEC_RAW || request->color_codec == PSR_CODEC_ZSTD;

	return settings.scale == 1 && settings.smooth == 1 && is_lossless;
}

/* A long frame ends by the limit on its time on cores: the budget stays below it with all of them at work. */
static double time_limit(const struct drawing *d)
{
	return fmin((double)d->request.time_budget_us * 1e3, (double)d->limit_ns / psr_pool_threads(d->pool));
}

/* By spheres alone, where there are too many for a survey. */
static void guess(struct budget_view *view, const struct scene *scene, const double density[BUDGET_RUNGS],
                  const struct psr_camera *camera)
{
	const double n_blocks = (double)scene_blocks(scene);

	view->area = scene_area(scene, camera, view->width, view->height);
	for (int i = 0; i < BUDGET_RUNGS; i++) {
		view->at[i].n_blocks = n_blocks;
		view->at[i].spread = view->area * density[i] * density[i];
		view->at[i].n_samples = fmin(view->area * density[i] * density[i], n_blocks * PSR_BLOCK_SAMPLES);
	}
}

/* What calibrations of the scene's models foresee for what is seen: the greatest error of a model, and the times of all
 * models together. sight NULL: nothing is known of the view. */
static void foresee(struct budget_view *view, const struct scene *scene, const struct survey *sight)
{
	const struct psr_calibrated like = {
		.apart = sight != NULL ? (float)fmax(sight->apart, LEAST_APART) : 1,
		.layers = sight != NULL ? (float)sight->layers : 0,
		.n_shadow_lights = view->n_shadow_lights,
	};

	view->is_calibrated = scene_check_calibrated(scene, NULL) == PSR_OK;
	if (!view->is_calibrated || (sight != NULL && sight->apart == 0)) /* nothing in view has no error */
		return;
	for (int i = 0; i < BUDGET_RUNGS; i++) {
		int is_known = 1;

		for (uint32_t m = 0; m < scene->n_models; m++) {
			const struct psr_calibration *calibration = psr_model_calibration(scene->model[m]->model);
			const double ms = psr_calibration_ms(calibration, sight != NULL ? &like : NULL, i);

			view->rmse[i] = fmax(view->rmse[i], psr_calibration_rmse(calibration, sight != NULL ? &like : NULL, i));
			view->ms[i] += ms;
			is_known &= ms > 0;
		}
		view->ms[i] = is_known ? view->ms[i] : 0;
	}
}

static void see(struct budget_view *view, const struct drawing *d, struct surveyor *surveyor)
{
	const struct psr_msg_frame *request = &d->request;
	struct psr_scene scene = d->scene->scene;
	double density[BUDGET_RUNGS];
	struct survey survey;

	_Static_assert(BUDGET_RUNGS <= SURVEY_MOST && BUDGET_RUNGS == PSR_RUNGS, "surveys and calibrations have each rung");
	budget_densities(density);
	scene.camera = request->camera;
	if (surveyor == NULL
	    || survey_scene(&survey, surveyor, &scene, request->width, request->height, density, BUDGET_RUNGS) <= 0) {
		guess(view, d->scene, density, &request->camera);
		foresee(view, d->scene, NULL);
		return;
	}
	view->area = survey.area;
	view->can_be_fine = survey.apart <= fine_most_apart(&scene);
	for (int i = 0; i < BUDGET_RUNGS; i++)
		view->at[i] = (struct budget_counts){ survey.at[i].n_blocks, survey.at[i].n_samples, survey.at[i].spread };
	foresee(view, d->scene, &survey);
}

void resolve_settings(struct drawing *d, const struct budget_learnt *learnt, struct surveyor *surveyor)
{
	const struct psr_msg_frame *request = &d->request;

	d->seen = (struct budget_view){
		.width = request->width, .height = request->height, .planes = request->planes,
		.n_shadow_lights = scene_shadow_lights(d->scene), .kept = d->kept,
	};
	d->is_seen = budget_is_asked(request);
	if (d->is_seen)
		see(&d->seen, d, surveyor);
	if (request->budget == PSR_WIRE_BUDGET_TIME)
		budget_choose_time(&d->choice, learnt, &d->seen, time_limit(d));
	else if (request->budget == PSR_WIRE_BUDGET_ERROR)
		budget_choose_error(&d->choice, learnt, &d->seen, request->error_bound);
	else if (request->budget == PSR_WIRE_BUDGET_RMSE)
		budget_choose_rmse(&d->choice, learnt, &d->seen, request->error_bound);
	else
		d->choice.chosen.settings = settings_of(request);
	d->settings = d->choice.chosen.settings;
	if (d->is_sharp) {
		d->settings.scale = 1;
		d->settings.smooth = 1;
	}
}

void resolve_spent(struct budget_spent *spent, const struct psr_report *report,
                   const struct psr_msg_settings *settings)
{
	const uint64_t *ns = report->ns;
	const int is_pass = settings->pass > 0;

	*spent = (struct budget_spent){
		.n_blocks = (double)report->count[PSR_STAGE_CULL], .n_samples = (double)report->n_samples_drawn,
		.n_covered = (double)(report->n_covered + report->n_filled), .error_px = report->error_px * settings->scale,
	};
	spent->ns[is_pass ? BUDGET_SPLATS : BUDGET_SAMPLES] =
		(double)(ns[PSR_STAGE_PLAN] + ns[PSR_STAGE_CULL] + ns[PSR_STAGE_WARP]);
	spent->ns[is_pass ? BUDGET_SUBPIXELS : BUDGET_PIXELS] =
		(double)(ns[PSR_STAGE_GAPS] + ns[PSR_STAGE_RESOLVE] + ns[PSR_STAGE_SHADE] + ns[PSR_STAGE_FILL]);
	spent->ns[BUDGET_SMOOTH] = (double)ns[PSR_STAGE_SMOOTH];
	spent->ns[BUDGET_SHADOWS] = (double)ns[PSR_STAGE_SHADOW];
}

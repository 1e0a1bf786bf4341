#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "figures.h"
#include "base/vec.h"

#define DISTANCE 4 /* of the eye, in the model's scale */
#define AMBIENT 0.12
#define BACKGROUND 0.9

const double figure_view[FIGURE_VIEWS][3] = {
	{ 0.5, 0.4, 1 }, { -0.9, 0.7, 0.6 }, { 0.3, -0.35, -1 }, { 1, 0.1, -0.4 }, { -0.6, 1, -0.7 }, { -1, -0.2, 0.8 },
};

int figure_model_load(struct figure_model *model, struct study *study, const char *name,
                      void (*make)(struct shape *), uint32_t resolution)
{
	const struct psr_model_info *info;
	int rc;

	memset(model, 0, sizeof *model);
	rc = make != NULL ? study_model_make(&model->source, name, make, study->err)
	                  : study_model_load(&model->source, name, study->err);
	if (rc != PSR_OK)
		return rc;
	study->resolution = resolution;
	rc = study_build(&model->model, NULL, study, &model->source);
	if (rc == PSR_OK)
		rc = psr_truth_create(&model->truth, model->source.mesh, study->err);
	if (rc != PSR_OK) {
		figure_model_fini(model);
		return rc;
	}
	info = psr_model_info(model->model);
	model->spacing = info->spacing;
	for (int k = 0; k < 3; k++)
		model->center[k] = (info->box_min[k] + info->box_max[k]) / 2;
	return PSR_OK;
}

void figure_model_fini(struct figure_model *model)
{
	psr_truth_destroy(model->truth);
	psr_model_unref(model->model);
	study_model_fini(&model->source);
	memset(model, 0, sizeof *model);
}

static void light_over_shoulder(struct psr_light *light, const double forward[3])
{
	const double up[3] = { 0, 1, 0 };
	double right[3], down[3];

	v3d_cross(right, forward, up);
	v3d_normalize(right, right);
	v3d_cross(down, forward, right);
	light->kind = PSR_LIGHT_DIRECTIONAL;
	v3d_scale(light->direction, forward, 0.8);
	v3d_add_scaled(light->direction, light->direction, 0.5, right);
	v3d_add_scaled(light->direction, light->direction, 0.45, down);
	v3d_set(light->color, 1, 1, 1);
}

void figure_shot_init(struct figure_shot *shot, const struct figure_model *model, const double toward[3],
                      double magnification, uint32_t side)
{
	const double away = DISTANCE * model->source.scale;
	struct psr_camera *camera = &shot->scene.camera;
	double unit[3], forward[3];

	memset(shot, 0, sizeof *shot);
	render_settings_default(&shot->settings, side, side);
	shot->instance = (struct psr_instance){ .model = model->model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	shot->scene.instance = &shot->instance;
	shot->scene.n_instances = 1;
	shot->scene.light = shot->light;
	shot->scene.n_lights = 1;
	v3d_set(shot->scene.ambient, AMBIENT, AMBIENT, AMBIENT);
	v3d_set(shot->scene.background, BACKGROUND, BACKGROUND, BACKGROUND);
	v3d_normalize(unit, toward);
	v3d_scale(forward, unit, -1);
	light_over_shoulder(&shot->light[0], forward);
	v3d_set(camera->target, model->center[0], model->center[1], model->center[2]);
	v3d_add_scaled(camera->eye, camera->target, away, unit);
	v3d_set(camera->up, 0, 1, 0);
	camera->kind = PSR_CAMERA_PERSPECTIVE;
	camera->fov_y = 2 * atan(side / 2.0 * model->spacing / (magnification * away));
}

void figure_shot_copy(struct figure_shot *to, const struct figure_shot *from)
{
	*to = *from;
	to->scene.instance = &to->instance;
	to->scene.light = to->light;
}

static int draw(struct psr_frame *frame, struct study *study, const struct figure_shot *shot, int has_gaps)
{
	struct psr_zstack *stack;
	int rc = renderer_warp(study->renderer, &shot->scene, &shot->settings, study->pool, &stack, study->err);

	for (int k = 1; rc == PSR_OK && !has_gaps && k <= PSR_MAX_DEPTH_LEVEL; k++) {
		const size_t n = (size_t)stack->level[k].width * stack->level[k].height;

		for (size_t i = 0; (stack->levels >> k & 1) && i < n; i++)
			stack->level[k].z[i] = INFINITY;
	}
	return rc == PSR_OK ? renderer_finish(study->renderer, stack, study->pool, frame, study->err) : rc;
}

int figure_draw(struct psr_frame *frame, struct study *study, const struct figure_shot *shot)
{
	return draw(frame, study, shot, 1);
}

int figure_draw_no_gaps(struct psr_frame *frame, struct study *study, const struct figure_shot *shot)
{
	return draw(frame, study, shot, 0);
}

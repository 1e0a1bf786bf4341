#include <assert.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/srgb.h"
#include "base/vec.h"
#include "render/plan.h"
#include "scene.h"

struct scene *scene_ref(struct scene *scene)
{
	scene->n_refs++;
	return scene;
}

void scene_unref(struct scene *scene)
{
	if (scene == NULL)
		return;
	assert(scene->n_refs > 0);
	if (--scene->n_refs > 0)
		return;
	for (uint32_t i = 0; i < scene->n_models; i++)
		catalogue_unref(scene->catalogue, scene->model[i]);
	free(scene->instance);
	free(scene->of_instance);
	free(scene->model);
	free(scene);
}

unsigned scene_shadow_lights(const struct scene *scene)
{
	unsigned n = 0;

	for (uint32_t i = 0; i < scene->scene.n_lights; i++)
		n += scene->light[i].casts_shadow != 0;
	return n;
}

uint64_t scene_blocks(const struct scene *scene)
{
	uint64_t n = 0;

	for (uint32_t i = 0; i < scene->scene.n_instances; i++)
		n += card_groups(&scene->model[scene->of_instance[i]]->card, scene->instance[i].representation);
	return n;
}

/* The spheres' widths are those of their outlines as if they stood in the middle of the picture. */
double scene_area(const struct scene *scene, const struct psr_camera *camera, uint32_t width, uint32_t height)
{
	const double all = (double)width * height;
	double forward[3], sum = 0;

	v3d_sub(forward, camera->target, camera->eye);
	v3d_normalize(forward, forward);
	for (uint32_t i = 0; i < scene->scene.n_instances; i++) {
		double center[3], rotation[3][3], pixels;
		const double radius = plan_place(center, rotation, &scene->scene.instance[i], camera->eye);
		const double apart = v3d_dot(center, center) - radius * radius;

		if (v3d_dot(center, forward) + radius <= 0)
			continue;
		if (camera->kind == PSR_CAMERA_ORTHOGRAPHIC)
			pixels = radius * height / camera->ortho_height;
		else
			pixels = apart > 0 ? radius / sqrt(apart) * height / (2 * tan(camera->fov_y / 2)) : height;
		sum += fmin(M_PI * pixels * pixels, all);
	}
	return sum;
}

int scene_has_sheer(const struct scene *scene)
{
	for (uint32_t i = 0; i < scene->n_models; i++)
		if (scene->model[i]->card.has_sheer)
			return 1;
	return 0;
}

int scene_has_octrees(const struct scene *scene)
{
	for (uint32_t i = 0; i < scene->scene.n_instances; i++) {
		const struct card *card = &scene->model[scene->of_instance[i]]->card;
		const enum psr_representation as = scene->instance[i].representation;

		if (as == PSR_OCTREE || (as == PSR_AUTOMATIC && card->n_blocks == 0 && card->n_cubes > 0))
			return 1;
	}
	return 0;
}

int scene_check_calibrated(const struct scene *scene, struct psr_error *err)
{
	for (uint32_t i = 0; i < scene->scene.n_instances; i++) {
		const struct card *card = &scene->model[scene->of_instance[i]]->card;

		if (scene->instance[i].representation == PSR_OCTREE || card->n_blocks == 0)
			return psr_fail(err, PSR_ERR_UNSUPPORTED,
			                "instance %" PRIu32 " is drawn as an octree: the RMSE of its pictures is not known; ask "
			                "for a budget of time or of the geometric error",
			                i);
		if (!card->is_calibrated)
			return psr_fail(err, PSR_ERR_UNSUPPORTED,
			                "the model of instance %" PRIu32 " is not calibrated, so the RMSE of its pictures is not "
			                "known: build it with psr-model build --calibrate, or ask for another budget",
			                i);
	}
	return PSR_OK;
}

/* While one frame of the scene is drawn, its models stay where they are: another one finds nothing to change. */
void scene_bind(struct scene *scene)
{
	for (uint32_t i = 0; i < scene->scene.n_instances; i++) {
		const struct psr_model *model = scene->model[scene->of_instance[i]]->model;

		if (scene->instance[i].model != model)
			scene->instance[i].model = model;
	}
}

static uint32_t add_model(struct scene *scene, struct catalogue_model *model)
{
	uint32_t i = 0;

	while (i < scene->n_models && scene->model[i] != model)
		i++;
	if (i == scene->n_models)
		scene->model[scene->n_models++] = catalogue_ref(scene->catalogue, model);
	return i;
}

static int is_one(uint32_t representations)
{
	return (representations & (representations - 1)) == 0;
}

static const char *lowest_name(const char *const names[], uint32_t representations)
{
	return names[__builtin_ctz(representations)];
}

static int add_instance(struct scene *scene, const struct handles *handles, const struct psr_msg_instance *msg,
                        struct psr_error *err)
{
	struct catalogue_model *model = handles_find(handles, msg->handle);
	uint32_t number = scene->scene.n_instances;
	struct psr_instance *instance = &scene->instance[number];
	static const char *const names[] = { "", "blocks", "an octree", "differential points" };
	static const enum psr_representation representations[] = {
		[PSR_WIRE_REP_AUTO] = PSR_AUTOMATIC, [PSR_WIRE_REP_BLOCKS] = PSR_BLOCKS, [PSR_WIRE_REP_OCTREE] = PSR_OCTREE,
		[PSR_WIRE_REP_DPOINT] = PSR_DPOINTS,
	};
	static const enum psr_color_by colors[] = {
		[PSR_WIRE_COLOR_OWN] = PSR_COLOR_OWN, [PSR_WIRE_COLOR_INTENSITY] = PSR_COLOR_INTENSITY,
		[PSR_WIRE_COLOR_CLASS] = PSR_COLOR_CLASS, [PSR_WIRE_COLOR_HEIGHT] = PSR_COLOR_HEIGHT,
		[PSR_WIRE_COLOR_RETURN] = PSR_COLOR_RETURN,
	};
	double norm = 0;

	if (model == NULL)
		return psr_fail(err, PSR_ERR_NOT_FOUND,
		                "instance %" PRIu32 " names handle %" PRIu32 ", and no open model has it", number, msg->handle);
	if (msg->representation != PSR_WIRE_REP_AUTO && !(model->card.representations >> msg->representation & 1))
		return psr_fail(err, PSR_ERR_UNSUPPORTED,
		                "instance %" PRIu32 " asks for representation %u (%s), and its model has %s%s", number,
		                msg->representation, names[msg->representation], lowest_name(names, model->card.representations),
		                is_one(model->card.representations) ? " alone" : " and others");
	instance->representation = representations[msg->representation];
	instance->color_by = colors[msg->color_by];
	for (int k = 0; k < 4; k++)
		norm += msg->rotation[k] * msg->rotation[k];
	norm = sqrt(norm);
	for (int k = 0; k < 4; k++)
		instance->rotation[k] = msg->rotation[k] / norm;
	memcpy(instance->translation, msg->translation, sizeof instance->translation);
	instance->scale = msg->scale;
	scene->of_instance[number] = add_model(scene, model);
	scene->scene.n_instances++;
	return PSR_OK;
}

int scene_create(struct scene **out, const struct handles *handles, const struct psr_msg_scene *msg,
                 struct psr_error *err)
{
	struct scene *scene;
	int code = PSR_OK;

	if (msg->flags & PSR_WIRE_SCENE_APPEND)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server does not append to scenes; send the whole scene");
	scene = calloc(1, sizeof *scene);
	if (scene == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a scene");
	scene->n_refs = 1;
	scene->catalogue = handles->catalogue;
	scene->instance = calloc(msg->n_instances > 0 ? msg->n_instances : 1, sizeof *scene->instance);
	scene->model = calloc(msg->n_instances > 0 ? msg->n_instances : 1, sizeof *scene->model);
	scene->of_instance = calloc(msg->n_instances > 0 ? msg->n_instances : 1, sizeof *scene->of_instance);
	if (scene->instance == NULL || scene->model == NULL || scene->of_instance == NULL)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for a scene");
	for (uint32_t i = 0; code == PSR_OK && i < msg->n_instances; i++)
		code = add_instance(scene, handles, &msg->instance[i], err);
	for (uint32_t i = 0; code == PSR_OK && i < msg->n_lights; i++)
		psr_msg_light_get(&scene->light[scene->scene.n_lights++], &msg->light[i]);
	if (code != PSR_OK) {
		scene_unref(scene);
		return code;
	}
	scene->scene.instance = scene->instance;
	scene->scene.light = scene->light;
	for (int k = 0; k < 3; k++) {
		scene->background[k] = msg->background[k];
		scene->scene.ambient[k] = msg->ambient;
		scene->scene.background[k] = (double)psr_srgb_to_linear[msg->background[k]];
	}
	*out = scene;
	return PSR_OK;
}

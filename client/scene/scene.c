#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "client/cli/cli.h"
#include "preset.h"
#include "scene.h"
#include "suggest.h"
#include "client/lib/camera.h"

void scene_close(struct scene *scene)
{
	if (scene == NULL)
		return;
	free(scene->model);
	free(scene->model_of);
	free(scene->preset);
	free(scene);
}

static int open_model(struct scene_model *model, struct psr_client *client, int is_quiet, int timeout_ms,
                      struct psr_error *err)
{
	struct psr_progress_line line = { 0 };
	int code;

	psr_client_on_progress(client, is_quiet ? NULL : psr_progress_draw, &line);
	code = psr_client_open(client, model->name, timeout_ms, &model->opened, err);
	psr_client_on_progress(client, NULL, NULL);
	psr_progress_end(&line);
	return code == PSR_ERR_NOT_FOUND ? suggest_model(client, model->name, timeout_ms, err) : code;
}

static int open_models(struct scene *scene, const struct scene_wish *wish, int timeout_ms, struct psr_error *err)
{
	if (wish->levels > 0 && !(psr_client_welcome(scene->client)->capabilities & PSR_CAP_LEVELS))
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this server opens whole files alone (capability bit 25): leave "
		                "--level out");
	for (uint32_t i = 0; i < wish->n_instances; i++) {
		uint32_t k = 0, pixels = wish->instance[i].pixels, levels = wish->instance[i].levels;
		int code;

		while (k < scene->n_models && strcmp(scene->model[k].name, wish->instance[i].model) != 0)
			k++;
		scene->model_of[i] = k;
		if (k < scene->n_models)
			continue;
		strcpy(scene->model[k].name, wish->instance[i].model);
		psr_client_set_resolution(scene->client, pixels != 0 ? pixels : wish->pixels);
		psr_client_set_levels(scene->client, levels != 0 ? levels : (uint32_t)wish->levels);
		code = open_model(&scene->model[k], scene->client, wish->is_quiet, timeout_ms, err);
		if (code != PSR_OK)
			return code;
		scene->n_models++;
	}
	return PSR_OK;
}

static void place_instances(struct scene *scene, const struct scene_wish *wish)
{
	struct psr_msg_scene *msg = &scene->msg;

	for (int a = 0; a < 3; a++) {
		scene->box_min[a] = INFINITY;
		scene->box_max[a] = -INFINITY;
	}
	instance_rotate(scene->up, &wish->instance[0].place, scene->model[scene->model_of[0]].opened.up);
	msg->n_instances = (uint16_t)wish->n_instances;
	for (uint32_t i = 0; i < wish->n_instances; i++) {
		const struct psr_msg_opened *opened = &scene->model[scene->model_of[i]].opened;

		msg->instance[i] = wish->instance[i].place;
		msg->instance[i].handle = opened->handle;
		instance_add_box(scene->box_min, scene->box_max, &msg->instance[i], opened->box_min, opened->box_max);
	}
}

static int get_presets(struct scene *scene, const struct scene_wish *wish, int timeout_ms, struct psr_error *err)
{
	int code;

	if (!(psr_client_welcome(scene->client)->capabilities & PSR_CAP_PRESETS))
		return PSR_OK;
	code = psr_client_presets(scene->client, scene->model[0].opened.handle, &scene->preset, &scene->n_presets,
	                          timeout_ms, err);
	for (uint32_t i = 0; code == PSR_OK && i < scene->n_presets; i++)
		preset_place(&scene->preset[i], &wish->instance[0].place);
	return code;
}

static int add_lights(struct scene *scene, const struct scene_wish *wish, struct psr_error *err)
{
	struct psr_msg_scene *msg = &scene->msg;
	int code = PSR_OK;

	msg->ambient = wish->ambient;
	memcpy(msg->background, wish->background, sizeof msg->background);
	msg->n_lights = (uint16_t)wish->n_lights;
	for (uint32_t i = 0; i < wish->n_lights && code == PSR_OK; i++) {
		const struct psr_msg_preset *preset = NULL;

		if (wish->preset_light[i] != NULL)
			code = preset_find(&preset, scene, PSR_WIRE_PRESET_LIGHT, wish->preset_light[i], err);
		if (code == PSR_OK)
			msg->light[i] = preset != NULL ? preset->light : wish->light[i];
	}
	if (code == PSR_OK && wish->lights_of != NULL)
		code = preset_all_lights(msg, scene, err);
	if (code != PSR_OK)
		return code;
	scene->has_key_light = msg->n_lights == 0 && !wish->has_ambient;
	scene->is_key_shadowed = wish->is_shadowed;
	msg->n_lights = (uint16_t)(msg->n_lights + scene->has_key_light);
	for (uint32_t i = 0; i < msg->n_lights && wish->is_shadowed; i++)
		msg->light[i].flags |= PSR_WIRE_LIGHT_SHADOW;
	return PSR_OK;
}

int scene_open(struct scene **out, const struct scene_wish *wish, struct psr_client *client, int timeout_ms,
               struct psr_error *err)
{
	uint32_t n = wish->n_instances, most = psr_client_welcome(client)->max_instances;
	struct scene *scene = calloc(1, sizeof *scene);
	int code = PSR_OK;

	*out = scene;
	if (scene != NULL) {
		scene->client = client;
		scene->model = calloc(n, sizeof *scene->model);
		scene->model_of = calloc(n, sizeof *scene->model_of);
	}
	if (scene == NULL || scene->model == NULL || scene->model_of == NULL)
		code = psr_fail(err, PSR_ERR_MEMORY, "no memory for %u instances", n);
	else if (n > most)
		code = psr_fail(err, PSR_ERR_LIMIT, "there are %u instances; the server takes %u", n, most);
	if (code == PSR_OK)
		code = open_models(scene, wish, timeout_ms, err);
	if (code == PSR_OK)
		code = get_presets(scene, wish, timeout_ms, err);
	if (code == PSR_OK) {
		place_instances(scene, wish);
		code = add_lights(scene, wish, err);
	}
	if (code == PSR_OK)
		return PSR_OK;
	scene_close(scene);
	*out = NULL;
	return code;
}

int scene_light(struct scene *scene, const struct psr_camera *camera)
{
	if (!scene->has_key_light)
		return 0;
	client_light_key(&scene->msg.light[0], camera);
	if (scene->is_key_shadowed)
		scene->msg.light[0].flags |= PSR_WIRE_LIGHT_SHADOW;
	return 1;
}

#include <stdio.h>
#include <string.h>
#include "base/json.h"
#include "base/view.h"
#include "client/scene/quality.h"
#include "replay.h"

static void add_color(cJSON *to, const char *name, const uint8_t rgb[3])
{
	char text[8];

	snprintf(text, sizeof text, "#%02x%02x%02x", rgb[0], rgb[1], rgb[2]);
	cJSON_AddStringToObject(to, name, text);
}

static void add_light(cJSON *to, const struct psr_msg_light *light)
{
	cJSON *item = cJSON_CreateObject();

	cJSON_AddStringToObject(item, "kind", view_light_kinds[light->kind - PSR_WIRE_LIGHT_DIRECTIONAL]);
	cJSON_AddBoolToObject(item, "shadow", (light->flags & PSR_WIRE_LIGHT_SHADOW) != 0);
	add_color(item, "color", light->color);
	json_add_number(item, "intensity", light->intensity);
	json_add_numbers(item, "position", light->position, 3);
	json_add_numbers(item, "direction", light->direction, 3);
	json_add_number(item, "inner", light->inner);
	json_add_number(item, "outer", light->outer);
	json_add_number(item, "reference", light->reference);
	cJSON_AddItemToArray(to, item);
}

static void add_scene(cJSON *to, const struct scene *scene)
{
	cJSON *models = cJSON_AddArrayToObject(to, "models"), *instances = cJSON_AddArrayToObject(to, "instances");
	cJSON *lights = cJSON_AddArrayToObject(to, "lights"), *item;
	char id[JSON_ID_TEXT];

	for (uint32_t i = 0; i < scene->n_models; i++) {
		item = cJSON_CreateObject();
		cJSON_AddStringToObject(item, "name", scene->model[i].name);
		cJSON_AddStringToObject(item, "content_id", json_id(id, scene->model[i].opened.content_id));
		cJSON_AddNumberToObject(item, "resolution", scene->model[i].opened.resolution);
		if (scene->model[i].opened.octree_levels > 0)
			cJSON_AddNumberToObject(item, "octree_levels", scene->model[i].opened.octree_levels);
		cJSON_AddItemToArray(models, item);
	}
	for (uint32_t i = 0; i < scene->msg.n_instances; i++) {
		const struct psr_msg_instance *place = &scene->msg.instance[i];

		item = cJSON_CreateObject();
		cJSON_AddNumberToObject(item, "model", scene->model_of[i]);
		if (place->representation != PSR_WIRE_REP_AUTO)
			cJSON_AddStringToObject(item, "as", instance_representations[place->representation]);
		if (place->color_by != PSR_WIRE_COLOR_OWN)
			cJSON_AddStringToObject(item, "color_by", scene_colors[place->color_by]);
		json_add_numbers(item, "rotation", place->rotation, 4);
		json_add_numbers(item, "translation", place->translation, 3);
		json_add_number(item, "scale", place->scale);
		cJSON_AddItemToArray(instances, item);
	}
	for (uint32_t i = 0; i < scene->msg.n_lights; i++)
		add_light(lights, &scene->msg.light[i]);
	json_add_number(to, "ambient", scene->msg.ambient);
	add_color(to, "background", scene->msg.background);
}

static void add_codec(cJSON *to, const struct psr_msg_frame *frame)
{
	char codec[16] = "lossless";

	if (frame->color_codec == PSR_CODEC_JPEG)
		snprintf(codec, sizeof codec, "jpeg:%u", frame->color_quality);
	else if (frame->color_codec == PSR_CODEC_RAW)
		strcpy(codec, "raw");
	cJSON_AddStringToObject(to, "codec", codec);
}

static void add_detail(cJSON *to, const struct psr_msg_frame *frame)
{
	char budget[QUALITY_BUDGET_TEXT];

	if (frame->budget != PSR_WIRE_BUDGET_NONE && frame->budget != PSR_WIRE_BUDGET_SETTINGS) {
		cJSON_AddStringToObject(to, "budget", quality_budget_text(budget, frame));
		return;
	}
	cJSON_AddNumberToObject(to, "scale", frame->settings.scale);
	json_add_number(to, "spacing_px", frame->settings.spacing_px);
	cJSON_AddBoolToObject(to, "smooth", frame->settings.smooth);
	cJSON_AddBoolToObject(to, "fine", frame->settings.smooth == PSR_SMOOTH_FINE);
	cJSON_AddBoolToObject(to, "splats", frame->settings.splats);
	cJSON_AddNumberToObject(to, "pass", frame->settings.pass);
	cJSON_AddNumberToObject(to, "passes", frame->pass_limit);
}

void replay_add(cJSON *report, const struct scene *scene, const struct psr_msg_frame *frame)
{
	cJSON *request = cJSON_AddObjectToObject(report, "request"), *camera, *planes;
	const double size[2] = { frame->width, frame->height };

	add_scene(request, scene);
	camera = cJSON_AddObjectToObject(request, "camera");
	cJSON_AddStringToObject(camera, "kind", view_camera_kinds[frame->camera.kind]);
	json_add_numbers(camera, "eye", frame->camera.eye, 3);
	json_add_numbers(camera, "target", frame->camera.target, 3);
	json_add_numbers(camera, "up", frame->camera.up, 3);
	json_add_number(camera, "extent",
	                frame->camera.kind == PSR_CAMERA_PERSPECTIVE ? frame->camera.fov_y : frame->camera.ortho_height);
	json_add_number(camera, "near", frame->camera.near_z);
	json_add_numbers(request, "size", size, 2);
	add_detail(request, frame);
	planes = cJSON_AddArrayToObject(request, "planes");
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (frame->planes >> plane & 1)
			cJSON_AddItemToArray(planes, cJSON_CreateString(psr_plane_name(plane)));
	add_codec(request, frame);
}

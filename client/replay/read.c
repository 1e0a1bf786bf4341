#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/infile.h"
#include "base/json.h"
#include "base/view.h"
#include "client/lib/camera.h"
#include "client/scene/quality.h"
#include "replay.h"

#define MAX_BYTES (16 << 20)

/* Reads members of a report; remembers the first that is missing or has a wrong type. */
struct reader {
	const char *missing;
};

static const cJSON *get(struct reader *reader, const cJSON *from, const char *name)
{
	const cJSON *item = cJSON_GetObjectItemCaseSensitive(from, name);

	if (item == NULL && reader->missing == NULL)
		reader->missing = name;
	return item;
}

static double get_number(struct reader *reader, const cJSON *from, const char *name, double least, double most)
{
	const cJSON *item = get(reader, from, name);
	double v = item != NULL && cJSON_IsNumber(item) ? item->valuedouble : NAN;

	if (v >= least && v <= most)
		return v;
	if (reader->missing == NULL)
		reader->missing = name;
	return least;
}

static void get_numbers(struct reader *reader, double *to, const cJSON *from, const char *name, int n)
{
	const cJSON *array = get(reader, from, name);

	for (int i = 0; i < n; i++) {
		const cJSON *item = cJSON_GetArrayItem(array, i);

		if (item != NULL && cJSON_IsNumber(item))
			to[i] = item->valuedouble;
		else if (reader->missing == NULL)
			reader->missing = name;
	}
}

static const char *get_string(struct reader *reader, const cJSON *from, const char *name)
{
	const cJSON *item = get(reader, from, name);

	if (item != NULL && cJSON_IsString(item))
		return item->valuestring;
	if (reader->missing == NULL)
		reader->missing = name;
	return "";
}

static int get_flag(struct reader *reader, const cJSON *from, const char *name)
{
	return cJSON_IsTrue(get(reader, from, name));
}

static void get_color(struct reader *reader, uint8_t rgb[3], const cJSON *from, const char *name)
{
	if (psr_parse_color(get_string(reader, from, name), rgb, NULL, NULL) != PSR_OK && reader->missing == NULL)
		reader->missing = name;
}

static int finish(const struct reader *reader, struct psr_error *err)
{
	if (reader->missing == NULL)
		return PSR_OK;
	return psr_fail(err, PSR_ERR_FORMAT,
	                "--replay: 'request' in the report has no usable '%s'; psr shot --report writes "
	                "such files",
	                reader->missing);
}

int replay_read(cJSON **report, const char *path, struct psr_error *err)
{
	struct psr_error why;
	char *text;
	int code = infile_read_text(&text, path, MAX_BYTES, &why);

	if (code != PSR_OK)
		return psr_fail(err, code, "--replay: cannot read %s", why.text);
	*report = cJSON_Parse(text);
	free(text);
	if (cJSON_GetObjectItemCaseSensitive(*report, "request") == NULL)
		return psr_fail(err, PSR_ERR_FORMAT,
		                "--replay: %.300s is no report of psr shot --report: it is not JSON, or has no 'request'",
		                path);
	return PSR_OK;
}

static const cJSON *request_of(const cJSON *report)
{
	return cJSON_GetObjectItemCaseSensitive(report, "request");
}

/* Returns the member's place among the words, from 1 on. */
static uint8_t find_kind(struct reader *reader, const cJSON *from, const char *name, const char *const *kinds, int n)
{
	const char *kind = get_string(reader, from, name);

	for (int i = 0; i < n; i++)
		if (strcmp(kind, kinds[i]) == 0)
			return (uint8_t)(i + 1);
	if (reader->missing == NULL)
		reader->missing = name;
	return 0;
}

int replay_wish(struct scene_wish *wish, const cJSON *report, struct psr_error *err)
{
	struct reader reader = { NULL };
	const cJSON *models = get(&reader, request_of(report), "models");
	const cJSON *instances = get(&reader, request_of(report), "instances"), *item;
	int n = cJSON_GetArraySize(instances), n_models = cJSON_GetArraySize(models);

	if (n < 1 || n > PSR_WIRE_MAX_INSTANCES || n_models < 1)
		return psr_fail(err, PSR_ERR_FORMAT, "--replay: the report has %d instances of %d models", n, n_models);
	wish->instance = calloc((size_t)n, sizeof *wish->instance);
	if (wish->instance == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %d instances", n);
	cJSON_ArrayForEach(item, instances)
	{
		struct instance_wish *to = &wish->instance[wish->n_instances++];
		const int k = (int)get_number(&reader, item, "model", 0, n_models - 1);
		const cJSON *model = cJSON_GetArrayItem(models, k);

		snprintf(to->model, sizeof to->model, "%s", get_string(&reader, model, "name"));
		to->pixels = (uint32_t)get_number(&reader, model, "resolution", 1, UINT32_MAX);
		if (cJSON_HasObjectItem(model, "octree_levels"))
			to->levels = (uint32_t)get_number(&reader, model, "octree_levels", 1, PSR_WIRE_MAX_LEVELS);
		if (cJSON_HasObjectItem(item, "as"))
			to->place.representation = find_kind(&reader, item, "as", &instance_representations[1], 3);
		if (cJSON_HasObjectItem(item, "color_by"))
			to->place.color_by = find_kind(&reader, item, "color_by", &scene_colors[1], 4);
		get_numbers(&reader, to->place.rotation, item, "rotation", 4);
		get_numbers(&reader, to->place.translation, item, "translation", 3);
		to->place.scale = get_number(&reader, item, "scale", 1 / PSR_WIRE_MAX_LENGTH, PSR_WIRE_MAX_LENGTH);
	}
	return finish(&reader, err);
}

static void read_light(struct reader *reader, struct psr_msg_light *light, const cJSON *from)
{
	memset(light, 0, sizeof *light);
	light->kind = find_kind(reader, from, "kind", view_light_kinds, 3);
	light->flags = get_flag(reader, from, "shadow") ? PSR_WIRE_LIGHT_SHADOW : 0;
	get_color(reader, light->color, from, "color");
	light->intensity = get_number(reader, from, "intensity", 0, PSR_WIRE_MAX_INTENSITY);
	get_numbers(reader, light->position, from, "position", 3);
	get_numbers(reader, light->direction, from, "direction", 3);
	light->inner = get_number(reader, from, "inner", 0, 4);
	light->outer = get_number(reader, from, "outer", 0, 4);
	light->reference = get_number(reader, from, "reference", 0, PSR_WIRE_MAX_LENGTH);
}

static int check_models(const struct scene *scene, const cJSON *models, struct psr_error *err)
{
	struct reader reader = { NULL };
	const cJSON *item;

	cJSON_ArrayForEach(item, models)
	{
		const char *name = get_string(&reader, item, "name"), *expected = get_string(&reader, item, "content_id");

		for (uint32_t i = 0; i < scene->n_models; i++) {
			char id[JSON_ID_TEXT];

			json_id(id, scene->model[i].opened.content_id);
			if (strcmp(scene->model[i].name, name) == 0 && strcmp(id, expected) != 0)
				return psr_fail(err, PSR_ERR_VERSION,
				                "--replay: the server has another model %.200s than the report's: its "
				                "content id is %s, not %.40s",
				                name, id, expected);
		}
	}
	return finish(&reader, err);
}

int replay_scene(struct scene *scene, const cJSON *report, struct psr_error *err)
{
	struct reader reader = { NULL };
	const cJSON *request = request_of(report), *lights = get(&reader, request, "lights"), *item;
	struct psr_msg_scene *msg = &scene->msg;
	int code = check_models(scene, get(&reader, request, "models"), err);

	if (code != PSR_OK)
		return code;
	if (cJSON_GetArraySize(lights) > PSR_WIRE_MAX_LIGHTS)
		return psr_fail(err, PSR_ERR_FORMAT, "--replay: the report has more than %d lights", PSR_WIRE_MAX_LIGHTS);
	scene->has_key_light = 0;
	msg->n_lights = 0;
	cJSON_ArrayForEach(item, lights)
		read_light(&reader, &msg->light[msg->n_lights++], item);
	msg->ambient = get_number(&reader, request, "ambient", 0, PSR_WIRE_MAX_INTENSITY);
	get_color(&reader, msg->background, request, "background");
	return finish(&reader, err);
}

static void read_planes(struct reader *reader, struct psr_msg_frame *frame, const cJSON *request)
{
	const cJSON *item, *planes = get(reader, request, "planes");

	cJSON_ArrayForEach(item, planes)
		for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
			if (cJSON_IsString(item) && strcmp(item->valuestring, psr_plane_name(plane)) == 0)
				frame->planes |= 1u << plane;
}

/* A report of psr 0.2 and before has neither scale, pass, fine nor splats. */
static void read_detail(struct reader *reader, struct psr_msg_frame *frame, const cJSON *request)
{
	struct psr_msg_settings *settings = &frame->settings;

	if (cJSON_HasObjectItem(request, "budget")) {
		if (quality_parse_budget(frame, get_string(reader, request, "budget"), NULL) != PSR_OK && reader->missing == NULL)
			reader->missing = "budget";
		return;
	}
	frame->budget = PSR_WIRE_BUDGET_SETTINGS;
	settings->scale = 1;
	if (cJSON_HasObjectItem(request, "scale"))
		settings->scale = (uint8_t)get_number(reader, request, "scale", 1, 4);
	if (cJSON_HasObjectItem(request, "pass"))
		settings->pass = (uint8_t)get_number(reader, request, "pass", 0, PSR_WIRE_MAX_PASS);
	settings->spacing_px = get_number(reader, request, "spacing_px", 1.0 / 64, 64);
	settings->smooth = (uint8_t)get_flag(reader, request, "smooth");
	if (cJSON_HasObjectItem(request, "fine") && get_flag(reader, request, "fine"))
		settings->smooth = PSR_SMOOTH_FINE;
	if (cJSON_HasObjectItem(request, "splats"))
		settings->splats = (uint8_t)get_flag(reader, request, "splats");
	frame->pass_limit = (uint16_t)get_number(reader, request, "passes", 0, 16);
}

int replay_frame(struct psr_msg_frame *frame, const cJSON *report, struct psr_error *err)
{
	struct reader reader = { NULL };
	const cJSON *request = request_of(report), *camera = get(&reader, request, "camera");
	double size[2] = { 0, 0 };

	get_numbers(&reader, size, request, "size", 2);
	if (!(size[0] >= 1 && size[0] <= PSR_WIRE_MAX_SIDE && size[1] >= 1 && size[1] <= PSR_WIRE_MAX_SIDE))
		return psr_fail(err, PSR_ERR_FORMAT, "--replay: the report's size is no size of a picture");
	frame->width = (uint32_t)size[0];
	frame->height = (uint32_t)size[1];
	frame->camera.kind = find_kind(&reader, camera, "kind", view_camera_kinds, 2) == 2 ? PSR_CAMERA_ORTHOGRAPHIC
	                                                                           : PSR_CAMERA_PERSPECTIVE;
	get_numbers(&reader, frame->camera.eye, camera, "eye", 3);
	get_numbers(&reader, frame->camera.target, camera, "target", 3);
	get_numbers(&reader, frame->camera.up, camera, "up", 3);
	*(frame->camera.kind == PSR_CAMERA_PERSPECTIVE ? &frame->camera.fov_y : &frame->camera.ortho_height) =
		get_number(&reader, camera, "extent", 1 / PSR_WIRE_MAX_LENGTH, PSR_WIRE_MAX_LENGTH);
	frame->camera.near_z = get_number(&reader, camera, "near", 0, PSR_WIRE_MAX_LENGTH);
	read_detail(&reader, frame, request);
	read_planes(&reader, frame, request);
	if (psr_codec_parse(&frame->color_codec, &frame->color_quality, get_string(&reader, request, "codec"), err)
	    != PSR_OK)
		return PSR_ERR_FORMAT;
	return finish(&reader, err);
}

#define _GNU_SOURCE
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/srgb.h"
#include "client/cli/optlist.h"
#include "client/lib/camera.h"
#include "client/scene/instance.h"
#include "psr/client.h"
#include "proto/proto.h"
#include "shot.h"

#define DEGREE (3.14159265358979323846 / 180)

/* As they stand in the suite, with the defaults of `psr shot`. */
struct words {
	const char *name, *model, *hash[PSR_N_PLANES];
	struct instance_wish instance[SHOT_MAX_INSTANCES]; /* besides the model */
	uint32_t n_instances;
	uint32_t size[2];
	int is_smooth, is_plain, with_splats;
	const char *quality; /* NULL, or fine */
	const char *color_by; /* NULL, or as psr shot has it */
	int64_t n_passes;
	struct psr_camera_wish wish;
	double fov, ortho, ambient;
	int has_ortho, has_ambient;
	uint8_t background[3];
	struct psr_msg_light light[SHOT_MAX_LIGHTS];
	uint32_t n_lights;
};

/* `now` holds the defaults until the first test. */
struct reader {
	struct words now, defaults;
	const struct psr_model *(*open)(const char *name);
	void (*on_shot)(struct shot *shot);
};

static int place_instance(struct shot *shot, const struct psr_model *(*open)(const char *name), const char *name,
                          const struct psr_msg_instance *place, struct psr_error *err)
{
	struct psr_instance *instance = &shot->instance[shot->scene.n_instances];

	*instance = (struct psr_instance){ .model = open(name), .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	if (!instance->model)
		return psr_fail(err, PSR_ERR_NOT_FOUND, "there is no model '%s'", name);
	shot->scene.n_instances++;
	if (!place)
		return PSR_OK;
	memcpy(instance->rotation, place->rotation, sizeof instance->rotation);
	memcpy(instance->translation, place->translation, sizeof instance->translation);
	instance->scale = place->scale;
	instance->representation = (enum psr_representation)place->representation;
	return PSR_OK;
}

/* The model comes first. */
static int place_instances(struct shot *shot, const struct reader *reader, struct psr_error *err)
{
	const struct words *words = &reader->now;
	static const char *const colors[] = { "", "intensity", "class", "height", "return" }; /* by enum psr_color_by */
	unsigned color_by = PSR_COLOR_OWN;
	int rc = place_instance(shot, reader->open, words->model ? words->model : "", NULL, err);

	shot->scene.instance = shot->instance;
	for (uint32_t i = 0; !rc && i < words->n_instances; i++)
		rc = place_instance(shot, reader->open, words->instance[i].model, &words->instance[i].place, err);
	while (words->color_by && color_by <= PSR_COLOR_RETURN && strcmp(colors[color_by], words->color_by) != 0)
		color_by++;
	if (!rc && color_by > PSR_COLOR_RETURN)
		return psr_fail(err, PSR_ERR_ARG, "'%.40s' is no number of a point", words->color_by);
	for (uint32_t i = 0; !rc && i < shot->scene.n_instances; i++)
		shot->instance[i].color_by = (enum psr_color_by)color_by;
	return rc;
}

/* Without a target the camera looks at the model alone. */
static int make_scene(struct shot *shot, struct words *words, struct psr_error *err)
{
	const struct psr_model_info *info = psr_model_info(shot->instance[0].model);
	struct psr_camera camera;

	memcpy(words->wish.natural_up, info->up, sizeof words->wish.natural_up);
	words->wish.fov_y = words->has_ortho ? 0 : words->fov * DEGREE;
	words->wish.ortho_height = words->has_ortho ? words->ortho : 0;
	int rc = psr_camera_complete(&camera, &words->wish, info->box_min, info->box_max,
	                             (double)shot->size[0] / shot->size[1], err);
	if (rc)
		return rc;
	if (!words->n_lights && !words->has_ambient)
		client_light_key(&words->light[words->n_lights++], &camera);
	shot->scene.camera = camera;
	for (uint32_t i = 0; i < words->n_lights; i++)
		psr_msg_light_get(&shot->light[i], &words->light[i]);
	shot->scene.light = shot->light;
	shot->scene.n_lights = words->n_lights;
	for (int k = 0; k < 3; k++) {
		shot->scene.ambient[k] = words->ambient;
		shot->scene.background[k] = (double)psr_srgb_to_linear[words->background[k]];
	}
	return PSR_OK;
}

static int parse_hash(uint64_t *hash, const char *text, struct psr_error *err)
{
	char *end;

	*hash = strtoull(text, &end, 16);
	return end == text + 16 && !*end ? PSR_OK : psr_fail(err, PSR_ERR_ARG, "'%.40s' is no hash", text);
}

static int end_shot(struct reader *reader, struct psr_error *err)
{
	static struct shot shot;
	struct words *now = &reader->now;

	if (!now->name)
		return PSR_OK;
	memset(&shot, 0, sizeof shot);
	snprintf(shot.name, sizeof shot.name, "%s", now->name);
	memcpy(shot.size, now->size, sizeof shot.size);
	shot.smooth = now->quality != NULL ? PSR_SMOOTH_FINE : now->is_plain ? PSR_SMOOTH_NONE : PSR_SMOOTH_EDGES;
	shot.n_passes = (unsigned)now->n_passes;
	shot.with_splats = now->with_splats;
	int rc = place_instances(&shot, reader, err);
	for (unsigned plane = 0; !rc && plane < PSR_N_PLANES; plane++)
		if (now->hash[plane]) {
			shot.planes |= 1u << plane;
			rc = parse_hash(&shot.hash[plane], now->hash[plane], err);
		}
	if (!rc && !shot.planes)
		return psr_fail(err, PSR_ERR_ARG, "'%s' has no hash", shot.name);
	if (!rc)
		rc = make_scene(&shot, now, err);
	if (!rc)
		reader->on_shot(&shot);
	return rc;
}

static int on_light(const char *text, void *userdata, struct psr_error *err)
{
	struct words *words = userdata;

	if (words->n_lights == SHOT_MAX_LIGHTS)
		return psr_fail(err, PSR_ERR_LIMIT, "more than %d lights", SHOT_MAX_LIGHTS);
	return psr_light_parse(&words->light[words->n_lights++], text, err);
}

static int on_instance(const char *text, void *userdata, struct psr_error *err)
{
	struct words *words = userdata;

	if (words->n_instances == SHOT_MAX_INSTANCES - 1)
		return psr_fail(err, PSR_ERR_LIMIT, "more than %d instances", SHOT_MAX_INSTANCES);
	return instance_parse(&words->instance[words->n_instances++], text, err);
}

static int on_hash(const char *text, void *userdata, struct psr_error *err)
{
	const char *colon = strchr(text, ':');
	struct words *words = userdata;
	unsigned plane = PSR_PLANE_COLOR;

	if (colon)
		while (plane < PSR_N_PLANES && strncmp(text, psr_plane_name(plane), (size_t)(colon - text)) != 0)
			plane++;
	if (plane == PSR_N_PLANES)
		return psr_fail(err, PSR_ERR_ARG, "'%.40s' is of no plane", text);
	words->hash[plane] = colon ? colon + 1 : text;
	return PSR_OK;
}

static int on_test(const char *text, void *userdata, struct psr_error *err)
{
	struct reader *reader = userdata;
	int rc = end_shot(reader, err);

	if (!reader->now.name)
		reader->defaults = reader->now;
	reader->now = reader->defaults;
	reader->now.name = text;
	return rc;
}

int shots_read(const char *path, const struct psr_model *(*open)(const char *name), void (*on_shot)(struct shot *shot),
               struct psr_error *err)
{
	struct reader reader = {
		.open = open, .on_shot = on_shot,
		.now = { .size = { 800, 600 }, .fov = 35, .ambient = 0.15, .background = { 0x20, 0x24, 0x28 } },
	};
	struct words *now = &reader.now;
	const char *models;
	const struct psr_opt opts[] = {
		{ .name = "test", .type = PSR_OPT_CALL, .value = &reader, .call = on_test },
		{ .name = "hash", .type = PSR_OPT_CALL, .value = now, .call = on_hash },
		{ .name = "models", .type = PSR_OPT_STRING, .value = &models },
		{ .name = "model", .type = PSR_OPT_STRING, .value = &now->model },
		{ .name = "instance", .type = PSR_OPT_CALL, .value = now, .call = on_instance },
		{ .name = "size", .type = PSR_OPT_SIZE, .value = now->size },
		{ .name = "eye", .type = PSR_OPT_VEC3, .value = now->wish.eye, .seen = &now->wish.has_eye },
		{ .name = "target", .type = PSR_OPT_VEC3, .value = now->wish.target, .seen = &now->wish.has_target },
		{ .name = "up", .type = PSR_OPT_VEC3, .value = now->wish.up, .seen = &now->wish.has_up },
		{ .name = "fov", .type = PSR_OPT_REAL, .value = &now->fov },
		{ .name = "ortho", .type = PSR_OPT_REAL, .value = &now->ortho, .seen = &now->has_ortho },
		{ .name = "light", .type = PSR_OPT_CALL, .value = now, .call = on_light },
		{ .name = "ambient", .type = PSR_OPT_REAL, .value = &now->ambient, .seen = &now->has_ambient },
		{ .name = "smooth", .type = PSR_OPT_FLAG, .value = &now->is_smooth },
		{ .name = "no-smooth", .type = PSR_OPT_FLAG, .value = &now->is_plain },
		{ .name = "color-by", .type = PSR_OPT_STRING, .value = &now->color_by },
		{ .name = "quality", .type = PSR_OPT_STRING, .value = &now->quality },
		{ .name = "passes", .type = PSR_OPT_INT, .value = &now->n_passes },
		{ .name = "splats", .type = PSR_OPT_FLAG, .value = &now->with_splats },
		{ .name = "background", .type = PSR_OPT_COLOR, .value = now->background },
		{ .name = NULL },
	};
	const struct psr_cli cli = { .usage = "", .summary = "", .opts = opts };
	struct wordfile file = { .path = path, .cli = &cli };
	char *text = NULL;
	int rc = wordfile_read(&file, &text, err);

	if (!rc)
		rc = end_shot(&reader, err);
	free(text);
	return rc;
}

#define _GNU_SOURCE
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/srgb.h"
#include "client/cli/optlist.h"
#include "client/lib/camera.h"
#include "psr/client.h"
#include "proto/proto.h"
#include "shot.h"

#define DEGREE (3.14159265358979323846 / 180)

/* As they stand in the suite, with the defaults of `psr shot`. */
struct words {
	const char *name, *model, *color, *depth;
	uint32_t size[2];
	int is_smooth, is_plain;
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

static int make_scene(struct shot *shot, struct words *words, struct psr_error *err)
{
	const struct psr_model_info *info = psr_model_info(shot->instance.model);
	struct psr_camera camera;

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
	shot->scene.instance = &shot->instance;
	shot->scene.n_instances = 1;
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

	if (!text)
		return psr_fail(err, PSR_ERR_ARG, "a hash of color or depth is missing");
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
	snprintf(shot.model, sizeof shot.model, "%s", now->model ? now->model : "");
	memcpy(shot.size, now->size, sizeof shot.size);
	shot.is_smooth = !now->is_plain;
	shot.n_passes = (unsigned)now->n_passes;
	shot.instance = (struct psr_instance){ .model = reader->open(shot.model), .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	if (!shot.instance.model)
		return psr_fail(err, PSR_ERR_NOT_FOUND, "there is no model '%s'", shot.model);
	int rc = parse_hash(&shot.color, now->color, err);
	if (!rc)
		rc = parse_hash(&shot.depth, now->depth, err);
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

static int on_hash(const char *text, void *userdata, struct psr_error *err)
{
	static const char prefix[] = "depth:";
	struct words *words = userdata;

	(void)err;
	if (strncmp(text, prefix, sizeof prefix - 1) == 0)
		words->depth = text + sizeof prefix - 1;
	else
		words->color = text;
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
		{ .name = "passes", .type = PSR_OPT_INT, .value = &now->n_passes },
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

#define _GNU_SOURCE
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "base/srgb.h"
#include "base/cli.h"
#include "psr/client.h"
#include "server/frames/wire.h"
#include "shot.h"

#define DEGREE (3.14159265358979323846 / 180)
#define MAX_WORDS 32

/* As they stand on the line, with the defaults of `psr shot`. */
struct words {
	const char *model;
	struct psr_camera_wish wish;
	double fov, ortho, ambient;
	int has_ortho, has_ambient;
	uint8_t background[3];
	struct psr_msg_light light[SHOT_MAX_LIGHTS];
	uint32_t n_lights;
};

static int on_light(const char *text, void *userdata, struct psr_error *err)
{
	struct words *words = userdata;
	if (words->n_lights == SHOT_MAX_LIGHTS)
		return psr_fail(err, PSR_ERR_LIMIT, "more than %d lights", SHOT_MAX_LIGHTS);
	return psr_light_parse(&words->light[words->n_lights++], text, err);
}

static int parse_words(struct words *words, struct shot *shot, int argc, char **argv, struct psr_error *err)
{
	const struct psr_opt opts[] = {
		{ .name = "model", .type = PSR_OPT_STRING, .value = &words->model },
		{ .name = "size", .type = PSR_OPT_SIZE, .value = shot->size },
		{ .name = "eye", .type = PSR_OPT_VEC3, .value = words->wish.eye, .seen = &words->wish.has_eye },
		{ .name = "target", .type = PSR_OPT_VEC3, .value = words->wish.target, .seen = &words->wish.has_target },
		{ .name = "up", .type = PSR_OPT_VEC3, .value = words->wish.up, .seen = &words->wish.has_up },
		{ .name = "fov", .type = PSR_OPT_REAL, .value = &words->fov },
		{ .name = "ortho", .type = PSR_OPT_REAL, .value = &words->ortho, .seen = &words->has_ortho },
		{ .name = "light", .type = PSR_OPT_CALL, .value = words, .call = on_light },
		{ .name = "ambient", .type = PSR_OPT_REAL, .value = &words->ambient, .seen = &words->has_ambient },
		{ .name = "smooth", .type = PSR_OPT_FLAG, .value = &shot->is_smooth },
		{ .name = "background", .type = PSR_OPT_COLOR, .value = words->background },
		{ .name = NULL },
	};
	const struct psr_cli cli = { .usage = "", .summary = "", .opts = opts };
	return psr_cli_parse(&cli, argc, argv, NULL, err);
}

static int make_scene(struct shot *shot, struct words *words, struct psr_error *err)
{
	const struct psr_model_info *info = psr_model_info(shot->instance.model);
	struct psr_msg_camera camera;

	words->wish.fov_y = words->has_ortho ? 0 : words->fov * DEGREE;
	words->wish.ortho_height = words->has_ortho ? words->ortho : 0;
	int rc = psr_camera_complete(&camera, &words->wish, info->box_min, info->box_max,
	                             (double)shot->size[0] / shot->size[1], err);
	if (rc)
		return rc;
	if (!words->n_lights && !words->has_ambient)
		client_light_key(&words->light[words->n_lights++], &camera);
	wire_to_camera(&shot->scene.camera, &camera);
	for (uint32_t i = 0; i < words->n_lights; i++)
		wire_to_light(&shot->light[i], &words->light[i]);
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

int shot_parse(struct shot *shot, char *line, const struct psr_model *(*open)(const char *name), struct psr_error *err)
{
	struct words words = { .fov = 35, .ambient = 0.15, .background = { 0x20, 0x24, 0x28 } };
	char *argv[MAX_WORDS + 1], *word;
	int argc = 0;

	memset(shot, 0, sizeof *shot);
	shot->size[0] = 800;
	shot->size[1] = 600;
	while ((word = strsep(&line, " \n")) != NULL)
		if (*word && argc < MAX_WORDS)
			argv[argc++] = word;
	argv[argc] = NULL;
	if (!argc || argv[0][0] == '#')
		return 1;
	int rc = parse_words(&words, shot, argc, argv, err);
	if (rc)
		return rc;
	snprintf(shot->name, sizeof shot->name, "%s", argv[0]);
	snprintf(shot->model, sizeof shot->model, "%s", words.model ? words.model : "");
	shot->instance = (struct psr_instance){ .model = open(shot->model), .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	if (!shot->instance.model)
		return psr_fail(err, PSR_ERR_NOT_FOUND, "there is no model '%s'", shot->model);
	return make_scene(shot, &words, err);
}

#include <stdio.h>
#include <string.h>
#include "base/view.h"
#include "preset.h"

const char *preset_of_light(const char *text)
{
	static const char prefix[] = "preset:";

	return strncmp(text, prefix, sizeof prefix - 1) == 0 ? text + sizeof prefix - 1 : NULL;
}

void preset_place(struct psr_msg_preset *preset, const struct psr_msg_instance *place)
{
	struct psr_camera *camera = &preset->camera;
	struct psr_msg_light *light = &preset->light;

	if (preset->kind == PSR_WIRE_PRESET_CAMERA) {
		instance_apply(camera->eye, place, camera->eye);
		instance_apply(camera->target, place, camera->target);
		instance_rotate(camera->up, place, camera->up);
		camera->near_z *= place->scale;
		if (camera->kind == PSR_CAMERA_ORTHOGRAPHIC)
			camera->ortho_height *= place->scale;
		return;
	}
	if (light->kind != PSR_WIRE_LIGHT_DIRECTIONAL)
		instance_apply(light->position, place, light->position);
	if (light->kind != PSR_WIRE_LIGHT_POINT)
		instance_rotate(light->direction, place, light->direction);
	light->reference *= place->scale;
}

const char *preset_type(const struct psr_msg_preset *preset)
{
	if (preset->kind == PSR_WIRE_PRESET_CAMERA)
		return view_camera_kinds[preset->camera.kind];
	return view_light_kinds[preset->light.kind - PSR_WIRE_LIGHT_DIRECTIONAL];
}

/* Lists as many names as fit. */
static int fail_missing(const struct scene *scene, uint8_t kind, const char *name, struct psr_error *err)
{
	const char *what = kind == PSR_WIRE_PRESET_CAMERA ? "camera" : "light";
	char names[300] = "";
	size_t used = 0;

	for (uint32_t i = 0; i < scene->n_presets; i++) {
		int n;

		if (scene->preset[i].kind != kind)
			continue;
		n = snprintf(names + used, sizeof names - used, "%s'%s'", used != 0 ? ", " : "", scene->preset[i].name);
		if (n < 0 || (size_t)n >= sizeof names - used - sizeof ", ...") {
			strcpy(names + used, ", ...");
			break;
		}
		used += (size_t)n;
	}
	if (names[0] == '\0')
		return psr_fail(err, PSR_ERR_NOT_FOUND, "the model has no %ss", what);
	return psr_fail(err, PSR_ERR_NOT_FOUND, "the model has no %s '%.80s'; it has %s", what, name, names);
}

static int check_server(const struct scene *scene, struct psr_error *err)
{
	const struct psr_msg_welcome *welcome = psr_client_welcome(scene->client);

	if (welcome->capabilities & PSR_CAP_PRESETS)
		return PSR_OK;
	return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s does not tell the cameras and lights of models", welcome->server);
}

int preset_find(const struct psr_msg_preset **out, const struct scene *scene, uint8_t kind, const char *name,
                struct psr_error *err)
{
	int code = check_server(scene, err);

	if (code != PSR_OK)
		return code;
	for (uint32_t i = 0; i < scene->n_presets; i++) {
		*out = &scene->preset[i];
		if ((*out)->kind == kind && strcmp((*out)->name, name) == 0)
			return PSR_OK;
	}
	return fail_missing(scene, kind, name, err);
}

int preset_all_lights(struct psr_msg_scene *msg, const struct scene *scene, struct psr_error *err)
{
	int code = check_server(scene, err);
	uint32_t n = 0;

	if (code != PSR_OK)
		return code;
	for (uint32_t i = 0; i < scene->n_presets; i++) {
		if (scene->preset[i].kind != PSR_WIRE_PRESET_LIGHT)
			continue;
		if (msg->n_lights == PSR_WIRE_MAX_LIGHTS)
			return psr_fail(err, PSR_ERR_LIMIT, "together with the model's lights there are more than %d; name some with "
			                "--light preset:NAME", PSR_WIRE_MAX_LIGHTS);
		msg->light[msg->n_lights++] = scene->preset[i].light;
		n++;
	}
	return n != 0 ? PSR_OK : fail_missing(scene, PSR_WIRE_PRESET_LIGHT, "", err);
}

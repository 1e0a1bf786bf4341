#include "preset.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *preset_of_light(const char *text)
{
	static const char prefix[] = "preset:";

	return strncmp(text, prefix, sizeof prefix - 1) == 0 ? text + sizeof prefix - 1 : NULL;
}

const char *preset_type(const struct psr_msg_preset *preset)
{
	if (preset->kind == PSR_WIRE_PRESET_CAMERA)
		return preset->camera.kind == PSR_WIRE_CAMERA_PERSPECTIVE ? "perspective" : "orthographic";
	return preset->light.kind == PSR_WIRE_LIGHT_DIRECTIONAL ? "directional"
	       : preset->light.kind == PSR_WIRE_LIGHT_POINT ? "point" : "spot";
}

struct presets {
	const struct psr_msg_preset *preset;
	uint32_t n;
};

/* "there are 'a', 'b'" as far as it fits. */
static int fail_missing(const struct presets *presets, uint8_t kind, const char *name, struct psr_error *err)
{
	const char *what = kind == PSR_WIRE_PRESET_CAMERA ? "camera" : "light";
	char names[300] = "";
	size_t used = 0;

	for (uint32_t i = 0; i < presets->n; i++) {
		int n;

		if (presets->preset[i].kind != kind)
			continue;
		n = snprintf(names + used, sizeof names - used, "%s'%s'", used != 0 ? ", " : "", presets->preset[i].name);
		if (n < 0 || (size_t)n >= sizeof names - used - sizeof ", ...") {
			strcpy(names + used, ", ...");
			break;
		}
		used += (size_t)n;
	}
	if (names[0] == '\0')
		return psr_fail(err, PSR_ERR_NOT_FOUND, "the model came without %ss", what);
	return psr_fail(err, PSR_ERR_NOT_FOUND, "no %s '%.80s' came with the model; there are %s", what, name, names);
}

static const struct psr_msg_preset *find(const struct presets *presets, uint8_t kind, const char *name)
{
	for (uint32_t i = 0; i < presets->n; i++)
		if (presets->preset[i].kind == kind && strcmp(presets->preset[i].name, name) == 0)
			return &presets->preset[i];
	return NULL;
}

static int add_all_lights(const struct presets *presets, struct psr_msg_scene *scene, struct psr_error *err)
{
	uint32_t n = 0;

	for (uint32_t i = 0; i < presets->n; i++) {
		if (presets->preset[i].kind != PSR_WIRE_PRESET_LIGHT)
			continue;
		if (scene->n_lights == PSR_WIRE_MAX_LIGHTS)
			return psr_fail(err, PSR_ERR_LIMIT, "with those of the model there are more than %d lights; name some with "
			                "--light preset:NAME", PSR_WIRE_MAX_LIGHTS);
		scene->light[scene->n_lights++] = presets->preset[i].light;
		n++;
	}
	return n != 0 ? PSR_OK : fail_missing(presets, PSR_WIRE_PRESET_LIGHT, "", err);
}

static int apply(const struct preset_wish *wish, const struct presets *presets, struct psr_msg_camera *camera,
                 struct psr_msg_scene *scene, struct psr_error *err)
{
	const struct psr_msg_preset *found;

	if (wish->camera != NULL) {
		found = find(presets, PSR_WIRE_PRESET_CAMERA, wish->camera);
		if (found == NULL)
			return fail_missing(presets, PSR_WIRE_PRESET_CAMERA, wish->camera, err);
		*camera = found->camera;
	}
	for (uint32_t i = 0; i < scene->n_lights; i++) {
		if (wish->light[i] == NULL)
			continue;
		found = find(presets, PSR_WIRE_PRESET_LIGHT, wish->light[i]);
		if (found == NULL)
			return fail_missing(presets, PSR_WIRE_PRESET_LIGHT, wish->light[i], err);
		scene->light[i] = found->light;
	}
	return wish->all_lights ? add_all_lights(presets, scene, err) : PSR_OK;
}

int preset_apply(const struct preset_wish *wish, struct psr_client *client, uint32_t handle,
                 struct psr_msg_camera *camera, struct psr_msg_scene *scene, int timeout_ms, struct psr_error *err)
{
	struct psr_msg_preset *preset = NULL;
	uint32_t n = 0;
	int code;

	if (wish->camera == NULL && !wish->has_lights && !wish->all_lights)
		return PSR_OK;
	code = psr_client_presets(client, handle, &preset, &n, timeout_ms, err);
	if (code == PSR_OK)
		code = apply(wish, &(struct presets){ preset, n }, camera, scene, err);
	free(preset);
	return code;
}

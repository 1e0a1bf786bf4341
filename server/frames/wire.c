#include <string.h>
#include "base/srgb.h"
#include "wire.h"

void wire_to_camera(struct psr_camera *camera, const struct psr_msg_camera *msg)
{
	const int is_perspective = msg->kind == PSR_WIRE_CAMERA_PERSPECTIVE;

	memcpy(camera->eye, msg->eye, sizeof camera->eye);
	memcpy(camera->target, msg->target, sizeof camera->target);
	memcpy(camera->up, msg->up, sizeof camera->up);
	camera->kind = is_perspective ? PSR_CAMERA_PERSPECTIVE : PSR_CAMERA_ORTHOGRAPHIC;
	camera->fov_y = is_perspective ? msg->extent : 0;
	camera->ortho_height = is_perspective ? 0 : msg->extent;
	camera->near_z = msg->near_z;
}

void wire_to_light(struct psr_light *light, const struct psr_msg_light *msg)
{
	light->kind = msg->kind == PSR_WIRE_LIGHT_DIRECTIONAL ? PSR_LIGHT_DIRECTIONAL
	              : msg->kind == PSR_WIRE_LIGHT_POINT ? PSR_LIGHT_POINT : PSR_LIGHT_SPOT;
	light->casts_shadow = (msg->flags & PSR_WIRE_LIGHT_SHADOW) != 0;
	memcpy(light->position, msg->position, sizeof light->position);
	memcpy(light->direction, msg->direction, sizeof light->direction);
	for (int k = 0; k < 3; k++)
		light->color[k] = (double)psr_srgb_to_linear[msg->color[k]] * msg->intensity;
	light->outer = msg->outer;
	light->inner = msg->inner;
	light->reference = msg->reference;
}

void wire_from_camera(struct psr_msg_preset *msg, const struct psr_preset_camera *preset)
{
	const struct psr_camera *from = &preset->camera;
	struct psr_msg_camera *to = &msg->camera;
	int is_perspective = from->kind == PSR_CAMERA_PERSPECTIVE;

	memset(msg, 0, sizeof *msg);
	msg->kind = PSR_WIRE_PRESET_CAMERA;
	memcpy(msg->name, preset->name, sizeof preset->name);
	to->kind = is_perspective ? PSR_WIRE_CAMERA_PERSPECTIVE : PSR_WIRE_CAMERA_ORTHOGRAPHIC;
	memcpy(to->eye, from->eye, sizeof to->eye);
	memcpy(to->target, from->target, sizeof to->target);
	memcpy(to->up, from->up, sizeof to->up);
	to->extent = is_perspective ? from->fov_y : from->ortho_height;
	to->near_z = from->near_z;
}

/* The greatest component becomes the intensity, the rest is the colour. */
static void color_and_intensity(struct psr_msg_light *to, const double color[3])
{
	double most = 0;

	for (int k = 0; k < 3; k++)
		most = color[k] > most ? color[k] : most;
	for (int k = 0; k < 3 && most > 0; k++)
		to->color[k] = psr_linear_to_srgb((float)(color[k] / most));
	to->intensity = most < PSR_WIRE_MAX_INTENSITY ? most : PSR_WIRE_MAX_INTENSITY;
}

void wire_from_light(struct psr_msg_preset *msg, const struct psr_preset_light *preset)
{
	const struct psr_light *from = &preset->light;
	struct psr_msg_light *to = &msg->light;

	memset(msg, 0, sizeof *msg);
	msg->kind = PSR_WIRE_PRESET_LIGHT;
	memcpy(msg->name, preset->name, sizeof preset->name);
	to->kind = from->kind == PSR_LIGHT_DIRECTIONAL ? PSR_WIRE_LIGHT_DIRECTIONAL
	           : from->kind == PSR_LIGHT_POINT ? PSR_WIRE_LIGHT_POINT : PSR_WIRE_LIGHT_SPOT;
	color_and_intensity(to, from->color);
	/* A model keeps zeros where a kind has no use for a field, as the wire does. */
	memcpy(to->position, from->position, sizeof to->position);
	memcpy(to->direction, from->direction, sizeof to->direction);
	to->inner = from->inner;
	to->outer = from->outer;
	to->reference = from->reference;
}

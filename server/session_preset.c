#include <string.h>
#include "base/srgb.h"
#include "session_preset.h"

void preset_from_camera(struct psr_msg_preset *msg, const struct psr_preset_camera *preset)
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

void preset_from_light(struct psr_msg_preset *msg, const struct psr_preset_light *preset)
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

#include <string.h>
#include "base/srgb.h"
#include "proto.h"

void psr_msg_light_get(struct psr_light *light, const struct psr_msg_light *msg)
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

/* The greatest component becomes the intensity, and the color is divided by it. */
static void color_and_intensity(struct psr_msg_light *to, const double color[3])
{
	double most = 0;

	for (int k = 0; k < 3; k++)
		most = color[k] > most ? color[k] : most;
	for (int k = 0; k < 3 && most > 0; k++)
		to->color[k] = psr_linear_to_srgb((float)(color[k] / most));
	to->intensity = most < PSR_WIRE_MAX_INTENSITY ? most : PSR_WIRE_MAX_INTENSITY;
}

void psr_msg_light_set(struct psr_msg_light *msg, const struct psr_light *light)
{
	memset(msg, 0, sizeof *msg);
	msg->kind = light->kind == PSR_LIGHT_DIRECTIONAL ? PSR_WIRE_LIGHT_DIRECTIONAL
	            : light->kind == PSR_LIGHT_POINT ? PSR_WIRE_LIGHT_POINT : PSR_WIRE_LIGHT_SPOT;
	msg->flags = light->casts_shadow ? PSR_WIRE_LIGHT_SHADOW : 0;
	color_and_intensity(msg, light->color);
	if (light->kind != PSR_LIGHT_DIRECTIONAL) {
		memcpy(msg->position, light->position, sizeof msg->position);
		msg->reference = light->reference;
	}
	if (light->kind != PSR_LIGHT_POINT)
		memcpy(msg->direction, light->direction, sizeof msg->direction);
	if (light->kind == PSR_LIGHT_SPOT) {
		msg->inner = light->inner;
		msg->outer = light->outer;
	}
}

#include "base/maths.h"
#include "render/render.h"

static inline float dot(const float a[3], const float b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* How much of a light arrives at p (1: all), and the unit vector to it. */
static inline float arriving(const struct plan_light *light, const float p[3], float to_light[3])
{
	if (light->kind == PSR_LIGHT_DIRECTIONAL) {
		for (int k = 0; k < 3; k++)
			to_light[k] = light->to_light[k];
		return 1;
	}
	for (int k = 0; k < 3; k++)
		to_light[k] = light->position[k] - p[k];
	const float distance2 = dot(to_light, to_light);
	if (!(distance2 > 0))
		return 0;
	const float distance = __builtin_sqrtf(distance2);
	for (int k = 0; k < 3; k++)
		to_light[k] = to_light[k] / distance;
	float amount = light->reference2 > 0 ? light->reference2 / distance2 : 1;
	if (light->kind == PSR_LIGHT_SPOT) {
		const float c = -dot(to_light, light->axis);
		if (!(c > light->cos_outer))
			return 0;
		if (c < light->cos_inner) { /* a smooth edge: 3 t^2 - 2 t^3 */
			const float t = (c - light->cos_outer) / (light->cos_inner - light->cos_outer);
			amount *= t * t * (3 - 2 * t);
		}
	}
	return amount;
}

static inline uint16_t light16(float linear)
{
	linear = linear > 0 ? linear : 0;
	linear = linear < 1 ? linear : 1;
	return (uint16_t)(linear * 65535.0f + 0.5f);
}

/* Phong: diffuse (ambient + sum I N.L) + specular sum I (R.V)^n, over the lights in front of the surface. */
static void shade_sample(const struct plan *plan, const struct plan_instance *in, const struct strip *s, uint32_t i,
                         float color[3])
{
	const float p[3] = { s->px[i], s->py[i], s->pz[i] }, n[3] = { s->nx[i], s->ny[i], s->nz[i] };
	const float diffuse[3] = { s->dr[i], s->dg[i], s->db[i] }, specular[3] = { s->sr[i], s->sg[i], s->sb[i] };
	float view[3];
	for (int k = 0; k < 3; k++)
		view[k] = plan->perspective ? in->eye[k] - p[k] : in->eye[k];
	const float length2 = dot(view, view), length = length2 > 0 ? __builtin_sqrtf(length2) : 1;

	for (int k = 0; k < 3; k++)
		color[k] = diffuse[k] * plan->ambient[k];
	for (uint32_t l = 0; l < plan->n_lights; l++) {
		const struct plan_light *light = &in->light[l];
		float to_light[3];
		const float amount = arriving(light, p, to_light), facing = dot(n, to_light);
		if (!(amount > 0 && facing > 0))
			continue;
		/* R.V with R = 2 (N.L) N - L */
		const float mirror = (2 * facing * dot(n, view) - dot(to_light, view)) / length;
		const float highlight = mirror > 0 ? psr_power(mirror < 1 ? mirror : 1, s->exponent[i]) : 0;
		for (int k = 0; k < 3; k++)
			color[k] += light->color[k] * amount * (diffuse[k] * facing + specular[k] * highlight);
	}
}

void shade_strip(const struct plan *plan, const struct strip *strip, uint16_t *rgb)
{
	const struct plan_instance *in = &plan->instance[strip->instance];
	for (uint32_t i = 0; i < strip->n; i++) {
		const uint32_t pixel = strip->pixel[i];
		float color[3] = { strip->dr[i], strip->dg[i], strip->db[i] };
		if (!strip->unlit[i])
			shade_sample(plan, in, strip, i, color);
		for (int k = 0; k < 3; k++)
			rgb[3 * (size_t)pixel + (size_t)k] = light16(color[k]);
	}
}

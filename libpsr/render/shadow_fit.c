#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "base/vec.h"
#include "shadow.h"

#define HALF_PI 1.57079632679489661923
#define MARGIN 3        /* texels on each side: four cells surround every lit point */
#define LEAST_SIDE 16
#define WIDEST 1.3089969389957472 /* 75 degrees; wider cones get faces of a cube */
#define CORNER 0.9553166181245093 /* angle from the axis of a cube's face to its corners */

/* The range of an instance along a unit vector, from its box and its sphere. */
static void range_along(const struct psr_instance *instance, const double axis[3], double *low, double *high)
{
	static const double origin[3] = { 0, 0, 0 };
	const struct psr_model_info *info = psr_model_info(instance->model);
	double center[3], rotation[3][3], middle[3], box = 0;
	const double radius = plan_place(center, rotation, instance, origin);
	const double sphere = v3d_dot(axis, center);
	double turned[3];

	m3d_apply_transposed(turned, (const double(*)[3])rotation, axis);
	for (int k = 0; k < 3; k++) {
		middle[k] = info->box_min[k] / 2 + info->box_max[k] / 2;
		box += fabs(turned[k]) * (info->box_max[k] / 2 - info->box_min[k] / 2) * instance->scale;
	}
	const double at = v3d_dot(axis, instance->translation) + instance->scale * v3d_dot(turned, middle);
	*low = fmax(sphere - radius, at - box);
	*high = fmin(sphere + radius, at + box);
}

static void scene_range(const struct psr_scene *scene, const double axis[3], double *low, double *high)
{
	*low = INFINITY;
	*high = -INFINITY;
	for (uint32_t i = 0; i < scene->n_instances; i++) {
		double l, h;

		range_along(&scene->instance[i], axis, &l, &h);
		*low = fmin(*low, l);
		*high = fmax(*high, h);
	}
}

static double radius_about(const struct psr_instance *instance, const double point[3])
{
	const struct psr_model_info *info = psr_model_info(instance->model);
	double center[3], rotation[3][3], farthest = 0;
	const double radius = plan_place(center, rotation, instance, point);

	for (int corner = 0; corner < 8; corner++) {
		double p[3];

		for (int k = 0; k < 3; k++)
			p[k] = instance->scale * ((corner >> k & 1 ? info->box_max[k] : info->box_min[k]) - info->origin[k]);
		m3d_apply(p, (const double(*)[3])rotation, p);
		v3d_add(p, p, center);
		farthest = fmax(farthest, v3d_length(p));
	}
	return fmin(farthest, v3d_length(center) + radius);
}

void shadow_bounds_make(struct shadow_bounds *bounds, const struct psr_scene *scene)
{
	bounds->spacing = INFINITY;
	bounds->radius = 0;
	for (int k = 0; k < 3; k++) {
		double low, high;

		scene_range(scene, (const double[3]){ k == 0, k == 1, k == 2 }, &low, &high);
		bounds->center[k] = low / 2 + high / 2;
	}
	for (uint32_t i = 0; i < scene->n_instances; i++) {
		const struct psr_instance *instance = &scene->instance[i];

		bounds->radius = fmax(bounds->radius, radius_about(instance, bounds->center));
		bounds->spacing = fmin(bounds->spacing, psr_model_info(instance->model)->spacing * instance->scale);
	}
}

/* The axis furthest from parallel to v. */
static void any_up(double up[3], const double v[3])
{
	int least = 0;

	for (int k = 1; k < 3; k++)
		if (fabs(v[k]) < fabs(v[least]))
			least = k;
	v3d_set(up, least == 0, least == 1, least == 2);
}

/* The arc tangent, in 0..pi/2, by bisection: frames use no libm. */
static double angle_of(double tangent)
{
	double low = 0, high = HALF_PI;

	for (int i = 0; i < 60; i++) {
		double middle = (low + high) / 2, s, c;

		psr_sincos(middle, &s, &c);
		if (s < tangent * c)
			low = middle;
		else
			high = middle;
	}
	return high;
}

static uint32_t clamp_side(double side, uint32_t most)
{
	return side < LEAST_SIDE ? LEAST_SIDE : side > most ? most : (uint32_t)side;
}

/* Places the eye far enough before the scene that a plan draws all of it. */
static uint32_t fit_directional(struct shadow_fit *fit, const struct psr_light *light, const struct psr_scene *scene,
                                const struct shadow_bounds *bounds, uint32_t side)
{
	double axis[3][3], low[3], high[3];
	struct psr_camera *camera = &fit->camera;

	v3d_normalize(axis[2], light->direction);
	any_up(camera->up, axis[2]);
	v3d_cross(axis[0], axis[2], camera->up);
	v3d_normalize(axis[0], axis[0]);
	v3d_cross(axis[1], axis[2], axis[0]);
	for (int a = 0; a < 3; a++)
		scene_range(scene, axis[a], &low[a], &high[a]);
	const double width = high[0] - low[0], height = high[1] - low[1],
				 most = fmax(fmax(width, height), 1e-6 * bounds->radius);
	const double texel = fmax(most / (side - 2 * MARGIN), bounds->spacing);
	fit->width = clamp_side(ceil(width / texel) + 2 * MARGIN, side);
	fit->height = clamp_side(ceil(height / texel) + 2 * MARGIN, side);
	v3d_set(camera->eye, 0, 0, 0);
	for (int a = 0; a < 3; a++)
		v3d_add_scaled(camera->eye, camera->eye, a < 2 ? low[a] / 2 + high[a] / 2 : low[2] - bounds->radius / 8,
		               axis[a]);
	v3d_add_scaled(camera->target, camera->eye, bounds->radius, axis[2]);
	camera->kind = PSR_CAMERA_ORTHOGRAPHIC;
	camera->fov_y = camera->near_z = 0;
	camera->ortho_height = texel * fit->height;
	fit->nearest = 0;
	fit->farthest = high[2] - low[2] + bounds->radius / 4;
	return 1;
}

/* The field of a square map: its axis, the tangent of half its angle, and the distance where texels match the spacing.
 * */
struct field {
	double axis[3], tangent, distance;
};

/* A square picture from the light of at least a field. */
static void fit_square(struct shadow_fit *fit, const struct psr_light *light, const struct field *field,
                       const struct shadow_bounds *bounds, uint32_t side)
{
	const double tangent = field->tangent, *axis = field->axis, *position = light->position;
	struct psr_camera *camera = &fit->camera;
	const double adequate = 2 * tangent * field->distance / bounds->spacing + 2 * MARGIN;

	fit->width = fit->height = clamp_side(ceil(adequate), side);
	memcpy(camera->eye, position, sizeof camera->eye);
	v3d_add_scaled(camera->target, position, field->distance, axis);
	any_up(camera->up, axis);
	camera->kind = PSR_CAMERA_PERSPECTIVE;
	camera->ortho_height = camera->near_z = 0;
	camera->fov_y = 2 * angle_of(tangent * fit->width / (fit->width - 2 * MARGIN));
	double to[3];
	v3d_sub(to, bounds->center, position);
	const double along = v3d_dot(axis, to), reach = bounds->radius * 1.01;
	fit->nearest = fmax(along - reach, 0);
	fit->farthest = fmax(along + reach, 0.01 * reach);
}

/* Whether the instances' sphere, at `to` from the light, and a spot's cone both reach into the pyramid of a face. */
static int face_sees(const double face[3], const double to[3], double radius, const struct psr_light *light)
{
	for (int k = 0; k < 3; k++)
		if (face[k] == 0)
			for (int sign = -1; sign <= 1; sign += 2)
				if ((v3d_dot(face, to) + sign * to[k]) * sqrt(0.5) < -radius)
					return 0;
	if (light->kind == PSR_LIGHT_SPOT && light->outer + CORNER < 2 * HALF_PI) {
		double axis[3], s, c;

		v3d_normalize(axis, light->direction);
		psr_sincos(light->outer + CORNER, &s, &c);
		return v3d_dot(axis, face) > c - 1e-9;
	}
	return 1;
}

static uint32_t fit_cube(struct shadow_fit fit[SHADOW_FACES], const struct psr_light *light, const double to[3],
                         double distance, const struct shadow_bounds *bounds, uint32_t side)
{
	uint32_t n = 0;

	for (int f = 0; f < SHADOW_FACES; f++) {
		struct field face = { { 0, 0, 0 }, 1, distance };

		face.axis[f / 2] = f & 1 ? -1 : 1;
		if (face_sees(face.axis, to, bounds->radius, light))
			fit_square(&fit[n++], light, &face, bounds, side);
	}
	return n;
}

uint32_t shadow_fit_light(struct shadow_fit fit[SHADOW_FACES], const struct psr_light *light,
                          const struct psr_scene *scene, const struct shadow_bounds *bounds, uint32_t side)
{
	if (light->kind == PSR_LIGHT_DIRECTIONAL)
		return fit_directional(fit, light, scene, bounds, side);
	double to[3], s, c, widest;
	v3d_sub(to, bounds->center, light->position);
	const double away = v3d_length(to), distance = fmax(away, bounds->radius), r = bounds->radius * 1.0001;
	const double sphere = away > r ? r / sqrt(away * away - r * r) : INFINITY; /* tangents of half angles */
	double cone = INFINITY;
	psr_sincos(WIDEST, &s, &c);
	widest = s / c;
	if (light->kind == PSR_LIGHT_SPOT && light->outer <= WIDEST) {
		psr_sincos(light->outer, &s, &c);
		cone = s / c;
	}
	if (fmin(sphere, cone) > widest)
		return fit_cube(fit, light, to, distance, bounds, side);
	struct field field = { .tangent = fmin(sphere, cone), .distance = distance };
	v3d_normalize(field.axis, sphere < cone ? to : light->direction);
	fit_square(fit, light, &field, bounds, side);
	return 1;
}

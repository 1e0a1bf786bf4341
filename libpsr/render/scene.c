#include <math.h>
#include "base/maths.h"
#include "base/vec.h"
#include "psr/scene.h"

#define MAX_LENGTH 1e30
#define PI 3.14159265358979323846

static int is_point(const double v[3])
{
	for (int i = 0; i < 3; i++)
		if (!(fabs(v[i]) <= MAX_LENGTH))
			return 0;
	return 1;
}

static int is_direction(const double v[3])
{
	double length = v3d_length(v);
	return is_point(v) && length >= 1e-30 && length <= MAX_LENGTH;
}

static int is_light(const double v[3])
{
	for (int i = 0; i < 3; i++)
		if (!(v[i] >= 0 && v[i] <= 1e9))
			return 0;
	return 1;
}

static int validate_camera(const struct psr_camera *camera, struct psr_error *err)
{
	double forward[3], right[3];
	if (!is_point(camera->eye) || !is_point(camera->target) || !is_point(camera->up))
		return psr_fail(err, PSR_ERR_ARG, "camera: eye, target and up must be finite and below 1e30");
	v3d_sub(forward, camera->target, camera->eye);
	if (!(v3d_normalize(forward, forward) > 0))
		return psr_fail(err, PSR_ERR_ARG, "camera: the target is where the eye is");
	if (!is_direction(camera->up))
		return psr_fail(err, PSR_ERR_ARG, "camera: up has no length");
	v3d_normalize(right, camera->up);
	v3d_cross(right, forward, right);
	if (!(v3d_length(right) >= 1e-6))
		return psr_fail(err, PSR_ERR_ARG, "camera: up is parallel to the viewing direction");
	if (camera->kind == PSR_CAMERA_PERSPECTIVE) {
		if (!(camera->fov_y >= 1e-6 && camera->fov_y <= 3.14159))
			return psr_fail(err, PSR_ERR_ARG, "camera: field of view of %g radians is not within 1e-6..3.14159", camera->fov_y);
	} else if (camera->kind == PSR_CAMERA_ORTHOGRAPHIC) {
		if (!(camera->ortho_height >= 1e-30 && camera->ortho_height <= MAX_LENGTH))
			return psr_fail(err, PSR_ERR_ARG, "camera: orthographic height of %g is not within 1e-30..1e30", camera->ortho_height);
	} else {
		return psr_fail(err, PSR_ERR_ARG, "camera: unknown kind %d", (int)camera->kind);
	}
	if (!(camera->near_z >= 0 && camera->near_z <= MAX_LENGTH))
		return psr_fail(err, PSR_ERR_ARG, "camera: near distance %g is not within 0..1e30", camera->near_z);
	return PSR_OK;
}

static int validate_light(const struct psr_light *light, unsigned i, struct psr_error *err)
{
	if (!is_light(light->color))
		return psr_fail(err, PSR_ERR_ARG, "light %u: colour times intensity must be within 0..1e9", i);
	if (light->kind != PSR_LIGHT_DIRECTIONAL && light->kind != PSR_LIGHT_POINT && light->kind != PSR_LIGHT_SPOT)
		return psr_fail(err, PSR_ERR_ARG, "light %u: unknown kind %d", i, (int)light->kind);
	if (light->kind != PSR_LIGHT_POINT && !is_direction(light->direction))
		return psr_fail(err, PSR_ERR_ARG, "light %u: its direction has no length, or is not finite", i);
	if (light->kind == PSR_LIGHT_DIRECTIONAL)
		return PSR_OK;
	if (!is_point(light->position))
		return psr_fail(err, PSR_ERR_ARG, "light %u: its position must be finite and below 1e30", i);
	if (!(light->reference >= 0 && light->reference <= MAX_LENGTH))
		return psr_fail(err, PSR_ERR_ARG, "light %u: reference distance %g is not within 0..1e30", i, light->reference);
	if (light->kind == PSR_LIGHT_SPOT &&
	    !(light->inner >= 0 && light->inner <= light->outer && light->outer > 0 && light->outer <= PI))
		return psr_fail(err, PSR_ERR_ARG, "light %u: half angles %g and %g must be 0 <= inner <= outer <= pi, outer > 0", i,
		                light->inner, light->outer);
	return PSR_OK;
}

static int validate_instance(const struct psr_instance *instance, unsigned i, struct psr_error *err)
{
	if (!instance->model || !psr_model_blocks(instance->model))
		return psr_fail(err, PSR_ERR_ARG, "instance %u: its model has no blocks", i);
	double q = 0;
	for (int k = 0; k < 4; k++)
		q += instance->rotation[k] * instance->rotation[k];
	if (!(fabs(q - 1) <= 1e-6))
		return psr_fail(err, PSR_ERR_ARG, "instance %u: its rotation is no unit quaternion", i);
	if (!is_point(instance->translation))
		return psr_fail(err, PSR_ERR_ARG, "instance %u: its translation must be finite and below 1e30", i);
	if (!(instance->scale >= 1e-30 && instance->scale <= MAX_LENGTH))
		return psr_fail(err, PSR_ERR_ARG, "instance %u: a scale of %g is not within 1e-30..1e30", i, instance->scale);
	return PSR_OK;
}

int psr_scene_validate(const struct psr_scene *scene, struct psr_error *err)
{
	if (scene->n_instances > PSR_MAX_INSTANCES)
		return psr_fail(err, PSR_ERR_LIMIT, "%u instances, at most %d", scene->n_instances, PSR_MAX_INSTANCES);
	if (scene->n_lights > PSR_MAX_LIGHTS)
		return psr_fail(err, PSR_ERR_LIMIT, "%u lights, at most %d", scene->n_lights, PSR_MAX_LIGHTS);
	if (!is_light(scene->ambient) || !is_light(scene->background))
		return psr_fail(err, PSR_ERR_ARG, "ambient and background must be within 0..1e9");
	int rc = validate_camera(&scene->camera, err);
	uint64_t n_blocks = 0;
	for (unsigned i = 0; !rc && i < scene->n_instances; i++) {
		rc = validate_instance(&scene->instance[i], i, err);
		if (!rc)
			n_blocks += psr_model_blocks(scene->instance[i].model)->n_blocks;
	}
	for (unsigned i = 0; !rc && i < scene->n_lights; i++)
		rc = validate_light(&scene->light[i], i, err);
	/* Sample ids are 32 bits, and the last block's would be that of an empty word. */
	if (!rc && n_blocks >= UINT64_C(1) << 26)
		return psr_fail(err, PSR_ERR_LIMIT, "the instances have %llu blocks together, at most 2^26 - 1",
		                (unsigned long long)n_blocks);
	return rc;
}

void psr_camera_frame(struct psr_camera *camera, const double box_min[3], const double box_max[3], double fov_y,
                      double aspect)
{
	/* The frame of a camera that looks along `forward` with +y up. */
	static const double right[3] = { 0.9302605094190634, 0, -0.3668996928526715 };
	static const double down[3] = { 0.11006990785580148, -0.9539392014169455, 0.2790781528257191 };
	static const double forward[3] = { -0.35, -0.3, -0.887411967464942 };
	const double margin = 1.06;
	/* The box's corners are made to fit, not a sphere about it: most objects are far from round. */
	double half[3], tangent[2] = { aspect, 1 }, distance = 0, extent = 0, deepest = 0;

	for (int i = 0; i < 3; i++) {
		camera->target[i] = box_min[i] / 2 + box_max[i] / 2;
		half[i] = box_max[i] / 2 - box_min[i] / 2;
	}
	if (fov_y > 0) {
		double s, c;
		psr_sincos(fov_y / 2, &s, &c);
		tangent[0] *= s / c;
		tangent[1] *= s / c;
	}
	for (int corner = 0; corner < 8; corner++) {
		double p[3];
		for (int i = 0; i < 3; i++)
			p[i] = corner >> i & 1 ? half[i] : -half[i];
		double x = fabs(v3d_dot(p, right)) / tangent[0], y = fabs(v3d_dot(p, down)) / tangent[1], z = v3d_dot(p, forward);
		extent = fmax(extent, fmax(x, y));
		distance = fmax(distance, fmax(x, y) * margin - z);
		deepest = fmax(deepest, -z);
	}
	if (!(extent > 0))
		extent = distance = 1;
	v3d_set(camera->up, 0, 1, 0);
	camera->kind = fov_y > 0 ? PSR_CAMERA_PERSPECTIVE : PSR_CAMERA_ORTHOGRAPHIC;
	camera->fov_y = fov_y > 0 ? fov_y : 0;
	camera->ortho_height = fov_y > 0 ? 0 : 2 * extent * margin;
	if (!(fov_y > 0))
		distance = 2 * deepest + extent;
	v3d_add_scaled(camera->eye, camera->target, -distance, forward);
	camera->near_z = (distance - deepest) / 2;
}

#include <math.h>
#include "vec.h"
#include "view.h"

#define MAX_LENGTH 1e30
#define PI 3.14159265358979323846

const char *const view_camera_kinds[2] = { "perspective", "orthographic" };
const char *const view_light_kinds[3] = { "directional", "point", "spot" };

int view_is_point(const double v[3])
{
	for (int i = 0; i < 3; i++)
		if (!(fabs(v[i]) <= MAX_LENGTH))
			return 0;
	return 1;
}

static int is_direction(const double v[3])
{
	double length = v3d_length(v);

	return view_is_point(v) && length >= 1e-30 && length <= MAX_LENGTH;
}

int view_is_light(const double v[3])
{
	for (int i = 0; i < 3; i++)
		if (!(v[i] >= 0 && v[i] <= 1e9))
			return 0;
	return 1;
}

int view_check_camera(const struct psr_camera *camera, struct psr_error *err)
{
	double forward[3], right[3];

	if (!view_is_point(camera->eye) || !view_is_point(camera->target) || !view_is_point(camera->up))
		return psr_fail(err, PSR_ERR_ARG, "eye, target and up must be finite and below 1e30");
	v3d_sub(forward, camera->target, camera->eye);
	if (!(v3d_normalize(forward, forward) > 0))
		return psr_fail(err, PSR_ERR_ARG, "target and eye are the same point");
	if (!is_direction(camera->up))
		return psr_fail(err, PSR_ERR_ARG, "up has no length");
	v3d_normalize(right, camera->up);
	v3d_cross(right, forward, right);
	if (!(v3d_length(right) >= 1e-6))
		return psr_fail(err, PSR_ERR_ARG, "up is parallel to the viewing direction");
	if (camera->kind == PSR_CAMERA_PERSPECTIVE) {
		if (!(camera->fov_y >= 1e-6 && camera->fov_y <= 3.14159))
			return psr_fail(err, PSR_ERR_ARG, "a field of view of %g radians is not within 1e-6..3.14159",
			                camera->fov_y);
	} else if (camera->kind == PSR_CAMERA_ORTHOGRAPHIC) {
		if (!(camera->ortho_height >= 1e-30 && camera->ortho_height <= MAX_LENGTH))
			return psr_fail(err, PSR_ERR_ARG, "an orthographic height of %g is not within 1e-30..1e30",
			                camera->ortho_height);
	} else {
		return psr_fail(err, PSR_ERR_ARG, "unknown kind %d", (int)camera->kind);
	}
	if (!(camera->near_z >= 0 && camera->near_z <= MAX_LENGTH))
		return psr_fail(err, PSR_ERR_ARG, "a near distance of %g is not within 0..1e30", camera->near_z);
	return PSR_OK;
}

int view_check_light(const struct psr_light *light, struct psr_error *err)
{
	if (!view_is_light(light->color))
		return psr_fail(err, PSR_ERR_ARG, "colour times intensity must be within 0..1e9");
	if (light->kind != PSR_LIGHT_DIRECTIONAL && light->kind != PSR_LIGHT_POINT && light->kind != PSR_LIGHT_SPOT)
		return psr_fail(err, PSR_ERR_ARG, "unknown kind %d", (int)light->kind);
	if (light->kind != PSR_LIGHT_POINT && !is_direction(light->direction))
		return psr_fail(err, PSR_ERR_ARG, "the direction has no length, or is not finite");
	if (light->kind == PSR_LIGHT_DIRECTIONAL)
		return PSR_OK;
	if (!view_is_point(light->position))
		return psr_fail(err, PSR_ERR_ARG, "the position must be finite and below 1e30");
	if (!(light->reference >= 0 && light->reference <= MAX_LENGTH))
		return psr_fail(err, PSR_ERR_ARG, "a reference distance of %g is not within 0..1e30", light->reference);
	if (light->kind == PSR_LIGHT_SPOT &&
	    !(light->inner >= 0 && light->inner <= light->outer && light->outer > 0 && light->outer <= PI))
		return psr_fail(err, PSR_ERR_ARG, "half angles %g and %g must be 0 <= inner <= outer <= pi, outer > 0",
		                light->inner, light->outer);
	return PSR_OK;
}

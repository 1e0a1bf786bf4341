#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "psr/client.h"
#include "psr/scene.h"

#define LEAST 1e-30 /* positive lengths on the wire */

static double near_from_box(const double eye[3], const double box_min[3], const double box_max[3])
{
	double near[3], far[3], near_z, to_box;

	for (int i = 0; i < 3; i++) {
		double below = box_min[i] - eye[i], above = eye[i] - box_max[i];

		near[i] = below > 0 ? below : above > 0 ? above : 0;
		far[i] = fmax(fabs(below), fabs(above));
	}
	near_z = 1e-3 * v3d_length(far);
	to_box = v3d_length(near);
	if (to_box > 0 && near_z > to_box / 2)
		near_z = to_box / 2;
	return near_z > LEAST ? near_z : LEAST;
}

/* Sine of the angle between a and b is below the limit of the protocol; also for a vector of length 0. */
static int is_parallel(const double a[3], const double b[3])
{
	double u[3], v[3], cross[3];

	if (v3d_normalize(u, a) == 0 || v3d_normalize(v, b) == 0)
		return 1;
	v3d_cross(cross, u, v);
	return v3d_length(cross) < 1e-6;
}

int psr_camera_complete(struct psr_msg_camera *camera, const struct psr_camera_wish *wish, const double box_min[3],
                        const double box_max[3], double aspect, struct psr_error *err)
{
	static const double y[3] = { 0, 1, 0 };
	struct psr_camera framed;
	double forward[3], axes[3][3];

	if (wish->has_up && !(v3d_length(wish->up) > 0))
		return psr_fail(err, PSR_ERR_ARG, "up 0,0,0 is no direction");
	psr_camera_frame(&framed, box_min, box_max, wish->has_up ? wish->up : y, wish->fov_y, aspect);
	if (wish->has_target) {
		v3d_sub(forward, framed.eye, framed.target);
		memcpy(framed.target, wish->target, sizeof framed.target);
		v3d_add(framed.eye, framed.target, forward);
	}
	if (wish->has_eye)
		memcpy(framed.eye, wish->eye, sizeof framed.eye);
	v3d_sub(forward, framed.target, framed.eye);
	if (!(v3d_length(forward) > 0))
		return psr_fail(err, PSR_ERR_ARG, "the eye %g,%g,%g is at the target%s", framed.eye[0], framed.eye[1],
		                framed.eye[2], wish->has_target ? "" : ", the middle of the model; say --target too");
	psr_camera_axes(axes, framed.up);
	if (!wish->has_up && is_parallel(framed.up, forward))
		v3d_scale(framed.up, axes[2], -1);
	if (is_parallel(framed.up, forward))
		return psr_fail(err, PSR_ERR_ARG, "up %g,%g,%g is 0 or runs along the view; choose another direction",
		                framed.up[0], framed.up[1], framed.up[2]);
	memset(camera, 0, sizeof *camera);
	memcpy(camera->eye, framed.eye, sizeof camera->eye);
	memcpy(camera->target, framed.target, sizeof camera->target);
	memcpy(camera->up, framed.up, sizeof camera->up);
	if (wish->fov_y > 0) {
		camera->kind = PSR_WIRE_CAMERA_PERSPECTIVE;
		camera->extent = wish->fov_y;
		camera->near_z = near_from_box(camera->eye, box_min, box_max);
	} else {
		camera->kind = PSR_WIRE_CAMERA_ORTHOGRAPHIC;
		camera->extent = wish->ortho_height > 0 ? wish->ortho_height : framed.ortho_height;
	}
	return PSR_OK;
}

void psr_light_key(struct psr_msg_light *light, const struct psr_msg_camera *camera)
{
	double forward[3], right[3], up[3];

	memset(light, 0, sizeof *light);
	memset(light->color, 255, sizeof light->color);
	light->kind = PSR_WIRE_LIGHT_DIRECTIONAL;
	light->intensity = 1;
	v3d_sub(forward, camera->target, camera->eye);
	v3d_normalize(forward, forward);
	v3d_cross(right, forward, camera->up);
	v3d_normalize(right, right);
	v3d_cross(up, right, forward);
	for (int i = 0; i < 3; i++)
		light->direction[i] = forward[i] + 0.5 * right[i] - 0.6 * up[i];
}

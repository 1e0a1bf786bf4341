#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "base/vec.h"
#include "camera.h"
#include "psr/scene.h"

#define LEAST 1e-30 /* positive lengths on the wire */
#define LEAST_FOV 1e-6
#define GREATEST_FOV 3.14159
#define MARGIN 1.06

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

/* Whether the sine of the angle between a and b is below the protocol's limit; also for a vector of length 0. */
static int is_parallel(const double a[3], const double b[3])
{
	double u[3], v[3], cross[3];

	if (v3d_normalize(u, a) == 0 || v3d_normalize(v, b) == 0)
		return 1;
	v3d_cross(cross, u, v);
	return v3d_length(cross) < 1e-6;
}

/* Computes the same bits on every machine, as frames must have. */
static void sincos_degrees(double degrees, double *s, double *c)
{
	double turn = fmod(degrees, 360);

	if (turn < 0)
		turn += 360;
	psr_sincos((turn > 180 ? 360 - turn : turn) * PSR_DEGREE, s, c);
	if (turn > 180)
		*s = -*s;
}

static void combine(double out[3], double k, const double a[3], double m, const double b[3])
{
	for (int i = 0; i < 3; i++)
		out[i] = k * a[i] + m * b[i];
}

/* Finds right, up and the direction to the eye. axes: right, up and front of the object. */
static void view_axes(double view[3][3], const double axes[3][3], double azimuth, double elevation, double roll)
{
	double s, c, level[3], right[3], up[3];

	sincos_degrees(azimuth, &s, &c);
	combine(right, c, axes[0], -s, axes[2]);
	combine(level, s, axes[0], c, axes[2]);
	sincos_degrees(elevation, &s, &c);
	combine(up, c, axes[1], -s, level);
	combine(view[2], c, level, s, axes[1]);
	sincos_degrees(roll, &s, &c);
	combine(view[0], c, right, -s, up);
	combine(view[1], c, up, s, right);
}

struct fit {
	double distance; /* of the eye of a perspective camera */
	double extent;   /* half the height of an orthographic picture */
	double deepest;  /* how far the box reaches from its middle towards the eye */
};

/* Enlarges `fit` until all corners of a box of these half sides are in a picture of these tangents. */
static void fit_box(struct fit *fit, const double half[3], const double view[3][3], const double tangent[2])
{
	for (int corner = 0; corner < 8; corner++) {
		double p[3], x, y, z;

		for (int i = 0; i < 3; i++)
			p[i] = corner >> i & 1 ? half[i] : -half[i];
		x = fabs(v3d_dot(p, view[0])) / tangent[0];
		y = fabs(v3d_dot(p, view[1])) / tangent[1];
		z = v3d_dot(p, view[2]);
		fit->extent = fmax(fit->extent, fmax(x, y));
		fit->distance = fmax(fit->distance, fmax(x, y) * MARGIN + z);
		fit->deepest = fmax(fit->deepest, z);
	}
}

/* Does for any direction what psr_camera_frame() does for one. */
static void frame_angles(struct psr_camera *camera, const struct psr_camera_wish *wish, const double up[3],
                         const double box_min[3], const double box_max[3], double aspect)
{
	uint32_t n_turn = wish->n_turn > 1 ? wish->n_turn : 1;
	double axes[3][3], view[3][3], half[3], tangent[2] = { aspect, 1 };
	struct fit fit = { 0, 0, 0 };

	memset(camera, 0, sizeof *camera);
	for (int i = 0; i < 3; i++) {
		camera->target[i] = box_min[i] / 2 + box_max[i] / 2;
		half[i] = box_max[i] / 2 - box_min[i] / 2;
	}
	if (wish->fov_y > 0) {
		double s, c;

		psr_sincos(wish->fov_y / 2, &s, &c);
		tangent[0] *= s / c;
		tangent[1] *= s / c;
	}
	psr_camera_axes(axes, up);
	for (uint32_t k = 1; k <= n_turn; k++) { /* the last one is the camera's own */
		view_axes(view, axes, wish->azimuth + 360.0 * (k % n_turn) / n_turn, wish->elevation, wish->roll);
		fit_box(&fit, half, view, tangent);
	}
	if (!(fit.extent > 0))
		fit.extent = fit.distance = 1;
	camera->ortho_height = wish->fov_y > 0 ? 0 : 2 * fit.extent * MARGIN;
	if (!(wish->fov_y > 0))
		fit.distance = 2 * fit.deepest + fit.extent;
	memcpy(camera->up, view[1], sizeof camera->up);
	v3d_add_scaled(camera->eye, camera->target, fit.distance, view[2]);
}

/* A camera with an eye is framed along its own view. */
static void roll_camera(struct psr_camera *camera, const double forward[3], double degrees)
{
	double right[3], up[3], along[3], s, c;

	v3d_normalize(along, forward);
	v3d_cross(right, along, camera->up);
	v3d_normalize(right, right);
	v3d_cross(up, right, along);
	sincos_degrees(degrees, &s, &c);
	combine(camera->up, c, up, s, right);
}

static int zoom_camera(struct psr_camera *camera, double zoom, struct psr_error *err)
{
	if (camera->kind == PSR_CAMERA_ORTHOGRAPHIC) {
		camera->ortho_height /= zoom;
		if (camera->ortho_height >= LEAST && camera->ortho_height <= PSR_WIRE_MAX_LENGTH)
			return PSR_OK;
		return psr_fail(err, PSR_ERR_ARG, "a zoom of %g leaves a picture of a height of %g", zoom,
		                camera->ortho_height);
	}
	camera->fov_y = 2 * atan(tan(camera->fov_y / 2) / zoom);
	if (camera->fov_y >= LEAST_FOV && camera->fov_y <= GREATEST_FOV)
		return PSR_OK;
	return psr_fail(err, PSR_ERR_ARG, "a zoom of %g leaves an angle of view of %g degrees; it has to be between 0.0001 "
	                "and 179.999", zoom, camera->fov_y / PSR_DEGREE);
}

/* Sets eye, target, up and ortho_height; rolls the camera only if there are angles. */
static int place_camera(struct psr_camera *framed, const struct psr_camera_wish *wish, const double box_min[3],
                        const double box_max[3], double aspect, struct psr_error *err)
{
	static const double y[3] = { 0, 1, 0 };
	const double *up = wish->has_up ? wish->up : v3d_length(wish->natural_up) > 0 ? wish->natural_up : y;
	double arm[3];

	if (!(v3d_length(up) > 0))
		return psr_fail(err, PSR_ERR_ARG, "up 0,0,0 is 0, which is no direction");
	if (wish->has_angles)
		frame_angles(framed, wish, up, box_min, box_max, aspect);
	else
		psr_camera_frame(framed, box_min, box_max, up, wish->fov_y, aspect);
	if (wish->has_target) {
		v3d_sub(arm, framed->eye, framed->target);
		memcpy(framed->target, wish->target, sizeof framed->target);
		v3d_add(framed->eye, framed->target, arm);
	}
	return PSR_OK;
}

/* Sets up for a camera that has an eye, or is framed without angles; up must not run along its view. */
static int turn_up(struct psr_camera *framed, const struct psr_camera_wish *wish, struct psr_error *err)
{
	double forward[3], axes[3][3];

	v3d_sub(forward, framed->target, framed->eye);
	if (!(v3d_length(forward) > 0))
		return psr_fail(err, PSR_ERR_ARG, "the eye %g,%g,%g is at the target%s", framed->eye[0], framed->eye[1],
		                framed->eye[2], wish->has_target ? "" : ", the middle of the model; say --target too");
	psr_camera_axes(axes, framed->up);
	if (!wish->has_up && is_parallel(framed->up, forward))
		for (int i = 0; i < 3; i++)
			framed->up[i] = 0 - axes[2][i];
	if (is_parallel(framed->up, forward))
		return psr_fail(err, PSR_ERR_ARG, "up %g,%g,%g is 0 or runs along the view; choose another direction",
		                framed->up[0], framed->up[1], framed->up[2]);
	if (wish->roll != 0)
		roll_camera(framed, forward, wish->roll);
	return PSR_OK;
}

int psr_camera_complete(struct psr_camera *camera, const struct psr_camera_wish *wish, const double box_min[3],
                        const double box_max[3], double aspect, struct psr_error *err)
{
	struct psr_camera framed;
	int code = place_camera(&framed, wish, box_min, box_max, aspect, err);

	if (code == PSR_OK && wish->has_eye)
		memcpy(framed.eye, wish->eye, sizeof framed.eye);
	if (code == PSR_OK && !wish->has_angles)
		code = turn_up(&framed, wish, err);
	if (code != PSR_OK)
		return code;
	memset(camera, 0, sizeof *camera);
	memcpy(camera->eye, framed.eye, sizeof camera->eye);
	memcpy(camera->target, framed.target, sizeof camera->target);
	memcpy(camera->up, framed.up, sizeof camera->up);
	if (wish->fov_y > 0) {
		camera->kind = PSR_CAMERA_PERSPECTIVE;
		camera->fov_y = wish->fov_y;
		camera->near_z = near_from_box(camera->eye, box_min, box_max);
	} else {
		camera->kind = PSR_CAMERA_ORTHOGRAPHIC;
		camera->ortho_height = wish->ortho_height > 0 ? wish->ortho_height : framed.ortho_height;
	}
	return wish->zoom > 0 && wish->zoom != 1 ? zoom_camera(camera, wish->zoom, err) : PSR_OK;
}

/* Rodrigues. */
static void turn_vector(double v[3], const double axis[3], double s, double c)
{
	double cross[3], along = v3d_dot(axis, v);

	v3d_cross(cross, axis, v);
	for (int i = 0; i < 3; i++)
		v[i] = c * v[i] + s * cross[i] + (1 - c) * along * axis[i];
}

void psr_camera_turn(struct psr_camera *camera, const double up[3], double degrees, const double box_min[3],
                     const double box_max[3])
{
	double axis[3], arm[3], s, c;

	v3d_normalize(axis, up);
	sincos_degrees(degrees, &s, &c);
	v3d_sub(arm, camera->eye, camera->target);
	turn_vector(arm, axis, s, c);
	turn_vector(camera->up, axis, s, c);
	v3d_add(camera->eye, camera->target, arm);
	if (camera->kind == PSR_CAMERA_PERSPECTIVE)
		camera->near_z = near_from_box(camera->eye, box_min, box_max);
}

void client_light_key(struct psr_msg_light *light, const struct psr_camera *camera)
{
	struct psr_light key;

	psr_light_key(&key, camera);
	*light = (struct psr_msg_light){ .kind = PSR_WIRE_LIGHT_DIRECTIONAL, .color = { 255, 255, 255 }, .intensity = 1 };
	memcpy(light->direction, key.direction, sizeof light->direction);
}

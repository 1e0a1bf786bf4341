#include "hand_pose.h"
#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "client/lib/camera.h"
#include "lens.h"

void hand_frame_of(struct hand_frame *frame, const struct hand_pose *pose)
{
	v3d_sub(frame->forward, pose->target, pose->eye);
	v3d_normalize(frame->forward, frame->forward);
	v3d_cross(frame->right, frame->forward, pose->up);
	v3d_normalize(frame->right, frame->right);
	v3d_cross(frame->up, frame->right, frame->forward);
}

double hand_pixel_at(const struct hand *hand, double depth)
{
	struct lens lens;

	lens_init(&lens, &hand->camera, hand->width, hand->height);
	return lens_pixel(&lens, depth);
}

static double depth_of(const struct hand *hand, const double point[3])
{
	struct hand_frame frame;
	double arm[3];

	hand_frame_of(&frame, &hand->pose);
	v3d_sub(arm, point, hand->pose.eye);
	return v3d_dot(arm, frame.forward);
}

double hand_box_size(const struct hand *hand)
{
	double sides[3];

	v3d_sub(sides, hand->box_max, hand->box_min);
	return v3d_length(sides) > 0 ? v3d_length(sides) : 1;
}

/* A depth to work with: a pivot behind the eye, or at it, has none. */
double hand_usable_depth(const struct hand *hand, double depth)
{
	double arm[3];

	if (depth > 0 && depth < INFINITY)
		return depth;
	depth = depth_of(hand, hand->pivot);
	if (depth > 1e-6 * hand_box_size(hand))
		return depth;
	v3d_sub(arm, hand->pose.target, hand->pose.eye);
	return v3d_length(arm);
}

static double aspect_of(const struct hand *hand)
{
	return (double)hand->width / hand->height;
}

/* Takes the pose if it makes a valid camera. */
int hand_take(struct hand *hand, const struct hand_pose *pose, struct psr_error *err)
{
	struct psr_camera_wish wish = { .has_eye = 1, .has_target = 1, .has_up = 1, .fov_y = pose->fov * PSR_DEGREE,
		                            .ortho_height = pose->ortho_height };
	int code;

	memcpy(wish.eye, pose->eye, sizeof wish.eye);
	memcpy(wish.target, pose->target, sizeof wish.target);
	memcpy(wish.up, pose->up, sizeof wish.up);
	for (int i = 0; i < 3; i++)
		if (!(fabs(pose->eye[i]) < PSR_WIRE_MAX_LENGTH) || !(fabs(pose->target[i]) < PSR_WIRE_MAX_LENGTH))
			return psr_fail(err, PSR_ERR_ARG, "the camera is too far away");
	if (pose->fov > 0 ? pose->fov >= 180 : !(pose->ortho_height > 1e-30 && pose->ortho_height < PSR_WIRE_MAX_LENGTH))
		return psr_fail(err, PSR_ERR_ARG, "the picture has no size");
	code = psr_camera_complete(&hand->camera, &wish, hand->box_min, hand->box_max, aspect_of(hand), err);
	if (code == PSR_OK)
		hand->pose = *pose;
	return code;
}

/* Turns eye, target and up about an axis of length 1 through `about`. */
void hand_turn_about(struct hand *hand, const double about[3], const double axis[3], double angle)
{
	struct hand_pose pose = hand->pose;
	double *end[3] = { pose.eye, pose.target, pose.up };
	const double s = sin(angle), c = cos(angle);

	for (int k = 0; k < 3; k++) {
		double v[3], cross[3], along;

		v3d_add_scaled(v, end[k], k < 2 ? -1 : 0, about);
		v3d_cross(cross, axis, v);
		along = v3d_dot(axis, v);
		for (int i = 0; i < 3; i++)
			end[k][i] = c * v[i] + s * cross[i] + (1 - c) * along * axis[i] + (k < 2 ? about[i] : 0);
	}
	hand_take(hand, &pose, NULL);
}

/* Stops straight above and straight below. */
void hand_orbit(struct hand *hand, const double about[3], double right, double up)
{
	struct hand_frame frame;
	double level[3], elevation, angle;

	hand_turn_about(hand, about, hand->up, right);
	hand_frame_of(&frame, &hand->pose);
	elevation = -asin(fmin(fmax(v3d_dot(frame.forward, hand->up), -1), 1));
	angle = fmin(fmax(elevation + up, -PI / 2), PI / 2) - elevation;
	v3d_cross(level, frame.forward, hand->up);
	if (v3d_length(level) < 1e-6)
		memcpy(level, frame.right, sizeof level);
	v3d_normalize(level, level);
	hand_turn_about(hand, about, level, -angle);
}

void hand_move(struct hand *hand, const double by[3])
{
	struct hand_pose pose = hand->pose;

	v3d_add(pose.eye, pose.eye, by);
	v3d_add(pose.target, pose.target, by);
	hand_take(hand, &pose, NULL);
}

/* ---- places ---- */

static void lens_of(struct lens *lens, const struct hand *hand)
{
	lens_init(lens, &hand->camera, hand->width, hand->height);
}

void hand_point(const struct hand *hand, struct hand_cursor at, double depth, double point[3])
{
	struct lens lens;

	lens_of(&lens, hand);
	lens_point(&lens, at.x, at.y, hand_usable_depth(hand, depth), point);
}

int hand_project(const struct hand *hand, const double point[3], struct hand_cursor *at, double *depth)
{
	struct lens lens;
	double is[2];

	lens_of(&lens, hand);
	if (!lens_project(&lens, point, is, depth))
		return 0;
	*at = (struct hand_cursor){ is[0], is[1] };
	return 1;
}

/* ---- all of it ---- */

static int frame_all(struct hand *hand, const struct psr_camera_wish *said, struct psr_error *err)
{
	struct psr_camera_wish wish = *said;
	struct hand_pose pose = hand->pose;
	struct psr_camera camera;
	int code;

	wish.fov_y = pose.fov * PSR_DEGREE;
	memcpy(wish.natural_up, hand->up, sizeof wish.natural_up);
	code = psr_camera_complete(&camera, &wish, hand->box_min, hand->box_max, aspect_of(hand), err);
	if (code != PSR_OK)
		return code;
	memcpy(pose.eye, camera.eye, sizeof pose.eye);
	memcpy(pose.target, camera.target, sizeof pose.target);
	memcpy(pose.up, camera.up, sizeof pose.up);
	pose.ortho_height = camera.ortho_height;
	hand_stop(hand);
	for (int i = 0; i < 3; i++)
		hand->pivot[i] = hand->box_min[i] / 2 + hand->box_max[i] / 2;
	return hand_take(hand, &pose, err);
}

void hand_set_box(struct hand *hand, const double box_min[3], const double box_max[3], const double up[3])
{
	const struct hand_pose pose = hand->pose;

	memcpy(hand->box_min, box_min, sizeof hand->box_min);
	memcpy(hand->box_max, box_max, sizeof hand->box_max);
	v3d_normalize(hand->up, up);
	hand_take(hand, &pose, NULL);
}

int hand_init(struct hand *hand, const double box_min[3], const double box_max[3], const double up[3], double fov,
              struct psr_error *err)
{
	const struct psr_camera_wish home = { .zoom = 1 };

	memset(hand, 0, sizeof *hand);
	memcpy(hand->box_min, box_min, sizeof hand->box_min);
	memcpy(hand->box_max, box_max, sizeof hand->box_max);
	if (v3d_normalize(hand->up, up) == 0)
		return psr_fail(err, PSR_ERR_ARG, "up %g,%g,%g is no direction", up[0], up[1], up[2]);
	hand->width = hand->height = 1;
	hand->has_inertia = 1;
	hand->pose.fov = fov;
	return frame_all(hand, &home, err);
}

void hand_set_size(struct hand *hand, uint32_t width, uint32_t height)
{
	hand->width = width;
	hand->height = height;
}

void hand_home(struct hand *hand)
{
	const struct psr_camera_wish home = { .zoom = 1 };

	frame_all(hand, &home, NULL);
}

void hand_look_from(struct hand *hand, double azimuth, double elevation)
{
	const struct psr_camera_wish side = { .has_angles = 1, .azimuth = azimuth, .elevation = elevation, .zoom = 1 };

	frame_all(hand, &side, NULL);
}

void hand_set_pose(struct hand *hand, const struct hand_pose *pose)
{
	hand_stop(hand);
	hand_take(hand, pose, NULL);
}

void hand_set_camera(struct hand *hand, const struct psr_camera *camera)
{
	struct hand_pose pose = hand->pose;

	memcpy(pose.eye, camera->eye, sizeof pose.eye);
	memcpy(pose.target, camera->target, sizeof pose.target);
	memcpy(pose.up, camera->up, sizeof pose.up);
	pose.fov = camera->kind == PSR_CAMERA_PERSPECTIVE ? camera->fov_y / PSR_DEGREE : 0;
	pose.ortho_height = camera->ortho_height;
	hand_set_pose(hand, &pose);
}

void hand_toggle_ortho(struct hand *hand)
{
	const double usual = 35;
	const double depth = hand_usable_depth(hand, INFINITY), pixel = hand_pixel_at(hand, depth);
	struct hand_pose pose = hand->pose;
	struct hand_frame frame;

	hand_stop(hand);
	if (pose.fov > 0) {
		pose.ortho_height = pixel * hand->height;
		pose.fov = 0;
	} else {
		const double far = pose.ortho_height / (2 * tan(usual * PSR_DEGREE / 2));

		hand_frame_of(&frame, &pose);
		pose.fov = usual;
		pose.ortho_height = 0;
		v3d_add_scaled(pose.eye, pose.eye, depth - far, frame.forward);
		v3d_add_scaled(pose.target, pose.eye, far, frame.forward);
	}
	hand_take(hand, &pose, NULL);
}

/* ---- at once ---- */

void hand_zoom(struct hand *hand, struct hand_cursor at, double depth, double steps)
{
	const double part = exp2(-steps / 8);
	struct hand_pose pose = hand->pose;
	double point[3], by[3];

	hand->glide = HAND_NONE;
	hand_point(hand, at, depth, point);
	if (pose.fov > 0) {
		v3d_sub(by, point, pose.eye);
		v3d_scale(by, by, 1 - part);
	} else {
		const struct hand_cursor middle = { hand->width / 2.0, hand->height / 2.0 };
		double center[3];

		hand_point(hand, middle, hand_usable_depth(hand, depth), center);
		v3d_sub(by, point, center);
		v3d_scale(by, by, 1 - part);
		pose.ortho_height *= part;
	}
	v3d_add(pose.eye, pose.eye, by);
	v3d_add(pose.target, pose.target, by);
	hand_take(hand, &pose, NULL);
}

void hand_turn(struct hand *hand, double right, double up)
{
	hand->glide = HAND_NONE;
	hand_orbit(hand, hand->pivot, right * PSR_DEGREE, up * PSR_DEGREE);
}

void hand_roll(struct hand *hand, double degrees)
{
	struct hand_frame frame;

	hand_frame_of(&frame, &hand->pose);
	hand_turn_about(hand, hand->pose.eye, frame.forward, degrees * PSR_DEGREE);
}

void hand_set_pivot(struct hand *hand, struct hand_cursor at, double depth)
{
	if (depth > 0 && depth < INFINITY)
		hand_point(hand, at, depth, hand->pivot);
}


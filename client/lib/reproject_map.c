#include <float.h>
#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "reproject_inside.h"

struct axes {
	double right[3], down[3], forward[3];
};

static void axes_of(struct axes *axes, const struct psr_camera *camera)
{
	v3d_sub(axes->forward, camera->target, camera->eye);
	v3d_normalize(axes->forward, axes->forward);
	v3d_normalize(axes->right, camera->up);
	v3d_cross(axes->right, axes->forward, axes->right);
	v3d_normalize(axes->right, axes->right);
	v3d_cross(axes->down, axes->forward, axes->right);
}

/* A place in the received picture, times `h`: in camera space of the drawn one. */
struct column {
	double q[3], h;
};

static void into(double q[3], const struct axes *to, const double world[3])
{
	const double v[3] = { v3d_dot(to->right, world), v3d_dot(to->down, world), v3d_dot(to->forward, world) };

	memcpy(q, v, sizeof v);
}

/* Columns of x, y, 1 and d. */
static void columns_of(struct column column[4], const struct psr_reproject *r, const struct psr_camera *camera)
{
	const int is_perspective = r->camera.kind == PSR_CAMERA_PERSPECTIVE;
	const double unit = reproject_footprint(&r->camera, r->source.height);
	struct axes from, to;
	double moved[3], v[3];

	axes_of(&from, &r->camera);
	axes_of(&to, camera);
	v3d_sub(moved, r->camera.eye, camera->eye);
	v3d_scale(v, from.right, unit);
	into(column[0].q, &to, v);
	v3d_scale(v, from.down, unit);
	into(column[1].q, &to, v);
	into(column[2].q, &to, is_perspective ? from.forward : moved);
	into(column[3].q, &to, is_perspective ? moved : from.forward);
	v3d_add_scaled(column[2].q, column[2].q, -0.5 * r->source.width, column[0].q);
	v3d_add_scaled(column[2].q, column[2].q, -0.5 * r->source.height, column[1].q);
	for (int k = 0; k < 4; k++)
		column[k].h = k == (is_perspective ? 3 : 2);
}

void reproject_map(struct reproject_warp *warp, const struct psr_reproject *r, const struct psr_camera *camera,
                   const struct psr_frame *to)
{
	const double pixels = 1 / reproject_footprint(camera, to->height);
	float *const as[4] = { warp->of_x, warp->of_y, warp->of_one, warp->of_d };
	struct column column[4];

	columns_of(column, r, camera);
	for (int k = 0; k < 4; k++) {
		const double *q = column[k].q, h = column[k].h;
		const double w = camera->kind == PSR_CAMERA_PERSPECTIVE ? q[2] : h;

		as[k][0] = (float)(q[0] * pixels + w * 0.5 * to->width);
		as[k][1] = (float)(q[1] * pixels + w * 0.5 * to->height);
		as[k][2] = (float)w;
		as[k][3] = (float)(camera->kind == PSR_CAMERA_PERSPECTIVE ? h : -q[2]);
	}
	warp->width = to->width;
	warp->height = to->height;
	if (camera->kind == PSR_CAMERA_PERSPECTIVE)
		warp->most_key = camera->near_z > 1 / (double)FLT_MAX ? (float)(1 / camera->near_z) : FLT_MAX;
	else
		warp->most_key = (float)-camera->near_z;
}

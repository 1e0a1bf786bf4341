#include "view.h"
#include "base/maths.h"
#include "base/vec.h"
#include "psr/render.h"

int view_init(struct view *view, const struct psr_camera *camera, uint32_t width, uint32_t height,
              struct psr_error *err)
{
	const struct psr_scene scene = { .camera = *camera };
	double sine, cosine;
	int rc = psr_scene_validate(&scene, err);
	if (rc != PSR_OK)
		return rc;
	if (width == 0 || height == 0)
		return psr_fail(err, PSR_ERR_ARG, "a picture of %ux%u has no pixels", width, height);
	if (width > PSR_MAX_SIDE || height > PSR_MAX_SIDE || (uint64_t)width * height > PSR_MAX_PIXELS)
		return psr_fail(err, PSR_ERR_LIMIT, "a picture of %ux%u pixels is over the limit of %d a side, %u in all",
		                width, height, PSR_MAX_SIDE, PSR_MAX_PIXELS);
	v3d_set(view->eye, camera->eye[0], camera->eye[1], camera->eye[2]);
	v3d_sub(view->forward, camera->target, camera->eye);
	v3d_normalize(view->forward, view->forward);
	v3d_normalize(view->right, camera->up);
	v3d_cross(view->right, view->forward, view->right);
	v3d_normalize(view->right, view->right);
	v3d_cross(view->down, view->forward, view->right);
	view->near_z = camera->near_z;
	view->width = width;
	view->height = height;
	view->is_perspective = camera->kind == PSR_CAMERA_PERSPECTIVE;
	if (view->is_perspective) {
		psr_sincos(camera->fov_y / 2, &sine, &cosine);
		view->pixel = 2 * sine / cosine / height;
	} else {
		view->pixel = camera->ortho_height / height;
	}
	return PSR_OK;
}

void view_ray(const struct view *view, double x, double y, double origin[3], double direction[3])
{
	double across = (x - view->width / 2) * view->pixel, along = (y - view->height / 2) * view->pixel;
	double *moved = view->is_perspective ? direction : origin;
	v3d_set(origin, view->eye[0], view->eye[1], view->eye[2]);
	v3d_set(direction, view->forward[0], view->forward[1], view->forward[2]);
	v3d_add_scaled(moved, moved, across, view->right);
	v3d_add_scaled(moved, moved, along, view->down);
}

#include "lens.h"
#include <math.h>
#include <string.h>
#include "base/vec.h"

void lens_init(struct lens *lens, const struct psr_camera *camera, double width, double height)
{
	memcpy(lens->eye, camera->eye, sizeof lens->eye);
	v3d_sub(lens->forward, camera->target, camera->eye);
	v3d_normalize(lens->forward, lens->forward);
	v3d_cross(lens->right, lens->forward, camera->up);
	v3d_normalize(lens->right, lens->right);
	v3d_cross(lens->up, lens->right, lens->forward);
	lens->width = width;
	lens->height = height;
	lens->tangent = camera->kind == PSR_CAMERA_PERSPECTIVE ? tan(camera->fov_y / 2) : 0;
	lens->ortho_height = camera->ortho_height;
}

double lens_pixel(const struct lens *lens, double depth)
{
	return (lens->tangent > 0 ? 2 * depth * lens->tangent : lens->ortho_height) / lens->height;
}

void lens_point(const struct lens *lens, double x, double y, double depth, double point[3])
{
	const double pixel = lens_pixel(lens, depth);

	v3d_add_scaled(point, lens->eye, depth, lens->forward);
	v3d_add_scaled(point, point, (x - lens->width / 2) * pixel, lens->right);
	v3d_add_scaled(point, point, (lens->height / 2 - y) * pixel, lens->up);
}

int lens_project(const struct lens *lens, const double point[3], double at[2], double *depth)
{
	double arm[3], z, pixel;

	v3d_sub(arm, point, lens->eye);
	z = v3d_dot(arm, lens->forward);
	if (depth != NULL)
		*depth = z;
	if (lens->tangent > 0 && !(z > 0))
		return 0;
	pixel = lens_pixel(lens, z);
	at[0] = lens->width / 2 + v3d_dot(arm, lens->right) / pixel;
	at[1] = lens->height / 2 - v3d_dot(arm, lens->up) / pixel;
	return 1;
}

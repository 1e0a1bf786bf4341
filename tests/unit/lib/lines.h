/* Lines of sight, and where they meet what is known. */
#ifndef TESTS_LIB_LINES_H
#define TESTS_LIB_LINES_H

#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "psr/view.h"

/* A line of sight of a camera that looks at the origin. */
struct line {
	double from[3], along[3]; /* along: 1 along the view axis */
};

/* Of the place x, y of a picture of side x side pixels. */
static inline struct line line_of(const struct psr_camera *camera, unsigned side, double x, double y)
{
	double axis[3][3];
	struct line line;
	const double right = x - side / 2.0, down = y - side / 2.0;

	v3d_scale(axis[2], camera->eye, -1);
	v3d_normalize(axis[2], axis[2]);
	v3d_cross(axis[0], axis[2], camera->up);
	v3d_normalize(axis[0], axis[0]);
	v3d_cross(axis[1], axis[2], axis[0]);
	memcpy(line.from, camera->eye, sizeof line.from);
	memcpy(line.along, axis[2], sizeof line.along);
	const double pixel = camera->kind == PSR_CAMERA_PERSPECTIVE ? 2 * tan(camera->fov_y / 2) / side
	                                                            : camera->ortho_height / side;
	double *moved = camera->kind == PSR_CAMERA_PERSPECTIVE ? line.along : line.from;
	v3d_add_scaled(moved, moved, right * pixel, axis[0]);
	v3d_add_scaled(moved, moved, down * pixel, axis[1]);
	return line;
}

/* Returns z' where the line meets a sphere about the origin first; INFINITY: nowhere. */
static inline double meet_sphere(const struct line *line, double radius)
{
	const double a = v3d_dot(line->along, line->along), b = v3d_dot(line->from, line->along);
	const double c = v3d_dot(line->from, line->from) - radius * radius, inside = b * b - a * c;

	return inside >= 0 ? (-b - sqrt(inside)) / a : INFINITY;
}

#endif

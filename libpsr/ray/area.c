#include "area.h"
#include "base/vec.h"
#include "tree.h"

void area_sum(const struct ray_scene *scene, const struct psr_mesh *mesh, double scale, double *sum)
{
	double area = 0;

	for (uint32_t i = 0; i < mesh->n_triangles + mesh->n_points; i++) {
		if (!ray_is_disc(scene, i)) {
			double corner[3][3], e1[3], e2[3], cross[3];

			ray_scene_corners(scene, i, corner);
			v3d_sub(e1, corner[1], corner[0]);
			v3d_sub(e2, corner[2], corner[0]);
			v3d_cross(cross, e1, e2);
			area += v3d_length(cross) / 2;
		} else {
			double radius = (double)mesh->point_radius[i - mesh->n_triangles] / scale;

			area += 3.1415926535897931 * radius * radius;
		}
		sum[i] = area;
	}
}

uint32_t area_find(const double *sum, uint32_t n, double x)
{
	uint32_t low = 0, high = n - 1;

	while (low < high) {
		uint32_t middle = low + (high - low) / 2;

		if (sum[middle] > x)
			high = middle;
		else
			low = middle + 1;
	}
	return low;
}

int area_point(const struct ray_scene *scene, uint32_t prim, double u, double v, double p[3])
{
	double corner[3][3];

	if (ray_is_disc(scene, prim)) {
		ray_scene_center(scene, prim, p);
		return 1;
	}
	if (u + v > 1) {
		u = 1 - u;
		v = 1 - v;
	}
	if (ray_scene_is_absent(scene, prim, u, v))
		return 0;
	ray_scene_corners(scene, prim, corner);
	for (int k = 0; k < 3; k++)
		p[k] = (1 - u - v) * corner[0][k] + u * corner[1][k] + v * corner[2][k];
	return 1;
}

#include "area.h"
#include "base/vec.h"
#include "sample/level.h"

void area_sum(const struct level *level, uint32_t n_prims, double *area)
{
	double sum = 0;

	for (uint32_t i = 0; i < n_prims; i++) {
		if (i < level->mesh->n_triangles) {
			double corner[3][3], e1[3], e2[3], cross[3];

			ray_scene_corners(level->scene, i, corner);
			v3d_sub(e1, corner[1], corner[0]);
			v3d_sub(e2, corner[2], corner[0]);
			v3d_cross(cross, e1, e2);
			sum += v3d_length(cross) / 2;
		} else {
			double radius = (double)level->mesh->point_radius[i - level->mesh->n_triangles] / level->surface->scale;

			sum += 3.1415926535897931 * radius * radius;
		}
		area[i] = sum;
	}
}

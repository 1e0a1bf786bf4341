#include <math.h>
#include "base/vec.h"
#include "triangle.h"

static double segment_distance2(const double a[3], const double b[3], const double p[3])
{
	double ab[3], ap[3], length2, t;

	v3d_sub(ab, b, a);
	v3d_sub(ap, p, a);
	length2 = v3d_dot(ab, ab);
	t = length2 > 0 ? fmin(1, fmax(0, v3d_dot(ap, ab) / length2)) : 0;
	v3d_add_scaled(ap, ap, -t, ab);
	return v3d_dot(ap, ap);
}

double triangle_distance2(const double corner[3][3], const double p[3])
{
	double edge[2][3], normal[3], to_p[3], side[3], nearest = INFINITY;
	int inside = 1;

	v3d_sub(edge[0], corner[1], corner[0]);
	v3d_sub(edge[1], corner[2], corner[0]);
	v3d_cross(normal, edge[0], edge[1]);
	for (int i = 0; i < 3; i++) {
		const double *a = corner[i], *b = corner[(i + 1) % 3];

		nearest = fmin(nearest, segment_distance2(a, b, p));
		v3d_sub(edge[0], b, a);
		v3d_sub(to_p, p, a);
		v3d_cross(side, normal, edge[0]);
		inside &= v3d_dot(side, to_p) >= 0;
	}
	if (inside && v3d_dot(normal, normal) > 0) {
		double height = v3d_dot(to_p, normal);

		nearest = fmin(nearest, height * height / v3d_dot(normal, normal));
	}
	return nearest;
}

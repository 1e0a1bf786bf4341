/* The distance of a place from triangles, by the regions of its nearest point (Ericson, Real-Time Collision Detection,
 * 5.1.5): another way than bound.c's, in doubles, triangle by triangle. */
#ifndef TESTS_UNIT_LIB_NEAREST_H
#define TESTS_UNIT_LIB_NEAREST_H

#include <math.h>
#include <stddef.h>
#include "base/vec.h"

static inline double nearest_on_line(const double p[3], const double a[3], const double ab[3])
{
	const double square = v3d_dot(ab, ab);
	double ap[3], left[3], t;

	v3d_sub(ap, p, a);
	t = square > 0 ? fmin(fmax(v3d_dot(ap, ab) / square, 0), 1) : 0;
	v3d_add_scaled(left, ap, -t, ab);
	return v3d_dot(left, left);
}

static inline double nearest_on_triangle(const double p[3], const double a[3], const double b[3], const double c[3])
{
	double ab[3], ac[3], bc[3], ap[3], d00, d01, d11, d20, d21, area, least;

	v3d_sub(ab, b, a);
	v3d_sub(ac, c, a);
	v3d_sub(bc, c, b);
	v3d_sub(ap, p, a);
	d00 = v3d_dot(ab, ab);
	d01 = v3d_dot(ab, ac);
	d11 = v3d_dot(ac, ac);
	d20 = v3d_dot(ap, ab);
	d21 = v3d_dot(ap, ac);
	area = d00 * d11 - d01 * d01;
	least = fmin(fmin(nearest_on_line(p, a, ab), nearest_on_line(p, a, ac)), nearest_on_line(p, b, bc));
	if (area > 1e-14 * d00 * d11) {
		const double v = (d11 * d20 - d01 * d21) / area, w = (d00 * d21 - d01 * d20) / area;
		double left[3];

		if (v >= 0 && w >= 0 && v + w <= 1) {
			v3d_add_scaled(left, ap, -v, ab);
			v3d_add_scaled(left, left, -w, ac);
			least = fmin(least, v3d_dot(left, left));
		}
	}
	return least;
}

static inline double nearest_distance(const float (*triangle)[3][3], size_t n, const double p[3])
{
	double least = INFINITY;

	for (size_t t = 0; t < n; t++) {
		double corner[3][3], low2 = 0;

		for (int k = 0; k < 3; k++) {
			const double x = triangle[t][0][k], y = triangle[t][1][k], z = triangle[t][2][k];
			const double away = fmax(fmax(fmin(fmin(x, y), z) - p[k], p[k] - fmax(fmax(x, y), z)), 0);

			low2 += away * away;
			corner[0][k] = x;
			corner[1][k] = y;
			corner[2][k] = z;
		}
		if (low2 < least)
			least = fmin(least, nearest_on_triangle(p, corner[0], corner[1], corner[2]));
	}
	return sqrt(least);
}

#endif

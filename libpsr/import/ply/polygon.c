#include <math.h>
#include "polygon.h"

/* Twice the signed area of a, b, c in the plane onto which the polygon is projected. */
static double area(const double a[2], const double b[2], const double c[2])
{
	return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* Projects along the axis where the polygon's normal (Newell's sum) is longest, keeping the winding counter-clockwise.
 * */
static void project(double (*flat)[2], const double (*point)[3], unsigned n)
{
	double normal[3] = { 0.0, 0.0, 0.0 };
	int axis = 0, x, y;

	for (unsigned i = 0; i < n; i++) {
		const double *p = point[i], *q = point[(i + 1) % n];

		for (int k = 0; k < 3; k++) {
			int a = (k + 1) % 3, b = (k + 2) % 3;

			normal[k] += (p[a] - q[a]) * (p[b] + q[b] - 2.0 * point[0][b]);
		}
	}
	for (int k = 1; k < 3; k++)
		if (fabs(normal[k]) > fabs(normal[axis]))
			axis = k;
	x = normal[axis] < 0.0 ? (axis + 2) % 3 : (axis + 1) % 3;
	y = normal[axis] < 0.0 ? (axis + 1) % 3 : (axis + 2) % 3;
	for (unsigned i = 0; i < n; i++) {
		flat[i][0] = point[i][x] - point[0][x];
		flat[i][1] = point[i][y] - point[0][y];
	}
}

static int is_convex(double (*flat)[2], unsigned n)
{
	for (unsigned i = 0; i < n; i++)
		if (area(flat[i], flat[(i + 1) % n], flat[(i + 2) % n]) < 0.0)
			return 0;
	return 1;
}

static void cut_fan(unsigned (*out)[3], unsigned n)
{
	for (unsigned i = 0; i + 2 < n; i++) {
		out[i][0] = 0;
		out[i][1] = i + 1;
		out[i][2] = i + 2;
	}
}

static int is_ear(double (*flat)[2], const unsigned *left, unsigned n, unsigned i)
{
	const unsigned before = left[(i + n - 1) % n], at = left[i], after = left[(i + 1) % n];
	const double *a = flat[before], *b = flat[at], *c = flat[after];

	if (!(area(a, b, c) > 0.0))
		return 0;
	for (unsigned k = 0; k < n; k++) {
		const double *p = flat[left[k]];

		if (left[k] != before && left[k] != at && left[k] != after && area(a, b, p) >= 0.0 && area(b, c, p) >= 0.0 &&
		    area(c, a, p) >= 0.0)
			return 0;
	}
	return 1;
}

void polygon_cut(unsigned (*out)[3], const double (*point)[3], unsigned n)
{
	double flat[POLYGON_MAX_CLIP][2];
	unsigned left[POLYGON_MAX_CLIP], n_out = 0;

	if (n > 3 && n <= POLYGON_MAX_CLIP)
		project(flat, point, n);
	if (n == 3 || n > POLYGON_MAX_CLIP || is_convex(flat, n)) {
		cut_fan(out, n);
		return;
	}
	for (unsigned i = 0; i < n; i++)
		left[i] = i;
	while (n > 3) {
		unsigned ear = 0;

		while (ear < n && !is_ear(flat, left, n, ear))
			ear++;
		if (ear == n)
			ear = 0; /* it crosses itself or has no area: cut any corner */
		out[n_out][0] = left[(ear + n - 1) % n];
		out[n_out][1] = left[ear];
		out[n_out++][2] = left[(ear + 1) % n];
		n--;
		for (unsigned i = ear; i < n; i++)
			left[i] = left[i + 1];
	}
	out[n_out][0] = left[0];
	out[n_out][1] = left[1];
	out[n_out][2] = left[2];
}

#include "shape.h"

#include <math.h>
#include <string.h>
#include "base/direction.h"
#include "base/vec.h"

#define MOST 6
#define ROUNDING 1e-9
#define OPEN 1e-4 /* of points that are nearly on one line, or two: their noise would be their curvature */
#define TURNS 3 /* of a cloud's frame: each turn leaves the square of the slope before */

/* Sums of squares of n unknowns: the upper half of the matrix, and the right side. */
struct sums {
	int n;
	double m[MOST][MOST + 1];
};

static void add(struct sums *sums, const double row[MOST], double right, double weight)
{
	for (int i = 0; i < sums->n; i++) {
		for (int k = i; k < sums->n; k++)
			sums->m[i][k] += weight * row[i] * row[k];
		sums->m[i][MOST] += weight * row[i] * right;
	}
}

/* By Cholesky's decomposition. A pivot that lost all but this part to those before leaves its unknown open. */
static int solve(double x[MOST], struct sums *sums, double least)
{
	const int n = sums->n;

	for (int i = 0; i < n; i++) {
		const double whole = sums->m[i][i];

		for (int k = 0; k < i; k++)
			sums->m[i][i] -= sums->m[k][i] * sums->m[k][i];
		if (!(sums->m[i][i] > least * whole))
			return 0;
		sums->m[i][i] = sqrt(sums->m[i][i]);
		for (int j = i + 1; j <= MOST; j++) {
			if (j >= n && j < MOST)
				continue;
			for (int k = 0; k < i; k++)
				sums->m[i][j] -= sums->m[k][i] * sums->m[k][j];
			sums->m[i][j] /= sums->m[i][i];
		}
	}
	for (int i = n - 1; i >= 0; i--) {
		x[i] = sums->m[i][MOST];
		for (int k = i + 1; k < n; k++)
			x[i] -= sums->m[i][k] * x[k];
		x[i] /= sums->m[i][i];
	}
	return 1;
}

/* A neighbour in the frame, in units of the farthest. */
static void seen(double at[3], const struct dpoint_local *local, const double p[3], double size)
{
	double away[3];

	v3d_sub(away, p, local->at);
	m3d_apply(at, (const double (*)[3])local->axis, away);
	v3d_scale(at, at, 1 / size);
}

static double farthest(const struct dpoint_local *local, const struct dpoint_neighbour *neighbour, uint32_t n)
{
	double most = 0;

	for (uint32_t i = 0; i < n; i++) {
		double away[3];

		v3d_sub(away, neighbour[i].at, local->at);
		most = fmax(most, v3d_dot(away, away));
	}
	return sqrt(most);
}

int dpoint_shape_of_ring(struct dpoint_local *local, const struct dpoint_neighbour *neighbour, uint32_t n)
{
	const double size = farthest(local, neighbour, n);
	struct sums sums = { .n = 3 };
	double x[MOST];

	if (!(size > 0 && size < INFINITY))
		return 0;
	for (uint32_t i = 0; i < n; i++) {
		double p[3], normal[3], r2;

		seen(p, local, neighbour[i].at, size);
		m3d_apply(normal, (const double (*)[3])local->axis, neighbour[i].normal);
		r2 = p[0] * p[0] + p[1] * p[1];
		if (!(r2 > 1e-12))
			continue;
		/* Heights over r: all rows are slopes. */
		add(&sums, (const double[MOST]){ 0.5 * p[0] * p[0], p[0] * p[1], 0.5 * p[1] * p[1] }, p[2], 1 / r2);
		/* A slope of more than 80 degrees is of another part of the surface. */
		if (normal[2] < 0.17)
			continue;
		add(&sums, (const double[MOST]){ p[0], p[1], 0 }, -normal[0] / normal[2], 1);
		add(&sums, (const double[MOST]){ 0, p[0], p[1] }, -normal[1] / normal[2], 1);
	}
	if (!solve(x, &sums, ROUNDING))
		return 0;
	for (int k = 0; k < 3; k++)
		local->shape[k] = x[k] / size;
	return 1;
}

/* The root of the mean square of what neighbours are off the polynomial, less what six unknowns take of it. */
static double residual(const struct dpoint_local *local, const struct dpoint_neighbour *neighbour, uint32_t n,
                       const double x[MOST], double size)
{
	double sum = 0;

	for (uint32_t i = 0; i < n; i++) {
		double p[3], off;

		seen(p, local, neighbour[i].at, size);
		off = p[2] - (0.5 * x[0] * p[0] * p[0] + x[1] * p[0] * p[1] + 0.5 * x[2] * p[1] * p[1] + x[3] * p[0] +
		              x[4] * p[1] + x[5]);
		sum += off * off;
	}
	return sqrt(sum / (n > 5 ? n - 5 : 1)) * size;
}

int dpoint_shape_of_cloud(struct dpoint_local *local, double *off, const struct dpoint_neighbour *neighbour, uint32_t n)
{
	const double size = farthest(local, neighbour, n);

	if (!(size > 0 && size < INFINITY) || n < 5)
		return 0;
	for (int turn = 0;; turn++) {
		struct sums sums = { .n = 6 };
		double x[MOST], slope2;

		psr_direction_basis(local->axis[2], local->axis);
		/* The place itself, and each neighbour the less, the farther it is. */
		add(&sums, (const double[MOST]){ 0, 0, 0, 0, 0, 1 }, 0, 1);
		for (uint32_t i = 0; i < n; i++) {
			double p[3], r2;

			seen(p, local, neighbour[i].at, size);
			r2 = v3d_dot(p, p);
			add(&sums, (const double[MOST]){ 0.5 * p[0] * p[0], p[0] * p[1], 0.5 * p[1] * p[1], p[0], p[1], 1 }, p[2],
			    1 / (0.1 + r2));
		}
		if (!solve(x, &sums, OPEN))
			return 0;
		slope2 = x[3] * x[3] + x[4] * x[4];
		if (turn == TURNS || slope2 < 1e-16) {
			*off = residual(local, neighbour, n, x, size);
			/* What slope is left turns heights into curvatures by these. */
			v3d_add_scaled(local->at, local->at, x[5] * size, local->axis[2]);
			for (int k = 0; k < 3; k++)
				local->shape[k] = x[k] / size / ((1 + slope2) * sqrt(1 + slope2));
			return 1;
		}
		double normal[3];

		v3d_add_scaled(normal, local->axis[2], -x[3], local->axis[0]);
		v3d_add_scaled(normal, normal, -x[4], local->axis[1]);
		if (v3d_normalize(normal, normal) == 0)
			return 0;
		memcpy(local->axis[2], normal, sizeof normal);
	}
}

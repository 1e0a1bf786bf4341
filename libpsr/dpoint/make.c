/* Principal curvatures and directions from a surface's second order. */
#include "dpoint.h"

#include <math.h>
#include <string.h>
#include "base/vec.h"

static int is_finite(const double *v, int n)
{
	double sum = 0;

	for (int i = 0; i < n; i++)
		sum += v[i] - v[i];
	return sum == 0;
}

/* The angle of the direction of the algebraically greater curvature, as cosine and sine; r > 0. The square root is of
 * what is no difference. */
static void greater_direction(double *c, double *s, double d, double b, double r)
{
	if (d > 0) {
		*c = sqrt(0.5 * (1 + d / r));
		*s = b / (2 * r * *c);
	} else {
		*s = copysign(sqrt(0.5 * (1 - d / r)), b);
		*c = b / (2 * r * *s);
	}
}

enum dpoint_made dpoint_make(struct dpoint *out, const struct dpoint_local *local)
{
	const double most = DPOINT_MOST_LAMBDA;
	const double *normal = local->axis[2];
	double m, d, b, r, c = 1, s = 0, size, shape[3], lambda[2], u[3];
	int is_clamped = 0;

	if (!is_finite(local->at, 3) || !is_finite(local->axis[0], 9) || !is_finite(local->shape, 3) ||
	    !(fabs(v3d_dot(normal, normal) - 1) < 1e-6))
		return DPOINT_BAD;
	/* Scaled, so that no square overflows or vanishes. */
	size = fmax(fmax(fabs(local->shape[0]), fabs(local->shape[1])), fabs(local->shape[2]));
	if (size == 0)
		size = 1;
	for (int i = 0; i < 3; i++)
		shape[i] = local->shape[i] / size;
	m = 0.5 * (shape[0] + shape[2]);
	d = 0.5 * (shape[0] - shape[2]);
	b = shape[1];
	r = sqrt(d * d + b * b);
	/* Below this, directions are rounding. */
	if (r > 1e-12) {
		greater_direction(&c, &s, d, b, r);
		if (m < 0) {
			const double turned = c;

			c = -s;
			s = turned;
		}
	}
	/* The lesser one by the product of both, which loses less than their difference. */
	lambda[0] = m < 0 ? m - r : m + r;
	lambda[1] = lambda[0] != 0 ? (shape[0] * shape[2] - b * b) / lambda[0] * size : 0;
	lambda[0] *= size;
	for (int i = 0; i < 2; i++) {
		is_clamped |= fabs(lambda[i]) > most * (1 + 1e-9);
		lambda[i] = fmin(fmax(lambda[i], -most), most);
	}
	memset(out, 0, sizeof *out);
	v3d_scale(u, local->axis[0], c);
	v3d_add_scaled(u, u, s, local->axis[1]);
	for (int i = 0; i < 3; i++) {
		out->at[i] = (float)local->at[i];
		out->normal[i] = (float)normal[i];
		out->u[i] = (float)u[i];
	}
	out->lambda_u = (float)lambda[0];
	/* A curvature that float has no normal number for is none. */
	if (fabsf(out->lambda_u) < 1e-30f)
		out->lambda_u = 0;
	out->rho = out->lambda_u != 0 ? (float)fmin(fmax(lambda[1] / lambda[0], -1), 1) : 0;
	return is_clamped ? DPOINT_CLAMPED : DPOINT_MADE;
}

/* Places and derivatives of rational B-spline patches, by the basis functions' recurrence (Piegl and Tiller, "The NURBS
 * Book", 2.5 and 4.5). */
#include "patch.h"

#include <assert.h>
#include <math.h>
#include <string.h>
#include "base/vec.h"

#define ORDER (DPOINT_MOST_DEGREE + 1)
/* A derivative below this part of the patch's size, per unit of a span, is none. */
#define NO_DERIVATIVE 1e-9

static int fail(struct psr_error *err, const char *what)
{
	return psr_fail(err, PSR_ERR_FORMAT, "a NURBS patch %s", what);
}

int dpoint_patch_check(const struct dpoint_patch *patch, struct psr_error *err)
{
	for (int k = 0; k < 2; k++) {
		const int degree = patch->degree[k];
		uint64_t n_knots;

		if (degree < 1 || degree > DPOINT_MOST_DEGREE)
			return psr_fail(err, PSR_ERR_FORMAT, "a NURBS patch has degree %d; 1 to %d are read", degree,
			                DPOINT_MOST_DEGREE);
		if (patch->n[k] <= (uint32_t)degree || patch->n[k] > 1u << 20)
			return psr_fail(err, PSR_ERR_FORMAT, "a NURBS patch of degree %d has %u control points along a side",
			                degree, patch->n[k]);
		n_knots = (uint64_t)patch->n[k] + (unsigned)degree + 1;
		for (uint64_t i = 0; i < n_knots; i++) {
			if (!isfinite(patch->knot[k][i]))
				return fail(err, "has a knot that is not finite");
			if (i > 0 && patch->knot[k][i] < patch->knot[k][i - 1])
				return fail(err, "has knots that fall");
		}
		if (!(patch->knot[k][patch->n[k]] - patch->knot[k][degree] > 0))
			return fail(err, "has knots without a domain: its first and last ones are equal");
	}
	for (uint64_t i = 0; i < (uint64_t)patch->n[0] * patch->n[1]; i++) {
		for (int c = 0; c < 4; c++)
			if (!(fabs(patch->control[i][c]) <= 1e30))
				return fail(err, "has a control point that is not finite, or beyond 1e30");
		if (!(patch->control[i][3] > 0))
			return fail(err, "has a weight that is not positive");
	}
	return PSR_OK;
}

static uint32_t n_spans_along(const struct dpoint_patch *patch, int k, uint32_t wanted, uint32_t *at)
{
	uint32_t n = 0;

	for (uint32_t i = (uint32_t)patch->degree[k]; i < patch->n[k]; i++) {
		if (!(patch->knot[k][i + 1] > patch->knot[k][i]))
			continue;
		if (n == wanted)
			*at = i;
		n++;
	}
	return n;
}

int dpoint_patch_span(struct dpoint_span *span, const struct dpoint_patch *patch, uint32_t i)
{
	uint32_t ignored, n_v = n_spans_along(patch, 1, UINT32_MAX, &ignored);

	assert(n_v > 0);
	n_spans_along(patch, 1, i % n_v, &span->at[1]);
	return i / n_v < n_spans_along(patch, 0, i / n_v, &span->at[0]);
}

/* The basis functions of degree p that are not 0 at x, and if asked for their first two derivatives: the functions of
 * degrees p - 1 and p - 2, divided by the knots' differences. */
static inline void basis(double b[3][ORDER], const double *knot, uint32_t span, int p, double x, int has_derivatives)
{
	double of[3][ORDER + 2]; /* of degree p - 2, p - 1, p; with a 0 on both sides */
	double left[ORDER], right[ORDER], n[ORDER] = { 1 };

	if (has_derivatives)
		memset(of, 0, sizeof of);
	for (int j = 0;; j++) {
		if (has_derivatives && j >= p - 2)
			memcpy(&of[j - (p - 2)][1], n, (size_t)(j + 1) * sizeof *n);
		if (j == p)
			break;
		double saved = 0;

		left[j] = x - knot[span - (uint32_t)j];
		right[j] = knot[span + 1 + (uint32_t)j] - x;
		for (int r = 0; r <= j; r++) {
			const double part = n[r] / (right[r] + left[j - r]);

			n[r] = saved + right[r] * part;
			saved = left[j - r] * part;
		}
		n[j + 1] = saved;
	}
	memcpy(b[0], n, sizeof n);
	if (!has_derivatives)
		return;
	memset(b[1], 0, 2 * sizeof *b);
	/* Function i of degree q begins at knot span - q + i. Its derivative is the difference of the two of degree q - 1
	 * that begin there and one later, which are i - 1 and i of theirs. */
	double slope[ORDER + 2] = { 0 }; /* of degree p - 1, with a 0 on both sides */

	for (int i = 0; i <= p; i++) {
		const double *at = knot + span - (uint32_t)p + i;
		const double low = i > 0 ? of[1][i] / (at[p] - at[0]) : 0;
		const double high = i < p ? of[1][i + 1] / (at[p + 1] - at[1]) : 0;

		b[1][i] = p * (low - high);
	}
	if (p < 2)
		return;
	for (int i = 0; i <= p - 1; i++) {
		const double *at = knot + span - (uint32_t)(p - 1) + i;
		const double low = i > 0 ? of[0][i] / (at[p - 1] - at[0]) : 0;
		const double high = i < p - 1 ? of[0][i + 1] / (at[p] - at[1]) : 0;

		slope[1 + i] = (p - 1) * (low - high);
	}
	for (int i = 0; i <= p; i++) {
		const double *at = knot + span - (uint32_t)p + i;
		const double low = i > 0 ? slope[i] / (at[p] - at[0]) : 0;
		const double high = i < p ? slope[i + 1] / (at[p + 1] - at[1]) : 0;

		b[2][i] = p * (low - high);
	}
}

enum { S, U, V, UU, UV, VV, N_DERIVATIVES };

/* Homogeneous place and derivatives, the first n of them, by units of a span. Returns the greatest coordinate of the
 * control points that count, from the first of them on. */
static inline double homogeneous(double a[][4], int n, const struct dpoint_patch *patch, const struct dpoint_span *span,
                                 const double uv[2])
{
	static const int order[N_DERIVATIVES][2] = { { 0, 0 }, { 1, 0 }, { 0, 1 }, { 2, 0 }, { 1, 1 }, { 0, 2 } };
	double b[2][3][ORDER], width[2], size = 0;
	const double *first = NULL;

	for (int k = 0; k < 2; k++) {
		const double *knot = patch->knot[k] + span->at[k];

		width[k] = knot[1] - knot[0];
		basis(b[k], patch->knot[k], span->at[k], patch->degree[k], uv[k] < 1 ? knot[0] + uv[k] * width[k] : knot[1],
		      n > S + 1);
		for (int i = 0; i <= patch->degree[k] && n > S + 1; i++) {
			b[k][1][i] *= width[k];
			b[k][2][i] *= width[k] * width[k];
		}
	}
	memset(a, 0, (size_t)n * sizeof *a);
	for (int i = 0; i <= patch->degree[0]; i++) {
		const uint64_t row = (uint64_t)(span->at[0] - (uint32_t)patch->degree[0] + (uint32_t)i) * patch->n[1];

		for (int j = 0; j <= patch->degree[1]; j++) {
			const double *p = patch->control[row + span->at[1] - (uint32_t)patch->degree[1] + (uint32_t)j];

			if (first == NULL)
				first = p;
			for (int d = 0; d < n; d++) {
				const double k = b[0][order[d][0]][i] * b[1][order[d][1]][j] * p[3];

				/* From the first control point on, so that a patch far from the origin loses nothing. */
				for (int c = 0; c < 3; c++)
					a[d][c] += k * (p[c] - first[c]);
				a[d][3] += k;
			}
			for (int c = 0; c < 3; c++)
				size = fabs(p[c] - first[c]) > size ? fabs(p[c] - first[c]) : size;
		}
	}
	return size;
}

static const double *first_control(const struct dpoint_patch *patch, const struct dpoint_span *span)
{
	return patch->control[(uint64_t)(span->at[0] - (uint32_t)patch->degree[0]) * patch->n[1] + span->at[1] -
	                      (uint32_t)patch->degree[1]];
}

static void place_of(double at[3], const double a[4], const double first[3])
{
	for (int c = 0; c < 3; c++)
		at[c] = first[c] + a[c] / a[3];
}

void dpoint_patch_place(double at[3], const struct dpoint_patch *patch, const struct dpoint_span *span,
                        const double uv[2])
{
	double a[S + 1][4];

	homogeneous(a, S + 1, patch, span, uv);
	place_of(at, a[S], first_control(patch, span));
}

/* Derivatives of the quotient. */
static void rational(double s[N_DERIVATIVES][3], const double a[N_DERIVATIVES][4])
{
	const double w = a[S][3];

	for (int c = 0; c < 3; c++) {
		s[S][c] = a[S][c] / w;
		s[U][c] = (a[U][c] - a[U][3] * s[S][c]) / w;
		s[V][c] = (a[V][c] - a[V][3] * s[S][c]) / w;
		s[UU][c] = (a[UU][c] - 2 * a[U][3] * s[U][c] - a[UU][3] * s[S][c]) / w;
		s[UV][c] = (a[UV][c] - a[U][3] * s[V][c] - a[V][3] * s[U][c] - a[UV][3] * s[S][c]) / w;
		s[VV][c] = (a[VV][c] - 2 * a[V][3] * s[V][c] - a[VV][3] * s[S][c]) / w;
	}
}

int dpoint_patch_local(struct dpoint_local *local, const struct dpoint_patch *patch, const struct dpoint_span *span,
                       const double uv[2])
{
	double a[N_DERIVATIVES][4], s[N_DERIVATIVES][3];
	double size = homogeneous(a, N_DERIVATIVES, patch, span, uv), e, f, g, u, skew, v;

	place_of(local->at, a[S], first_control(patch, span));
	rational(s, (const double (*)[4])a);
	memset(local->shape, 0, sizeof local->shape);
	u = v3d_normalize(local->axis[0], s[U]);
	v3d_cross(local->axis[2], s[U], s[V]);
	v = v3d_normalize(local->axis[2], local->axis[2]) / u;
	v3d_cross(local->axis[1], local->axis[2], local->axis[0]);
	/* v is what Sv has across Su; it may be long, and still along Su. */
	if (!(u > NO_DERIVATIVE * size) || !(v > NO_DERIVATIVE * size) || !(v > NO_DERIVATIVE * v3d_length(s[V])))
		return 0;
	skew = v3d_dot(s[V], local->axis[0]) / u;
	e = v3d_dot(s[UU], local->axis[2]);
	f = v3d_dot(s[UV], local->axis[2]);
	g = v3d_dot(s[VV], local->axis[2]);
	/* The second form of (du, dv) in lengths along x and y: du = (x - skew' y) / u, dv = y / v. */
	local->shape[0] = e / (u * u);
	local->shape[1] = (f - e * skew) / (u * v);
	local->shape[2] = (g - 2 * f * skew + e * skew * skew) / (v * v);
	return 1;
}

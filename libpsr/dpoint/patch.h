/* Patches of rational B-splines, and their exact places, normals and curvatures. */
#ifndef PSR_DPOINT_PATCH_H
#define PSR_DPOINT_PATCH_H

#include <stdint.h>
#include "dpoint.h"
#include "psr/error.h"

#define DPOINT_MOST_DEGREE 15

/* A tensor product in u and v; a Bezier patch of degree d has d + 1 control points and the knots 0 ... 0 1 ... 1. Its
 * outside is where Su x Sv points. */
struct dpoint_patch {
	int degree[2];              /* 1..DPOINT_MOST_DEGREE */
	uint32_t n[2];              /* control points along u and v, more than the degree */
	const double *knot[2];      /* n + degree + 1, which do not fall; the domain is knot[degree]..knot[n] */
	const double (*control)[4]; /* n[0] * n[1], v fastest: x, y, z as they are, and the weight, > 0 */
};

/* Checks a patch's promises. FORMAT: degrees, counts, knots that fall or that leave no domain, numbers that are not
 * finite, weights that are not positive. */
int dpoint_patch_check(const struct dpoint_patch *patch, struct psr_error *err);

/* A part between two knots along u and v that follow each other, where the patch is smooth: the lower knots. */
struct dpoint_span {
	uint32_t at[2];
};

/* Finds span `i` of those that are not empty; returns 0 if there are no more. */
int dpoint_patch_span(struct dpoint_span *span, const struct dpoint_patch *patch, uint32_t i);

/* Computes the place at u and v, 0 to 1 within the span. A border has the derivatives of this side. */
void dpoint_patch_place(double at[3], const struct dpoint_patch *patch, const struct dpoint_span *span,
                        const double uv[2]);

/* Computes place, frame and shape. Returns 0 where the patch has no normal: at poles, where a side is one point, at
 * cusps, and where it runs back along itself. The place is computed in any case. */
int dpoint_patch_local(struct dpoint_local *local, const struct dpoint_patch *patch, const struct dpoint_span *span,
                       const double uv[2]);

#endif

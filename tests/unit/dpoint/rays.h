/* Rays between kept points, in doubles. */
#ifndef TESTS_DPOINT_RAYS_H
#define TESTS_DPOINT_RAYS_H

#include <math.h>
#include "base/vec.h"
#include "dpoint/surface.h"

/* Whether a ray through the origin towards w meets z = (a x^2 + b y^2) / 2, moved by p, within the extents, with its
 * normal towards w, or either way if it has two sides, and no further than `behind` behind the origin. By steps of a
 * Newton iteration from both ends of what may count, in doubles. */
static int is_stopped(const double p[3], const double w[3], const double l[2], const double extent[2], double behind,
                      int is_two_sided)
{
	for (int from = 0; from < 2; from++) {
		double t = from ? 0.5 : -behind;

		for (int i = 0; i < 20; i++) {
			const double x = p[0] + t * w[0], y = p[1] + t * w[1];
			const double off = p[2] + t * w[2] - 0.5 * (l[0] * x * x + l[1] * y * y);
			const double slope = w[2] - l[0] * x * w[0] - l[1] * y * w[1];

			if (fabs(off) < 1e-12 && (slope > 0 || is_two_sided) && t >= -behind && fabs(x) <= extent[0] &&
			    fabs(y) <= extent[1])
				return 1;
			t -= off / (fabs(slope) > 1e-9 ? slope : 1e-9);
		}
	}
	return 0;
}

/* Whether no kept point is in the way of the ray that comes from direction w to a place, or stops it after that. */
static int gets_through(const struct dpoint_surface *surface, const struct dpoint_choice *choice,
                        const struct dpoint_cover_options *o, const double at[3], const double w[3], double behind)
{
	for (size_t i = 0; i < surface->n_candidates; i++) {
		const struct dpoint_candidate *c = &surface->candidate[i];
		const double l[2] = { c->point.lambda_u, c->point.lambda_u * c->point.rho };
		double axis[3][3], away[3], p[3], r[3], wide[2];
		float extent[2];

		if (!choice->is_kept[i])
			continue;
		for (int k = 0; k < 3; k++)
			away[k] = at[k] - c->point.at[k];
		dpoint_candidate_extent(extent, c, o->sine);
		for (int k = 0; k < 2; k++)
			wide[k] = extent[k];
		if (v3d_length(away) > 2 * (wide[0] + wide[1]) + 0.1) /* quadrics lean less than that */
			continue;
		for (int k = 0; k < 3; k++) {
			axis[0][k] = c->point.u[k];
			axis[2][k] = c->point.normal[k];
		}
		v3d_cross(axis[1], axis[2], axis[0]);
		for (int k = 0; k < 3; k++) {
			p[k] = r[k] = 0;
			for (int j = 0; j < 3; j++) {
				p[k] += axis[k][j] * away[j];
				r[k] += axis[k][j] * w[j];
			}
		}
		if (is_stopped(p, r, l, wide, behind, o->is_two_sided != NULL))
			return 0;
	}
	return 1;
}

#endif

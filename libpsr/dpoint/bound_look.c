#include "bound_seen.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/array.h"
#include "base/vec.h"
#include "psr/error.h"

#define SLIVER 1e-7 /* of a facet's altitude to its side: it is its sides alone */

static inline double lesser(double a, double b)
{
	return b < a ? b : a;
}

static inline double greater(double a, double b)
{
	return b > a ? b : a;
}

static void find_box(struct bound_box *box, const double corner[3][3])
{
	double low[3], high[3];

	for (int k = 0; k < 3; k++) {
		low[k] = lesser(lesser(corner[0][k], corner[1][k]), corner[2][k]);
		high[k] = greater(greater(corner[0][k], corner[1][k]), corner[2][k]);
	}
	bound_box_set(box, low, high);
}

static void set_plane(struct bound_seen *seen, int i, const double normal[3], const double on[3])
{
	for (int k = 0; k < 3; k++)
		seen->plane[i / 2][k][i % 2] = normal[k];
	seen->plane[i / 2][3][i % 2] = -v3d_dot(normal, on);
}

static void prepare(struct bound_seen *seen, const double corner[3][3])
{
	double most = 0, normal[3], square;

	memcpy(seen->corner, corner, sizeof seen->corner);
	for (int i = 0; i < 3; i++) {
		v3d_sub(seen->side[i], corner[(i + 1) % 3], corner[i]);
		square = v3d_dot(seen->side[i], seen->side[i]);
		most = greater(most, square);
		seen->per_side[i] = square > 0 ? 1 / square : 0;
	}
	v3d_cross(normal, seen->side[0], seen->side[1]);
	square = v3d_dot(normal, normal);
	if (!(square > SLIVER * SLIVER * most * most)) {
		memset(seen->plane, 0, sizeof seen->plane);
		seen->plane[0][3] = seen->plane[1][3] = (bound_pair){ -1, -1 };
		return;
	}
	v3d_scale(normal, normal, 1 / sqrt(square));
	for (int i = 0; i < 3; i++) {
		double inwards[3];

		v3d_cross(inwards, normal, seen->side[i]);
		set_plane(seen, i, inwards, corner[i]);
	}
	set_plane(seen, 3, normal, corner[0]);
}

void bound_rise(double w[2], const struct bound_view *view, const double low[2], const double high[2])
{
	const double lambda[2] = { view->a, view->b };

	w[0] = w[1] = 0;
	for (int k = 0; k < 2; k++) {
		const double x = 0.5 * lambda[k] * low[k] * low[k], y = 0.5 * lambda[k] * high[k] * high[k];
		const double middle = low[k] < 0 && high[k] > 0 ? 0 : x;

		w[0] += lesser(lesser(x, y), middle);
		w[1] += greater(greater(x, y), middle);
	}
}

struct looking_at {
	struct bound_view *view;
	struct bound_box reach;
};

static int take(const struct facet *facet, size_t n, void *userdata)
{
	const struct looking_at *l = userdata;
	struct bound_view *view = l->view;

	for (size_t f = 0; f < n; f++) {
		double corner[3][3];
		struct bound_box box;

		for (int i = 0; i < 3; i++) {
			double away[3];

			for (int k = 0; k < 3; k++)
				away[k] = facet[f].corner[i][k] - view->at[k];
			m3d_apply(corner[i], (const double (*)[3])view->axis, away);
		}
		find_box(&box, (const double (*)[3])corner);
		if (bound_is_apart(&box, &l->reach))
			continue;
		if (!ARRAY_ROOM(view->seen, view->n_seen, view->seen_room))
			return PSR_ERR_MEMORY;
		view->seen[view->n_seen].box = box;
		prepare(&view->seen[view->n_seen++], (const double (*)[3])corner);
	}
	return 0;
}

int bound_look(struct bound_view *view, const struct facets *facets, const struct dpoint *point, const float extent[2],
               double far)
{
	double low[3] = { -extent[0], -extent[1] }, high[3] = { extent[0], extent[1] };
	struct looking_at l = { .view = view };
	struct facet_box box;
	double w[2];

	view->n_seen = 0;
	view->far = far;
	view->a = point->lambda_u;
	view->b = (double)point->lambda_u * point->rho;
	for (int k = 0; k < 3; k++) {
		view->at[k] = point->at[k];
		view->axis[0][k] = point->u[k];
		view->axis[2][k] = point->normal[k];
	}
	v3d_cross(view->axis[1], view->axis[2], view->axis[0]);
	bound_rise(w, view, low, high);
	low[2] = w[0];
	high[2] = w[1];
	bound_box_reach(&l.reach, low, high, far);
	for (int k = 0; k < 3; k++) {
		const double middle = view->at[k] + 0.5 * (w[0] + w[1]) * view->axis[2][k];
		const double reach = extent[0] * fabs(view->axis[0][k]) + extent[1] * fabs(view->axis[1][k]) +
		                     0.5 * (w[1] - w[0]) * fabs(view->axis[2][k]) + far + 1e-6;

		box.low[k] = (float)(middle - reach);
		box.high[k] = (float)(middle + reach);
	}
	view->is_failed = facets_search(facets, &box, take, &l) != 0;
	return view->is_failed ? PSR_ERR_MEMORY : PSR_OK;
}

void bound_view_fini(struct bound_view *view)
{
	free(view->seen);
	free(view->list);
	memset(view, 0, sizeof *view);
}

/* ---- distances ---- */

static inline double between_0_and_1(double t)
{
	return t > 0 ? t < 1 ? t : 1 : 0;
}

static double side_distance2(const struct bound_seen *seen, int i, const double p[3])
{
	double away[3], t;

	v3d_sub(away, p, seen->corner[i]);
	t = between_0_and_1(v3d_dot(away, seen->side[i]) * seen->per_side[i]);
	v3d_add_scaled(away, away, -t, seen->side[i]);
	return v3d_dot(away, away);
}

/* The nearest side is one that the place is beyond. */
double bound_distance2(const struct bound_seen *seen, const double p[3])
{
	double least = INFINITY;
	bound_pair above[2];

	for (int i = 0; i < 2; i++)
		above[i] = seen->plane[i][0] * p[0] + seen->plane[i][1] * p[1] + seen->plane[i][2] * p[2] + seen->plane[i][3];
	if (lesser(lesser(above[0][0], above[0][1]), above[1][0]) >= 0)
		return above[1][1] * above[1][1];
	for (int i = 0; i < 3; i++)
		if (above[i / 2][i % 2] < 0)
			least = lesser(least, side_distance2(seen, i, p));
	return least;
}

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

static void prepare(struct bound_seen *seen)
{
	double most = 0, square;

	for (int i = 0; i < 3; i++) {
		v3d_sub(seen->side[i], seen->corner[(i + 1) % 3], seen->corner[i]);
		square = v3d_dot(seen->side[i], seen->side[i]);
		most = greater(most, square);
		seen->per_side[i] = square > 0 ? 1 / square : 0;
		seen->low[i] = lesser(lesser(seen->corner[0][i], seen->corner[1][i]), seen->corner[2][i]);
		seen->high[i] = greater(greater(seen->corner[0][i], seen->corner[1][i]), seen->corner[2][i]);
	}
	v3d_cross(seen->normal, seen->side[0], seen->side[1]);
	square = v3d_dot(seen->normal, seen->normal);
	seen->per_normal = square > SLIVER * SLIVER * most * most ? 1 / square : 0;
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

int bound_is_apart(const struct bound_seen *seen, const double low[3], const double high[3], double far)
{
	for (int k = 0; k < 3; k++)
		if (!(seen->low[k] <= high[k] + far && seen->high[k] >= low[k] - far))
			return 1;
	return 0;
}

struct looking_at {
	struct bound_view *view;
	double low[3], high[3];
};

static int take(const struct facet *facet, size_t n, void *userdata)
{
	const struct looking_at *l = userdata;
	struct bound_view *view = l->view;

	for (size_t f = 0; f < n; f++) {
		struct bound_seen *seen;

		if (!ARRAY_ROOM(view->seen, view->n_seen, view->seen_room))
			return PSR_ERR_MEMORY;
		seen = &view->seen[view->n_seen];
		for (int i = 0; i < 3; i++) {
			double away[3];

			for (int k = 0; k < 3; k++)
				away[k] = facet[f].corner[i][k] - view->at[k];
			m3d_apply(seen->corner[i], (const double (*)[3])view->axis, away);
		}
		prepare(seen);
		view->n_seen += !bound_is_apart(seen, l->low, l->high, view->far);
	}
	return 0;
}

int bound_look(struct bound_view *view, const struct facets *facets, const struct dpoint *point, const float extent[2],
               double far)
{
	struct looking_at l = { view, { -extent[0], -extent[1], 0 }, { extent[0], extent[1], 0 } };
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
	bound_rise(w, view, l.low, l.high);
	l.low[2] = w[0];
	l.high[2] = w[1];
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

static double side_distance2(const struct bound_seen *seen, int i, const double away[3])
{
	const double t = between_0_and_1(v3d_dot(away, seen->side[i]) * seen->per_side[i]);
	double left[3];

	v3d_add_scaled(left, away, -t, seen->side[i]);
	return v3d_dot(left, left);
}

/* The nearest side is one that the place is beyond. */
double bound_distance2(const struct bound_seen *seen, const double p[3])
{
	double least = INFINITY, away[3], across[3];

	for (int i = 0; i < 3; i++) {
		v3d_sub(away, p, seen->corner[i]);
		v3d_cross(across, seen->side[i], away);
		if (seen->per_normal == 0 || v3d_dot(across, seen->normal) < 0)
			least = lesser(least, side_distance2(seen, i, away));
	}
	if (least < INFINITY)
		return least;
	v3d_sub(away, p, seen->corner[0]);
	return v3d_dot(away, seen->normal) * v3d_dot(away, seen->normal) * seen->per_normal;
}

#include "lid.h"

#include <math.h>
#include <string.h>
#include "base/vec.h"
#include "group.h"

void lid_make(struct lid *lid, const struct dpoint_candidate *candidate, const struct dpoint_cover_options *options)
{
	struct rectangle *r = &lid->rectangle;
	float most[3];

	rectangle_of(r, candidate, options);
	lid->is_two_sided = dpoint_is_two_sided(options, candidate->part);
	lid->graze = options->graze;
	for (int k = 0; k < 2; k++) {
		r->extent[k] = fmaxf(0, r->extent[k] - options->slack);
		most[k] = r->extent[k] + DPOINT_GRAZES * lid->graze;
	}
	most[2] = 0.5f * fabsf(r->lambda_u) * (most[0] * most[0] + fabsf(r->rho) * most[1] * most[1]);
	lid->reach = 1.01f * v3f_length(most) + 1e-6f;
}

void lid_corners(struct dpoint_cell *cell, const struct lid *lid)
{
	const struct rectangle *r = &lid->rectangle;

	memset(cell, 0, sizeof *cell);
	for (int i = 0; i < 4; i++) {
		v3f_add_scaled(cell->corner[i], r->at, i == 0 || i == 3 ? r->extent[0] : -r->extent[0], r->axis[0]);
		v3f_add_scaled(cell->corner[i], cell->corner[i], i < 2 ? r->extent[1] : -r->extent[1], r->axis[1]);
	}
}

int lid_stops_all(const struct lid *lid, const float p[3], const float normal[3], float flattest, float behind)
{
	const struct rectangle *r = &lid->rectangle;
	const float off = fabsf(p[2] - dpoint_quadric_at(r->lambda_u, r->rho, p[0], p[1]));
	float n[3], cosine, lean, least, reach;

	if (!(fabsf(p[0]) <= r->extent[0] && fabsf(p[1]) <= r->extent[1]))
		return 0;
	v3f_set(n, -(r->lambda_u * p[0]), -(r->lambda_u * r->rho * p[1]), 1);
	v3f_normalize(n, n);
	m3f_apply_transposed(n, (const float (*)[3])r->axis, n);
	cosine = fminf(1, v3f_dot(n, normal));
	lean = sqrtf(1 - cosine * cosine);
	least = cosine * flattest - lean * sqrtf(1 - flattest * flattest);
	if (!(least > 0))
		return 0;
	reach = 2 * off / least;
	return fabsf(r->lambda_u) * reach <= 0.25f * least && reach <= behind && fabsf(p[0]) + reach <= r->extent[0] &&
	       fabsf(p[1]) + reach <= r->extent[1];
}

/* Whether a ray from p in direction w, in the frame of the rectangle, meets its quadric within its sides, from `side`.
 * It is met where A t^2 + B t + C is 0; of its roots each has its side. */
static int meets(const struct lid *lid, const float p[3], const float w[3], float side, float behind)
{
	const struct rectangle *r = &lid->rectangle;
	const float l[2] = { r->lambda_u, r->lambda_u * r->rho };
	const float a = 0.5f * (l[0] * w[0] * w[0] + l[1] * w[1] * w[1]);
	const float b = l[0] * p[0] * w[0] + l[1] * p[1] * w[1] - w[2];
	const float c = dpoint_quadric_at(r->lambda_u, r->rho, p[0], p[1]) - p[2], inside = b * b - 4 * a * c;
	float root, t;

	if (inside < 0)
		return 0;
	root = side * sqrtf(inside);
	t = side * b <= 0 ? 2 * c / (root - b) : (-b - root) / (2 * a);
	return t >= -behind && fabsf(p[0] + t * w[0]) <= r->extent[0] + dpoint_graze_by(lid->graze, w[0], w[1], w[2])
	       && fabsf(p[1] + t * w[1]) <= r->extent[1] + dpoint_graze_by(lid->graze, w[1], w[0], w[2]);
}

int lid_stops(const struct lid *lid, const float p[3], const float from[3], float behind)
{
	float w[3];

	m3f_apply(w, (const float (*)[3])lid->rectangle.axis, from);
	return meets(lid, p, w, 1, behind) || (lid->is_two_sided && meets(lid, p, w, -1, behind));
}

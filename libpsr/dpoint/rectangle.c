#include "rectangle.h"

#include <math.h>
#include <string.h>
#include "base/vec.h"

/* Of unit vectors so near to each other the angle's tangent is at most 1.2 times their distance. */
#define MOST_CHORD 0.6f
/* Of a normal's angle: the derivative of asin is at most 1.6 up to here. */
#define MOST_SINE 0.78f

/* Of angles below 0.01, rounding would be too much of what is left. */
static void find_sure(struct looking *l, float angle)
{
	const double most = fmin((double)angle, 1.5);
	double s, c, w = 0.25;

	while (0.18 * w * w * w > most / 16)
		w *= 0.9;
	psr_sincos(0.875 * most, &s, &c);
	l->sure_sine2 = angle >= 0.01f ? (float)(w * w) : -1;
	l->sure_cosine2 = (float)(c * c);
}

void looking_init(struct looking *l, const struct dpoint_surface *surface, const struct cell_tree *tree,
                  const struct dpoint_cover_options *options)
{
	double s, c;

	psr_sincos(fmin(options->angle, 3.14159), &s, &c);
	*l = (struct looking){ .surface = surface, .options = options, .tree = tree, .cosine = c > 0 ? (float)c : 0,
	                       .chord = MOST_CHORD };
	if (c > 0.82)
		l->chord = (float)sqrt(2 - 2 * c);
	find_sure(l, options->angle);
}

void cell_plane(float normal[3], const struct dpoint_cell *cell)
{
	float a[3], b[3];

	v3f_sub(a, cell->corner[2], cell->corner[0]);
	v3f_sub(b, cell->corner[3], cell->corner[1]);
	v3f_cross(normal, a, b);
	v3f_normalize(normal, normal);
	if (v3f_dot(normal, cell->normal) < 0)
		v3f_scale(normal, normal, -1);
}

float cell_area(const struct dpoint_cell *cell)
{
	float a[3], b[3], n[3];

	v3f_sub(a, cell->corner[2], cell->corner[0]);
	v3f_sub(b, cell->corner[3], cell->corner[1]);
	v3f_cross(n, a, b);
	return 0.5f * v3f_length(n);
}

void rectangle_of(struct rectangle *r, const struct dpoint_candidate *c, const struct dpoint_cover_options *options)
{
	const float lambda[2] = { c->point.lambda_u, c->point.lambda_u * c->point.rho };
	float rise = 0;

	memcpy(r->at, c->point.at, sizeof r->at);
	memcpy(r->axis[0], c->point.u, sizeof r->axis[0]);
	memcpy(r->axis[2], c->point.normal, sizeof r->axis[2]);
	v3f_cross(r->axis[1], r->axis[2], r->axis[0]);
	for (int k = 0; k < 3; k++)
		for (int i = 0; i < 3; i++)
			r->slant[k][i] = fabsf(r->axis[k][i]);
	r->lambda_u = c->point.lambda_u;
	r->rho = c->point.rho;
	r->part = c->part;
	r->attr = c->point.attr;
	look_of(r->look, r->attr);
	dpoint_candidate_extent(r->extent, c, options->sine);
	r->height = fminf(options->height, 0.5f * fminf(r->extent[0], r->extent[1]));
	for (int k = 0; k < 2; k++)
		rise = fmaxf(rise, 2 * fabsf(lambda[k]) * r->extent[k] * r->extent[k]);
	r->deep = rise + r->height;
}

void rectangle_shorten(struct rectangle *r, float slack)
{
	const float lambda[2] = { r->lambda_u, r->lambda_u * r->rho };

	for (int k = 0; k < 2; k++) {
		const float w = lambda[k] * r->extent[k];

		r->extent[k] = r->extent[k] * sqrtf(fmaxf(0, 1 - w * w)) - slack;
	}
}

/* e sqrt(1 - (lambda e)^2) = most has its lesser root at (lambda e)^2 = (1 - sqrt(1 - (2 lambda most)^2)) / 2, here
 * without a difference. */
int rectangle_around(float delta[2], const struct dpoint_candidate *c, const struct dpoint_cell *cell,
                     const struct dpoint_cover_options *options)
{
	float p[3], most[2] = { 0, 0 };
	struct rectangle r;

	rectangle_of(&r, c, options);
	for (int i = 0; i < 4; i++) {
		rectangle_sees(p, &r, cell->corner[i]);
		for (int k = 0; k < 2; k++)
			most[k] = fmaxf(most[k], fabsf(p[k]));
	}
	for (int k = 0; k < 2; k++) {
		const float lambda = fabsf(r.lambda_u * (k == 0 ? 1 : r.rho)), m = most[k] + 1.01f * options->slack;
		const float inside = 1 - 4 * lambda * lambda * m * m;
		float extent;
		unsigned class;

		if (!(inside >= 0))
			return 0;
		extent = m * sqrtf(2 / (1 + sqrtf(inside))) * 1.0001f;
		class = dpoint_delta_class(extent);
		if (dpoint_delta_of_class(class) < extent && class-- == 0)
			return 0;
		if (extent * lambda > options->sine)
			return 0;
		delta[k] = dpoint_delta_of_class(class);
	}
	return 1;
}

int rectangle_suits_off(const struct looking *l, const struct rectangle *r, const struct dpoint_cell *cell,
                        const float at[3], float off)
{
	float n[3], cell_normal[3], dot;
	struct look_range look;

	if (cell->part == DPOINT_BEYOND || !(off <= r->height))
		return 0;
	if (cell->attr != r->attr) {
		look_range_of(&look, cell->attr);
		if (look_range_distance(&look, r->look) > l->options->looks)
			return 0;
	}
	if (cell->normal[0] == 0 && cell->normal[1] == 0 && cell->normal[2] == 0)
		return 1;
	dpoint_normal_at(n, r->lambda_u, r->rho, at[0], at[1]);
	m3f_apply(cell_normal, (const float (*)[3])r->axis, cell->normal);
	dot = v3f_dot(n, cell_normal);
	return dot > 0 && dot * dot >= l->cosine * l->cosine * v3f_dot(n, n);
}

int rectangle_suits(const struct looking *l, const struct rectangle *r, const struct dpoint_cell *cell,
                    const float at[3])
{
	return rectangle_surely_suits(l, r, cell, at) ||
	       rectangle_suits_off(l, r, cell, at, fabsf(at[2] - dpoint_height_at(r->lambda_u, r->rho, at[0], at[1])));
}

int rectangle_covers(const struct looking *l, const struct rectangle *r, const struct dpoint_cell *cell)
{
	float middle[3] = { 0, 0, 0 }, p[3];

	if (l->options->is_within_parts && cell->part != r->part)
		return 0;
	for (int c = 0; c < 4; c++) {
		rectangle_sees(p, r, cell->corner[c]);
		if (!(fabsf(p[0]) <= r->extent[0] && fabsf(p[1]) <= r->extent[1]))
			return 0;
		v3f_add_scaled(middle, middle, 0.25f, p);
	}
	return rectangle_suits(l, r, cell, middle);
}

/* Within the sphere S_p's normal turns by 1.6 radius |lambda_u| at most, as long as the sine of its angle is below
 * MOST_SINE, and heights part by the tangent of the normals' difference. What these alone are too much for is told
 * first: rounded sums and products grow with each of their terms. */
int rectangle_suits_node(const struct looking *l, const struct rectangle *r, size_t i, const float p[3])
{
	const struct cell_node *node = &l->tree->node[i];
	const float radius = l->tree->ball[i].radius, turn = 1.6f * radius * fabsf(r->lambda_u);
	const float u = fabsf(p[0]), v = fabsf(p[1]), away = (u > v ? u : v) + radius;
	float n[3], normal[3], off, chord;

	if (!rectangle_may_suit(l, r, radius))
		return 0;
	chord = node->spread + turn;
	if (node->spread >= MOST_CHORD || !(away * fabsf(r->lambda_u) <= MOST_SINE) || chord > l->chord ||
	    1.2f * chord * radius > r->height)
		return 0;
	off = fabsf(p[2] - dpoint_height_at(r->lambda_u, r->rho, p[0], p[1]));
	if (off + 1.2f * chord * radius > r->height || look_range_distance(&node->looks, r->look) > l->options->looks)
		return 0;
	dpoint_normal_at(n, r->lambda_u, r->rho, p[0], p[1]);
	v3f_normalize(n, n);
	m3f_apply(normal, (const float (*)[3])r->axis, node->normal);
	v3f_sub(n, n, normal);
	chord = v3f_length(n) + node->spread + turn;
	return chord <= l->chord && off + 1.2f * chord * radius <= r->height;
}

int rectangle_covers_node(const struct looking *l, const struct rectangle *r, size_t i, const float p[3])
{
	const float radius = l->tree->ball[i].radius;

	return fabsf(p[0]) + radius <= r->extent[0] && fabsf(p[1]) + radius <= r->extent[1] &&
	       !(l->options->is_within_parts && l->tree->node[i].part != r->part) && rectangle_suits_node(l, r, i, p);
}

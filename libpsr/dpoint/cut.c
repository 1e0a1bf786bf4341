#include "cut.h"

#include <math.h>
#include <string.h>
#include "base/direction.h"
#include "base/maths.h"
#include "base/vec.h"
#include "look.h"
#include "rectangle.h"

#define MOST_UNITS (1u << 20) /* of a side */
#define TURNED 0.25           /* of a cell: normals that turn within so little are let be */

/* How many units the longest side has, and the one that x runs along. */
static uint32_t units_of(const struct cutting *c)
{
	return c->n * c->grains * c->units;
}

/* The corners' weights of the place that is x and y units from the apex along its sides. */
static void weigh(double weight[3], const struct cutting *c, double x, double y)
{
	const double unit = 1.0 / units_of(c);

	y *= c->ratio;
	weight[c->along] = x * unit;
	weight[3 - c->apex - c->along] = y * unit;
	weight[c->apex] = 1 - (x + y) * unit;
}

static void place_at(double at[3], const struct cutting *c, const double weight[3])
{
	v3d_scale(at, c->corner[0]->at, weight[0]);
	v3d_add_scaled(at, at, weight[1], c->corner[1]->at);
	v3d_add_scaled(at, at, weight[2], c->corner[2]->at);
}

/* A basis whose x follows the triangle's side: on a flat face rectangles then lie along its edges. */
static void basis_along(double axis[3][3], const struct cutting *c, const double normal[3])
{
	double along[3];

	psr_direction_basis(normal, axis);
	v3d_sub(along, c->corner[(c->side + 1) % 3]->at, c->corner[c->side]->at);
	v3d_add_scaled(along, along, -v3d_dot(along, normal), normal);
	if (v3d_normalize(along, along) == 0)
		return;
	memcpy(axis[0], along, sizeof along);
	v3d_cross(axis[1], axis[2], axis[0]);
}

/* The normal that shading has. Returns 0 where there is none: then it is 0. */
static int normal_at(double normal[3], const struct cutting *c, const double weight[3])
{
	v3d_set(normal, 0, 0, 0);
	for (int i = 0; i < 3; i++)
		v3d_add_scaled(normal, normal, weight[i], c->corner[i]->normal);
	return v3d_normalize(normal, normal) != 0;
}

/* Between the corners: the normal that shading has, and the mean of their second forms, seen in its tangent plane. */
static int local_at(struct dpoint_local *local, const struct cutting *c, const double weight[3])
{
	double t[6] = { 0 }, normal[3], along[2][3];

	place_at(local->at, c, weight);
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 6; k++)
			t[k] += weight[i] * c->corner[i]->tensor[k];
	if (!normal_at(normal, c, weight))
		return 0;
	basis_along(local->axis, c, normal);
	for (int i = 0; i < 2; i++) {
		const double *a = local->axis[i];

		along[i][0] = t[0] * a[0] + t[1] * a[1] + t[2] * a[2];
		along[i][1] = t[1] * a[0] + t[3] * a[1] + t[4] * a[2];
		along[i][2] = t[2] * a[0] + t[4] * a[1] + t[5] * a[2];
	}
	local->shape[0] = v3d_dot(along[0], local->axis[0]);
	local->shape[1] = v3d_dot(along[0], local->axis[1]);
	local->shape[2] = v3d_dot(along[1], local->axis[1]);
	return 1;
}

/* A piece begins x and y units from the apex, and is `size` units long on both sides; the longest side cuts it off. */
struct piece {
	uint32_t x, y, size;
};

/* Whether it begins beyond the longest side, or on it. */
static int is_beyond(const struct cutting *c, const struct piece *p)
{
	return p->x + (uint64_t)c->ratio * p->y >= units_of(c);
}

/* How high it is where it begins and where it ends; none at the end: a triangle. */
static void heights_of(double height[2], const struct cutting *c, const struct piece *p)
{
	for (uint32_t i = 0; i < 2; i++)
		height[i] = fmin(p->size, (double)(units_of(c) - p->x - i * p->size) / c->ratio - p->y);
}

static void weigh_middle(double weight[3], const struct cutting *c, const struct piece *p)
{
	double height[2];

	heights_of(height, c, p);
	if (height[1] > 0)
		weigh(weight, c, p->x + p->size * 0.5, p->y + (height[0] + height[1]) * 0.25);
	else
		weigh(weight, c, p->x + p->size * (1.0 / 3), p->y + height[0] * (1.0 / 3));
}

/* The weights of a piece's four corners; of a triangle the last two are one. */
static void weigh_corners(double weight[4][3], const struct cutting *c, const struct piece *p)
{
	double height[2];

	heights_of(height, c, p);
	weigh(weight[0], c, p->x, p->y);
	weigh(weight[1], c, p->x + p->size, p->y);
	weigh(weight[3], c, p->x, p->y + height[0]);
	if (height[1] > 0)
		weigh(weight[2], c, p->x + p->size, p->y + height[1]);
	else
		memcpy(weight[2], weight[3], sizeof weight[2]);
}

/* Whether the point's rectangle around the cell is within the bound. Where there is no point there is nothing to
 * mend. */
static int is_within(const struct cutting *c, const struct dpoint_cell *cell, const struct dpoint_local *local,
                     const struct dpoint_candidate *like)
{
	const struct dpoint_cover_options *cover = c->options->cover;
	struct dpoint_candidate candidate;
	float extent[2];

	if (dpoint_candidate_make(&candidate, local, like) == DPOINT_BAD)
		return 1;
	if (!rectangle_around(candidate.delta, &candidate, cell, cover))
		return 0;
	dpoint_candidate_extent(extent, &candidate, cover->sine);
	return bound_look(c->view, &c->surface->facets, &candidate.point, extent, cover->error) == PSR_OK &&
	       bound_holds(c->view, extent, cover->error, NULL);
}

/* Whether normals turn by too much along a side. */
static int turns(const struct cutting *c, const struct piece *p)
{
	double normal[4][3], weight[4][3];

	if (p->size <= c->least_turned)
		return 0;
	weigh_corners(weight, c, p);
	for (int i = 0; i < 4; i++)
		normal_at(normal[i], c, weight[i]);
	for (int i = 0; i < 4; i++)
		if (v3d_dot(normal[i], normal[(i + 1) % 4]) < c->least_cosine)
			return 1;
	return 0;
}

/* Makes the cell and the shape in its middle. Returns 0 where that cannot be told: then the cell has no normal. */
static int cell_of(struct dpoint_cell *cell, struct dpoint_local *local, const struct cutting *c, const struct piece *p)
{
	double weight[4][3], place[3];
	int is_good;

	weigh_corners(weight, c, p);
	for (int i = 0; i < 4; i++) {
		place_at(place, c, weight[i]);
		for (int k = 0; k < 3; k++)
			cell->corner[i][k] = (float)place[k];
	}
	memset(cell->normal, 0, sizeof cell->normal);
	cell->part = c->material;
	weigh_middle(weight[0], c, p);
	is_good = local_at(local, c, weight[0]);
	for (int k = 0; k < 3 && is_good; k++)
		cell->normal[k] = (float)local->axis[2][k];
	return is_good;
}

/* The piece, or its quarters where normals turn too much, or the bound asks for smaller ones. */
static int put(const struct cutting *c, const struct piece *p, uint64_t attr)
{
	const float delta = c->options->delta;
	const uint32_t half = p->size / 2;
	struct dpoint_candidate like = { .delta = { delta, delta }, .part = c->material, .point.attr = attr };
	struct dpoint_cell made, *cell;
	struct dpoint_local local;
	const int is_good = cell_of(&made, &local, c, p);
	int rc = PSR_OK;

	made.attr = attr;
	if (half > 0 && is_good && (turns(c, p) || (c->view != NULL && !is_within(c, &made, &local, &like)))) {
		for (uint32_t i = 0; i < 4 && rc == PSR_OK; i++) {
			const struct piece part = { p->x + (i & 1) * half, p->y + (i >> 1) * half, half };

			if (!is_beyond(c, &part))
				rc = put(c, &part, attr);
		}
		return rc;
	}
	if (c->surface->n_cells > CUT_MOST_PIECES)
		return PSR_ERR_LIMIT;
	cell = dpoint_surface_cell(c->surface);
	if (cell == NULL)
		return PSR_ERR_MEMORY;
	*cell = made;
	like.cell = (uint32_t)c->surface->n_cells - 1;
	return dpoint_surface_put(c->surface, is_good ? &local : NULL, &like);
}

/* How a piece looks. */
struct seen {
	enum { SEEN_BEYOND, SEEN_EVEN, SEEN_UNEVEN } kind; /* beyond: beyond the longest side; uneven: all of it is put */
	int is_absent;           /* an even piece: there is no surface */
	struct look_range range; /* of one that is there */
};

static int look_at(struct seen *seen, const struct cutting *c, const struct piece *p)
{
	double weight[3];
	uint64_t attr = 0;

	weigh_middle(weight, c, p);
	*seen = (struct seen){ .kind = SEEN_EVEN };
	if (c->options->look != NULL)
		seen->is_absent = !c->options->look(c->options->userdata, c->triangle, weight[1], weight[2], &attr);
	look_range_of(&seen->range, attr);
	return PSR_OK;
}

/* What was cut out ends rectangles, as what is beyond a border does. */
static int put_absent(const struct cutting *c, const struct piece *p)
{
	struct dpoint_local local;
	struct dpoint_cell *cell;

	if (c->surface->n_cells > CUT_MOST_PIECES)
		return PSR_ERR_LIMIT;
	cell = dpoint_surface_cell(c->surface);
	if (cell == NULL)
		return PSR_ERR_MEMORY;
	cell_of(cell, &local, c, p);
	cell->part = DPOINT_BEYOND;
	cell->attr = 0;
	return PSR_OK;
}

static int put_seen(const struct cutting *c, const struct piece *p, const struct seen *seen)
{
	if (seen->kind != SEEN_EVEN)
		return PSR_OK;
	if (seen->is_absent)
		return put_absent(c, p);
	return put(c, p, look_range_middle(&seen->range));
}

/* Whether all quarters are even, and look like one piece. */
static int join(struct seen *all, const struct seen quarter[4], int most)
{
	*all = quarter[0];
	for (int i = 1; i < 4 && all->kind == SEEN_EVEN; i++) {
		if (quarter[i].kind == SEEN_BEYOND)
			continue;
		if (quarter[i].kind == SEEN_UNEVEN || quarter[i].is_absent != all->is_absent)
			all->kind = SEEN_UNEVEN;
		look_range_join(&all->range, &quarter[i].range);
	}
	if (!all->is_absent && look_range_width(&all->range) > most)
		all->kind = SEEN_UNEVEN;
	return all->kind == SEEN_EVEN;
}

/* Looks at a piece grain by grain, and puts the largest parts of it that look even, unless it does so itself. */
static int gather(struct seen *seen, const struct cutting *c, const struct piece *p)
{
	const uint32_t half = p->size / 2;
	struct seen quarter[4];
	struct piece part[4];
	int rc = PSR_OK;

	if (is_beyond(c, p)) {
		*seen = (struct seen){ .kind = SEEN_BEYOND };
		return PSR_OK;
	}
	if (p->size == c->units)
		return look_at(seen, c, p);
	for (uint32_t i = 0; i < 4 && rc == PSR_OK; i++) {
		part[i] = (struct piece){ p->x + (i & 1) * half, p->y + (i >> 1) * half, half };
		rc = gather(&quarter[i], c, &part[i]);
	}
	if (rc != PSR_OK || join(seen, quarter, c->options->looks))
		return rc;
	for (int i = 0; i < 4 && rc == PSR_OK; i++)
		rc = put_seen(c, &part[i], &quarter[i]);
	return rc;
}

int cut(const struct cutting *c)
{
	const uint32_t size = c->grains * c->units;
	int rc = PSR_OK;

	for (uint32_t i = 0; i < c->n; i++)
		for (uint32_t j = 0; i + c->ratio * j < c->n && rc == PSR_OK; j++) {
			const struct piece piece = { i * size, j * size, size };
			struct seen seen;

			rc = gather(&seen, c, &piece);
			if (rc == PSR_OK)
				rc = put_seen(c, &piece, &seen);
		}
	return rc;
}

/* A flat rectangle around a cell of this size reaches beyond a border by less than the error. */
static double finest_of(const struct cutting *c)
{
	const struct dpoint_cover_options *cover = c->options->cover;
	const double turned = c->options->turn > 0 ? c->options->cell * TURNED : INFINITY;

	return c->view == NULL ? turned : fmin(turned, fmax(0.25 * (double)cover->error, (double)cover->slack));
}

/* A narrow triangle has fewer parts across: pieces shall not be narrow. */
static void plan_ratio(struct cutting *c, const double length[3])
{
	const double x = length[c->apex], y = length[(c->apex + 2) % 3];
	const uint32_t across = (uint32_t)fmax(fmin(ceil(fmin(x, y) / c->options->cell), c->n), 1);

	c->along = (c->apex + 1) % 3;
	c->ratio = 1;
	if (ceil(fmax(x, y) / c->options->cell) < 2 * across)
		return;
	c->along = (c->apex + (x < y ? 2 : 1)) % 3;
	c->ratio = (c->n + across - 1) / across;
	c->n = across * c->ratio;
}

static void plan_turn(struct cutting *c, double most)
{
	double sine;

	psr_sincos(fmin(c->options->turn, 3), &sine, &c->least_cosine);
	c->least_turned = UINT32_MAX;
	if (c->options->turn > 0 && most > 0)
		c->least_turned = (uint32_t)fmin(c->options->cell * TURNED / most * units_of(c), MOST_UNITS);
}

double cut_plan(struct cutting *c, unsigned is_open)
{
	const double cell = c->options->cell, grain = c->options->grain_of != NULL ? c->options->grain_of[c->material] : 0;
	double length[3], most = 0, followed = -1, n;

	c->side = c->apex = 0;
	for (int i = 0; i < 3; i++) {
		double along[3], rank;

		v3d_sub(along, c->corner[(i + 1) % 3]->at, c->corner[i]->at);
		length[i] = v3d_length(along);
		rank = length[i] + (is_open >> i & 1 ? 1e30 : 0);
		if (length[i] > most) {
			most = length[i];
			c->apex = (i + 2) % 3;
		}
		if (rank > followed) {
			followed = rank;
			c->side = i;
		}
	}
	n = fmax(ceil(most / cell), 1);
	c->n = (uint32_t)fmin(n, CUT_MOST_PARTS);
	plan_ratio(c, length);
	c->grains = 1;
	while (grain > 0 && c->n * c->grains < CUT_MOST_PARTS && most / ((double)c->n * c->grains) > 1.5 * grain)
		c->grains *= 2;
	c->units = 1;
	while (units_of(c) < MOST_UNITS && most / units_of(c) > finest_of(c))
		c->units *= 2;
	plan_turn(c, most);
	return grain > 0 ? fmax(n, ceil(most / (3 * grain))) : n;
}

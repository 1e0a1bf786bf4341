#include "mesh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "base/vec.h"
#include "corners.h"

#define MOST_PIECES (1u << 28)
#define MOST_CUT 4096 /* parts of a side */

struct cutting {
	struct dpoint_surface *surface;
	const struct dpoint_mesh_options *options;
	const struct corner *corner[3];
	uint32_t triangle, material, n; /* n: parts of each side */
	float delta;
	int side;             /* the one that directions follow where any would do */
};

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

/* Between the corners: the normal that shading has, and the mean of their second forms, seen in its tangent plane. */
static int local_at(struct dpoint_local *local, const struct cutting *c, const double weight[3])
{
	double t[6] = { 0 }, normal[3] = { 0, 0, 0 }, along[2][3];

	place_at(local->at, c, weight);
	for (int i = 0; i < 3; i++) {
		v3d_add_scaled(normal, normal, weight[i], c->corner[i]->normal);
		for (int k = 0; k < 6; k++)
			t[k] += weight[i] * c->corner[i]->tensor[k];
	}
	if (v3d_normalize(normal, normal) == 0)
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

/* A piece: corners at (i, j) in parts of the sides, i + j <= n. */
static int put_piece(const struct cutting *c, const int at[3][2])
{
	const double u = (double)(at[0][0] + at[1][0] + at[2][0]) / (3 * c->n);
	const double v = (double)(at[0][1] + at[1][1] + at[2][1]) / (3 * c->n);
	struct dpoint_candidate like = { .delta = { c->delta, c->delta }, .part = c->material };
	struct dpoint_cell *cell;
	struct dpoint_local local;
	int is_good;

	if (c->options->look != NULL && !c->options->look(c->options->userdata, c->triangle, u, v, &like.point.attr))
		return PSR_OK;
	cell = dpoint_surface_cell(c->surface);
	if (cell == NULL)
		return PSR_ERR_MEMORY;
	for (int p = 0; p < 3; p++) {
		const double b = (double)at[p][0] / c->n, d = (double)at[p][1] / c->n;
		double place[3];

		place_at(place, c, (const double[3]){ 1 - b - d, b, d });
		for (int k = 0; k < 3; k++)
			cell->corner[p][k] = (float)place[k];
	}
	memcpy(cell->corner[3], cell->corner[2], sizeof cell->corner[3]);
	memset(cell->normal, 0, sizeof cell->normal);
	cell->part = c->material;
	cell->attr = like.point.attr;
	is_good = local_at(&local, c, (const double[3]){ 1 - u - v, u, v });
	for (int k = 0; k < 3 && is_good; k++)
		cell->normal[k] = (float)local.axis[2][k];
	like.cell = (uint32_t)c->surface->n_cells - 1;
	return dpoint_surface_put(c->surface, is_good ? &local : NULL, &like);
}

static int cut(const struct cutting *c)
{
	const int n = (int)c->n;
	int rc = PSR_OK;

	for (int i = 0; i < n; i++)
		for (int j = 0; i + j < n && rc == PSR_OK; j++) {
			rc = put_piece(c, (const int[3][2]){ { i, j }, { i + 1, j }, { i, j + 1 } });
			if (rc == PSR_OK && i + j + 1 < n)
				rc = put_piece(c, (const int[3][2]){ { i + 1, j }, { i + 1, j + 1 }, { i, j + 1 } });
		}
	return rc;
}

/* A strip beside an open edge, in the triangle's plane, as wide as a cell. */
static int put_strip(const struct cutting *c, int side)
{
	const struct corner *a = c->corner[side], *b = c->corner[(side + 1) % 3], *other = c->corner[(side + 2) % 3];
	double along[3], in[3], out[3], width = c->options->cell;

	v3d_sub(along, b->at, a->at);
	v3d_sub(in, other->at, a->at);
	v3d_add_scaled(out, in, -v3d_dot(in, along) / v3d_dot(along, along), along);
	if (!(v3d_dot(along, along) > 0) || v3d_normalize(out, out) == 0)
		return PSR_OK;
	for (uint32_t i = 0; i < c->n; i++) {
		struct dpoint_cell *cell = dpoint_surface_cell(c->surface);

		if (cell == NULL)
			return PSR_ERR_MEMORY;
		for (int p = 0; p < 4; p++) {
			const double part = (double)(i + (p == 1 || p == 2)) / c->n, away = p < 2 ? 0 : -width;

			for (int k = 0; k < 3; k++)
				cell->corner[p][k] = (float)(a->at[k] + part * along[k] + away * out[k]);
		}
		for (int k = 0; k < 3; k++)
			cell->normal[k] = (float)a->normal[k];
		cell->part = DPOINT_BEYOND;
		cell->attr = 0;
	}
	return PSR_OK;
}

/* Returns the length of the longest side; follows that one, or the longest open one. */
static double measure_sides(struct cutting *c, unsigned is_open)
{
	double most = 0, followed = -1;

	for (int i = 0; i < 3; i++) {
		double along[3];

		v3d_sub(along, c->corner[(i + 1) % 3]->at, c->corner[i]->at);
		const double length = v3d_length(along), rank = length + (is_open >> i & 1 ? 1e30 : 0);

		most = fmax(most, length);
		if (rank > followed) {
			followed = rank;
			c->side = i;
		}
	}
	return most;
}

int dpoint_sample_mesh(struct dpoint_surface *surface, const struct psr_mesh *mesh,
                       const struct dpoint_mesh_options *options, struct psr_error *err)
{
	struct cutting c = { .surface = surface, .options = options };
	struct corners corners;
	uint64_t n_pieces = 0;
	double n_parts, size;
	int rc = corners_init(&corners, mesh, options);

	for (uint32_t t = 0; t < mesh->n_triangles && rc == PSR_OK; t++) {
		for (int i = 0; i < 3; i++)
			c.corner[i] = &corners.corner[corners.of[3 * (size_t)t + (size_t)i]];
		c.triangle = t;
		c.material = mesh->triangle_material[t];
		c.delta = options->delta_of != NULL ? options->delta_of[c.material] : options->delta;
		size = options->delta_of != NULL ? fmin(options->cell, (double)c.delta) : options->cell;
		n_parts = fmax(ceil(measure_sides(&c, corners.is_open[t]) / size), 1);
		c.n = (uint32_t)fmin(n_parts, MOST_CUT);
		n_pieces += (uint64_t)c.n * c.n;
		if (n_parts > MOST_CUT || n_pieces > MOST_PIECES)
			rc = psr_fail(err, PSR_ERR_LIMIT,
			              "the mesh has more than %u pieces of %g, or a triangle has sides of more than %d; make them"
			              " larger", MOST_PIECES, size, MOST_CUT);
		if (rc == PSR_OK)
			rc = cut(&c);
		for (int i = 0; i < 3 && rc == PSR_OK; i++)
			if (corners.is_open[t] >> i & 1)
				rc = put_strip(&c, i);
	}
	surface->n_bad += corners.n_bad;
	corners_fini(&corners);
	return rc == PSR_ERR_MEMORY ? psr_fail(err, rc, "no memory for the pieces of the mesh") : rc;
}

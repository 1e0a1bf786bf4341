#include "trimmed.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "trim_grid.h"

#define MOST_SIDES 8       /* of a triangle that four lines cut */
#define NO_AREA 1e-9       /* of a cell of the grid */
#define LOOSE 1.02         /* a rectangle is longer than what it has to cover by this: words turn it by pi / 256 */
#define MOST_LOOKS (1u << 28) /* cells that triangles are looked at in */

struct sampling {
	struct dpoint_surface *surface;
	const struct psr_patch *patch;
	const struct dpoint_trimmed_options *options;
	struct trim_grid grid;
	uint64_t looks;
};

/* A convex part of the plane of parameters. */
struct polygon {
	int n;
	double at[MOST_SIDES][2];
};

/* Leaves what is on one side of a line: x, or y, at least `limit`, or at most. */
static void clip(struct polygon *p, int k, double limit, double sign)
{
	struct polygon out = { .n = 0 };

	for (int i = 0; i < p->n; i++) {
		const double *a = p->at[i], *b = p->at[(i + 1) % p->n];
		const double x = sign * (a[k] - limit), y = sign * (b[k] - limit);

		if (x >= 0 && out.n < MOST_SIDES)
			memcpy(out.at[out.n++], a, sizeof *out.at);
		if ((x < 0) != (y < 0) && x != 0 && y != 0 && out.n < MOST_SIDES) {
			out.at[out.n][k] = limit;
			out.at[out.n][1 - k] = a[1 - k] + x / (x - y) * (b[1 - k] - a[1 - k]);
			out.n++;
		}
	}
	*p = out;
}

static double area_of(const struct polygon *p)
{
	double area = 0;

	for (int i = 2; i < p->n; i++)
		area += 0.5 * ((p->at[i - 1][0] - p->at[0][0]) * (p->at[i][1] - p->at[0][1]) -
		               (p->at[i - 1][1] - p->at[0][1]) * (p->at[i][0] - p->at[0][0]));
	return area;
}

/* ---- cells ---- */

int dpoint_trimmed_refuse(double cell, struct psr_error *err)
{
	return psr_fail(err, PSR_ERR_LIMIT, "the surface would be covered in more than %u pieces of %g; build blocks",
	                TRIM_MOST_CELLS, cell);
}

/* Turns the frame until x is along a direction, as seen on the tangent plane. */
static void turn_along(struct dpoint_local *local, const double direction[3])
{
	const double a = local->shape[0], b = local->shape[1], d = local->shape[2];
	double c = v3d_dot(direction, local->axis[0]), s = v3d_dot(direction, local->axis[1]), x[3];
	const double length = sqrt(c * c + s * s);

	if (!(length > 1e-6 * v3d_length(direction)))
		return;
	c /= length;
	s /= length;
	v3d_scale(x, local->axis[0], c);
	v3d_add_scaled(local->axis[0], x, s, local->axis[1]);
	v3d_cross(local->axis[1], local->axis[2], local->axis[0]);
	local->shape[0] = a * c * c + 2 * b * c * s + d * s * s;
	local->shape[1] = (d - a) * c * s + b * (c * c - s * s);
	local->shape[2] = a * s * s - 2 * b * c * s + d * c * c;
}

/* A piece of the surface, and where its corners are. */
struct piece {
	uint32_t in[2]; /* cell of the grid */
	double uv[4][2], middle[2];
	float corner[4][3];
};

/* Finds the rectangle around a piece: half of its sides, of a class, and where its middle is, by three of the
 * corners. What a class is too long by is on the side that is away from the rim, which x of the shape runs
 * along, with the surface on its left. */
static void find_rectangle(float half[2], double uv[2], const struct piece *piece, const struct dpoint_local *local)
{
	double low[2] = { INFINITY, INFINITY }, high[2] = { -INFINITY, -INFINITY }, seen[4][2], to[2], area = 0, part[2];
	int first = 0, second = 0;
	struct dpoint point;
	float side[2][3];

	half[0] = half[1] = 0;
	if (dpoint_make(&point, local) == DPOINT_BAD)
		return;
	memcpy(side[0], point.u, sizeof *side);
	v3f_cross(side[1], point.normal, point.u);
	for (int c = 0; c < 4; c++)
		for (int k = 0; k < 2; k++) {
			float away[3];

			v3f_sub(away, piece->corner[c], piece->corner[0]);
			seen[c][k] = (double)v3f_dot(away, side[k]);
			low[k] = fmin(low[k], seen[c][k]);
			high[k] = fmax(high[k], seen[c][k]);
		}
	for (int c = 1; c < 3; c++)
		for (int d = c + 1; d < 4; d++) {
			const double found = seen[c][0] * seen[d][1] - seen[c][1] * seen[d][0];

			if (fabs(found) > fabs(area)) {
				area = found;
				first = c;
				second = d;
			}
		}
	if (!(fabs(area) > 1e-3 * (high[0] - low[0]) * (high[1] - low[1])))
		return;
	for (int k = 0; k < 2; k++) {
		const double need = LOOSE * 0.5 * (high[k] - low[k]), inside = side[k][0] * local->axis[1][0] +
		                    side[k][1] * local->axis[1][1] + side[k][2] * local->axis[1][2];
		const unsigned class = dpoint_delta_class((float)fmin(need, 0.8));

		/* Not the next class: fitting may bring it to that, where it ends at the rim. */
		half[k] = dpoint_delta_of_class(class > 1 ? class - 2 : 0);
		to[k] = 0.5 * (low[k] + high[k]) + inside * (half[k] - need);
	}
	part[0] = (to[0] * seen[second][1] - to[1] * seen[second][0]) / area;
	part[1] = (to[1] * seen[first][0] - to[0] * seen[first][1]) / area;
	for (int k = 0; k < 2; k++)
		uv[k] = piece->uv[0][k] + part[0] * (piece->uv[first][k] - piece->uv[0][k]) +
		        part[1] * (piece->uv[second][k] - piece->uv[0][k]);
}

/* Beside a rim, candidates are along it, where any direction would do: so they reach over it least. One that may be as
 * large as all becomes long and thin where the rim is hollow, and need not cover the piece: others are little larger
 * than that. */
static int put_beside(struct sampling *s, const struct piece *piece, const struct dpoint_candidate *like,
                      const struct dpoint_local *middle, const double along[3])
{
	static const float larger[] = { INFINITY, 3, 1 };
	struct dpoint_local local = *middle;
	double uv[2] = { piece->middle[0], piece->middle[1] };
	float half[2];
	int rc = PSR_OK;

	turn_along(&local, along);
	find_rectangle(half, uv, piece, &local);
	if (!trim_local(&local, &s->grid, piece->in, uv, s->options))
		local = *middle;
	turn_along(&local, along);
	for (size_t i = 0; i < sizeof larger / sizeof *larger && rc == PSR_OK; i++) {
		struct dpoint_candidate one = *like;

		for (int k = 0; k < 2 && half[k] > 0; k++)
			one.delta[k] = fminf(dpoint_delta_of_class(dpoint_delta_class(larger[i] * half[k])), like->delta[k]);
		rc = dpoint_surface_put(s->surface, &local, &one);
	}
	return rc;
}

static int is_finite(const struct piece *piece)
{
	float sum = 0;

	for (int c = 0; c < 4; c++)
		for (int k = 0; k < 3; k++)
			sum += 0 * piece->corner[c][k];
	return sum == 0;
}

/* A cell, and its candidate, or candidates. */
static int put(struct sampling *s, const struct piece *piece)
{
	const struct dpoint_trimmed_options *o = s->options;
	struct dpoint_candidate like = { .delta = { o->delta, o->delta }, .part = s->patch->material, .point.attr = o->attr,
		                             .cell = (uint32_t)s->surface->n_cells };
	struct dpoint_cell *cell;
	struct dpoint_local local;
	double along[3];
	int is_good;

	if (!is_finite(piece)) {
		s->surface->n_bad++;
		return PSR_OK;
	}
	cell = dpoint_surface_cell(s->surface);
	if (cell == NULL)
		return PSR_ERR_MEMORY;
	if (s->surface->n_cells > TRIM_MOST_CELLS)
		return PSR_ERR_LIMIT;
	is_good = trim_local(&local, &s->grid, piece->in, piece->middle, o);
	memcpy(cell->corner, piece->corner, sizeof cell->corner);
	cell->part = s->patch->material;
	cell->attr = o->attr;
	for (int k = 0; k < 3; k++)
		cell->normal[k] = is_good ? (float)local.axis[2][k] : 0;
	if (is_good && trim_along(along, &s->grid, piece->in, local.at))
		return put_beside(s, piece, &like, &local, along);
	return dpoint_surface_put(s->surface, is_good ? &local : NULL, &like);
}

static void place(float out[3], const struct sampling *s, const uint32_t cell[2], const double uv[2])
{
	double at[3];

	trim_place(at, &s->grid, cell, uv, s->options);
	for (int k = 0; k < 3; k++)
		out[k] = (float)at[k];
}

/* A convex polygon within a cell of the grid, by quadrilaterals. */
static int put_polygon(struct sampling *s, const struct polygon *p, const uint32_t at[2])
{
	int rc = PSR_OK;

	for (int i = 1; i + 1 < p->n && rc == PSR_OK; i += 2) {
		const int n = i + 2 < p->n ? 4 : 3;
		const int corner[4] = { 0, i, i + 1, n == 4 ? i + 2 : i + 1 };
		struct piece piece = { .in = { at[0], at[1] } };

		for (int c = 0; c < 4; c++) {
			memcpy(piece.uv[c], p->at[corner[c]], sizeof piece.uv[c]);
			place(piece.corner[c], s, at, piece.uv[c]);
			for (int k = 0; k < 2 && c < n; k++)
				piece.middle[k] += piece.uv[c][k] / n;
		}
		rc = put(s, &piece);
	}
	return rc;
}

/* ---- what is inside ---- */

/* Cells of the grid that the triangle meets: inside, or cut if a rim may be there. */
static int put_triangle(struct sampling *s, uint32_t t)
{
	const uint32_t *corner = s->patch->triangle[t];
	const struct trim_axis *x = &s->grid.axis[0], *y = &s->grid.axis[1];
	struct polygon all = { .n = 3 };
	int rc = PSR_OK;

	for (int i = 0; i < 3; i++)
		memcpy(all.at[i], s->patch->corner[corner[i]], sizeof *all.at);
	for (uint32_t i = trim_find(x, fmin(fmin(all.at[0][0], all.at[1][0]), all.at[2][0])); i < x->n && rc == PSR_OK; i++) {
		struct polygon column = all;
		double low = INFINITY, high = -INFINITY;

		if (x->line[i] >= fmax(fmax(all.at[0][0], all.at[1][0]), all.at[2][0]))
			break;
		clip(&column, 0, x->line[i], 1);
		clip(&column, 0, x->line[i + 1], -1);
		for (int k = 0; k < column.n; k++) {
			low = fmin(low, column.at[k][1]);
			high = fmax(high, column.at[k][1]);
		}
		if (++s->looks > MOST_LOOKS)
			return PSR_ERR_LIMIT;
		for (uint32_t j = trim_find(y, low); j < y->n && y->line[j] < high && rc == PSR_OK; j++) {
			uint8_t *state = &s->grid.state[(size_t)i * y->n + j];
			struct polygon part = column;

			if (++s->looks > MOST_LOOKS)
				return PSR_ERR_LIMIT;
			if (*state != TRIM_RIM) {
				*state = TRIM_IN;
				continue;
			}
			clip(&part, 1, y->line[j], 1);
			clip(&part, 1, y->line[j + 1], -1);
			if (area_of(&part) > NO_AREA * (x->line[i + 1] - x->line[i]) * (y->line[j + 1] - y->line[j]))
				rc = put_polygon(s, &part, (const uint32_t[2]){ i, j });
		}
	}
	return rc;
}

/* Whether one of the four cells around a corner is inside. */
static int is_at_inside(const struct trim_grid *grid, uint32_t i, uint32_t j)
{
	const uint32_t n = grid->axis[0].n, m = grid->axis[1].n;
	int is_inside = 0;

	for (uint32_t x = i > 0 ? i - 1 : 0; x <= i && x < n; x++)
		for (uint32_t y = j > 0 ? j - 1 : 0; y <= j && y < m; y++)
			is_inside |= grid->state[(size_t)x * m + y] == TRIM_IN;
	return is_inside;
}

/* Cells inside, with two lines of corners at a time. */
static int put_inside(struct sampling *s)
{
	const struct trim_axis *x = &s->grid.axis[0], *y = &s->grid.axis[1];
	float (*corner)[3] = malloc(2 * ((size_t)y->n + 1) * sizeof *corner);
	int rc = corner != NULL ? PSR_OK : PSR_ERR_MEMORY;

	for (uint32_t i = 0; i <= x->n && rc == PSR_OK; i++) {
		float (*row)[3] = corner + (i & 1) * ((size_t)y->n + 1), (*before)[3] = corner + (~i & 1) * ((size_t)y->n + 1);

		for (uint32_t j = 0; j <= y->n; j++)
			if (is_at_inside(&s->grid, i, j))
				place(row[j], s, (const uint32_t[2]){ i < x->n ? i : i - 1, j < y->n ? j : j - 1 },
				      (const double[2]){ x->line[i], y->line[j] });
		for (uint32_t j = 0; j < y->n && i > 0 && rc == PSR_OK; j++) {
			const double uv[4][2] = { { x->line[i - 1], y->line[j] }, { x->line[i], y->line[j] },
				                      { x->line[i], y->line[j + 1] }, { x->line[i - 1], y->line[j + 1] } };
			struct piece piece = { .in = { i - 1, j } };

			if (s->grid.state[(size_t)(i - 1) * y->n + j] != TRIM_IN)
				continue;
			memcpy(piece.uv, uv, sizeof piece.uv);
			piece.middle[0] = 0.5 * (x->line[i - 1] + x->line[i]);
			piece.middle[1] = 0.5 * (y->line[j] + y->line[j + 1]);
			memcpy(piece.corner[0], before[j], sizeof *piece.corner);
			memcpy(piece.corner[1], row[j], sizeof *piece.corner);
			memcpy(piece.corner[2], row[j + 1], sizeof *piece.corner);
			memcpy(piece.corner[3], before[j + 1], sizeof *piece.corner);
			rc = put(s, &piece);
		}
	}
	free(corner);
	return rc;
}

int dpoint_sample_trimmed(struct dpoint_surface *surface, const struct psr_patch *patch,
                          const struct dpoint_trimmed_options *options, struct psr_error *err)
{
	struct sampling s = { surface, patch, options, { .state = NULL }, 0 };
	int rc = trim_init(&s.grid, patch, options, err);

	if (rc != PSR_OK || s.grid.axis[0].n == 0 || s.grid.axis[1].n == 0) {
		trim_fini(&s.grid);
		return rc;
	}
	for (uint32_t t = 0; t < patch->n_triangles && rc == PSR_OK; t++)
		rc = put_triangle(&s, t);
	if (rc == PSR_OK)
		rc = put_inside(&s);
	if (rc == PSR_OK)
		rc = trim_put_rims(surface, &s.grid, patch, options);
	if (rc == PSR_OK && options->facet > 0)
		rc = trim_put_facets(surface, &s.grid, patch, options);
	trim_fini(&s.grid);
	if (rc == PSR_ERR_LIMIT)
		return dpoint_trimmed_refuse(options->cell, err);
	return rc == PSR_ERR_MEMORY ? psr_fail(err, rc, "no memory for the pieces of a face") : rc;
}

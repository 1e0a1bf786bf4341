#include "surfaces.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/vec.h"
#include "sweep.h"

#define QUARTER_PI 0.78539816339744830962

void surface_turn(uint32_t k, uint32_t n, double *c, double *s)
{
	uint64_t eighths = (uint64_t)(k % n) * 8;
	uint64_t octant = eighths / n, rest = eighths % n;
	double near_c, near_s, t;

	if (octant & 1)
		rest = n - rest;
	psr_sincos(QUARTER_PI * (double)rest / n, &near_s, &near_c);
	if (rest == n)
		near_s = near_c;
	if ((octant + 1) & 2) {
		t = near_c;
		near_c = near_s;
		near_s = t;
	}
	*c = octant >= 2 && octant < 6 ? -near_c : near_c;
	*s = octant >= 4 ? -near_s : near_s;
}

/* Sums are paired from outside inwards, so that a curve and its reverse agree to the last bit. */
static void bezier(const double *const control[4], int dim, double s, double t, double *point, double *slope)
{
	double b0 = s * s * s, b1 = 3 * (s * s) * t, b2 = 3 * (t * t) * s, b3 = t * t * t;

	for (int k = 0; k < dim; k++) {
		double p0 = control[0][k], p1 = control[1][k], p2 = control[2][k], p3 = control[3][k];

		point[k] = (b0 * p0 + b3 * p3) + (b1 * p1 + b2 * p2);
		if (slope != NULL)
			slope[k] = 3 * ((s * s * (p1 - p0) + t * t * (p3 - p2)) + 2 * (s * t) * (p2 - p1));
	}
}

void surface_bezier(const double *const control[4], int dim, uint32_t i, uint32_t n, double *point, double *slope)
{
	bezier(control, dim, (double)(n - i) / n, (double)i / n, point, slope);
}

struct surface_profile surface_line(double r0, double y0, double r1, double y1, uint32_t steps, uint32_t material)
{
	struct surface_profile line = {
		.p = { { r0, y0 }, { r0 + (r1 - r0) / 3, y0 + (y1 - y0) / 3 },
		       { r1 - (r1 - r0) / 3, y1 - (y1 - y0) / 3 }, { r1, y1 } },
		.from = 0, .to = 1, .steps = steps, .material = material,
	};

	return line;
}

/* The profile's direction where its own derivative vanishes: towards, or from, the nearest other control point. */
static void profile_slope(const struct surface_profile *piece, double t, double slope[2])
{
	for (int k = 1; k < 4 && slope[0] == 0 && slope[1] == 0; k++) {
		const double *a = t < 0.5 ? piece->p[0] : piece->p[3 - k];
		const double *b = t < 0.5 ? piece->p[k] : piece->p[3];

		slope[0] = b[0] - a[0];
		slope[1] = b[1] - a[1];
	}
}

static void lathe_piece(struct shape *shape, const struct surface_profile *piece, uint32_t n, struct shape_vertex *grid)
{
	const double *const control[4] = { piece->p[0], piece->p[1], piece->p[2], piece->p[3] };
	double point[2], slope[2], c, s;
	struct shape_vertex *v = grid;

	for (uint32_t row = 0; row <= piece->steps; row++) {
		double t = row == piece->steps ? piece->to : piece->from + (piece->to - piece->from) * row / piece->steps;

		bezier(control, 2, 1 - t, t, point, slope);
		profile_slope(piece, t, slope);
		for (uint32_t col = 0; col < n; col++, v++) {
			surface_turn(col, n, &c, &s);
			v3d_set(v->p, point[0] * c, point[1], -point[0] * s);
			v3d_set(v->n, slope[1] * c, -slope[0], -slope[1] * s);
		}
	}
	shape->current = piece->material;
	shape_grid(shape, grid, piece->steps + 1, n, 0, 1);
}

void surface_lathe(struct shape *shape, const struct surface_profile *pieces, uint32_t n_pieces, uint32_t n)
{
	for (uint32_t i = 0; i < n_pieces; i++) {
		struct shape_vertex *grid = shape_grid_alloc(shape, pieces[i].steps + 1, n);

		if (grid == NULL)
			return;
		lathe_piece(shape, &pieces[i], n, grid);
		free(grid);
	}
}

void surface_rod(struct shape *shape, const double a[3], double ra, const double b[3], double rb, uint32_t n)
{
	uint32_t first = shape->n_vertices, material = shape->current;
	double axis[3], length;

	v3d_sub(axis, b, a);
	length = v3d_length(axis);
	assert(length > 0);
	const struct surface_profile pieces[] = {
		surface_line(0, 0, ra, 0, 1, material),
		surface_line(ra, 0, rb, length, 1, material),
		surface_line(rb, length, 0, length, 1, material),
	};
	surface_lathe(shape, pieces, 3, n);
	sweep_along(shape, first, a, b);
}

void surface_torus(struct shape *shape, double major, double minor, double y, uint32_t n_major, uint32_t n_minor)
{
	struct shape_vertex *grid = shape_grid_alloc(shape, n_minor, n_major), *v = grid;
	double c, s, minor_c, minor_s;

	if (grid == NULL)
		return;
	for (uint32_t row = 0; row < n_minor; row++) {
		surface_turn(row, n_minor, &minor_c, &minor_s);
		double r = major + minor * minor_c;
		for (uint32_t col = 0; col < n_major; col++, v++) {
			surface_turn(col, n_major, &c, &s);
			v3d_set(v->p, r * c, y + minor * minor_s, -r * s);
			v3d_set(v->n, minor_c * c, minor_s, -minor_c * s);
		}
	}
	shape_grid(shape, grid, n_minor, n_major, 1, 1);
	free(grid);
}

void surface_box(struct shape *shape, const double half[3])
{
	struct shape_vertex face[4];

	for (int axis = 0; axis < 3; axis++) {
		for (int sign = -1; sign <= 1; sign += 2) {
			/* columns x rows = the axis, for the positive side; the negative one has them swapped */
			int col_axis = (axis + (sign > 0 ? 1 : 2)) % 3, row_axis = (axis + (sign > 0 ? 2 : 1)) % 3;
			memset(face, 0, sizeof face);
			for (int i = 0; i < 4; i++) {
				face[i].p[axis] = sign * half[axis];
				face[i].p[col_axis] = i & 1 ? half[col_axis] : -half[col_axis];
				face[i].p[row_axis] = i & 2 ? half[row_axis] : -half[row_axis];
				face[i].n[axis] = sign;
			}
			shape_grid(shape, face, 2, 2, 0, 0);
		}
	}
}

/* One direction of a patch at i/n: four curves across become the control points of one. */
static void patch_side(const double control[4][4][3], int along_rows, uint32_t i, uint32_t n, double point[4][3],
                       double slope[4][3])
{
	for (int k = 0; k < 4; k++) {
		const double *const c[4] = {
			along_rows ? control[0][k] : control[k][0], along_rows ? control[1][k] : control[k][1],
			along_rows ? control[2][k] : control[k][2], along_rows ? control[3][k] : control[k][3],
		};

		surface_bezier(c, 3, i, n, point[k], slope[k]);
	}
}

void surface_patch(struct shape *shape, const double control[4][4][3], uint32_t rows, uint32_t cols)
{
	struct shape_vertex *grid = shape_grid_alloc(shape, rows + 1, cols + 1), *v = grid;
	double at[4][3], across[4][3], by_row[3], by_col[3], mixed[3];

	if (grid == NULL)
		return;
	for (uint32_t i = 0; i <= rows; i++) {
		patch_side(control, 1, i, rows, at, across);
		const double *const line[4] = { at[0], at[1], at[2], at[3] };
		const double *const change[4] = { across[0], across[1], across[2], across[3] };
		for (uint32_t j = 0; j <= cols; j++, v++) {
			surface_bezier(line, 3, j, cols, v->p, by_col);
			surface_bezier(change, 3, j, cols, by_row, mixed);
			if (v3d_dot(by_col, by_col) == 0) {
				/* a pole: a step away from it by_col is the mixed derivative times that step */
				v3d_scale(by_col, mixed, i == 0 ? 1 : -1);
			} else if (v3d_dot(by_row, by_row) == 0) {
				v3d_scale(by_row, mixed, j == 0 ? 1 : -1);
			}
			v3d_cross(v->n, by_col, by_row);
		}
	}
	shape_grid(shape, grid, rows + 1, cols + 1, 0, 0);
	free(grid);
}

#include "sweep.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "surfaces.h"

#define CAP 4 /* rows of a tube's round end */

void sweep_angle(double turns, double *c, double *s)
{
	surface_turn((uint32_t)((turns - floor(turns)) * 1048576 + 0.5), 1048576, c, s);
}

void sweep_frame(const double axis[3], double turn[3][3])
{
	double helper[3] = { 0, 0, 0 }, x[3], z[3];
	int least = 0;

	for (int k = 1; k < 3; k++) {
		if (fabs(axis[k]) < fabs(axis[least]))
			least = k;
	}
	helper[least] = 1;
	v3d_cross(x, axis, helper);
	v3d_normalize(x, x);
	v3d_cross(z, x, axis);
	for (int k = 0; k < 3; k++)
		v3d_set(turn[k], x[k], axis[k], z[k]);
}

void sweep_along(struct shape *shape, uint32_t first, const double a[3], const double b[3])
{
	double axis[3], turn[3][3];

	v3d_sub(axis, b, a);
	v3d_normalize(axis, axis);
	sweep_frame(axis, turn);
	shape_move(shape, first, turn, a);
}

static int is_pole(const struct shape_vertex *row, uint32_t n_cols)
{
	for (uint32_t j = 1; j < n_cols; j++) {
		if (row[j].p[0] != row[0].p[0] || row[j].p[1] != row[0].p[1] || row[j].p[2] != row[0].p[2])
			return 0;
	}
	return 1;
}

/* One normal for the whole pole, unless it is the tip of something so slender that its sides face away from that. */
static void join_pole(struct shape_vertex *row, uint32_t n_cols)
{
	double sum[3] = { 0, 0, 0 }, length;

	if (!is_pole(row, n_cols))
		return;
	for (uint32_t j = 0; j < n_cols; j++)
		v3d_add(sum, sum, row[j].n);
	length = v3d_length(sum);
	for (uint32_t j = 0; j < n_cols; j++) {
		if (v3d_dot(sum, row[j].n) < 0.5 * length * v3d_length(row[j].n))
			return;
	}
	for (uint32_t j = 0; j < n_cols; j++)
		v3d_set(row[j].n, sum[0], sum[1], sum[2]);
}

void sweep_normals(struct shape_vertex *grid, uint32_t n_rows, uint32_t n_cols, int wrap_rows, int wrap_cols)
{
	for (uint32_t i = 0; i < n_rows * n_cols; i++)
		v3d_set(grid[i].n, 0, 0, 0);
	for (uint32_t i = 0; i + !wrap_rows < n_rows; i++) {
		struct shape_vertex *low = grid + (size_t)i * n_cols, *high = grid + (size_t)((i + 1) % n_rows) * n_cols;

		for (uint32_t j = 0; j + !wrap_cols < n_cols; j++) {
			uint32_t next = (j + 1) % n_cols;
			double rising[3], falling[3], n[3];

			v3d_sub(rising, high[next].p, low[j].p);
			v3d_sub(falling, high[j].p, low[next].p);
			v3d_cross(n, rising, falling);
			v3d_add(low[j].n, low[j].n, n);
			v3d_add(low[next].n, low[next].n, n);
			v3d_add(high[j].n, high[j].n, n);
			v3d_add(high[next].n, high[next].n, n);
		}
	}
	if (!wrap_rows) {
		join_pole(grid, n_cols);
		join_pole(grid + (size_t)(n_rows - 1) * n_cols, n_cols);
	}
}

void sweep_band(struct shape *shape, const struct sweep_grid *grid, uint32_t first, uint32_t last)
{
	uint32_t n = last - first + 1;
	struct shape_vertex *band = shape_grid_alloc(shape, grid->n_rows, n);

	if (band == NULL)
		return;
	for (uint32_t i = 0; i < grid->n_rows; i++) {
		for (uint32_t j = 0; j < n; j++)
			band[(size_t)i * n + j] = grid->vertex[(size_t)i * grid->n_cols + (first + j) % grid->n_cols];
	}
	shape_grid(shape, band, grid->n_rows, n, grid->wrap_rows, 0);
	free(band);
}

void sweep_surface(struct shape *shape, sweep_function *at, const void *context, uint32_t quads_v, uint32_t quads_u,
                   int wrap_u)
{
	uint32_t rows = quads_v + 1, cols = wrap_u ? quads_u : quads_u + 1, first = shape->n_vertices;
	struct shape_vertex *grid = shape_grid_alloc(shape, rows, cols);

	if (grid == NULL)
		return;
	for (uint32_t i = 0; i < rows * cols; i++)
		at((double)(i % cols) / quads_u, (double)(i / cols) / quads_v, grid[i].p, context);
	sweep_normals(grid, rows, cols, 0, wrap_u);
	shape_grid(shape, grid, rows, cols, 0, wrap_u);
	for (uint32_t i = 0; i < rows * cols && !shape->failed; i++) {
		shape->uv[first + i][0] = (float)((double)(i % cols) / quads_u);
		shape->uv[first + i][1] = (float)((double)(i / cols) / quads_v);
	}
	free(grid);
}

/* A ring of the tube; x is at right angles to the tangent. */
struct ring {
	uint32_t sides;
	double center[3], tangent[3], x[3], radius;
};

/* Counter-clockwise around the tangent. */
static void put_ring(struct shape_vertex *row, const struct ring *ring)
{
	double y[3], c, s;

	v3d_cross(y, ring->tangent, ring->x);
	for (uint32_t j = 0; j < ring->sides; j++) {
		surface_turn(j, ring->sides, &c, &s);
		v3d_add_scaled(row[j].p, ring->center, ring->radius * c, ring->x);
		v3d_add_scaled(row[j].p, row[j].p, ring->radius * s, y);
		/* a pole's places are the same to the last bit */
		if (ring->radius == 0)
			v3d_set(row[j].p, ring->center[0], ring->center[1], ring->center[2]);
	}
}

/* The rows of a round end beyond the ring, the outermost, a point, first (sign -1) or last. */
static void put_cap(struct shape_vertex *rows, const struct ring *ring, int sign)
{
	struct ring row = *ring;
	double c, s;

	for (uint32_t k = 0; k < CAP; k++) {
		surface_turn(sign < 0 ? k : k + 1, 4 * CAP, &c, &s);
		v3d_add_scaled(row.center, ring->center, ring->radius * (sign < 0 ? -c : s), ring->tangent);
		row.radius = ring->radius * (sign < 0 ? s : c);
		put_ring(rows + (size_t)k * ring->sides, &row);
	}
}

void sweep_tube(struct shape *shape, const double (*path)[3], const double *radius, uint32_t n, uint32_t sides)
{
	uint32_t low = radius[0] > 0 ? CAP : 0, high = radius[n - 1] > 0 ? CAP : 0;
	struct shape_vertex *grid = shape_grid_alloc(shape, low + n + high, sides);
	struct ring ring = { .sides = sides };
	double turn[3][3];

	if (grid == NULL)
		return;
	for (uint32_t i = 0; i < n; i++) {
		v3d_sub(ring.tangent, path[i + 1 < n ? i + 1 : i], path[i > 0 ? i - 1 : i]);
		v3d_normalize(ring.tangent, ring.tangent);
		if (i == 0) {
			sweep_frame(ring.tangent, turn);
			v3d_set(ring.x, turn[0][0], turn[1][0], turn[2][0]);
		}
		/* carried along the path without a twist */
		v3d_add_scaled(ring.x, ring.x, -v3d_dot(ring.x, ring.tangent), ring.tangent);
		v3d_normalize(ring.x, ring.x);
		v3d_set(ring.center, path[i][0], path[i][1], path[i][2]);
		ring.radius = radius[i];
		put_ring(grid + (size_t)(low + i) * sides, &ring);
		if (i == 0 && low)
			put_cap(grid, &ring, -1);
		if (i == n - 1 && high)
			put_cap(grid + (size_t)(low + n) * sides, &ring, 1);
	}
	sweep_normals(grid, low + n + high, sides, 0, 1);
	shape_grid(shape, grid, low + n + high, sides, 0, 1);
	free(grid);
}

void sweep_bend(struct shape *shape, const double curve[3][3], double radius, uint32_t n, uint32_t sides)
{
	double path[64][3], radii[64];

	assert(n >= 2 && n <= 64);
	for (uint32_t i = 0; i < n; i++) {
		double t = (double)i / (n - 1), s = 1 - t;

		for (int k = 0; k < 3; k++)
			path[i][k] = s * s * curve[0][k] + 2 * s * t * curve[1][k] + t * t * curve[2][k];
		radii[i] = radius;
	}
	sweep_tube(shape, (const double (*)[3])path, radii, n, sides);
}

/* A sphere whose octants are drawn apart: rows and columns where they meet are doubled. */
void sweep_block(struct shape *shape, const double center[3], const double half[3], double radius)
{
	enum { STEPS = 4, ROWS = 2 * (STEPS + 1), COLS = 4 * (STEPS + 1) };
	struct shape_vertex grid[ROWS * COLS];
	uint32_t first = shape->n_vertices;
	double c, s, across, up, inner[3];

	for (int k = 0; k < 3; k++)
		inner[k] = half[k] - radius;
	for (uint32_t i = 0; i < ROWS * COLS; i++) {
		uint32_t row = i / COLS, col = i % COLS, octant = col / (STEPS + 1), high = row > STEPS;
		uint32_t step = high ? row - STEPS - 1 : STEPS - row;
		struct shape_vertex *v = &grid[i];

		surface_turn(octant * STEPS + col % (STEPS + 1), 4 * STEPS, &c, &s);
		surface_turn(step, 4 * STEPS, &across, &up);
		v3d_set(v->n, across * c, high ? up : -up, -across * s);
		v3d_set(v->p, octant == 0 || octant == 3 ? inner[0] : -inner[0], high ? inner[1] : -inner[1],
		        octant < 2 ? -inner[2] : inner[2]);
		v3d_add_scaled(v->p, v->p, radius, v->n);
		v3d_add(v->p, v->p, center);
	}
	shape_grid(shape, grid, ROWS, COLS, 0, 1);
	for (uint32_t row = 0; row < ROWS; row += ROWS - 1) {
		uint32_t corner[4];

		for (uint32_t k = 0; k < 4; k++)
			corner[k] = first + row * COLS + (row ? k : 3 - k) * (STEPS + 1);
		shape_triangle(shape, corner[0], corner[1], corner[2]);
		shape_triangle(shape, corner[0], corner[2], corner[3]);
	}
}

void sweep_ball(struct shape *shape, const double center[3], const double half[3], uint32_t rows, uint32_t cols)
{
	uint32_t first = shape->n_vertices;
	struct shape_vertex *grid = shape_grid_alloc(shape, rows + 1, cols);
	const double m[3][3] = { { half[0], 0, 0 }, { 0, half[1], 0 }, { 0, 0, half[2] } };
	double c, s, across, up;

	if (grid == NULL)
		return;
	for (uint32_t i = 0; i < (rows + 1) * cols; i++) {
		surface_turn(i / cols, 2 * rows, &up, &across);
		surface_turn(i % cols, cols, &c, &s);
		v3d_set(grid[i].p, across * c, -up, -across * s);
		memcpy(grid[i].n, grid[i].p, sizeof grid[i].n);
	}
	shape_grid(shape, grid, rows + 1, cols, 0, 1);
	shape_transform(shape, first, m, center);
	free(grid);
}

void sweep_cone(struct shape *shape, const double a[3], double radius, const double b[3], uint32_t n)
{
	uint32_t first = shape->n_vertices, material = shape->current;
	double axis[3];

	v3d_sub(axis, b, a);
	const struct surface_profile pieces[] = {
		surface_line(0, 0, radius, 0, 1, material),
		surface_line(radius, 0, 0, v3d_length(axis), 1, material),
	};
	surface_lathe(shape, pieces, 2, n);
	sweep_along(shape, first, a, b);
}

/* More surfaces for the generators: swept, rounded, given by a function. Added with the shape's current material and
 * closed unless said otherwise. */
#ifndef MODELS_SWEEP_H
#define MODELS_SWEEP_H

#include "shape.h"

/* Cosine and sine of `turns` full turns (any sign), rounded to 2^-20 of a turn. */
void sweep_angle(double turns, double *c, double *s);

/* A rotation that turns +Y into `axis` (unit). */
void sweep_frame(const double axis[3], double turn[3][3]);

/* Turns a shape made around +Y from the origin on so that it points from a towards b, and moves it to a. */
void sweep_along(struct shape *shape, uint32_t first, const double a[3], const double b[3]);

/* Computes the vertices' normals from their places: each is the sum of the normals of the quads around it, weighted by
 * area. A first or last row that is one point has one normal, unless it is a sharp tip. */
void sweep_normals(struct shape_vertex *grid, uint32_t n_rows, uint32_t n_cols, int wrap_rows, int wrap_cols);

struct sweep_grid {
	const struct shape_vertex *vertex; /* row after row */
	uint32_t n_rows, n_cols;
	int wrap_rows;
};

/* Adds the columns first..last of a grid, a piece of it; last may be n_cols, which is column 0. */
void sweep_band(struct shape *shape, const struct sweep_grid *grid, uint32_t first, uint32_t last);

/* The place at u (along a row) and v (from the first to the last row), both in 0..1. */
typedef void sweep_function(double u, double v, double p[3], const void *context);

/* A grid of the function: quads_v rows of quads_u quads; outside is where dp/du x dp/dv points. wrap_u: u = 1 is u = 0.
 * Not closed by itself. (u, v) are the places in the picture. */
void sweep_surface(struct shape *shape, sweep_function *at, const void *context, uint32_t quads_v, uint32_t quads_u,
                   int wrap_u);

/* A tube of `sides` sides around an open path of n >= 2 places with round ends; a radius of 0 at an end is a point. */
void sweep_tube(struct shape *shape, const double (*path)[3], const double *radius, uint32_t n, uint32_t sides);

/* One of constant radius around a quadratic Bezier curve. */
void sweep_bend(struct shape *shape, const double curve[3][3], double radius, uint32_t n, uint32_t sides);

/* A box with rounded edges: |x| <= half[0] and so on around `center`, 0 < radius < half. */
void sweep_block(struct shape *shape, const double center[3], const double half[3], double radius);

/* An ellipsoid. */
void sweep_ball(struct shape *shape, const double center[3], const double half[3], uint32_t rows, uint32_t cols);

/* A cone with a flat base around a and its tip at b. */
void sweep_cone(struct shape *shape, const double a[3], double radius, const double b[3], uint32_t n);

#endif

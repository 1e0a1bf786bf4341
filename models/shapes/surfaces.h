/* Surfaces that the generators are put together from. All of them are added with the shape's current material unless
 * said otherwise, have exact normals, and use no function whose last bit differs by machine. */
#ifndef MODELS_SURFACES_H
#define MODELS_SURFACES_H

#include "shape.h"

/* Cosine and sine of k/n of a full turn; n > 0. Exactly symmetric: k and n - k, the quarters and the eighths agree. */
void surface_turn(uint32_t k, uint32_t n, double *c, double *s);

/* A piece of a profile: the part from..to (0..1) of the cubic Bezier curve (r, y), r >= 0, in `steps` steps. Pieces
 * that meet at the same control point, or at the same parameter of the same curve, share their places exactly; their
 * normals are each piece's own, so that a corner of the profile is a crease. */
struct surface_profile {
	double p[4][2];
	double from, to;
	uint32_t steps;
	uint32_t material;
};

/* A straight piece from (r0, y0) to (r1, y1). */
struct surface_profile surface_line(double r0, double y0, double r1, double y1, uint32_t steps, uint32_t material);

/* The surface of revolution of the pieces around +Y with n meridians. Outside is to the right of the profile as it
 * goes (r to the right, y up): a solid's goes from its lowest point, by its outside, to its highest. Sets the current
 * material. */
void surface_lathe(struct shape *shape, const struct surface_profile *pieces, uint32_t n_pieces, uint32_t n);

/* A closed stump of a cone (a cylinder if the radii agree) with flat caps, from a (radius ra) to b (radius rb), a != b,
 * n sides. */
void surface_rod(struct shape *shape, const double a[3], double ra, const double b[3], double rb, uint32_t n);

/* A torus around +Y at height y: n_major meridians of n_minor vertices. */
void surface_torus(struct shape *shape, double major, double minor, double y, uint32_t n_major, uint32_t n_minor);

/* A box with flat faces: |x| <= half[0] and so on. */
void surface_box(struct shape *shape, const double half[3]);

/* A bicubic Bezier patch, row after row, in `rows` x `cols` quads; outside as in shape_grid. Patches with the same (or
 * the reversed) control points along a side, and the same number of quads there, share their places along it exactly.
 * Rows or columns that are one point are poles: the normal there is the limit. */
void surface_patch(struct shape *shape, const double control[4][4][3], uint32_t rows, uint32_t cols);

/* The point of a cubic Bezier curve of `dim` <= 3 coordinates at i/n, and its derivative (NULL: not wanted). The
 * reversed curve at (n - i)/n is the same point to the last bit. */
void surface_bezier(const double *const control[4], int dim, uint32_t i, uint32_t n, double *point, double *slope);

#endif

/* The shading normals of a mesh. */
#ifndef PSR_SURFACE_NORMAL_H
#define PSR_SURFACE_NORMAL_H

#include <stdint.h>
#include "psr/mesh.h"
#include "surface.h"

/* A triangle's own plane: orthonormal x, y, and z the unit normal of its front (all 0 where it has no area), and its
 * sides from corner 0 as x[i], y[i] of it, in object units; y[0] = 0. */
struct plane {
	double axis[3][3];
	double x[2], y[2];
};

int normal_plane(const struct psr_mesh *mesh, uint32_t triangle, struct plane *plane); /* whether it has an area */

/* (s, t) differences along the sides (texture_sides) as the matrix that takes x, y of the plane to s, t. The plane has
 * an area. */
void normal_jacobian(const struct plane *plane, const double side[2][2], double jacobian[2][2]);

/* The unit normal at a place: interpolated, the triangle's own where there is none, and on the triangle's front side.
 * Of a triangle without an area whatever the vertices say, or +z. */
void normal_interpolate(const struct psr_mesh *mesh, uint32_t triangle, double u, double v, float normal[3]);

/* Turns `normal` (normal_interpolate) into that of a normal map whose vector there is `mapped`, of any length but 0.
 * The tangent is the mesh's, or where it has none that of growing s; its jacobian (of the texture, normal_jacobian)
 * tells that. The bitangent is perpendicular to both, on the side of falling t. Without an orientation (a jacobian of
 * determinant 0) nothing is changed. */
void normal_map(const struct psr_mesh *mesh, const struct surface_place *place, const struct plane *plane,
                const double jacobian[2][2], const float mapped[3], float normal[3]);

#endif

/* The shading normals of a mesh. */
#ifndef PSR_SURFACE_NORMAL_H
#define PSR_SURFACE_NORMAL_H

#include <stdint.h>
#include "psr/mesh.h"
#include "surface.h"

/* A triangle's own plane: orthonormal x, y, and z the unit normal of its front (all 0 without area), and its sides
 * from corner 0 as x[i], y[i], in object units; y[0] = 0. */
struct plane {
	double axis[3][3];
	double x[2], y[2];
};

int normal_plane(const struct psr_mesh *mesh, uint32_t triangle, struct plane *plane); /* whether it has an area */

/* Computes the matrix from x, y of the plane to s, t, from differences along the sides (texture_sides). The plane must
 * have an area. */
void normal_jacobian(const struct plane *plane, const double side[2][2], double jacobian[2][2]);

/* Computes the unit normal at a place: interpolated, or else the triangle's own, on its front side. For a triangle
 * without area: the vertices', or +z. */
void normal_interpolate(const struct psr_mesh *mesh, uint32_t triangle, double u, double v, float normal[3]);

static inline int normal_is_mapped(const struct psr_material *material)
{
	return material->normal_texture.image >= 0 && material->normal_scale != 0;
}

/* Turns `normal` (normal_interpolate) by a normal map's vector `mapped`, of any length but 0. The tangent is the mesh's
 * own, or else the direction of growing s, by the texture's jacobian (normal_jacobian); the bitangent is perpendicular
 * to both, on the side of falling t. A jacobian of determinant 0 changes nothing. */
void normal_map(const struct psr_mesh *mesh, const struct surface_place *place, const struct plane *plane,
                const double jacobian[2][2], const float mapped[3], float normal[3]);

#endif

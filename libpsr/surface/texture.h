/* Where textures lie on a mesh, and which values they have at a point. */
#ifndef PSR_SURFACE_TEXTURE_H
#define PSR_SURFACE_TEXTURE_H

#include <stdint.h>
#include "psr/mesh.h"

/* Texture coordinates at barycentric (u, v) of a triangle, after the transform; 0 if they are not finite. */
int texture_place(const struct psr_mesh *mesh, const struct psr_texture *texture, uint32_t triangle, double u, double v,
                  double st[2]);

/* side[i] becomes (s, t) of corner i + 1 less (s, t) of corner 0. */
void texture_sides(const struct psr_mesh *mesh, const struct psr_texture *texture, uint32_t triangle,
                   double side[2][2]);

/* Linear RGBA at barycentric (u, v) of a primitive, each in 0..1: base factor times vertex or point colour, without
 * textures. */
void texture_plain_color(const struct psr_mesh *mesh, uint32_t prim, double u, double v, float rgba[4]);

/* Computes that colour times the base texture as a point shows it, bilinear or nearest. */
void texture_base_color(const struct psr_mesh *mesh, uint32_t prim, double u, double v, float rgba[4]);

/* Returns whether a place is transparent: MASK below its cutoff, BLEND below one half. Filters as for magnification. */
int texture_is_absent(const struct psr_mesh *mesh, uint32_t prim, double u, double v);

static inline uint32_t texture_material(const struct psr_mesh *mesh, uint32_t prim)
{
	return prim < mesh->n_triangles ? mesh->triangle_material[prim] : mesh->point_material[prim - mesh->n_triangles];
}

#endif

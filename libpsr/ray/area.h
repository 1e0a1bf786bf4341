/* Picks random places on a mesh, evenly by area. */
#ifndef PSR_RAY_AREA_H
#define PSR_RAY_AREA_H

#include "ray.h"

/* Fills sum[i] with the area of primitives 0 to i, in inner units. scale: the scene's. */
void area_sum(const struct ray_scene *scene, const struct psr_mesh *mesh, double scale, double *sum);

/* Returns the primitive that holds x, 0 <= x < sum[n - 1]. A random x picks primitives by area. n > 0. */
uint32_t area_find(const double *sum, uint32_t n, double x);

/* Computes a point of a triangle, evenly spread for u and v in 0..1, or a disc's centre. Returns 0 if the surface is
 * absent there. */
int area_point(const struct ray_scene *scene, uint32_t prim, double u, double v, double p[3]);

#endif

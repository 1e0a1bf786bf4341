/* Rays against the triangles and discs (a cloud's points) of a mesh, by the numbers of psr/mesh.h, in the inner
 * coordinates of a model: object = origin + scale * inner.
 *
 * As glTF asks, rays pass through the backs of one-sided faces, through texels of MASK materials below the cutoff, and
 * through BLEND ones below one half. After ray_scene_stipple() first hits pass BLEND ones in proportion, and all hits
 * of a ray include BLEND ones of any opacity. A tree finds the primitive in float; the hit's place is computed in
 * double. One thread builds the tree and AVX2 walks it, so that threads and CPUs do not matter. Of faces that coincide
 * the tree's order chooses one; a ray through a vertex, to the rounding of a float, may slip between its faces. */
#ifndef PSR_RAY_RAY_H
#define PSR_RAY_RAY_H

#include <stdint.h>
#include "psr/error.h"
#include "psr/mesh.h"

#define RAY_NONE UINT32_MAX

struct ray {
	double origin[3], direction[3]; /* direction: of any length but 0; its length is the unit of t */
};

struct ray_hit {
	uint32_t prim; /* RAY_NONE: the ray meets nothing */
	int is_back;   /* the ray meets it from the back */
	double t, u, v; /* position = (1 - u - v) * v0 + u * v1 + v * v2; u, v >= 0, u + v <= 1; 0, 0 on discs */
};

struct ray_scene;

/* The mesh must outlive the scene. scale > 0. MEMORY, INTERNAL. */
int ray_scene_create(struct ray_scene **out, const struct psr_mesh *mesh, const double origin[3], double scale,
                     struct psr_error *err);
void ray_scene_destroy(struct ray_scene *scene); /* NULL is fine */

/* From now on the first hits of rays pass BLEND surfaces in proportion to their transparency, by a pattern of cells of
 * this side in inner units (surface/stipple.h). No thread may trace during the call. */
void ray_scene_stipple(struct ray_scene *scene, double cell);

/* Returns whether alpha makes a place of a primitive transparent. Filters its texture as for magnification. */
int ray_scene_is_absent(const struct ray_scene *scene, uint32_t prim, double u, double v);

/* Returns whether the surface at this place of a primitive lets a part of the light through. */
int ray_scene_is_sheer(const struct ray_scene *scene, uint32_t prim, double u, double v);

/* Finds the first hits of n rays at t >= t_min. Any number of threads may trace at once. */
void ray_scene_trace(const struct ray_scene *scene, const struct ray *ray, int n, double t_min, struct ray_hit *hit);

/* Finds the first hits within t_min..t_max, to the rounding of a float. t_min <= t_max. */
void ray_scene_trace_near(const struct ray_scene *scene, const struct ray *ray, int n, double t_min, double t_max,
                          struct ray_hit *hit);

/* Finds all hits of n rays at t >= 0, nearest first: n_hits[i] of ray i from hit[i * most] on, the nearest `most` (1..
 * RAY_MOST_HITS) of its 2 * RAY_MOST_HITS nearest primitives. Hits of one side within 2^-20 of their first are one, of
 * the lowest primitive; discs within half of the smaller radius behind the nearest are one with it, so that a ray meets
 * a cloud's surface once. The tree's order does not matter. Any number of threads may trace at once. */
#define RAY_MOST_HITS 64
void ray_scene_trace_all(const struct ray_scene *scene, const struct ray *ray, int n, int most, struct ray_hit *hit,
                         int *n_hits);

/* Does the same also for rays along the same lines from their other ends, origin + length * direction, backwards. Both
 * have the same `most`. other may be NULL. */
struct ray_hits {
	int most;
	struct ray_hit *hit; /* n * most */
	int *n;
};
void ray_scene_trace_ends(const struct ray_scene *scene, const struct ray *ray, int n, double length,
                          const struct ray_hits *hits, const struct ray_hits *other);

/* Returns whether rays in any directions meet anything at 0 <= t < t_max, to the rounding of a float. Any number of
 * threads may trace at once. */
void ray_scene_occluded(const struct ray_scene *scene, const struct ray *ray, int n, double t_max,
                        uint8_t *is_occluded);

/* Prepares ray_scene_distance(), which needs it; costs nothing without points. MEMORY. */
int ray_scene_index_distances(struct ray_scene *scene, struct psr_error *err);

/* Returns the distance to the nearest point of the mesh, of any side, transparent or not; INFINITY if none is within
 * `most`. */
double ray_scene_distance(const struct ray_scene *scene, const double point[3], double most);

/* Computes u and v of a ray on a primitive that it is known to meet. */
void ray_locate(const struct ray_scene *scene, const struct ray *ray, uint32_t prim, double *u, double *v);

/* Find the centre of a point's disc; the corners of a triangle. */
void ray_scene_center(const struct ray_scene *scene, uint32_t prim, double center[3]);
void ray_scene_corners(const struct ray_scene *scene, uint32_t prim, double corner[3][3]);

/* Computes the unit normal of a triangle or disc on its front; 0,0,0 of a triangle without area. */
const float *ray_scene_normal(const struct ray_scene *scene, uint32_t prim);

#endif

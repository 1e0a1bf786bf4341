/* Rays against a mesh, which may have triangles, discs (a cloud's points) or both; numbers of primitives are those of
 * psr/mesh.h. Everything here is in the inner coordinates of a model: object = origin + scale * inner.
 *
 * Surfaces are seen as glTF asks: rays go on through the backs of one-sided faces, through texels of MASK materials
 * below the cutoff, and through BLEND ones below one half, or in proportion (ray_scene_stipple); then all hits of a ray
 * are BLEND ones, too, wherever these are anything at all. What a ray meets is found in float by a tree, and where it meets it is computed in double from the primitive, so that a hit has the
 * same bits wherever the same one is found. The tree is built by one thread and walked by the same instructions on
 * every CPU with AVX2: the same primitive is found whatever the threads. Of faces that coincide the tree's order
 * chooses one; and a ray that goes through a vertex to within the rounding of a float may slip between its faces. */
#ifndef PSR_RAY_RAY_H
#define PSR_RAY_RAY_H

#include <stdint.h>
#include "psr/error.h"
#include "psr/mesh.h"

#define RAY_NONE UINT32_MAX

struct ray {
	double origin[3], direction[3]; /* direction of any length but 0: t counts in it */
};

struct ray_hit {
	uint32_t prim; /* RAY_NONE: nothing is met */
	int is_back;   /* met from the back */
	double t, u, v; /* position = (1 - u - v) * v0 + u * v1 + v * v2; u, v >= 0, u + v <= 1; 0, 0 on discs */
};

struct ray_scene;

/* The mesh must outlive the scene. scale > 0. MEMORY, INTERNAL. */
int ray_scene_create(struct ray_scene **out, const struct psr_mesh *mesh, const double origin[3], double scale,
                     struct psr_error *err);
void ray_scene_destroy(struct ray_scene *scene); /* NULL is fine */

/* From now on rays that look for their first hit go through BLEND surfaces in proportion to what these let through, by a
 * pattern of cells of this side in inner units (surface/stipple.h). Nobody may trace at the time. */
void ray_scene_stipple(struct ray_scene *scene, double cell);

/* Whether there is nothing at this place of a primitive, for its alpha. The texture is that of a point, as
 * magnification filters it. */
int ray_scene_is_absent(const struct ray_scene *scene, uint32_t prim, double u, double v);

/* Whether what is at this place of a primitive lets a part of the light through. */
int ray_scene_is_sheer(const struct ray_scene *scene, uint32_t prim, double u, double v);

/* The first hits of n rays at t >= t_min. Any number of threads may trace at once. */
void ray_scene_trace(const struct ray_scene *scene, const struct ray *ray, int n, double t_min, struct ray_hit *hit);

/* The same, and nothing beyond t_max, to the rounding of a float. t_min <= t_max. */
void ray_scene_trace_near(const struct ray_scene *scene, const struct ray *ray, int n, double t_min, double t_max,
                          struct ray_hit *hit);

/* All hits of n rays at t >= 0, nearest first: those of ray i at hit[i * most], n_hits[i] of them, at most `most` (1..
 * RAY_MOST_HITS); beyond, the farthest are left out, and a ray counts no more than its 2 * RAY_MOST_HITS nearest
 * primitives. Of hits of one ray and side that coincide to within 2^-20 with the first of them, the lowest primitive's
 * stands for all. Discs of one side that are met within half of the smaller radius behind the nearest are one with it:
 * a cloud's surface is met once. Nothing depends on the order in which the tree finds things. Any number of threads
 * may trace at once. */
#define RAY_MOST_HITS 64
void ray_scene_trace_all(const struct ray_scene *scene, const struct ray *ray, int n, int most, struct ray_hit *hit,
                         int *n_hits);

/* The same, and also for the rays that come along the same lines from their other ends: from origin + length *
 * direction, backwards. Both have the same `most`. other: NULL if nobody asks for it. */
struct ray_hits {
	int most;
	struct ray_hit *hit; /* n * most */
	int *n;
};
void ray_scene_trace_ends(const struct ray_scene *scene, const struct ray *ray, int n, double length,
                          const struct ray_hits *hits, const struct ray_hits *other);

/* Whether anything is met at 0 <= t < t_max, to the rounding of a float. For rays that go all ways. Any number of
 * threads may trace at once. */
void ray_scene_occluded(const struct ray_scene *scene, const struct ray *ray, int n, double t_max,
                        uint8_t *is_occluded);

/* To be called before distances to a mesh with points are asked for; costs nothing without. MEMORY. */
int ray_scene_index_distances(struct ray_scene *scene, struct psr_error *err);

/* Distance from a point to the nearest point of the mesh, whatever side it is of and whether it is cut out; INFINITY if
 * none is within `most`. */
double ray_scene_distance(const struct ray_scene *scene, const double point[3], double most);

/* u and v of the hit of a ray that is known to meet this primitive. */
void ray_locate(const struct ray_scene *scene, const struct ray *ray, uint32_t prim, double *u, double *v);

/* Centre of a point's disc; corners of a triangle. */
void ray_scene_center(const struct ray_scene *scene, uint32_t prim, double center[3]);
void ray_scene_corners(const struct ray_scene *scene, uint32_t prim, double corner[3][3]);

/* Unit normal of a triangle or disc on its front; 0,0,0 of a triangle that has no area. */
const float *ray_scene_normal(const struct ray_scene *scene, uint32_t prim);

#endif

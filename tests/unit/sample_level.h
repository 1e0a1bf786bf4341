/* One level of the sampler over a small mesh, for its tests: inner and object coordinates are the same. */
#ifndef TESTS_SAMPLE_LEVEL_H
#define TESTS_SAMPLE_LEVEL_H

#include "base/vec.h"
#include "psr/direction.h"
#include "psr/pool.h"
#include "sample/level.h"
#include "sample/projection.h"
#include "sample_meshes.h"

#define TOLERANCE 0.43633231299858238 /* 25 degrees */

struct level_set {
	struct psr_mesh *mesh; /* belongs to the set */
	struct ray_scene *scene;
	struct surface surface;
	struct psr_pool *pool;
	struct psr_projection projection[N_PROJECTIONS];
	struct level level;
};

/* Everything but level_make(). */
static inline void level_set_open(struct level_set *set, struct psr_mesh *mesh, uint32_t resolution, int n_threads)
{
	static const double zero[3];

	memset(set, 0, sizeof *set);
	set->mesh = mesh;
	assert(ray_scene_create(&set->scene, mesh, zero, 1, NULL) == PSR_OK);
	assert(surface_init(&set->surface, mesh, 1) == PSR_OK);
	assert(psr_pool_create(&set->pool, n_threads, 0) == PSR_OK);
	projection_list(set->projection, 2.0 / resolution, TOLERANCE);
	set->level = (struct level){ .mesh = mesh, .scene = set->scene, .surface = &set->surface, .pool = set->pool,
		                         .ds = 2.0 / resolution, .cosine = (float)cos(TOLERANCE),
		                         .n_projections = N_PROJECTIONS };
}

static inline void level_set_make(struct level_set *set, struct psr_mesh *mesh, uint32_t resolution, int n_threads)
{
	level_set_open(set, mesh, resolution, n_threads);
	assert(level_make(&set->level, set->projection, NULL, NULL) == PSR_OK);
}

static inline void level_set_close(struct level_set *set)
{
	level_fini(&set->level);
	surface_fini(&set->surface);
	ray_scene_destroy(set->scene);
	psr_pool_destroy(set->pool);
	meshes_free(set->mesh);
}

/* A random place of the surface, by area; returns its primitive. */
static inline uint32_t level_set_place(const struct level_set *set, uint64_t *seed, float p[3], float n[3])
{
	const struct psr_mesh *mesh = set->mesh;
	double total = 0, x, u = meshes_random(seed), v = meshes_random(seed);
	uint32_t prim = 0;

	for (int pass = 0; pass < 2; pass++) {
		double sum = 0;

		x = pass == 1 ? meshes_random(seed) * total : 0;
		for (uint32_t i = 0; i < mesh->n_triangles; i++) {
			double c[3][3], a[3], b[3], cross[3];

			ray_scene_corners(set->scene, i, c);
			v3d_sub(a, c[1], c[0]);
			v3d_sub(b, c[2], c[0]);
			v3d_cross(cross, a, b);
			sum += v3d_length(cross) / 2;
			if (pass == 1 && sum >= x) {
				prim = i;
				break;
			}
		}
		total = pass == 0 ? sum : total;
	}
	if (u + v > 1) {
		u = 1 - u;
		v = 1 - v;
	}
	double corner[3][3];

	ray_scene_corners(set->scene, prim, corner);
	for (int k = 0; k < 3; k++) {
		p[k] = (float)((1 - u - v) * corner[0][k] + u * corner[1][k] + v * corner[2][k]);
		n[k] = ray_scene_normal(set->scene, prim)[k];
	}
	return prim;
}

#endif

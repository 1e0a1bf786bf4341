/* One level of the sampler over a small mesh, for its tests: inner and object coordinates are the same. */
#ifndef TESTS_SAMPLE_LEVEL_H
#define TESTS_SAMPLE_LEVEL_H

#include "base/vec.h"
#include "base/direction.h"
#include "ray/area.h"
#include "sample/level.h"
#include "meshes.h"

#define TOLERANCE 0.43633231299858238 /* 25 degrees */

struct level_set {
	struct psr_mesh *mesh; /* belongs to the set */
	struct ray_scene *scene;
	struct surface surface;
	struct psr_pool *pool;
	struct level level;
	double *area; /* of all triangles up to this one */
};

/* Everything but level_make(). */
static inline void level_set_open(struct level_set *set, struct psr_mesh *mesh, uint32_t resolution, int n_threads)
{
	static const double zero[3];

	memset(set, 0, sizeof *set);
	set->mesh = mesh;
	assert(ray_scene_create(&set->scene, mesh, zero, 1, NULL) == PSR_OK);
	assert(surface_init(&set->surface, mesh, 1) == PSR_OK);
	assert(psr_pool_create(&set->pool, n_threads, NULL) == PSR_OK);
	set->level.sampling = (struct sampling){ .mesh = mesh, .scene = set->scene, .surface = &set->surface,
		                                     .pool = set->pool, .ds = 2.0 / resolution };
	projection_list(set->level.sampling.projection, 2.0 / resolution, TOLERANCE);
	set->area = malloc((mesh->n_triangles + 1) * sizeof *set->area);
	area_sum(set->scene, mesh, 1, set->area);
}

static inline void level_set_make(struct level_set *set, struct psr_mesh *mesh, uint32_t resolution, int n_threads)
{
	level_set_open(set, mesh, resolution, n_threads);
	assert(level_make(&set->level, NULL) == PSR_OK);
}

static inline void level_set_close(struct level_set *set)
{
	level_fini(&set->level);
	surface_fini(&set->surface);
	ray_scene_destroy(set->scene);
	psr_pool_destroy(set->pool);
	meshes_free(set->mesh);
	free(set->area);
}

/* Pyramids of three sides from the middle outwards. */
static inline struct psr_mesh *meshes_needles(uint32_t n, double width)
{
	struct psr_mesh *mesh = meshes_new(4 * n, 3 * n);
	uint64_t seed = 5;

	for (uint32_t i = 0; i < n; i++) {
		double direction[3], frame[3][3];

		do {
			for (int k = 0; k < 3; k++)
				direction[k] = 2 * meshes_random(&seed) - 1;
		} while (v3d_dot(direction, direction) > 1 || v3d_normalize(direction, direction) < 0.1);
		psr_direction_basis(direction, frame);
		v3d_scale(mesh->position[4 * i + 3], direction, 0.9);
		for (uint32_t c = 0; c < 3; c++) {
			double *foot = mesh->position[4 * i + c], angle = 2.0943951 * c;

			v3d_scale(foot, direction, 0.4);
			v3d_add_scaled(foot, foot, width / 2 * cos(angle), frame[0]);
			v3d_add_scaled(foot, foot, width / 2 * sin(angle), frame[1]);
			mesh->triangle[3 * i + c][0] = 4 * i + c;
			mesh->triangle[3 * i + c][1] = 4 * i + (c + 1) % 3;
			mesh->triangle[3 * i + c][2] = 4 * i + 3;
		}
	}
	return mesh;
}

/* A random place of the surface, by area; returns its primitive, of which n is the front. */
static inline uint32_t level_set_place(const struct level_set *set, uint64_t *seed, float p[3], float n[3])
{
	double x = meshes_random(seed) * set->area[set->mesh->n_triangles - 1];
	double u = meshes_random(seed), v = meshes_random(seed);
	double corner[3][3];
	uint32_t prim = area_find(set->area, set->mesh->n_triangles, x);

	if (u + v > 1) {
		u = 1 - u;
		v = 1 - v;
	}
	ray_scene_corners(set->scene, prim, corner);
	for (int k = 0; k < 3; k++) {
		p[k] = (float)((1 - u - v) * corner[0][k] + u * corner[1][k] + v * corner[2][k]);
		n[k] = ray_scene_normal(set->scene, prim)[k];
	}
	return prim;
}

/* Distance to the nearest kept sample, in pixels; INFINITY if none is within `reach` pixels. Samples that are shaded
 * away from n do not count, unless they are two-sided. */
static inline double level_set_nearest(const struct level_set *set, const float p[3], const float n[3], double reach)
{
	const float (*direction)[3] = psr_direction_table();
	const struct kept *kept = &set->level.kept;
	double ds = set->level.sampling.ds, least = reach * ds;
	int low[3], high[3], at[3], is_any = 0;

	for (int k = 0; k < 3; k++) {
		low[k] = (int)floor(((double)p[k] - reach * ds) / ds);
		high[k] = (int)floor(((double)p[k] + reach * ds) / ds);
	}
	for (at[2] = low[2]; at[2] <= high[2]; at[2]++) {
		for (at[1] = low[1]; at[1] <= high[1]; at[1]++) {
			for (at[0] = low[0]; at[0] <= high[0]; at[0]++) {
				for (uint32_t i = grid_first(&kept->grid, at); i != GRID_NONE; i = kept->sample[i].next) {
					const struct kept_sample *sample = &kept->sample[i];
					float d[3];

					v3f_sub(d, sample->position, p);
					if (!sample->two_sided && v3f_dot(direction[sample->normal], n) <= 0)
						continue;
					if ((double)v3f_length(d) <= least) {
						least = (double)v3f_length(d);
						is_any = 1;
					}
				}
			}
		}
	}
	return is_any ? least / ds : INFINITY;
}

#endif

/* The context of a level: all steps read it, and none changes it. */
#ifndef PSR_SAMPLE_PROJECT_SAMPLING_H
#define PSR_SAMPLE_PROJECT_SAMPLING_H

#include <stdint.h>
#include "base/pool.h"
#include "projection.h"
#include "psr/mesh.h"
#include "ray/ray.h"
#include "surface/surface.h"
#include "surface/texture.h"
#include "thin.h"

struct sampling {
	const struct psr_mesh *mesh;
	const struct ray_scene *scene;
	const struct surface *surface;
	struct psr_pool *pool;
	const uint8_t *thin; /* enum thin, by primitive, once thin_mark() has made it; NULL: nothing is thin */
	unsigned level;      /* 0: the finest */
	double ds;           /* a pixel at this level's resolution, inner units */
	struct psr_projection projection[N_PROJECTIONS]; /* spacing: this level's */
};

static inline uint32_t sampling_n_prims(const struct sampling *sampling)
{
	return sampling->mesh->n_triangles + sampling->mesh->n_points;
}

static inline const struct psr_material *sampling_material(const struct sampling *sampling, uint32_t prim)
{
	return &sampling->mesh->material[texture_material(sampling->mesh, prim)];
}

static inline int sampling_is_thin(const struct sampling *sampling, uint32_t surface)
{
	return sampling->thin != NULL && sampling->thin[surface & ~SURFACE_BACK] != 0;
}

/* Returns whether samples of a surface may count for both sides: these have patches of their own. */
static inline int sampling_is_sheet(const struct sampling *sampling, uint32_t surface)
{
	return sampling_is_thin(sampling, surface)
	       || sampling_material(sampling, surface & ~SURFACE_BACK)->two_sided != 0;
}

static inline void sampling_normal(const struct sampling *sampling, uint32_t surface, float n[3])
{
	const float *front = ray_scene_normal(sampling->scene, surface & ~SURFACE_BACK);
	float sign = (surface & SURFACE_BACK) != 0 ? -1 : 1;

	for (int k = 0; k < 3; k++)
		n[k] = sign * front[k];
}

#endif

#include "../base/vec.h"
#include "level.h"

/* Pixels between two sides of what one sample stands for. */
#define THICKNESS 0.5

#define CHUNK 1024
#define BATCH 64

/* Where a triangle is looked through: its middle, and near its corners. */
static const double PLACE[4][3] = { { 1.0 / 3, 1.0 / 3, 1.0 / 3 },
	                                { 0.8, 0.1, 0.1 },
	                                { 0.1, 0.8, 0.1 },
	                                { 0.1, 0.1, 0.8 } };
#define N_PLACES 4

/* From the far side of what is just THICKNESS thick, outwards. */
static void aim(const struct level *level, uint32_t prim, const double place[3], struct ray *ray)
{
	const float *n = ray_scene_normal(level->scene, prim);
	double corner[3][3];

	ray_scene_corners(level->scene, prim, corner);
	for (int k = 0; k < 3; k++) {
		ray->direction[k] = (double)n[k];
		ray->origin[k] = place[0] * corner[0][k] + place[1] * corner[1][k] + place[2] * corner[2][k]
		                 - THICKNESS * level->ds * (double)n[k];
	}
}

/* Another face of the same look, met from outside before the ray leaves through its own. */
static int is_other_side(const struct level *level, uint32_t prim, const struct ray_hit *hit)
{
	return hit->prim != RAY_NONE && hit->prim != prim && !hit->is_back && hit->t < THICKNESS * level->ds
	       && texture_material(level->mesh, hit->prim) == texture_material(level->mesh, prim);
}

struct part {
	uint32_t prim[BATCH];
	int n;
};

static void keep_thin(const struct level *level, struct part *part, const double place[3])
{
	struct ray ray[BATCH];
	struct ray_hit hit[BATCH];
	int n = 0;

	for (int i = 0; i < part->n; i++)
		aim(level, part->prim[i], place, &ray[i]);
	ray_scene_trace_near(level->scene, ray, part->n, 0, THICKNESS * level->ds, hit);
	for (int i = 0; i < part->n; i++)
		if (is_other_side(level, part->prim[i], &hit[i]))
			part->prim[n++] = part->prim[i];
	part->n = n;
}

static void mark_chunk(int i, void *userdata)
{
	struct level *level = userdata;
	uint32_t prim = (uint32_t)i * CHUNK, end = prim + CHUNK;

	end = end < level->mesh->n_triangles ? end : level->mesh->n_triangles;
	while (prim < end) {
		struct part part = { .n = 0 };

		for (; prim < end && part.n < BATCH; prim++) {
			const float *n = ray_scene_normal(level->scene, prim);

			if (level->finer_sides != NULL && (level->finer_sides[prim] & SIDE_THIN) != 0)
				level->sides[prim] |= SIDE_THIN;
			else if (level->surface->is_plain[texture_material(level->mesh, prim)] &&
			         (n[0] != 0 || n[1] != 0 || n[2] != 0))
				part.prim[part.n++] = prim;
		}
		for (int k = 0; k < N_PLACES && part.n != 0; k++)
			keep_thin(level, &part, PLACE[k]);
		for (int k = 0; k < part.n; k++)
			level->sides[part.prim[k]] |= SIDE_THIN;
	}
}

void thin_mark(struct level *level)
{
	if (level->mesh->color == NULL)
		psr_pool_for(level->pool, (int)((level->mesh->n_triangles + CHUNK - 1) / CHUNK), mark_chunk, level);
}

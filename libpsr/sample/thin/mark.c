#include <math.h>
#include "base/vec.h"
#include "sample/level.h"

/* Pixels between two sides of what one sample stands for. By the rim of a thicker plate, views along it see one side
 * beyond the samples of the other: of the kittyhawk, 1 in 5,000 pixels at 0.75. */
#define THICKNESS 0.6

/* So far, in pixels, behind what was met it is looked on. */
#define PAST 0.001

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

/* Another face of the same look, met from outside. */
static int is_other_side(const struct level *level, uint32_t prim, const struct ray_hit *hit)
{
	return hit->prim != prim && !hit->is_back
	       && texture_material(level->mesh, hit->prim) == texture_material(level->mesh, prim);
}

struct job {
	struct level *level;
	const struct psr_projection *projection;
};

/* Whether n faces the better one of the two ends of the line that it faces best: sample/own/owner.c keeps what is thin there. */
static int is_sampled_side(const struct job *job, uint32_t prim)
{
	const float *n = ray_scene_normal(job->level->scene, prim);
	float most = 0;

	for (unsigned q = 0; q < job->level->n_projections; q += 2) {
		float g = v3f_dot(job->projection[q].axis[2], n);

		most = fabsf(g) > fabsf(most) ? g : most;
	}
	return most >= 0;
}

struct part {
	int n;
	uint32_t prim[BATCH];
	uint8_t is_behind[BATCH]; /* what is sampled, wherever it was looked */
};

/* Looks at one place of each, and on behind what is of another look, as leaves grow through each other. */
static void keep_thin(const struct job *job, struct part *part, const double place[3])
{
	const struct level *level = job->level;
	const double length = THICKNESS * level->ds;
	struct ray ray[BATCH];
	struct ray_hit hit[BATCH];
	double done[BATCH] = { 0 };
	struct part left = *part;

	for (int i = 0; i < left.n; i++)
		aim(level, left.prim[i], place, &ray[i]);
	part->n = 0;
	while (left.n != 0) {
		int n = 0;

		ray_scene_trace_near(level->scene, ray, left.n, 0, length, hit);
		for (int i = 0; i < left.n; i++) {
			double at = done[i] + hit[i].t;

			if (hit[i].prim == RAY_NONE || !(at < length))
				continue;
			if (is_other_side(level, left.prim[i], &hit[i])) {
				part->prim[part->n] = left.prim[i];
				part->is_behind[part->n++] = left.is_behind[i] && is_sampled_side(job, hit[i].prim);
				continue;
			}
			left.prim[n] = left.prim[i];
			left.is_behind[n] = left.is_behind[i];
			done[n] = at + PAST * level->ds;
			v3d_add_scaled(ray[n].origin, ray[i].origin, done[n] - done[i], ray[i].direction);
			for (int k = 0; k < 3; k++)
				ray[n].direction[k] = ray[i].direction[k];
			n++;
		}
		left.n = n;
	}
}

static void mark_chunk(int i, void *userdata)
{
	const struct job *job = userdata;
	struct level *level = job->level;
	uint32_t prim = (uint32_t)i * CHUNK, end = prim + CHUNK;

	end = end < level->mesh->n_triangles ? end : level->mesh->n_triangles;
	while (prim < end) {
		struct part part = { .n = 0 };

		for (; prim < end && part.n < BATCH; prim++) {
			const float *n = ray_scene_normal(level->scene, prim);

			if (level->finer_sides != NULL && (level->finer_sides[prim] & SIDE_THIN) != 0)
				level->sides[prim] |= level->finer_sides[prim] & (SIDE_THIN | SIDE_BEHIND);
			else if (level->surface->is_plain[texture_material(level->mesh, prim)] &&
			         (n[0] != 0 || n[1] != 0 || n[2] != 0)) {
				part.prim[part.n] = prim;
				part.is_behind[part.n++] = !is_sampled_side(job, prim);
			}
		}
		for (int k = 0; k < N_PLACES && part.n != 0; k++)
			keep_thin(job, &part, PLACE[k]);
		for (int k = 0; k < part.n; k++)
			level->sides[part.prim[k]] |= (uint8_t)(SIDE_THIN | (part.is_behind[k] ? SIDE_BEHIND : 0));
	}
}

void thin_mark(struct level *level, const struct psr_projection *projection)
{
	struct job job = { level, projection };

	if (level->mesh->color == NULL)
		psr_pool_for(level->pool, (int)((level->mesh->n_triangles + CHUNK - 1) / CHUNK), mark_chunk, &job);
}

#include <math.h>
#include <string.h>
#include "cull.h"

#define GROUPS_TASK 256 /* groups of cubes for a thread at a time, some ten microseconds */
#define ROUNDING 1e-3f  /* more than what floats are off by, of what is compared with cubes' */

static inline float to_camera(const float m[4], float x, float y, float z)
{
	return m[0] * x + m[1] * y + m[2] * z + m[3];
}

/* Whether samples this many pixels apart need no depth buffer but the picture's; as the kernel decides. */
static inline int fits_pixel(float pixels)
{
	return pixels * (1 - 0x1p-12f) <= 1;
}

struct cull_sphere cull_view_sphere(const struct plan_instance *in, const float center[3], float radius)
{
	struct cull_sphere v;

	for (int a = 0; a < 3; a++)
		v.c[a] = to_camera(in->cull.center_m[a], center[0], center[1], center[2]);
	v.r = radius * in->cull.scale;
	return v;
}

struct cull_sphere cull_view_cluster(const struct plan_instance *in, const struct psr_cluster *k)
{
	return cull_view_sphere(in, k->center, k->radius);
}

static float nearest_cube_of(const struct plan_instance *in, const struct psr_cluster *k)
{
	const struct psr_cube_level *level = &in->cull.cubes->level[k->level];
	float nearest = INFINITY;

	for (uint32_t i = 0; i < k->n_blocks; i++) {
		double c[3];

		psr_cubes_center(in->cull.cubes, level, k->first_block + i, c);
		const float z = to_camera(in->cull.center_m[2], (float)c[0], (float)c[1], (float)c[2]);
		nearest = z < nearest ? z : nearest;
	}
	return nearest - (float)(CUBES_RADIUS * level->edge) * in->cull.scale;
}

/* The least z' of the spheres of a cluster's blocks. */
static float nearest_of(const struct plan_instance *in, const struct psr_cluster *k)
{
	if (in->cull.cubes != NULL)
		return nearest_cube_of(in, k);

	const struct psr_blocks *b = in->cull.blocks;
	const int16_t *x = b->sphere_x + k->first_block, *y = b->sphere_y + k->first_block;
	const int16_t *z = b->sphere_z + k->first_block;
	const uint16_t *r = b->sphere_r + k->first_block;
	const float *m = in->cull.center_m[2], half = 0.5f * in->cull.scale;
	float nearest = INFINITY;

	for (uint32_t i = 0; i < k->n_blocks; i++) {
		const float front = ((m[0] * x[i] + m[1] * y[i]) + m[2] * z[i]) - half * r[i];

		nearest = front < nearest ? front : nearest;
	}
	return nearest * (1.0f / 16384) + m[3];
}

/* Whether samples are dense enough for pixels, or the settings' spacing, all over the cluster. Tests its sphere first;
 * that reaches nearer than its blocks do, by half of its radius where it holds a whole model. */
static int fits_cluster(const struct plan *plan, const struct plan_instance *in, const struct psr_cluster *k)
{
	const struct cull_sphere v = cull_view_cluster(in, k);
	const float spacing = in->level_spacing * (float)(1u << k->level) * plan->finer;

	if (fits_pixel(cull_stretch(&in->cull, v.c[0], v.c[1], v.c[2], v.r, v.c[2] - v.r) * spacing))
		return 1;
	if (!plan->perspective || !fits_pixel(cull_stretch(&in->cull, v.c[0], v.c[1], v.c[2], v.r, v.c[2]) * spacing))
		return 0;
	return fits_pixel(cull_stretch(&in->cull, v.c[0], v.c[1], v.c[2], v.r, nearest_of(in, k)) * spacing);
}

/* From coarse to fine. */
static void choose_of_blocks(struct cull_group *group, const struct plan *plan, const struct plan_instance *in)
{
	const struct psr_blocks *b = in->cull.blocks;

	memset(group, 0, b->n_clusters * sizeof *group);
	for (unsigned level = b->n_levels; level-- > 0;)
		for (uint32_t k = 0; k < b->n_clusters; k++) {
			struct cull_group *g = &group[b->cluster[k].group];

			if (plan_is_cancelled_at(plan, k))
				return;
			if (b->cluster[k].level != level || g->fits)
				continue;
			g->level = (uint8_t)level;
			g->fits = level > 0 && fits_cluster(plan, in, &b->cluster[k]);
		}
}

/* ---- cubes: each level has a cluster of each group, in the order of groups ---- */

/* Returns a level above which none fits: where a unit of length spans least pixels, at a group's farthest, samples are more
 * than a pixel apart already. What is before the eye only in part tells nothing. */
static unsigned coarsest_of(const struct plan *plan, const struct plan_instance *in, const struct cull_sphere *v,
                            unsigned level)
{
	const float far = plan->perspective ? v->c[2] + v->r : 1;
	const float pixels = in->cull.focal / far * in->level_spacing * plan->finer * (1 - ROUNDING);

	if (plan->perspective && !(v->c[2] - v->r > plan->near_z))
		return level;
	while (level > 0 && pixels * (float)(1u << level) > 1)
		level--;
	return level;
}

struct choosing {
	struct cull_group *group;
	const struct plan *plan;
	const struct plan_instance *in;
};

/* Out of view any level will do. */
static void choose_of_cubes(int task, void *userdata)
{
	const struct choosing *c = userdata;
	const struct psr_blocks *b = c->in->cull.blocks;
	const uint32_t n_groups = b->n_clusters / b->n_levels, first = (uint32_t)task * GROUPS_TASK;
	const uint32_t end = n_groups - first < GROUPS_TASK ? n_groups : first + GROUPS_TASK;

	for (uint32_t i = first; i < end; i++) {
		const struct psr_cluster *own = &b->cluster[i];
		unsigned level = b->n_levels - 1;
		const struct cull_sphere v = cull_view_cluster(c->in, &own[level * n_groups]);
		const int is_out = !cull_sees_sphere(c->plan, &v);

		level = is_out ? 0 : coarsest_of(c->plan, c->in, &v, level);
		while (level > 0 && !fits_cluster(c->plan, c->in, &own[level * n_groups]))
			level--;
		c->group[i] = (struct cull_group){ .level = (uint8_t)level, .fits = level > 0, .is_out = (uint8_t)is_out };
	}
}

int cull_choose_levels(struct bins *bins, const struct plan *plan, struct psr_pool *pool)
{
	for (uint32_t i = 0; i < plan->n_instances && !plan_is_cancelled(plan); i++) {
		const struct plan_instance *in = &plan->instance[i];
		const struct psr_blocks *b = in->cull.blocks;
		struct choosing c = { bins->group + in->first_group, plan, in };

		if (in->cull.cubes == NULL) {
			choose_of_blocks(c.group, plan, in);
			continue;
		}
		const uint32_t n_tasks = (b->n_clusters / b->n_levels + GROUPS_TASK - 1) / GROUPS_TASK;
		psr_pool_for_until(n_tasks > 1 ? pool : NULL, &plan->cancel, (int)n_tasks, choose_of_cubes, &c);
	}
	return plan_is_cancelled(plan) ? PSR_ERR_CANCELLED : PSR_OK;
}

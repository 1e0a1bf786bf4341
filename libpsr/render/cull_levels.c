#include <math.h>
#include <string.h>
#include "cull.h"

#define FEW_BUNCHES 4  /* of groups of cubes, which take some microseconds: for one thread */
#define ROUNDING 1e-3f /* more than what floats are off by, of what is compared with cubes' */

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

/* Returns a level above which none fits: where a unit of length spans least pixels, at the sphere's farthest, samples
 * are more than a pixel apart already. What is before the eye only in part tells nothing. */
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

/* Out of view any level will do. */
static struct cull_group choose_group(const struct plan *plan, const struct plan_instance *in, uint32_t group)
{
	const struct psr_blocks *b = in->cull.blocks;
	const uint32_t n_groups = b->n_clusters / b->n_levels;
	const struct psr_cluster *own = &b->cluster[group];
	unsigned level = b->n_levels - 1;
	const struct cull_sphere v = cull_view_cluster(in, &own[level * n_groups]);

	if (!cull_sees_sphere(plan, &v))
		return (struct cull_group){ .is_out = 1, .n_alike = 1 };
	level = coarsest_of(plan, in, &v, level);
	while (level > 0 && !fits_cluster(plan, in, &own[level * n_groups]))
		level--;
	return (struct cull_group){ .level = (uint8_t)level, .fits = level > 0, .n_alike = 1 };
}

/* Chooses of a bunch of groups at once, if all are out of view; or if all may be in view, no level above one fits the
 * farthest of them, and that one fits the nearest. */
static int choose_alike(struct cull_group *out, const struct plan *plan, const struct plan_instance *in, uint32_t bunch)
{
	const struct psr_cube_bunch *bound = &in->cull.cubes->bunch[bunch];
	const struct cull_sphere v = cull_view_sphere(in, bound->center, bound->radius);

	*out = (struct cull_group){ .is_out = 1 };
	if (!cull_sees_sphere(plan, &v))
		return 1;
	if (plan->perspective && !(v.c[2] - v.r > plan->near_z))
		return 0;
	const unsigned level = coarsest_of(plan, in, &v, in->cull.blocks->n_levels - 1);
	const float stretch = cull_stretch(&in->cull, v.c[0], v.c[1], v.c[2], v.r, v.c[2] - v.r);
	const float pixels = stretch * in->level_spacing * (float)(1u << level) * plan->finer * (1 + ROUNDING);
	*out = (struct cull_group){ .level = (uint8_t)level, .fits = level > 0 };
	return (level == 0 || pixels <= 1) && cull_holds_sphere(plan, &v);
}

struct choosing {
	struct cull_group *group;
	const struct plan *plan;
	const struct plan_instance *in;
};

static void choose_of_bunch(int bunch, void *userdata)
{
	const struct choosing *c = userdata;
	const struct psr_blocks *b = c->in->cull.blocks;
	const uint32_t n_groups = b->n_clusters / b->n_levels, first = (uint32_t)bunch * CUBES_BUNCH;
	const uint32_t n = n_groups - first < CUBES_BUNCH ? n_groups - first : CUBES_BUNCH;
	struct cull_group alike;

	if (choose_alike(&alike, c->plan, c->in, (uint32_t)bunch)) {
		alike.n_alike = 1;
		for (uint32_t i = 1; i < n; i++)
			c->group[first + i] = alike;
		alike.n_alike = (uint8_t)n;
		c->group[first] = alike;
		return;
	}
	for (uint32_t i = first; i < first + n; i++)
		c->group[i] = choose_group(c->plan, c->in, i);
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
		const uint32_t n_bunches = (b->n_clusters / b->n_levels + CUBES_BUNCH - 1) / CUBES_BUNCH;
		psr_pool_for_until(n_bunches > FEW_BUNCHES ? pool : NULL, &plan->cancel, (int)n_bunches, choose_of_bunch, &c);
	}
	return plan_is_cancelled(plan) ? PSR_ERR_CANCELLED : PSR_OK;
}

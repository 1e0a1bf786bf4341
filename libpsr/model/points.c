#include "points.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include "base/mem.h"
#include "base/vec.h"
#include "file.h"

#define MOST_SPHERE 1.999f /* of a coordinate and a radius: spheres have 16 bits for 2 */
#define LEAST_COSINE 0.05f
#define SPHERE_SLACK 0x1p-20f /* rounding of the centre's distance */

enum { SET_GROUPS = 0, SET_POINTS = 4, SET_SINE = 8, SET_HEIGHT = 12 };

#define fail(section, format, ...) \
	psr_fail(err, PSR_ERR_FORMAT, "%s: section %s: " format, name, section, ##__VA_ARGS__)

/* ---- the file's structure ---- */

void file_put_points(uint8_t *at, const struct dpoint_set *set)
{
	file_put(at + SET_GROUPS, 4, set->n_groups);
	file_put(at + SET_POINTS, 4, set->n_points);
	file_put(at + SET_SINE, 4, psr_bits_from_float(set->sine));
	file_put(at + SET_HEIGHT, 4, psr_bits_from_float(set->height));
}

void file_get_points(struct dpoint_set *set, const uint8_t *at)
{
	set->n_groups = (uint32_t)file_get(at + SET_GROUPS, 4);
	set->n_points = (uint32_t)file_get(at + SET_POINTS, 4);
	set->sine = psr_float_from_bits((uint32_t)file_get(at + SET_SINE, 4));
	set->height = psr_float_from_bits((uint32_t)file_get(at + SET_HEIGHT, 4));
}

uint32_t file_lean_count(uint64_t length)
{
	const uint64_t n = length / section_table[SECTION_POINT_LEAN].item_bytes;

	return n < UINT32_MAX ? (uint32_t)n : UINT32_MAX;
}

int model_check_point_counts(const struct dpoint_set *set, const char *name, struct psr_error *err)
{
	if (set->n_groups == 0 || set->n_groups > MODEL_MAX_BLOCKS)
		return fail("DPNT", "%" PRIu32 " groups; it must be 1 to %" PRIu32, set->n_groups, MODEL_MAX_BLOCKS);
	if (set->n_points < set->n_groups || set->n_points / DPOINT_GROUP > set->n_groups)
		return fail("DPNT", "%" PRIu32 " points do not fit %" PRIu32 " groups of up to %d", set->n_points, set->n_groups,
		            DPOINT_GROUP);
	if (set->n_lean > set->n_points)
		return fail("DLEN", "%" PRIu32 " of %" PRIu32 " points lean", set->n_lean, set->n_points);
	/* Not (... > ...), so that NaN fails as well. */
	if (!(set->sine > 0 && set->sine <= 1) || !(set->height >= 0 && set->height <= 2))
		return fail("DPNT", "the sine %g is not above 0 and at most 1, or the height %g not 0 to 2", (double)set->sine,
		            (double)set->height);
	return PSR_OK;
}

static int check_group(const struct dpoint_set *set, uint32_t i, uint64_t next, const char *name, struct psr_error *err)
{
	const struct dpoint_group *g = &set->group[i];
	int is_bad = 0;

	if (g->first != next || g->n == 0 || g->n > DPOINT_GROUP || g->n > set->n_points - next)
		return fail("DGRP", "group %" PRIu32 " has %d points from %" PRIu32 " on; the next free one is %" PRIu64 " of %"
		            PRIu32, i, g->n, g->first, next, set->n_points);
	for (int k = 0; k < 2; k++)
		is_bad |= set->delta != NULL ? g->delta[k] != DPOINT_OWN_DELTA : g->delta[k] >= DPOINT_DELTA_CLASSES;
	if (is_bad || (g->flags & ~(DPOINT_TWO_SIDED | DPOINT_LEANING)) != 0)
		return fail("DGRP", "group %" PRIu32 " has deltas of classes %d and %d, and flags %d", i, g->delta[0], g->delta[1],
		            g->flags);
	if (((g->flags & DPOINT_LEANING) != 0) != (g->first >= set->n_points - set->n_lean))
		return fail("DGRP", "group %" PRIu32 " of point %" PRIu32 " has flags %d; the last %" PRIu32 " of %" PRIu32 " points"
		            " lean", i, g->first, g->flags, set->n_lean, set->n_points);
	for (int k = 0; k < 3; k++)
		if (!(fabsf(g->box.low[k]) <= MOST_SPHERE) || !(g->box.step[k] >= 0 && g->box.step[k] <= MOST_SPHERE))
			return fail("DGRP", "the box of group %" PRIu32 " begins at %g and has steps of %g", i,
			            (double)g->box.low[k], (double)g->box.step[k]);
	return PSR_OK;
}

int model_validate_points(const struct dpoint_set *set, const char *name, struct psr_error *err)
{
	uint64_t next = 0;
	int code;

	for (uint32_t i = 0; i < set->n_groups; i++) {
		code = check_group(set, i, next, name, err);
		if (code != PSR_OK)
			return code;
		next += set->group[i].n;
	}
	if (next != set->n_points)
		return fail("DGRP", "points %" PRIu64 " to %" PRIu32 " are in no group", next, set->n_points - 1);
	for (uint32_t i = 0; i < set->n_points; i++)
		if (!dpoint_word_is_valid(&set->word[i]))
			return fail("DWRD", "the curvatures of point %" PRIu32 " have no meaning", i);
	for (uint32_t i = 0; i < set->n_points && set->delta != NULL; i++)
		if (set->delta[i][0] >= DPOINT_DELTA_CLASSES || set->delta[i][1] >= DPOINT_DELTA_CLASSES)
			return fail("DDLT", "point %" PRIu32 " has deltas of classes %d and %d", i, set->delta[i][0], set->delta[i][1]);
	for (uint32_t i = 0; i < set->n_lean; i++)
		for (int k = 0; k < 4; k++)
			if (!(fabsf(dpoint_lean_by(set->lean[i].by[k / 2][k % 2])) <= DPOINT_MOST_LEAN_BY))
				return fail("DLEN", "the lean of point %" PRIu32 " grows by %g", i,
				            (double)dpoint_lean_by(set->lean[i].by[k / 2][k % 2]));
	return PSR_OK;
}

/* ---- what is drawn ---- */

struct making {
	struct psr_points *points;
	struct psr_cluster *cluster;
	uint64_t *mask;
	int16_t *center[3];
	uint16_t *radius;
	int8_t *axis[3];
	uint8_t *sine, *flags;
};

/* One allocation, the widest elements first. */
static int make_arrays(struct making *m)
{
	struct psr_points *points = m->points;
	const size_t n = points->groups.n_blocks, n_clusters = points->groups.n_clusters;
	const size_t size = n * (sizeof *m->mask + 4 * sizeof(int16_t) + 5) + n_clusters * sizeof *m->cluster;

	m->mask = psr_alloc_array(size, 1);
	if (m->mask == NULL)
		return 0;
	points->n_bytes = sizeof *points + size;
	m->cluster = (struct psr_cluster *)(void *)(m->mask + n);
	m->center[0] = (int16_t *)(void *)(m->cluster + n_clusters);
	m->center[1] = m->center[0] + n;
	m->center[2] = m->center[1] + n;
	m->radius = (uint16_t *)(m->center[2] + n);
	m->flags = (uint8_t *)(m->radius + n);
	m->sine = m->flags + n;
	for (int k = 0; k < 3; k++)
		m->axis[k] = (int8_t *)m->sine + (size_t)(k + 1) * n;
	return 1;
}

/* Rounds a sphere to what blocks have. Returns 0 if it is beyond that. */
static int put_sphere(struct making *m, uint32_t i)
{
	struct dpoint_sphere sphere;
	float away[3], radius;

	dpoint_group_sphere(&sphere, m->points->set, i);
	for (int k = 0; k < 3; k++) {
		if (!(fabsf(sphere.middle[k]) <= MOST_SPHERE))
			return 0;
		m->center[k][i] = (int16_t)floorf(sphere.middle[k] * 16384 + 0.5f);
		away[k] = sphere.middle[k] - (float)m->center[k][i] * (1.0f / 16384);
	}
	radius = sphere.radius + v3f_length(away) + SPHERE_SLACK + DPOINT_GRAZES * m->points->graze;
	if (!(radius <= MOST_SPHERE))
		return 0;
	m->radius[i] = (uint16_t)ceilf(radius * 32768);
	return 1;
}

static void put_cone(struct making *m, uint32_t i)
{
	float mean[3], axis[3], most = 0, cosine;

	dpoint_group_cosine(mean, NULL, m->points->set, i);
	for (int k = 0; k < 3; k++)
		most = fmaxf(most, fabsf(mean[k]));
	for (int k = 0; k < 3; k++) {
		axis[k] = most > 0 ? floorf(mean[k] / most * 127 + 0.5f) : k == 0 ? 127 : 0;
		m->axis[k][i] = (int8_t)axis[k];
	}
	v3f_normalize(axis, axis);
	cosine = dpoint_group_cosine(NULL, axis, m->points->set, i);
	const float sine = ceilf(sqrtf(fmaxf(1 - cosine * cosine, 0)) * 255 + 1e-3f);
	m->sine[i] = (uint8_t)(cosine >= LEAST_COSINE && sine < PSR_CONE_ANY ? sine : PSR_CONE_ANY);
}

static void put_cluster(struct making *m, uint32_t c)
{
	const struct psr_blocks *groups = &m->points->groups;
	const uint32_t first = c * POINTS_CLUSTER, left = groups->n_blocks - first;
	struct psr_cluster *cluster = &m->cluster[c];
	float low[3] = { 2, 2, 2 }, high[3] = { -2, -2, -2 };

	*cluster = (struct psr_cluster){ .first_block = first, .n_blocks = left < POINTS_CLUSTER ? left : POINTS_CLUSTER,
		                             .group = c };
	for (uint32_t i = first; i < first + cluster->n_blocks; i++) {
		float center[3], radius;

		psr_blocks_sphere(groups, i, center, &radius);
		for (int k = 0; k < 3; k++) {
			low[k] = fminf(low[k], center[k]);
			high[k] = fmaxf(high[k], center[k]);
		}
	}
	for (int k = 0; k < 3; k++)
		cluster->center[k] = 0.5f * (low[k] + high[k]);
	for (uint32_t i = first; i < first + cluster->n_blocks; i++) {
		float center[3], radius, away[3];

		psr_blocks_sphere(groups, i, center, &radius);
		v3f_sub(away, center, cluster->center);
		cluster->radius = fmaxf(cluster->radius, (v3f_length(away) + radius) * 1.00001f);
	}
}

static void point_to(struct psr_blocks *groups, const struct making *m, int has_cones)
{
	groups->cluster = m->cluster;
	groups->mask = m->mask;
	groups->sphere_x = m->center[0];
	groups->sphere_y = m->center[1];
	groups->sphere_z = m->center[2];
	groups->sphere_r = m->radius;
	groups->flags = m->flags;
	if (!has_cones)
		return;
	groups->cone_x = m->axis[0];
	groups->cone_y = m->axis[1];
	groups->cone_z = m->axis[2];
	groups->cone_sine = m->sine;
}

int psr_points_create(struct psr_points **out, const struct dpoint_set *set, uint32_t resolution, const char *name,
                      struct psr_error *err)
{
	struct psr_points *points = calloc(1, sizeof *points);
	struct making m = { .points = points };
	int has_cones = 0;

	if (points == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for its points", name);
	points->set = set;
	points->graze = dpoint_graze(resolution);
	points->groups = (struct psr_blocks){ .n_blocks = set->n_groups, .n_levels = 1, .n_samples = set->n_points,
		                                  .n_clusters = (set->n_groups + POINTS_CLUSTER - 1) / POINTS_CLUSTER };
	if (!make_arrays(&m)) {
		free(points);
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for %" PRIu32 " groups of points", name, set->n_groups);
	}
	points->groups.mask = m.mask;
	for (uint32_t i = 0; i < set->n_groups; i++) {
		const int is_two_sided = (set->group[i].flags & DPOINT_TWO_SIDED) != 0;

		m.mask[i] = UINT64_MAX >> (64 - set->group[i].n);
		m.flags[i] = is_two_sided ? PSR_BLOCK_TWO_SIDED : 0;
		has_cones |= !is_two_sided;
		if (!put_sphere(&m, i)) {
			psr_points_destroy(points);
			return fail("DGRP", "the points of group %" PRIu32 " reach further than 2 from the origin", i);
		}
		put_cone(&m, i);
	}
	point_to(&points->groups, &m, has_cones);
	for (uint32_t c = 0; c < points->groups.n_clusters; c++)
		put_cluster(&m, c);
	*out = points;
	return PSR_OK;
}

void psr_points_destroy(struct psr_points *points)
{
	if (points == NULL)
		return;
	psr_free((void *)(uintptr_t)points->groups.mask);
	free(points);
}

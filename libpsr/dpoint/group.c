#include "group.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/radix.h"
#include "base/vec.h"

#define MORTON_BITS 30

/* Sides and deltas first, then the place. */
static uint64_t key_of(uint32_t kind, uint32_t morton)
{
	return (uint64_t)kind << MORTON_BITS | morton;
}

static uint32_t kind_of_key(const struct radix_entry *key)
{
	return (uint32_t)(key->key >> MORTON_BITS);
}

/* Ten bits an axis of -1..1. */
static uint32_t morton_of(const float at[3])
{
	uint32_t morton = 0;

	for (int k = 0; k < 3; k++) {
		const uint32_t x = (uint32_t)(fminf(fmaxf(at[k] * 0.5f + 0.5f, 0), 0.999f) * 1024);

		for (int bit = 0; bit < 10; bit++)
			morton |= (x >> bit & 1) << (3 * bit + k);
	}
	return morton;
}

/* How many of the keys can be one group. */
static uint32_t cut(float low[3], float high[3], const struct radix_entry *key, size_t n,
                    const struct dpoint_surface *surface)
{
	const uint32_t kind = kind_of_key(key);
	uint32_t count = 0;

	for (; count < n && count < DPOINT_GROUP; count++) {
		const float *at = surface->candidate[key[count].value].point.at;
		float lower[3], higher[3], most = 0;

		if (kind_of_key(&key[count]) != kind)
			break;
		for (int k = 0; k < 3; k++) {
			lower[k] = count > 0 ? fminf(low[k], at[k]) : at[k];
			higher[k] = count > 0 ? fmaxf(high[k], at[k]) : at[k];
			most = fmaxf(most, higher[k] - lower[k]);
		}
		if (most > DPOINT_MOST_BOX)
			break;
		memcpy(low, lower, sizeof lower);
		memcpy(high, higher, sizeof higher);
	}
	return count;
}

static int is_leaning(const struct dpoint_surface *surface, uint32_t candidate)
{
	return candidate - surface->first_lean < surface->n_lean;
}

/* Flags, and classes of deltas. */
static uint32_t kind_of(const struct dpoint_grouping *grouping, uint32_t candidate, int has_own)
{
	const struct dpoint_candidate *c = &grouping->surface->candidate[candidate];
	const uint32_t du = has_own ? DPOINT_OWN_DELTA : dpoint_delta_class(c->delta[0]);
	const uint32_t dv = has_own ? DPOINT_OWN_DELTA : dpoint_delta_class(c->delta[1]);
	uint32_t flags = is_leaning(grouping->surface, candidate) ? DPOINT_LEANING : 0;

	if (grouping->is_two_sided != NULL && grouping->is_two_sided[c->part])
		flags |= DPOINT_TWO_SIDED;
	return flags << 16 | du << 8 | dv;
}

/* Groups before they are in their order: the first key of each. */
struct cut_group {
	struct dpoint_group group;
	uint32_t morton, first; /* of its middle, those that lean last; of its keys */
};

static int compare_groups(const void *a, const void *b)
{
	const struct cut_group *x = a, *y = b;

	if (x->morton != y->morton)
		return x->morton < y->morton ? -1 : 1;
	return x->first < y->first ? -1 : x->first > y->first;
}

static size_t cut_all(struct cut_group *to, const struct radix_entry *key, size_t n,
                      const struct dpoint_surface *surface)
{
	size_t n_groups = 0;

	for (size_t i = 0; i < n; i += to[n_groups - 1].group.n) {
		struct cut_group *cut_group = &to[n_groups++];
		struct dpoint_group *g = &cut_group->group;
		const uint32_t kind = kind_of_key(&key[i]);
		float low[3], high[3], middle[3];

		memset(cut_group, 0, sizeof *cut_group);
		g->n = (uint8_t)cut(low, high, &key[i], n - i, surface);
		g->delta[0] = (uint8_t)(kind >> 8);
		g->delta[1] = (uint8_t)kind;
		g->flags = (uint8_t)(kind >> 16);
		dpoint_box_make(&g->box, low, high);
		for (int k = 0; k < 3; k++)
			middle[k] = 0.5f * (low[k] + high[k]);
		cut_group->morton = morton_of(middle) | (g->flags & DPOINT_LEANING ? 1u << MORTON_BITS : 0);
		cut_group->first = (uint32_t)i;
	}
	return n_groups;
}

/* The kept candidates and their groups. */
struct making {
	const struct dpoint_grouping *grouping;
	struct radix_entry *key; /* the value is a candidate */
	struct cut_group *cut_group;
	size_t n, n_groups;
};

static void group_all(struct making *m, int has_own)
{
	const struct dpoint_surface *surface = m->grouping->surface;

	m->n = 0;
	for (uint32_t i = 0; i < surface->n_candidates; i++) {
		const struct dpoint_candidate *c = &surface->candidate[i];

		if (m->grouping->choice->is_kept[i])
			m->key[m->n++] = (struct radix_entry){
				key_of(kind_of(m->grouping, i, has_own), morton_of(c->point.at)), i };
	}
	radix_sort(m->key, m->n);
	m->n_groups = cut_all(m->cut_group, m->key, m->n, surface);
}

/* Rims of trimmed faces have many lengths, and two points of one length are seldom neighbours. Returns whether points
 * have deltas of their own. */
static int group_shortest(struct making *m)
{
	size_t shared, own;

	group_all(m, 0);
	shared = m->n_groups * sizeof(struct dpoint_group);
	own = m->n * sizeof *((struct dpoint_set *)NULL)->delta;
	if (shared <= own)
		return 0;
	group_all(m, 1);
	if (own + m->n_groups * sizeof(struct dpoint_group) < shared)
		return 1;
	group_all(m, 0);
	return 0;
}

static void put_words(struct dpoint_set *set, struct dpoint_group *group, struct dpoint_word *word, uint8_t (*delta)[2],
                      struct dpoint_lean *lean, const struct making *m)
{
	const struct dpoint_surface *surface = m->grouping->surface;

	for (uint32_t i = 0; i < set->n_groups; i++) {
		const struct radix_entry *first = &m->key[m->cut_group[i].first];

		group[i] = m->cut_group[i].group;
		group[i].first = set->n_points;
		for (uint32_t k = 0; k < group[i].n; k++) {
			const struct dpoint_candidate *c = &surface->candidate[first[k].value];

			for (int side = 0; side < 2 && delta != NULL; side++)
				delta[set->n_points][side] = (uint8_t)dpoint_delta_class(c->delta[side]);
			if (group[i].flags & DPOINT_LEANING)
				lean[set->n_lean++] = surface->lean[first[k].value - surface->first_lean];
			dpoint_pack(&word[set->n_points++], &c->point, &group[i].box);
		}
	}
}

int dpoint_set_make(struct dpoint_set *set, const struct dpoint_grouping *grouping)
{
	const size_t room = grouping->choice->n_kept + 1;
	struct making m = { .grouping = grouping, .key = malloc(2 * room * sizeof *m.key),
		                .cut_group = malloc(room * sizeof *m.cut_group) };
	struct dpoint_group *group = malloc(room * sizeof *group);
	struct dpoint_word *word = malloc(room * sizeof *word);
	uint8_t (*delta)[2] = NULL;
	struct dpoint_lean *lean = NULL;
	int rc = room > UINT32_MAX ? PSR_ERR_LIMIT : PSR_OK;

	*set = (struct dpoint_set){ .sine = grouping->sine, .group = group, .word = word };
	if (rc == PSR_OK && (m.key == NULL || m.cut_group == NULL || group == NULL || word == NULL))
		rc = PSR_ERR_MEMORY;
	if (rc == PSR_OK && group_shortest(&m)) {
		set->delta = (const uint8_t (*)[2])(delta = malloc(room * sizeof *delta));
		rc = delta == NULL ? PSR_ERR_MEMORY : PSR_OK;
	}
	if (rc == PSR_OK && grouping->surface->n_lean > 0) {
		set->lean = lean = malloc(grouping->surface->n_lean * sizeof *lean);
		rc = lean == NULL ? PSR_ERR_MEMORY : PSR_OK;
	}
	if (rc == PSR_OK) {
		qsort(m.cut_group, m.n_groups, sizeof *m.cut_group, compare_groups);
		set->n_groups = (uint32_t)m.n_groups;
		put_words(set, group, word, delta, lean, &m);
	}
	free(m.key);
	free(m.cut_group);
	return rc;
}

void dpoint_set_fini(struct dpoint_set *set)
{
	free((void *)(uintptr_t)set->group);
	free((void *)(uintptr_t)set->word);
	free((void *)(uintptr_t)set->delta);
	free((void *)(uintptr_t)set->lean);
	memset(set, 0, sizeof *set);
}

/* ---- bounds ---- */

/* A corner of a point's rectangle: its place, how far the quadric is from it at most, and both normals there. Along
 * each side normals' components grow with the distance from the middle, so that corners have the extremes. */
struct corner {
	float at[3], height, normal[2][3];
};

static void turn(float out[3], const struct dpoint *p, const float across[3], const float local[3])
{
	for (int k = 0; k < 3; k++)
		out[k] = local[0] * p->u[k] + local[1] * across[k] + local[2] * p->normal[k];
	v3f_normalize(out, out);
}

static void corner_of(struct corner *c, const struct dpoint *p, const float extent[2], int which)
{
	const float u = which & 1 ? extent[0] : -extent[0], v = which & 2 ? extent[1] : -extent[1];
	float across[3], local[3];

	v3f_cross(across, p->normal, p->u);
	dpoint_normal_at(local, p->lambda_u, p->rho, u, v);
	turn(c->normal[0], p, across, local);
	v3f_set(local, -p->lambda_u * u, -p->lambda_u * p->rho * v, 1);
	turn(c->normal[1], p, across, local);
	for (int k = 0; k < 3; k++)
		c->at[k] = p->at[k] + u * p->u[k] + v * across[k];
	c->height = 0.5f * fabsf(p->lambda_u) * (u * u + fabsf(p->rho) * (v * v));
}

static void point_of(struct dpoint *p, float extent[2], const struct dpoint_set *set, const struct dpoint_group *g,
                     uint32_t k)
{
	const struct dpoint_limit limit = dpoint_limit_of(set, g, k);

	dpoint_unpack(p, &set->word[g->first + k], &g->box);
	dpoint_extent(extent, p, &limit);
}

void dpoint_group_sphere(struct dpoint_sphere *sphere, const struct dpoint_set *set, uint32_t group)
{
	const struct dpoint_group *g = &set->group[group];

	for (int k = 0; k < 3; k++)
		sphere->middle[k] = g->box.low[k] + 0.5f * DPOINT_PLACE_STEPS * g->box.step[k];
	sphere->radius = 0;
	for (uint32_t i = 0; i < g->n; i++) {
		struct dpoint p;
		struct corner c;
		float extent[2], away[3];

		point_of(&p, extent, set, g, i);
		for (int which = 0; which < 4; which++) {
			corner_of(&c, &p, extent, which);
			v3f_sub(away, c.at, sphere->middle);
			sphere->radius = fmaxf(sphere->radius, v3f_length(away) + c.height);
		}
	}
	sphere->radius *= 1.00001f;
}

float dpoint_group_cosine(float mean[3], const float axis[3], const struct dpoint_set *set, uint32_t group)
{
	const struct dpoint_group *g = &set->group[group];
	float least = 1;

	if (axis == NULL) {
		v3f_set(mean, 0, 0, 0);
		for (uint32_t i = 0; i < g->n; i++) {
			struct dpoint p;
			float extent[2];

			point_of(&p, extent, set, g, i);
			v3f_add(mean, mean, p.normal);
		}
		v3f_normalize(mean, mean);
		axis = mean;
	}
	for (uint32_t i = 0; i < g->n; i++) {
		struct dpoint p;
		float extent[2];

		point_of(&p, extent, set, g, i);
		for (int which = 0; which < 4; which++) {
			struct corner c;

			corner_of(&c, &p, extent, which);
			least = fminf(least, fminf(v3f_dot(c.normal[0], axis), v3f_dot(c.normal[1], axis)));
		}
	}
	return least - 1e-6f;
}

#include "group.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"

/* Deltas first, then the place. */
struct key {
	float delta[2];
	uint32_t morton, candidate;
};

static int compare(const void *a, const void *b)
{
	const struct key *x = a, *y = b;

	for (int k = 0; k < 2; k++)
		if (x->delta[k] != y->delta[k])
			return x->delta[k] < y->delta[k] ? -1 : 1;
	if (x->morton != y->morton)
		return x->morton < y->morton ? -1 : 1;
	return x->candidate < y->candidate ? -1 : x->candidate > y->candidate;
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
static uint32_t cut(float low[3], float high[3], const struct key *key, size_t n, const struct dpoint_surface *surface)
{
	uint32_t count = 0;

	for (; count < n && count < DPOINT_GROUP; count++) {
		const float *at = surface->candidate[key[count].candidate].point.at;
		float lower[3], higher[3], most = 0;

		if (key[count].delta[0] != key->delta[0] || key[count].delta[1] != key->delta[1])
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

/* A corner of a point's rectangle, its normal by (6), and the most that S_p is above it. */
struct corner {
	float at[3], normal[3], height;
};

static void corner_of(struct corner *c, const struct dpoint *p, const float extent[2], int which)
{
	const float u = which & 1 ? extent[0] : -extent[0], v = which & 2 ? extent[1] : -extent[1];
	float across[3], n[3];

	v3f_cross(across, p->normal, p->u);
	dpoint_normal_at(n, p->lambda_u, p->rho, u, v);
	for (int k = 0; k < 3; k++) {
		c->at[k] = p->at[k] + u * p->u[k] + v * across[k];
		c->normal[k] = n[0] * p->u[k] + n[1] * across[k] + n[2] * p->normal[k];
	}
	v3f_normalize(c->normal, c->normal);
	c->height = sqrtf(u * u + v * v);
}

/* The sphere is about the box's middle. S_p is no higher above a rectangle than its corner is from the point, and its
 * normals turn least in the middle: corners have the extremes of both components. */
static void bound(struct dpoint_group *g, const struct dpoint_groups *groups, float sine)
{
	const struct dpoint_limit limit = { sine, { g->delta[0], g->delta[1] } };

	v3f_set(g->axis, 0, 0, 0);
	for (int k = 0; k < 3; k++)
		g->middle[k] = g->box.low[k] + 0.5f * DPOINT_PLACE_STEPS * g->box.step[k];
	for (int pass = 0; pass < 2; pass++) {
		for (uint32_t i = 0; i < g->n; i++) {
			struct dpoint p;
			float extent[2];

			dpoint_unpack(&p, &groups->word[g->first + i], &g->box);
			dpoint_extent(extent, &p, &limit);
			if (pass == 0)
				v3f_add(g->axis, g->axis, p.normal);
			for (int which = 0; which < 4 && pass == 1; which++) {
				struct corner c;
				float away[3];

				corner_of(&c, &p, extent, which);
				v3f_sub(away, c.at, g->middle);
				g->radius = fmaxf(g->radius, v3f_length(away) + c.height);
				v3f_sub(away, c.normal, g->axis);
				g->chord = fmaxf(g->chord, v3f_length(away));
			}
		}
		if (pass == 0)
			v3f_normalize(g->axis, g->axis);
	}
	g->radius *= 1.00001f;
	g->chord = fminf(g->chord * 1.00001f + 1e-6f, 2);
}

int dpoint_groups_make(struct dpoint_groups *groups, const struct dpoint_surface *surface,
                       const struct dpoint_choice *choice, float sine)
{
	struct key *key = malloc((choice->n_kept + 1) * sizeof *key);
	size_t n = 0;

	memset(groups, 0, sizeof *groups);
	groups->word = malloc((choice->n_kept + 1) * sizeof *groups->word);
	groups->group = calloc(choice->n_kept + 1, sizeof *groups->group);
	if (key == NULL || groups->word == NULL || groups->group == NULL) {
		free(key);
		return PSR_ERR_MEMORY;
	}
	for (uint32_t i = 0; i < surface->n_candidates; i++) {
		const struct dpoint_candidate *c = &surface->candidate[i];

		if (choice->is_kept[i])
			key[n++] = (struct key){ { c->delta[0], c->delta[1] }, morton_of(c->point.at), i };
	}
	qsort(key, n, sizeof *key, compare);
	for (size_t i = 0; i < n; i += groups->group[groups->n_groups - 1].n) {
		struct dpoint_group *g = &groups->group[groups->n_groups++];
		float low[3], high[3];

		g->first = (uint32_t)i;
		g->n = cut(low, high, &key[i], n - i, surface);
		memcpy(g->delta, key[i].delta, sizeof g->delta);
		dpoint_box_make(&g->box, low, high);
		for (uint32_t k = 0; k < g->n; k++)
			dpoint_pack(&groups->word[i + k], &surface->candidate[key[i + k].candidate].point, &g->box);
		bound(g, groups, sine);
	}
	groups->n_words = n;
	free(key);
	return PSR_OK;
}

void dpoint_groups_fini(struct dpoint_groups *groups)
{
	free(groups->group);
	free(groups->word);
	memset(groups, 0, sizeof *groups);
}

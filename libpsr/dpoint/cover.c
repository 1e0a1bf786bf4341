/* Which cells each candidate covers. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/array.h"
#include "base/vec.h"
#include "cell_tree.h"

#define CHUNK 256 /* candidates */
/* Of unit vectors so near to each other the angle's tangent is at most 1.2 times their distance. */
#define MOST_CHORD 0.6f

struct looking {
	struct dpoint_cover *cover;
	const struct dpoint_surface *surface;
	const struct dpoint_cover_options *options;
	const struct cell_tree *tree;
	float cosine, chord; /* of options->angle; chord: 2 sin(angle / 2), at most MOST_CHORD */
	int is_failed;
};

/* A candidate as cells see it. */
struct rectangle {
	float at[3], axis[3][3]; /* u, v, normal */
	float extent[2];         /* to be covered with: shortened */
	float deep;              /* how far from the tangent plane any of its cells may be */
	float height;
	float lambda_u, rho;
	uint32_t part;
};

static void rectangle_of(struct rectangle *r, const struct dpoint_candidate *c,
                         const struct dpoint_cover_options *options)
{
	const struct dpoint_limit limit = { options->sine, { c->delta[0], c->delta[1] } };
	const float lambda[2] = { c->point.lambda_u, c->point.lambda_u * c->point.rho };
	float rise = 0;

	memcpy(r->at, c->point.at, sizeof r->at);
	memcpy(r->axis[0], c->point.u, sizeof r->axis[0]);
	memcpy(r->axis[2], c->point.normal, sizeof r->axis[2]);
	v3f_cross(r->axis[1], r->axis[2], r->axis[0]);
	r->lambda_u = c->point.lambda_u;
	r->rho = c->point.rho;
	r->part = c->part;
	dpoint_extent(r->extent, &c->point, &limit);
	r->height = fminf(options->height, 0.5f * fminf(r->extent[0], r->extent[1]));
	for (int k = 0; k < 2; k++) {
		const float w = lambda[k] * r->extent[k];

		rise = fmaxf(rise, 2 * fabsf(w) * r->extent[k]);
		r->extent[k] = r->extent[k] * sqrtf(fmaxf(0, 1 - w * w)) - options->slack;
	}
	r->deep = rise + r->height;
}

static void seen(float at[3], const struct rectangle *r, const float p[3])
{
	float away[3];

	v3f_sub(away, p, r->at);
	m3f_apply(at, (const float (*)[3])r->axis, away);
}

static int is_covered(const struct looking *l, const struct rectangle *r, const struct dpoint_cell *cell)
{
	float middle[3] = { 0, 0, 0 }, p[3], n[3], cell_normal[3], dot;

	if (l->options->is_within_parts && cell->part != r->part)
		return 0;
	for (int c = 0; c < 4; c++) {
		seen(p, r, cell->corner[c]);
		if (!(fabsf(p[0]) <= r->extent[0] && fabsf(p[1]) <= r->extent[1]))
			return 0;
		v3f_add_scaled(middle, middle, 0.25f, p);
	}
	if (!(fabsf(middle[2] - dpoint_height_at(r->lambda_u, r->rho, middle[0], middle[1])) <= r->height))
		return 0;
	if (cell->normal[0] == 0 && cell->normal[1] == 0 && cell->normal[2] == 0)
		return 1;
	dpoint_normal_at(n, r->lambda_u, r->rho, middle[0], middle[1]);
	m3f_apply(cell_normal, (const float (*)[3])r->axis, cell->normal);
	dot = v3f_dot(n, cell_normal);
	return dot > 0 && dot * dot >= l->cosine * l->cosine * v3f_dot(n, n);
}

/* Whether all of a node's cells are covered, told by its sphere and its normals alone. Within the sphere S_p's normal
 * turns by radius |lambda_u| at most, and heights part by the tangent of the normals' difference. */
static int is_covered_whole(const struct looking *l, const struct rectangle *r, const struct cell_node *node,
                            const float p[3])
{
	float n[3], normal[3], chord;

	if (!(fabsf(p[0]) + node->radius <= r->extent[0] && fabsf(p[1]) + node->radius <= r->extent[1]) ||
	    node->spread >= MOST_CHORD || (l->options->is_within_parts && node->part != r->part))
		return 0;
	dpoint_normal_at(n, r->lambda_u, r->rho, p[0], p[1]);
	v3f_normalize(n, n);
	m3f_apply(normal, (const float (*)[3])r->axis, node->normal);
	v3f_sub(n, n, normal);
	chord = v3f_length(n) + node->spread + 1.6f * node->radius * fabsf(r->lambda_u);
	return chord <= l->chord && fabsf(p[2] - dpoint_height_at(r->lambda_u, r->rho, p[0], p[1])) +
	                            1.2f * chord * node->radius <= r->height;
}

struct found {
	uint32_t *node;
	size_t n, room;
	int is_failed;
};

/* The covered nodes of a subtree. */
static void search(struct found *found, const struct looking *l, const struct rectangle *r, size_t i)
{
	const struct cell_node *node = &l->tree->node[i];
	const int is_leaf = cell_node_is_leaf(node);
	float p[3];

	seen(p, r, node->middle);
	if (!(fabsf(p[0]) <= r->extent[0] + node->radius && fabsf(p[1]) <= r->extent[1] + node->radius &&
	      fabsf(p[2]) <= r->deep + node->radius))
		return;
	if (is_leaf ? !is_covered(l, r, &l->surface->cell[l->tree->order[node->begin]]) : !is_covered_whole(l, r, node, p)) {
		if (!is_leaf) {
			search(found, l, r, 2 * i + 1);
			search(found, l, r, 2 * i + 2);
		}
		return;
	}
	if (!ARRAY_ROOM(found->node, found->n, found->room)) {
		found->is_failed = 1;
		return;
	}
	found->node[found->n++] = (uint32_t)i;
}

size_t dpoint_cover_size(const struct dpoint_cover *cover, uint32_t candidate)
{
	size_t n = 0;

	for (uint32_t k = 0; k < cover->n[candidate]; k++) {
		const struct cell_node *node = &cover->tree->node[cover->list[candidate][k]];

		n += node->end - node->begin;
	}
	return n;
}

static void look(int chunk, void *userdata)
{
	struct looking *l = userdata;
	struct dpoint_cover *cover = l->cover;
	const size_t begin = (size_t)chunk * CHUNK;
	const size_t end = begin + CHUNK < cover->n_candidates ? begin + CHUNK : cover->n_candidates;
	struct found found = { NULL, 0, 0, 0 };
	size_t at = 0;

	for (size_t i = begin; i < end; i++) {
		struct rectangle r;
		const size_t before = found.n;

		rectangle_of(&r, &l->surface->candidate[i], l->options);
		if (r.extent[0] > 0 && r.extent[1] > 0)
			search(&found, l, &r, 0);
		cover->n[i] = (uint32_t)(found.n - before);
	}
	cover->chunk[chunk] = found.node;
	for (size_t i = begin; i < end; i++) {
		cover->list[i] = found.node + at;
		at += cover->n[i];
	}
	if (found.is_failed)
		__atomic_store_n(&l->is_failed, 1, __ATOMIC_RELAXED);
}

int dpoint_cover_init(struct dpoint_cover *cover, const struct dpoint_surface *surface,
                      const struct dpoint_cover_options *options, struct psr_pool *pool,
                      const struct psr_cancel *cancel)
{
	struct looking l = { .cover = cover, .surface = surface, .options = options };
	double s, c;
	int rc;

	memset(cover, 0, sizeof *cover);
	cover->n_candidates = surface->n_candidates;
	cover->n_cells = surface->n_cells;
	if (surface->n_cells == 0 || surface->n_candidates == 0)
		return PSR_OK;
	cover->n_chunks = (cover->n_candidates + CHUNK - 1) / CHUNK;
	cover->tree = calloc(1, sizeof *cover->tree);
	cover->list = calloc(cover->n_candidates, sizeof *cover->list);
	cover->n = calloc(cover->n_candidates, sizeof *cover->n);
	cover->chunk = calloc(cover->n_chunks, sizeof *cover->chunk);
	if (cover->list == NULL || cover->n == NULL || cover->chunk == NULL || cover->tree == NULL)
		return PSR_ERR_MEMORY;
	psr_sincos(fmin(options->angle, 3.14159), &s, &c);
	l.cosine = c > 0 ? (float)c : 0;
	l.chord = c > 0.82 ? (float)sqrt(2 - 2 * c) : MOST_CHORD;
	l.tree = cover->tree;
	rc = cell_tree_init(cover->tree, surface->cell, surface->n_cells);
	if (rc == PSR_OK)
		rc = psr_pool_for_until(pool, cancel, (int)cover->n_chunks, look, &l);
	if (rc == PSR_OK && l.is_failed)
		rc = PSR_ERR_MEMORY;
	return rc;
}

void dpoint_cover_fini(struct dpoint_cover *cover)
{
	for (size_t i = 0; i < cover->n_chunks && cover->chunk != NULL; i++)
		free(cover->chunk[i]);
	free(cover->chunk);
	if (cover->tree != NULL)
		cell_tree_fini(cover->tree);
	free(cover->tree);
	free(cover->list);
	free(cover->n);
	memset(cover, 0, sizeof *cover);
}

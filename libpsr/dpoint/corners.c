#include "corners.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "base/vec.h"
#include "shape.h"

#define MOST_AROUND 64 /* neighbours of a corner; of more, these */

struct key {
	double at[3];
	float normal[3];
	uint32_t index; /* 3 * triangle + corner */
};

static int compare_keys(const void *a, const void *b)
{
	const struct key *x = a, *y = b;

	for (int k = 0; k < 3; k++)
		if (x->at[k] != y->at[k])
			return x->at[k] < y->at[k] ? -1 : 1;
	for (int k = 0; k < 3; k++)
		if (x->normal[k] != y->normal[k])
			return x->normal[k] < y->normal[k] ? -1 : 1;
	return x->index < y->index ? -1 : x->index > y->index;
}

static int is_same(const struct key *x, const struct key *y)
{
	for (int k = 0; k < 3; k++)
		if (x->at[k] != y->at[k] || x->normal[k] != y->normal[k])
			return 0;
	return 1;
}

static void face_normal(float normal[3], const struct psr_mesh *mesh, const uint32_t corner[3])
{
	double a[3], b[3], n[3];

	v3d_sub(a, mesh->position[corner[1]], mesh->position[corner[0]]);
	v3d_sub(b, mesh->position[corner[2]], mesh->position[corner[0]]);
	v3d_cross(n, a, b);
	v3d_normalize(n, n);
	for (int k = 0; k < 3; k++)
		normal[k] = (float)n[k];
}

static void make_keys(struct key *key, const struct psr_mesh *mesh)
{
	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		float face[3];

		face_normal(face, mesh, mesh->triangle[t]);
		for (int i = 0; i < 3; i++) {
			const uint32_t v = mesh->triangle[t][i];
			const float *own = mesh->normal[v];
			struct key *k = &key[3 * (size_t)t + (size_t)i];

			memcpy(k->at, mesh->position[v], sizeof k->at);
			memcpy(k->normal, v3f_dot(own, own) > 0 ? own : face, sizeof k->normal);
			k->index = 3 * t + (uint32_t)i;
		}
	}
}

static void name_corners(struct corners *c, const struct key *key, size_t n, const struct dpoint_mesh_options *options)
{
	c->n = 0;
	for (size_t i = 0; i < n; i++) {
		if (i == 0 || !is_same(&key[i], &key[i - 1])) {
			struct corner *corner = &c->corner[c->n++];

			memset(corner, 0, sizeof *corner);
			for (int k = 0; k < 3; k++) {
				corner->at[k] = (key[i].at[k] - options->origin[k]) * options->scale;
				corner->normal[k] = key[i].normal[k];
			}
			v3d_normalize(corner->normal, corner->normal);
		}
		c->of[key[i].index] = c->n - 1;
	}
}

/* ---- edges ---- */

struct edge {
	uint64_t ends; /* the lower corner, then the other */
	uint32_t index;
};

static int compare_edges(const void *a, const void *b)
{
	const struct edge *x = a, *y = b;

	return x->ends != y->ends ? (x->ends < y->ends ? -1 : 1) : x->index < y->index ? -1 : x->index > y->index;
}

/* The other corners of triangles around a corner follow from its edges, sorted by their ends. */
static size_t list_edges(struct edge *edge, const struct corners *c, uint32_t n_triangles)
{
	size_t n = 0;

	for (uint32_t i = 0; i < 3 * n_triangles; i++) {
		const uint32_t a = c->of[i], b = c->of[i % 3 == 2 ? i - 2 : i + 1];

		if (a != b)
			edge[n++] = (struct edge){ a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a, i };
	}
	qsort(edge, n, sizeof *edge, compare_edges);
	return n;
}

static size_t find_open(struct corners *c, struct edge *edge, size_t n)
{
	size_t n_single = 0;

	for (size_t i = 0, next; i < n; i = next) {
		for (next = i + 1; next < n && edge[next].ends == edge[i].ends;)
			next++;
		if (next == i + 1)
			c->is_open[edge[i].index / 3] |= (uint8_t)(1 << edge[i].index % 3);
		for (int k = 0; k < 2 && next == i + 2; k++)
			c->next[edge[i + (size_t)k].index] = edge[i + 1 - (size_t)k].index;
		edge[n_single++] = edge[i];
	}
	return n_single;
}

/* ---- curvatures ---- */

static void tensor_of(double tensor[6], const struct dpoint_local *local)
{
	static const int row[6] = { 0, 0, 0, 1, 1, 2 }, column[6] = { 0, 1, 2, 1, 2, 2 };

	for (int i = 0; i < 6; i++) {
		const double *x = local->axis[0], *y = local->axis[1];
		const int r = row[i], c = column[i];

		tensor[i] = local->shape[0] * x[r] * x[c] + local->shape[1] * (x[r] * y[c] + y[r] * x[c]) +
		            local->shape[2] * y[r] * y[c];
	}
}

static void bend(struct corners *c, uint32_t i, const uint32_t *other, uint32_t n)
{
	struct dpoint_neighbour around[MOST_AROUND];
	struct corner *corner = &c->corner[i];
	struct dpoint_local local;

	if (v3d_dot(corner->normal, corner->normal) == 0) {
		c->n_bad++;
		return;
	}
	memcpy(local.at, corner->at, sizeof local.at);
	psr_direction_basis(corner->normal, local.axis);
	for (uint32_t k = 0; k < n && k < MOST_AROUND; k++) {
		memcpy(around[k].at, c->corner[other[k]].at, sizeof around[k].at);
		memcpy(around[k].normal, c->corner[other[k]].normal, sizeof around[k].normal);
	}
	if (dpoint_shape_of_ring(&local, around, n < MOST_AROUND ? n : MOST_AROUND))
		tensor_of(corner->tensor, &local);
	else
		c->n_bad++;
}

/* Neighbours of each corner by counting: edges are sorted by their lower end, and each stands for both. */
static int bend_all(struct corners *c, const struct edge *edge, size_t n_edges)
{
	size_t *first = calloc((size_t)c->n + 2, sizeof *first);
	uint32_t *other = malloc((2 * n_edges + 1) * sizeof *other);

	if (first == NULL || other == NULL) {
		free(first);
		free(other);
		return PSR_ERR_MEMORY;
	}
	for (size_t i = 0; i < n_edges; i++) {
		first[(edge[i].ends >> 32) + 2]++;
		first[(edge[i].ends & UINT32_MAX) + 2]++;
	}
	for (size_t i = 1; i < (size_t)c->n + 2; i++)
		first[i] += first[i - 1];
	for (size_t i = 0; i < n_edges; i++) {
		const uint32_t a = (uint32_t)(edge[i].ends >> 32), b = (uint32_t)edge[i].ends;

		other[first[a + 1]++] = b;
		other[first[b + 1]++] = a;
	}
	for (uint32_t i = 0; i < c->n; i++)
		bend(c, i, other + first[i], (uint32_t)(first[i + 1] - first[i]));
	free(first);
	free(other);
	return PSR_OK;
}

int corners_init(struct corners *c, const struct psr_mesh *mesh, const struct dpoint_mesh_options *options)
{
	const size_t n = 3 * (size_t)mesh->n_triangles;
	struct key *key = malloc((n + 1) * sizeof *key);
	struct edge *edge = malloc((n + 1) * sizeof *edge);
	int rc = PSR_ERR_MEMORY;

	memset(c, 0, sizeof *c);
	c->of = malloc((n + 1) * sizeof *c->of);
	c->corner = malloc((n + 1) * sizeof *c->corner);
	c->is_open = calloc((size_t)mesh->n_triangles + 1, 1);
	c->next = malloc((n + 1) * sizeof *c->next);
	if (key != NULL && edge != NULL && c->of != NULL && c->corner != NULL && c->is_open != NULL &&
	    c->next != NULL) {
		memset(c->next, 0xff, n * sizeof *c->next);
		make_keys(key, mesh);
		qsort(key, n, sizeof *key, compare_keys);
		name_corners(c, key, n, options);
		rc = bend_all(c, edge, find_open(c, edge, list_edges(edge, c, mesh->n_triangles)));
	}
	free(key);
	free(edge);
	return rc;
}

void corners_fini(struct corners *c)
{
	free(c->corner);
	free(c->of);
	free(c->is_open);
	free(c->next);
	memset(c, 0, sizeof *c);
}

float corners_bend(const struct corners *c, const struct psr_mesh *mesh, uint32_t triangle, int edge)
{
	const uint32_t next = c->next[3 * (size_t)triangle + (size_t)edge];
	float normal[2][3], cosine;

	if (next == UINT32_MAX)
		return 1;
	face_normal(normal[0], mesh, mesh->triangle[triangle]);
	face_normal(normal[1], mesh, mesh->triangle[next / 3]);
	cosine = v3f_dot(normal[0], normal[1]);
	return cosine > 0 ? sqrtf(fmaxf(0, 1 - cosine * cosine)) : 1;
}

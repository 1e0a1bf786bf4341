#include <math.h>
#include <stdlib.h>
#include "base/vec.h"
#include "cloud.h"

#define EDGES 8       /* of a point, to its nearest neighbours */
#define N_WEIGHTS 65536

/* Growing trees: each point's parent, and whether its normal is opposed to the parent's. */
struct forest {
	uint32_t *parent;
	uint8_t *is_turned, *rank;
};

static uint32_t edges_of(const struct cloud *cloud)
{
	return cloud->k < EDGES ? cloud->k : EDGES;
}

/* 0 if two points lie in one plane: their normals agree up to the sign, and neither is off the other's plane, as the
 * other side of a thin sheet is. */
static uint32_t weight(const struct cloud *cloud, uint32_t i, uint32_t j)
{
	double d[3], length, cosine, off = 0.0, off_i, off_j, w;
	const float *a = cloud->normal[i], *b = cloud->normal[j];
	v3d_sub(d, cloud->point[j].at, cloud->point[i].at);
	length = v3d_normalize(d, d);
	cosine = fabs((double)a[0] * b[0] + (double)a[1] * b[1] + (double)a[2] * b[2]);
	if (length > 0.0) {
		off_i = a[0] * d[0] + a[1] * d[1] + a[2] * d[2];
		off_j = b[0] * d[0] + b[1] * d[1] + b[2] * d[2];
		off = fmax(off_i * off_i, off_j * off_j);
	}
	w = 0.5 * (1.0 - cosine + off) * N_WEIGHTS;
	return w > 0.0 ? w < N_WEIGHTS - 1 ? (uint32_t)w : N_WEIGHTS - 1 : 0;
}

/* Finds the root, and whether the point's normal is opposed to the root's. Halves paths. */
static uint32_t find(struct forest *f, uint32_t i, int *is_turned)
{
	int turned = 0;
	while (f->parent[i] != i) {
		uint32_t up = f->parent[i];
		/* A root is its own parent, not turned. */
		f->is_turned[i] ^= f->is_turned[up];
		f->parent[i] = f->parent[up];
		turned ^= f->is_turned[i];
		i = f->parent[i];
	}
	*is_turned = turned;
	return i;
}

static void join(struct cloud *cloud, struct forest *f, uint32_t i, uint32_t j)
{
	const float *a = cloud->normal[i], *b = cloud->normal[j];
	int turned_i, turned_j, differ;
	uint32_t root_i = find(f, i, &turned_i), root_j = find(f, j, &turned_j), t;
	if (root_i == root_j)
		return;
	differ = (double)a[0] * b[0] + (double)a[1] * b[1] + (double)a[2] * b[2] < 0.0;
	if (f->rank[root_i] < f->rank[root_j]) {
		t = root_i;
		root_i = root_j;
		root_j = t;
	}
	f->rank[root_i] = (uint8_t)(f->rank[root_i] + (f->rank[root_i] == f->rank[root_j]));
	f->parent[root_j] = root_i;
	f->is_turned[root_j] = (uint8_t)(turned_i ^ turned_j ^ differ);
}

/* Kruskal's algorithm: edges in the order of weights, then of points. */
static int grow(struct cloud *cloud, struct forest *f)
{
	const uint32_t n_edges = edges_of(cloud);
	uint64_t *start = calloc(N_WEIGHTS + 1, sizeof *start);
	uint32_t *edge = malloc(((size_t)cloud->n * n_edges + 1) * sizeof *edge);
	if (start == NULL || edge == NULL) {
		free(start);
		free(edge);
		return PSR_ERR_MEMORY;
	}
	for (uint32_t i = 0; i < cloud->n; i++)
		for (uint32_t j = 0; j < n_edges; j++)
			start[weight(cloud, i, cloud->near[(size_t)i * cloud->k + j]) + 1]++;
	for (uint32_t w = 0; w < N_WEIGHTS; w++)
		start[w + 1] += start[w];
	for (uint32_t i = 0; i < cloud->n; i++)
		for (uint32_t j = 0; j < n_edges; j++)
			edge[start[weight(cloud, i, cloud->near[(size_t)i * cloud->k + j])]++] = i * n_edges + j;
	for (uint64_t e = 0; e < (uint64_t)cloud->n * n_edges; e++)
		join(cloud, f, edge[e] / n_edges, cloud->near[(size_t)(edge[e] / n_edges) * cloud->k + edge[e] % n_edges]);
	free(start);
	free(edge);
	return PSR_OK;
}

/* Sums over the points of a tree, weighted by the area of their discs, with normals on the root's side. */
struct vote {
	double area, middle[3];
	double flux, size;  /* of (p - middle) through the surface: three times the volume if closed; its bound */
	double normal[3];
	double given;       /* agreement with the file's normals */
};

static void add_votes(const struct cloud *cloud, struct forest *f, struct vote *vote)
{
	for (int pass = 0; pass < 2; pass++)
		for (uint32_t i = 0; i < cloud->n; i++) {
			int turned;
			struct vote *v = &vote[find(f, i, &turned)];
			const double area = (double)cloud->radius[i] * cloud->radius[i], signed_area = turned ? -area : area;
			double d[3], n[3] = { cloud->normal[i][0], cloud->normal[i][1], cloud->normal[i][2] };
			if (pass == 0) {
				v->area += area;
				v3d_add_scaled(v->middle, v->middle, area, cloud->point[i].at);
				continue;
			}
			v3d_scale(d, v->middle, v->area > 0.0 ? 1.0 / v->area : 0.0);
			v3d_sub(d, cloud->point[i].at, d);
			v->flux += signed_area * v3d_dot(d, n);
			v->size += area * v3d_length(d);
			v3d_add_scaled(v->normal, v->normal, signed_area, n);
			/* Given normals are right: if the point is turned, the root is wrong. */
			if (cloud->is_given[i])
				v->given += turned ? -1.0 : 1.0;
		}
}

/* Normals of a closed surface add up to 0; a flat surface has no volume. */
static int is_upside_down(const struct vote *v)
{
	int axis = 0;
	if (v->given != 0.0)
		return v->given < 0.0;
	if (fabs(v->flux) * v->area >= v3d_length(v->normal) * v->size && v->flux != 0.0)
		return v->flux < 0.0;
	for (int c = 1; c < 3; c++)
		if (fabs(v->normal[c]) > fabs(v->normal[axis]))
			axis = c;
	return v->normal[axis] < 0.0;
}

static int turn_normals(struct cloud *cloud, struct forest *f)
{
	struct vote *vote = calloc(cloud->n, sizeof *vote);
	if (vote == NULL)
		return PSR_ERR_MEMORY;
	add_votes(cloud, f, vote);
	for (uint32_t i = 0; i < cloud->n; i++) {
		int turned;
		uint32_t root = find(f, i, &turned);
		for (int c = 0; c < 3 && !cloud->is_given[i] && turned != is_upside_down(&vote[root]); c++)
			cloud->normal[i][c] = -cloud->normal[i][c];
	}
	free(vote);
	return PSR_OK;
}

int cloud_orient(struct cloud *cloud)
{
	struct forest f = { malloc(cloud->n * sizeof *f.parent), calloc(cloud->n, 1), calloc(cloud->n, 1) };
	int rc = f.parent == NULL || f.is_turned == NULL || f.rank == NULL ? PSR_ERR_MEMORY : PSR_OK;
	for (uint32_t i = 0; rc == PSR_OK && i < cloud->n; i++)
		f.parent[i] = i;
	if (rc == PSR_OK)
		rc = grow(cloud, &f);
	if (rc == PSR_OK)
		rc = turn_normals(cloud, &f);
	free(f.parent);
	free(f.is_turned);
	free(f.rank);
	return rc;
}

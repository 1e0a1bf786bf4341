#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "crease.h"
#include "import.h"

/* Normals of faces in one plane differ by less than 0.1 degrees (1 minus the cosine): the precision of six digits for a
 * triangle whose height is a 3000th of its distance from the origin. */
#define FLAT 1.5e-6
#define LONE 1.01 /* of its own area: a triangle whose flat part adds slivers alone */

/* Corners (3 * triangle + corner) around each point: corner[start[p] .. start[p + 1]), in the order of triangles. */
struct fan {
	uint32_t *point;    /* of each vertex: the first vertex at its position */
	uint64_t *start;
	uint64_t *corner;
	uint8_t *wanted;    /* by triangle: its vertices have no normals */
	double (*face)[3];  /* unit normals; 0 for a triangle without area */
	uint32_t *flat;     /* of each triangle: its parent in the union-find forest of flat parts */
	double *area;       /* twice the area of the flat part, stored at its root */
};

static void fan_fini(struct fan *fan)
{
	free(fan->point);
	free(fan->start);
	free(fan->corner);
	free(fan->wanted);
	free(fan->face);
	free(fan->flat);
	free(fan->area);
}

/* Computes the corner's weighted normal e x f / (|e|^2 |f|^2), exact on spheres and free of angles (N. Max, "Weights
 * for computing vertex normals from facet normals", 1999). 0 without area. */
static void corner_share(double share[3], const struct psr_mesh *mesh, uint64_t corner)
{
	const uint32_t *v = mesh->triangle[corner / 3];
	const unsigned at = (unsigned)(corner % 3);
	const double *p = mesh->position[v[at]], *q = mesh->position[v[(at + 1) % 3]], *r = mesh->position[v[(at + 2) % 3]];
	double e[3], f[3], weight;

	v3d_sub(e, q, p);
	v3d_sub(f, r, p);
	v3d_cross(share, e, f);
	weight = v3d_dot(e, e) * v3d_dot(f, f);
	v3d_scale(share, share, weight > 0.0 && isfinite(weight) ? 1.0 / weight : 0.0);
}

static void face_normals(struct fan *fan, const struct psr_mesh *mesh)
{
	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		if (!fan->wanted[t])
			continue;
		corner_share(fan->face[t], mesh, 3 * (uint64_t)t);
		if (v3d_normalize(fan->face[t], fan->face[t]) == 0.0)
			v3d_set(fan->face[t], 0.0, 0.0, 0.0);
	}
}

/* Returns the root of t's flat part: its first triangle. Halves paths. */
static uint32_t flat_of(struct fan *fan, uint32_t t)
{
	while (fan->flat[t] != t)
		t = fan->flat[t] = fan->flat[fan->flat[t]];
	return t;
}

static void join_flat(struct fan *fan, uint32_t a, uint32_t b)
{
	if (1.0 - v3d_dot(fan->face[a], fan->face[b]) > FLAT)
		return;
	a = flat_of(fan, a);
	b = flat_of(fan, b);
	fan->flat[a > b ? a : b] = a > b ? b : a;
}

static double twice_area(const struct psr_mesh *mesh, uint32_t t)
{
	const uint32_t *v = mesh->triangle[t];
	double e[3], f[3], n[3];

	v3d_sub(e, mesh->position[v[1]], mesh->position[v[0]]);
	v3d_sub(f, mesh->position[v[2]], mesh->position[v[0]]);
	v3d_cross(n, e, f);
	return v3d_length(n);
}

/* Joins triangles that lie in one plane and touch. */
static void find_flats(struct fan *fan, const struct psr_mesh *mesh)
{
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		fan->flat[t] = t;
	for (uint32_t p = 0; p < mesh->n_vertices; p++) {
		const uint64_t first = fan->start[p], end = fan->start[p + 1];

		for (uint64_t i = first; i < end && end - first <= CREASE_MAX_CORNERS; i++)
			for (uint64_t k = first; k < i; k++)
				join_flat(fan, (uint32_t)(fan->corner[i] / 3), (uint32_t)(fan->corner[k] / 3));
	}
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		fan->area[flat_of(fan, t)] += twice_area(mesh, t);
}

static int has_normals(const struct psr_mesh *mesh, const uint32_t v[3])
{
	for (int c = 0; c < 3; c++)
		for (int i = 0; i < 3; i++)
			if (mesh->normal[v[c]][i] != 0.0f)
				return 1;
	return 0;
}

static int fan_init(struct fan *fan, const struct import_mesh *im, struct psr_error *err)
{
	const struct psr_mesh *mesh = im->mesh;
	uint64_t sum = 0;
	int rc;

	memset(fan, 0, sizeof *fan);
	rc = import_mesh_groups(&fan->point, im, IMPORT_SAME_NEARLY, err);
	if (rc != PSR_OK)
		return rc;
	fan->start = calloc((size_t)mesh->n_vertices + 2, sizeof *fan->start);
	fan->corner = malloc((3 * (size_t)mesh->n_triangles + 1) * sizeof *fan->corner);
	fan->wanted = malloc((size_t)mesh->n_triangles + 1);
	fan->face = calloc((size_t)mesh->n_triangles + 1, sizeof *fan->face);
	fan->flat = malloc(((size_t)mesh->n_triangles + 1) * sizeof *fan->flat);
	fan->area = calloc((size_t)mesh->n_triangles + 1, sizeof *fan->area);
	if (fan->start == NULL || fan->wanted == NULL || fan->corner == NULL || fan->face == NULL || fan->flat == NULL ||
	    fan->area == NULL) {
		fan_fini(fan);
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for the normals of %u triangles", im->path,
		                mesh->n_triangles);
	}
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		fan->wanted[t] = !has_normals(mesh, mesh->triangle[t]);
	/* Counts are two places ahead, so that filling leaves start[p] at the start of p. */
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		for (int c = 0; fan->wanted[t] && c < 3; c++)
			fan->start[fan->point[mesh->triangle[t][c]] + 2]++;
	for (uint64_t p = 0; p < (uint64_t)mesh->n_vertices + 2; p++) {
		sum += fan->start[p];
		fan->start[p] = sum;
	}
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		for (int c = 0; fan->wanted[t] && c < 3; c++)
			fan->corner[fan->start[fan->point[mesh->triangle[t][c]] + 1]++] = 3 * (uint64_t)t + (uint64_t)c;
	face_normals(fan, mesh);
	find_flats(fan, mesh);
	return PSR_OK;
}

/* Appends a copy of vertex v, for corners with another normal. */
static int split_vertex(struct import_mesh *im, uint32_t v, struct psr_error *err)
{
	struct import_column column[IMPORT_MAX_COLUMNS];
	const uint32_t to = im->mesh->n_vertices;
	int n_columns, rc = import_mesh_grow(im, 1, 0, 0, err);

	if (rc != PSR_OK)
		return rc;
	n_columns = import_vertex_columns(column, im->mesh);
	for (int i = 0; i < n_columns; i++)
		memcpy(import_column_at(&column[i], to), import_column_at(&column[i], v), column[i].size);
	return PSR_OK;
}

/* Lists the corners around the current point. */
struct ring {
	unsigned n;
	uint64_t at[CREASE_MAX_CORNERS];
	uint32_t vertex[CREASE_MAX_CORNERS]; /* before splitting */
	struct crease_corner corner[CREASE_MAX_CORNERS];
};

static void take_ring(struct ring *ring, struct fan *fan, const struct psr_mesh *mesh, uint64_t first)
{
	for (unsigned i = 0; i < ring->n; i++) {
		const uint64_t at = fan->corner[first + i];
		const uint32_t t = (uint32_t)(at / 3);

		ring->at[i] = at;
		ring->vertex[i] = mesh->triangle[t][at % 3];
		memcpy(ring->corner[i].face, fan->face[t], sizeof fan->face[t]);
		corner_share(ring->corner[i].share, mesh, at);
		ring->corner[i].area = fan->area[flat_of(fan, t)];
		ring->corner[i].is_flat = ring->corner[i].area > LONE * twice_area(mesh, t);
	}
}

/* Corners of a vertex with equal normals go on sharing it. */
static int put_normals(struct import_mesh *im, const struct ring *ring, struct psr_error *err)
{
	for (unsigned i = 0; i < ring->n; i++) {
		uint32_t *v = &im->mesh->triangle[ring->at[i] / 3][ring->at[i] % 3];
		const float *normal = ring->corner[i].normal;
		int is_first = 1, rc;
		unsigned k;

		for (k = 0; k < i; k++) {
			if (ring->vertex[k] != ring->vertex[i])
				continue;
			is_first = 0;
			if (memcmp(ring->corner[k].normal, normal, sizeof ring->corner[k].normal) == 0)
				break;
		}
		if (k < i) {
			*v = im->mesh->triangle[ring->at[k] / 3][ring->at[k] % 3];
			continue;
		}
		if (!is_first) {
			rc = split_vertex(im, *v, err);
			if (rc != PSR_OK)
				return rc;
			v = &im->mesh->triangle[ring->at[i] / 3][ring->at[i] % 3];
			*v = im->mesh->n_vertices - 1;
		}
		memcpy(im->mesh->normal[*v], normal, sizeof ring->corner[i].normal);
	}
	return PSR_OK;
}

int import_mesh_smooth(struct import_mesh *im, struct psr_error *err)
{
	const double crease = 1.0 - cos(im->options.crease);
	const uint32_t n_vertices = im->mesh->n_vertices;
	struct ring *ring;
	struct fan fan;
	int rc = fan_init(&fan, im, err);

	if (rc != PSR_OK)
		return rc;
	ring = malloc(sizeof *ring);
	if (ring == NULL)
		rc = psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for the normals of a vertex", im->path);
	for (uint32_t p = 0; p < n_vertices && rc == PSR_OK; p++) {
		const uint64_t first = fan.start[p], n = fan.start[p + 1] - first;

		if (n == 0 || n > CREASE_MAX_CORNERS)
			continue;
		ring->n = (unsigned)n;
		take_ring(ring, &fan, im->mesh, first);
		crease_normals(ring->corner, ring->n, crease);
		rc = put_normals(im, ring, err);
	}
	free(ring);
	fan_fini(&fan);
	return rc;
}

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "import.h"

#define MAX_VALENCE 512 /* corners around one point beyond which each face keeps its own normal: the sum is quadratic */

/* Corners (3 * triangle + corner) around each point: corner[start[p] .. start[p + 1]), in the order of triangles. */
struct fan {
	uint32_t *point;    /* of each vertex: the first vertex at its position */
	uint64_t *start;
	uint64_t *corner;
	uint8_t *wanted;    /* triangles whose vertices have no normals yet */
	double (*face)[3];  /* unit normals; 0 for a triangle without area */
};

static void fan_fini(struct fan *fan)
{
	free(fan->point);
	free(fan->start);
	free(fan->corner);
	free(fan->wanted);
	free(fan->face);
}

static double dot(const double a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The corner's share in the normal: e x f / (|e|^2 |f|^2), which is exact where the vertices lie on a sphere (N. Max,
 * "Weights for computing vertex normals from facet normals", 1999) and needs no angle. 0 where there is no area. */
static void corner_share(double share[3], const struct psr_mesh *mesh, uint64_t corner)
{
	const uint32_t *v = mesh->triangle[corner / 3];
	const unsigned at = (unsigned)(corner % 3);
	const double *p = mesh->position[v[at]], *q = mesh->position[v[(at + 1) % 3]], *r = mesh->position[v[(at + 2) % 3]];
	double e[3], f[3], weight;

	for (int i = 0; i < 3; i++) {
		e[i] = q[i] - p[i];
		f[i] = r[i] - p[i];
	}
	weight = dot(e, e) * dot(f, f);
	share[0] = e[1] * f[2] - e[2] * f[1];
	share[1] = e[2] * f[0] - e[0] * f[2];
	share[2] = e[0] * f[1] - e[1] * f[0];
	for (int i = 0; i < 3; i++)
		share[i] = weight > 0.0 && isfinite(weight) ? share[i] / weight : 0.0;
}

static void face_normals(struct fan *fan, const struct psr_mesh *mesh)
{
	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		double *n = fan->face[t], length;

		if (!fan->wanted[t])
			continue;
		corner_share(n, mesh, 3 * (uint64_t)t);
		length = sqrt(dot(n, n));
		for (int i = 0; i < 3; i++)
			n[i] = length > 0.0 && isfinite(length) ? n[i] / length : 0.0;
	}
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
	rc = import_mesh_groups(&fan->point, im, 0, err);
	if (rc != PSR_OK)
		return rc;
	fan->start = calloc((size_t)mesh->n_vertices + 2, sizeof *fan->start);
	fan->corner = malloc((3 * (size_t)mesh->n_triangles + 1) * sizeof *fan->corner);
	fan->wanted = malloc((size_t)mesh->n_triangles + 1);
	fan->face = calloc((size_t)mesh->n_triangles + 1, sizeof *fan->face);
	if (fan->start == NULL || fan->wanted == NULL || fan->corner == NULL || fan->face == NULL) {
		fan_fini(fan);
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for the normals of %u triangles", im->path,
		                mesh->n_triangles);
	}
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		fan->wanted[t] = !has_normals(mesh, mesh->triangle[t]);
	/* Counted two places on, so that filling leaves start[p] where p begins. */
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
	return PSR_OK;
}

/* A corner around the point at hand. */
struct corner {
	double share[3];
	uint64_t at;
	float normal[3];
};

static void corner_normal(float normal[3], const struct fan *fan, const struct corner *around, unsigned n, unsigned i)
{
	const double *face = fan->face[around[i].at / 3];
	double sum[3] = { 0.0, 0.0, 0.0 }, length;

	for (unsigned k = 0; k < n; k++)
		for (int c = 0; c < 3 && dot(face, fan->face[around[k].at / 3]) >= IMPORT_CREASE_COSINE; c++)
			sum[c] += around[k].share[c];
	length = sqrt(dot(sum, sum));
	for (int c = 0; c < 3; c++)
		normal[c] = length > 0.0 && isfinite(length) ? (float)(sum[c] / length) : 0.0f;
}

/* A copy of vertex v at the end, for the corners that want another normal. */
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

/* Corners of one vertex with one normal go on sharing it: the first takes it, others with the same normal follow. */
static int put_normals(struct import_mesh *im, const struct corner *around, unsigned n, const uint32_t *old,
                       struct psr_error *err)
{
	for (unsigned i = 0; i < n; i++) {
		uint32_t *v = &im->mesh->triangle[around[i].at / 3][around[i].at % 3];
		int is_first = 1, rc;
		unsigned k;

		for (k = 0; k < i; k++) {
			if (old[k] != old[i])
				continue;
			is_first = 0;
			if (memcmp(around[k].normal, around[i].normal, sizeof around[k].normal) == 0)
				break;
		}
		if (k < i) {
			*v = im->mesh->triangle[around[k].at / 3][around[k].at % 3];
			continue;
		}
		if (!is_first) {
			rc = split_vertex(im, *v, err);
			if (rc != PSR_OK)
				return rc;
			v = &im->mesh->triangle[around[i].at / 3][around[i].at % 3];
			*v = im->mesh->n_vertices - 1;
		}
		memcpy(im->mesh->normal[*v], around[i].normal, sizeof around[i].normal);
	}
	return PSR_OK;
}

int import_mesh_smooth(struct import_mesh *im, struct psr_error *err)
{
	struct corner around[MAX_VALENCE];
	uint32_t old[MAX_VALENCE];
	const uint32_t n_vertices = im->mesh->n_vertices;
	struct fan fan;
	int rc = fan_init(&fan, im, err);

	if (rc != PSR_OK)
		return rc;
	for (uint32_t p = 0; p < n_vertices && rc == PSR_OK; p++) {
		const uint64_t first = fan.start[p], n = fan.start[p + 1] - first;

		if (n > MAX_VALENCE)
			continue;
		for (unsigned i = 0; i < n; i++) {
			around[i].at = fan.corner[first + i];
			old[i] = im->mesh->triangle[around[i].at / 3][around[i].at % 3];
			corner_share(around[i].share, im->mesh, around[i].at);
		}
		for (unsigned i = 0; i < n; i++)
			corner_normal(around[i].normal, &fan, around, (unsigned)n, i);
		rc = put_normals(im, around, (unsigned)n, old, err);
	}
	fan_fini(&fan);
	return rc;
}

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "import.h"

static int is_finite3(const double p[3])
{
	return isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]);
}

/* Edges are scaled by their largest component first, so that neither tiny nor huge units make the area 0 or
 * infinite. */
static int has_area(const double a[3], const double b[3], const double c[3])
{
	double e[3], f[3], n[3], largest = 0.0;

	for (int i = 0; i < 3; i++) {
		e[i] = b[i] - a[i];
		f[i] = c[i] - a[i];
		largest = fmax(largest, fmax(fabs(e[i]), fabs(f[i])));
	}
	if (!(largest > 0.0) || !isfinite(largest))
		return 0;
	for (int i = 0; i < 3; i++) {
		e[i] /= largest;
		f[i] /= largest;
	}
	n[0] = e[1] * f[2] - e[2] * f[1];
	n[1] = e[2] * f[0] - e[0] * f[2];
	n[2] = e[0] * f[1] - e[1] * f[0];
	return n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 0.0;
}

static int check_indices(const struct import_mesh *im, struct psr_error *err)
{
	const struct psr_mesh *mesh = im->mesh;

	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		for (int c = 0; c < 3; c++)
			if (mesh->triangle[t][c] >= mesh->n_vertices)
				return psr_fail(err, PSR_ERR_FORMAT, "%s: triangle %u refers to vertex %u, but there are only %u",
				                im->path, t,
				                mesh->triangle[t][c], mesh->n_vertices);
		if (mesh->triangle_material[t] >= mesh->n_materials)
			return psr_fail(err, PSR_ERR_FORMAT, "%s: triangle %u refers to material %u, but there are only %u",
			                im->path, t,
			                mesh->triangle_material[t], mesh->n_materials);
	}
	return PSR_OK;
}

static void drop_triangles(struct psr_mesh *mesh)
{
	uint32_t kept = 0;

	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		const uint32_t *v = mesh->triangle[t];
		const double *a = mesh->position[v[0]], *b = mesh->position[v[1]], *c = mesh->position[v[2]];

		if (!is_finite3(a) || !is_finite3(b) || !is_finite3(c) || !has_area(a, b, c))
			continue;
		if (kept != t) {
			memcpy(mesh->triangle[kept], mesh->triangle[t], sizeof mesh->triangle[t]);
			mesh->triangle_material[kept] = mesh->triangle_material[t];
		}
		kept++;
	}
	mesh->n_dropped_triangles += mesh->n_triangles - kept;
	mesh->n_triangles = kept;
}

/* Vertices that no triangle uses would widen the bounds, and may be anything but finite. */
static int drop_vertices(struct import_mesh *im, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	uint32_t *target = calloc(mesh->n_vertices > 0 ? mesh->n_vertices : 1, sizeof *target), kept = 0;

	if (target == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to check %u vertices", im->path, mesh->n_vertices);
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		for (int c = 0; c < 3; c++)
			target[mesh->triangle[t][c]] = 1;
	for (uint32_t v = 0; v < mesh->n_vertices; v++) {
		if (target[v] == 0)
			continue;
		if (kept != v) {
			memcpy(mesh->position[kept], mesh->position[v], sizeof mesh->position[v]);
			memcpy(mesh->normal[kept], mesh->normal[v], sizeof mesh->normal[v]);
			if (mesh->uv[0] != NULL)
				memcpy(mesh->uv[0][kept], mesh->uv[0][v], sizeof mesh->uv[0][v]);
			if (mesh->color != NULL)
				memcpy(mesh->color[kept], mesh->color[v], sizeof mesh->color[v]);
		}
		target[v] = kept++;
	}
	for (uint32_t t = 0; kept < mesh->n_vertices && t < mesh->n_triangles; t++)
		for (int c = 0; c < 3; c++)
			mesh->triangle[t][c] = target[mesh->triangle[t][c]];
	mesh->n_vertices = kept;
	free(target);
	return PSR_OK;
}

static void unit_normal(float n[3])
{
	double largest = fmax(fabs(n[0]), fmax(fabs(n[1]), fabs(n[2]))), x, y, z, length;

	if (!isfinite(n[0]) || !isfinite(n[1]) || !isfinite(n[2]) || largest == 0.0) {
		n[0] = n[1] = n[2] = 0.0f;
		return;
	}
	x = n[0] / largest;
	y = n[1] / largest;
	z = n[2] / largest;
	length = sqrt(x * x + y * y + z * z);
	n[0] = (float)(x / length);
	n[1] = (float)(y / length);
	n[2] = (float)(z / length);
}

static void tidy_vertices(struct psr_mesh *mesh)
{
	for (uint32_t v = 0; v < mesh->n_vertices; v++) {
		unit_normal(mesh->normal[v]);
		if (mesh->uv[0] != NULL && !(isfinite(mesh->uv[0][v][0]) && isfinite(mesh->uv[0][v][1])))
			mesh->uv[0][v][0] = mesh->uv[0][v][1] = 0.0f;
		for (int c = 0; mesh->color != NULL && c < 4; c++) {
			float x = mesh->color[v][c];

			mesh->color[v][c] = isnan(x) ? 1.0f : x < 0.0f ? 0.0f : x > 1.0f ? 1.0f : x;
		}
	}
}

int import_mesh_repair(struct import_mesh *im, struct psr_error *err)
{
	int rc = check_indices(im, err);

	if (rc != PSR_OK)
		return rc;
	drop_triangles(im->mesh);
	rc = drop_vertices(im, err);
	if (rc != PSR_OK)
		return rc;
	tidy_vertices(im->mesh);
	return PSR_OK;
}

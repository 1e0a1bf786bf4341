#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "import.h"

static int is_finite3(const double p[3])
{
	return isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]);
}

/* Scales edges by their largest component, so that tiny or huge units make the area neither 0 nor infinite. */
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

int import_mesh_check_indices(const struct import_mesh *im, struct psr_error *err)
{
	const struct psr_mesh *mesh = im->mesh;

	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		for (int c = 0; c < 3; c++)
			if (mesh->triangle[t][c] >= mesh->n_vertices)
				return psr_fail(err, PSR_ERR_FORMAT, "%s: triangle %u refers to vertex %u, but there are only %u",
				                im->path, t, mesh->triangle[t][c], mesh->n_vertices);
		if (mesh->triangle_material[t] >= mesh->n_materials)
			return psr_fail(err, PSR_ERR_FORMAT, "%s: triangle %u refers to material %u, but there are only %u",
			                im->path, t, mesh->triangle_material[t], mesh->n_materials);
	}
	return PSR_OK;
}

static void drop_triangles(struct import_mesh *im)
{
	struct psr_mesh *mesh = im->mesh;
	uint32_t kept = 0, n_flat = 0, n_infinite = 0;

	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		const uint32_t *v = mesh->triangle[t];
		const double *a = mesh->position[v[0]], *b = mesh->position[v[1]], *c = mesh->position[v[2]];

		if (!is_finite3(a) || !is_finite3(b) || !is_finite3(c)) {
			n_infinite++;
		} else if (!has_area(a, b, c)) {
			n_flat++;
		} else {
			import_mesh_move_triangle(mesh, kept++, t);
		}
	}
	mesh->n_triangles = kept;
	n_flat = im->is_cut ? 0 : n_flat;
	mesh->n_dropped_triangles += n_flat + n_infinite;
	if (n_flat > 0)
		import_mesh_warn(im, "faces without area were left out: %u", n_flat);
	if (n_infinite > 0)
		import_mesh_warn(im, "faces with a corner that is not finite were left out: %u", n_infinite);
}

static int drop_doubles(struct import_mesh *im, struct psr_error *err)
{
	uint32_t n;
	int rc = import_mesh_drop_duplicates(&n, im, err);

	if (rc != PSR_OK)
		return rc;
	im->mesh->n_dropped_triangles += n;
	if (n > 0)
		import_mesh_warn(im, "duplicate faces were left out: %u", n);
	return PSR_OK;
}

/* Unused vertices would widen the bounds, and need not be finite. */
int import_mesh_drop_vertices(struct import_mesh *im, struct psr_error *err)
{
	struct import_column column[IMPORT_MAX_COLUMNS];
	struct psr_mesh *mesh = im->mesh;
	const int n_columns = import_vertex_columns(column, mesh);
	uint32_t *target = calloc(mesh->n_vertices > 0 ? mesh->n_vertices : 1, sizeof *target), kept = 0;

	if (target == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory to check %u vertices", im->path, mesh->n_vertices);
	for (uint32_t t = 0; t < mesh->n_triangles; t++)
		for (int c = 0; c < 3; c++)
			target[mesh->triangle[t][c]] = 1;
	for (uint32_t v = 0; v < mesh->n_vertices; v++) {
		if (target[v] == 0)
			continue;
		for (int i = 0; kept != v && i < n_columns; i++)
			memcpy(import_column_at(&column[i], kept), import_column_at(&column[i], v), column[i].size);
		target[v] = kept++;
	}
	for (uint32_t t = 0; kept < mesh->n_vertices && t < mesh->n_triangles; t++)
		for (int c = 0; c < 3; c++)
			mesh->triangle[t][c] = target[mesh->triangle[t][c]];
	mesh->n_vertices = kept;
	free(target);
	return PSR_OK;
}

static int drop_points(struct import_mesh *im, struct psr_error *err)
{
	struct import_column column[IMPORT_MAX_COLUMNS];
	struct psr_mesh *mesh = im->mesh;
	const int n_columns = import_point_columns(column, mesh);
	uint32_t kept = 0;

	for (uint32_t p = 0; p < mesh->n_points; p++) {
		if (mesh->point_material[p] >= mesh->n_materials)
			return psr_fail(err, PSR_ERR_FORMAT, "%s: point %u refers to material %u, but there are only %u", im->path,
			                p, mesh->point_material[p], mesh->n_materials);
		if (!is_finite3(mesh->point[p]))
			continue;
		for (int i = 0; kept != p && i < n_columns; i++)
			memcpy(import_column_at(&column[i], kept), import_column_at(&column[i], p), column[i].size);
		kept++;
	}
	if (kept < mesh->n_points)
		import_mesh_warn(im, "points that are not finite were left out: %u", mesh->n_points - kept);
	mesh->n_dropped_primitives += mesh->n_points - kept;
	mesh->n_points = kept;
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

/* Keeps the handedness; a missing one becomes right-handed. Without a direction the tangent becomes 0. */
static void unit_tangent(float t[4])
{
	unit_normal(t);
	t[3] = t[0] == 0.0f && t[1] == 0.0f && t[2] == 0.0f ? 0.0f : t[3] < 0.0f ? -1.0f : 1.0f;
}

static void tidy_color(float color[4])
{
	for (int c = 0; c < 4; c++)
		color[c] = isnan(color[c]) ? 1.0f : color[c] < 0.0f ? 0.0f : color[c] > 1.0f ? 1.0f : color[c];
}

static void tidy_elements(struct psr_mesh *mesh)
{
	for (uint32_t v = 0; v < mesh->n_vertices; v++) {
		unit_normal(mesh->normal[v]);
		if (mesh->tangent != NULL)
			unit_tangent(mesh->tangent[v]);
		for (int set = 0; set < PSR_UV_SETS; set++)
			if (mesh->uv[set] != NULL && !(isfinite(mesh->uv[set][v][0]) && isfinite(mesh->uv[set][v][1])))
				mesh->uv[set][v][0] = mesh->uv[set][v][1] = 0.0f;
		if (mesh->color != NULL)
			tidy_color(mesh->color[v]);
	}
	for (uint32_t p = 0; p < mesh->n_points; p++) {
		unit_normal(mesh->point_normal[p]);
		if (mesh->point_color != NULL)
			tidy_color(mesh->point_color[p]);
	}
}

int import_mesh_repair(struct import_mesh *im, struct psr_error *err)
{
	int rc = import_mesh_check_indices(im, err);

	if (rc == PSR_OK) {
		drop_triangles(im);
		rc = drop_doubles(im, err);
	}
	if (rc == PSR_OK)
		rc = import_mesh_drop_vertices(im, err);
	if (rc == PSR_OK)
		rc = drop_points(im, err);
	if (rc == PSR_OK)
		tidy_elements(im->mesh);
	return rc;
}

/* What the fuzzers of scans require of a mesh. Run from the root of the repository. */
#ifndef TESTS_FUZZ_IMPORT_CHECK_H
#define TESTS_FUZZ_IMPORT_CHECK_H

#include <math.h>
#include <stdlib.h>
#include "import/import.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

static inline void require(int truth)
{
	if (!truth)
		abort();
}

static inline int is_unit(const float n[3])
{
	return fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1.0f) < 1e-5f;
}

static inline void check_surface(const struct psr_mesh *mesh)
{
	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		require(mesh->triangle_material[t] < mesh->n_materials);
		for (int c = 0; c < 3; c++)
			require(mesh->triangle[t][c] < mesh->n_vertices);
	}
	for (uint32_t v = 0; v < mesh->n_vertices; v++) {
		const float *n = mesh->normal[v];

		require((n[0] == 0.0f && n[1] == 0.0f && n[2] == 0.0f) || is_unit(n));
		for (int c = 0; c < 3; c++)
			require(isfinite(mesh->position[v][c]));
		require(mesh->uv[0] == NULL || (isfinite(mesh->uv[0][v][0]) && isfinite(mesh->uv[0][v][1])));
		for (int c = 0; c < 4 && mesh->color != NULL; c++)
			require(mesh->color[v][c] >= 0.0f && mesh->color[v][c] <= 1.0f);
	}
}

static inline void check_points(const struct psr_mesh *mesh)
{
	for (uint32_t p = 0; p < mesh->n_points; p++) {
		require(mesh->point_material[p] < mesh->n_materials);
		require(is_unit(mesh->point_normal[p]));
		require(mesh->point_radius[p] > 0.0f && isfinite(mesh->point_radius[p]));
		for (int c = 0; c < 3; c++)
			require(isfinite(mesh->point[p][c]));
		for (int c = 0; c < 4 && mesh->point_color != NULL; c++)
			require(mesh->point_color[p][c] >= 0.0f && mesh->point_color[p][c] <= 1.0f);
	}
}

static inline void import_check(int (*read)(struct import_mesh *, const uint8_t *, size_t, struct psr_error *),
                                const char *path, const uint8_t *data, size_t n)
{
	struct psr_mesh *mesh = NULL;
	struct import_mesh im;
	struct psr_error err = { 0, "" };
	int rc;

	require(import_mesh_init(&im, path, &err) == PSR_OK);
	rc = read(&im, data, n, &err);
	if (rc == PSR_OK)
		rc = import_mesh_finish(&mesh, &im, &err);
	import_mesh_fini(&im);
	require((rc == PSR_OK) == (mesh != NULL) && rc == err.code);
	if (mesh != NULL) {
		require(mesh->n_materials > 0 && (mesh->n_triangles > 0 || mesh->n_points > 0));
		check_surface(mesh);
		check_points(mesh);
	}
	psr_mesh_destroy(mesh);
}

#endif

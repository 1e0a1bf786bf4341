/* glTF from memory: whatever is accepted keeps the promises of psr/mesh.h. Run from the root of the repository, whose
 * tests/data/import is the folder from which files may be read. */
#include <math.h>
#include <stdlib.h>
#include "import/import.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

static void require(int truth)
{
	if (!truth)
		abort();
}

static void check(const struct psr_mesh *mesh)
{
	require(mesh->n_triangles > 0 && mesh->n_materials > 0);
	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		require(mesh->triangle_material[t] < mesh->n_materials);
		for (int c = 0; c < 3; c++)
			require(mesh->triangle[t][c] < mesh->n_vertices);
	}
	for (uint32_t v = 0; v < mesh->n_vertices; v++) {
		const float *n = mesh->normal[v];
		float length = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];

		require(length == 0.0f || fabsf(length - 1.0f) < 1e-5f);
		for (int c = 0; c < 3; c++)
			require(isfinite(mesh->position[v][c]));
		require(mesh->uv[0] == NULL || (isfinite(mesh->uv[0][v][0]) && isfinite(mesh->uv[0][v][1])));
	}
	for (uint32_t m = 0; m < mesh->n_materials; m++)
		require(mesh->material[m].base_texture.image < (int)mesh->n_images);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	struct psr_mesh *mesh = NULL;
	struct import_mesh im;
	struct psr_error err = { 0, "" };
	int rc;

	require(import_mesh_init(&im, "tests/data/import/fuzz.glb", &err) == PSR_OK);
	rc = import_gltf(&im, data, n, &err);
	if (rc == PSR_OK)
		rc = import_mesh_finish(&mesh, &im, &err);
	import_mesh_fini(&im);
	require((rc == PSR_OK) == (mesh != NULL) && rc == err.code);
	if (mesh != NULL)
		check(mesh);
	psr_mesh_destroy(mesh);
	return 0;
}

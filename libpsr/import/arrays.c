#include <string.h>
#include "import.h"

int psr_mesh_create(struct psr_mesh **out, const double (*position)[3], uint32_t n_vertices,
                    const uint32_t (*triangle)[3], uint32_t n_triangles, struct psr_error *err)
{
	struct psr_material material;
	struct import_mesh im;
	int rc = import_mesh_init(&im, "the arrays", err);

	psr_material_default(&material);
	if (rc == PSR_OK && import_mesh_add_material(&im, &material, err) < 0)
		rc = psr_fail(err, PSR_ERR_MEMORY, "no memory for a mesh");
	if (rc == PSR_OK)
		rc = import_mesh_grow(&im, n_vertices, n_triangles, 0, err);
	if (rc == PSR_OK && n_vertices > 0 && n_triangles > 0) {
		memcpy(im.mesh->position, position, n_vertices * sizeof *position);
		memcpy(im.mesh->triangle, triangle, n_triangles * sizeof *triangle);
	}
	if (rc == PSR_OK)
		rc = import_mesh_finish(out, &im, err);
	if (rc == PSR_OK)
		(*out)->up[1] = 1;
	import_mesh_fini(&im);
	return rc;
}

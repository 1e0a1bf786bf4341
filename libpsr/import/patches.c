/* Exact surfaces beside a mesh's triangles. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/cad_module.h"
#include "dpoint/patch.h"
#include "import.h"

void import_patches_destroy(struct psr_patch *patch, uint32_t n)
{
	for (uint32_t i = 0; i < n; i++)
		cad_patch_free(&patch[i]);
	free(patch);
}

void import_mesh_move_triangle(struct psr_mesh *mesh, uint32_t to, uint32_t from)
{
	memmove(mesh->triangle[to], mesh->triangle[from], sizeof mesh->triangle[from]);
	mesh->triangle_material[to] = mesh->triangle_material[from];
	if (mesh->triangle_patch != NULL)
		mesh->triangle_patch[to] = mesh->triangle_patch[from];
}

static int check_corners(const struct psr_patch *patch, struct psr_error *err)
{
	for (uint32_t i = 0; i < patch->n_corners; i++)
		for (int k = 0; k < 2; k++)
			if (!(patch->corner[i][k] >= patch->knot[k][patch->degree[k]] &&
			      patch->corner[i][k] <= patch->knot[k][patch->n[k]]))
				return psr_fail(err, PSR_ERR_FORMAT, "corner %u of a NURBS patch is not within its domain", i);
	return PSR_OK;
}

static double turn_of(const struct psr_patch *patch, const uint32_t corner[3])
{
	const double *a = patch->corner[corner[0]], *b = patch->corner[corner[1]], *c = patch->corner[corner[2]];

	return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

int import_patch_check(const struct psr_patch *patch, uint32_t n_materials, struct psr_error *err)
{
	const struct dpoint_patch surface = { .degree = { patch->degree[0], patch->degree[1] },
		                                  .n = { patch->n[0], patch->n[1] },
		                                  .knot = { patch->knot[0], patch->knot[1] },
		                                  .control = (const double (*)[4])patch->control };
	int rc = dpoint_patch_check(&surface, err);

	if (rc == PSR_OK)
		rc = check_corners(patch, err);
	if (rc == PSR_OK && (patch->material >= n_materials || patch->n_triangles == 0))
		rc = psr_fail(err, PSR_ERR_FORMAT, "a NURBS patch has material %u of %u and %u triangles", patch->material,
		              n_materials, patch->n_triangles);
	for (uint32_t t = 0; t < patch->n_triangles && rc == PSR_OK; t++) {
		const uint32_t *corner = patch->triangle[t];

		if (corner[0] >= patch->n_corners || corner[1] >= patch->n_corners || corner[2] >= patch->n_corners ||
		    !(turn_of(patch, corner) >= 0))
			rc = psr_fail(err, PSR_ERR_FORMAT,
			              "triangle %u of a NURBS patch has corners %u, %u, %u of %u, or is clockwise", t, corner[0],
			              corner[1], corner[2], patch->n_corners);
	}
	return rc;
}

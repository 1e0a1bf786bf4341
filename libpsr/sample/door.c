#include <math.h>
#include "../base/vec.h"
#include "door.h"
#include "sheet.h"

static int check_materials(const struct psr_mesh *mesh, struct psr_error *err)
{
	for (uint32_t i = 0; i < mesh->n_materials; i++) {
		int image = mesh->material[i].base_texture.image;

		if (image >= 0
		    && ((uint32_t)image >= mesh->n_images || mesh->image[image].width == 0 || mesh->image[image].height == 0))
			return psr_fail(err, PSR_ERR_ARG, "material %u uses image %d, which does not exist or is empty", i, image);
	}
	return PSR_OK;
}

int door_check_mesh(const struct psr_mesh *mesh, struct psr_error *err)
{
	if (mesh->n_triangles == 0)
		return psr_fail(err, PSR_ERR_ARG, "the mesh has no triangles");
	if (mesh->n_triangles >= SHEET_BACK)
		return psr_fail(err, PSR_ERR_LIMIT, "%u triangles are over the limit of %u", mesh->n_triangles,
		                SHEET_BACK - 1);
	for (uint32_t i = 0; i < mesh->n_triangles; i++) {
		for (int k = 0; k < 3; k++)
			if (mesh->triangle[i][k] >= mesh->n_vertices)
				return psr_fail(err, PSR_ERR_ARG, "triangle %u uses vertex %u of %u", i, mesh->triangle[i][k],
				                mesh->n_vertices);
		if (mesh->triangle_material[i] >= mesh->n_materials)
			return psr_fail(err, PSR_ERR_ARG, "triangle %u uses material %u of %u", i, mesh->triangle_material[i],
			                mesh->n_materials);
	}
	for (uint32_t i = 0; i < mesh->n_vertices; i++)
		for (int k = 0; k < 3; k++)
			if (!isfinite(mesh->position[i][k]))
				return psr_fail(err, PSR_ERR_ARG, "vertex %u is not finite", i);
	return check_materials(mesh, err);
}

int door_bound_mesh(const struct psr_mesh *mesh, double center[3], double *radius, struct psr_error *err)
{
	double min[3] = { INFINITY, INFINITY, INFINITY }, max[3] = { -INFINITY, -INFINITY, -INFINITY }, reach = 0;

	for (size_t i = 0; i < 3 * (size_t)mesh->n_triangles; i++) {
		const double *p = mesh->position[mesh->triangle[i / 3][i % 3]];

		for (int k = 0; k < 3; k++) {
			min[k] = p[k] < min[k] ? p[k] : min[k];
			max[k] = p[k] > max[k] ? p[k] : max[k];
		}
	}
	for (int k = 0; k < 3; k++)
		center[k] = min[k] + (max[k] - min[k]) / 2;
	for (size_t i = 0; i < 3 * (size_t)mesh->n_triangles; i++) {
		double d[3], length;

		v3d_sub(d, mesh->position[mesh->triangle[i / 3][i % 3]], center);
		length = v3d_length(d);
		reach = length > reach ? length : reach;
	}
	*radius = reach * (1 + 0x1p-20);
	if (!isnormal(*radius) || *radius * *radius == 0 || !isfinite(*radius * *radius))
		return psr_fail(err, PSR_ERR_ARG,
		                "the mesh has a radius of %g: it must have an extent, and one whose square is a number", *radius);
	return PSR_OK;
}

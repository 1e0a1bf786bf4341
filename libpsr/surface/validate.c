#include <math.h>
#include "base/vec.h"
#include "surface.h"
#include "validate.h"

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

static int check_points(const struct psr_mesh *mesh, struct psr_error *err)
{
	for (uint32_t i = 0; i < mesh->n_points; i++) {
		if (mesh->point_material[i] >= mesh->n_materials)
			return psr_fail(err, PSR_ERR_ARG, "point %u uses material %u of %u", i, mesh->point_material[i],
			                mesh->n_materials);
		if (!(mesh->point_radius[i] > 0) || !isfinite(mesh->point_radius[i]))
			return psr_fail(err, PSR_ERR_ARG, "point %u has a radius of %g", i, (double)mesh->point_radius[i]);
		for (int k = 0; k < 3; k++)
			if (!isfinite(mesh->point[i][k]) || !isfinite(mesh->point_normal[i][k]))
				return psr_fail(err, PSR_ERR_ARG, "point %u is not finite", i);
	}
	return PSR_OK;
}

int validate_mesh(const struct psr_mesh *mesh, struct psr_error *err)
{
	if (mesh->n_triangles == 0 && mesh->n_points == 0)
		return psr_fail(err, PSR_ERR_ARG, "the mesh has no triangles and no points");
	if ((uint64_t)mesh->n_triangles + mesh->n_points >= SURFACE_BACK)
		return psr_fail(err, PSR_ERR_LIMIT, "%u triangles and %u points are over the limit of %u", mesh->n_triangles,
		                mesh->n_points, SURFACE_BACK - 1);
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
	if (check_points(mesh, err) != PSR_OK)
		return PSR_ERR_ARG;
	return check_materials(mesh, err);
}

/* Counts corners of triangles, and points, each of which reaches as far as its disc. */
static uint64_t n_corners(const struct psr_mesh *mesh)
{
	return 3 * (uint64_t)mesh->n_triangles + mesh->n_points;
}

static const double *corner_of(const struct psr_mesh *mesh, uint64_t i, double *around)
{
	const uint64_t n = 3 * (uint64_t)mesh->n_triangles;

	*around = i < n ? 0 : (double)mesh->point_radius[i - n];
	return i < n ? mesh->position[mesh->triangle[i / 3][i % 3]] : mesh->point[i - n];
}

int validate_bound_mesh(const struct psr_mesh *mesh, double center[3], double *radius, struct psr_error *err)
{
	double min[3] = { INFINITY, INFINITY, INFINITY }, max[3] = { -INFINITY, -INFINITY, -INFINITY }, reach = 0;

	for (uint64_t i = 0; i < n_corners(mesh); i++) {
		double around;
		const double *p = corner_of(mesh, i, &around);

		for (int k = 0; k < 3; k++) {
			min[k] = fmin(min[k], p[k] - around);
			max[k] = fmax(max[k], p[k] + around);
		}
	}
	for (int k = 0; k < 3; k++)
		center[k] = min[k] + (max[k] - min[k]) / 2;
	for (uint64_t i = 0; i < n_corners(mesh); i++) {
		double d[3], around;

		v3d_sub(d, corner_of(mesh, i, &around), center);
		reach = fmax(reach, v3d_length(d) + around);
	}
	*radius = reach * (1 + 0x1p-20);
	if (!isnormal(*radius) || *radius * *radius == 0 || !isfinite(*radius * *radius))
		return psr_fail(err, PSR_ERR_ARG,
		                "the mesh has a radius of %g: it must be above 0, and its square finite",
		                *radius);
	return PSR_OK;
}

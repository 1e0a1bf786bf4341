#include "../base/vec.h"
#include "material.h"
#include "psr/direction.h"
#include "psr/error.h"
#include "surface.h"
#include "texture.h"

/* The quantised normals are up to 1.27 degrees off; one at this height still faces the projection. */
#define LEAST_HEIGHT 0.03f

int surface_init(struct surface *surface, const struct psr_mesh *mesh, double scale)
{
	*surface = (struct surface){ .mesh = mesh, .scale = scale };
	return PSR_OK;
}

void surface_fini(struct surface *surface)
{
	*surface = (struct surface){ 0 };
}

static void face_normal(const struct psr_mesh *mesh, uint32_t prim, float normal[3])
{
	const uint32_t *index = mesh->triangle[prim];
	double e1[3], e2[3], n[3];

	v3d_sub(e1, mesh->position[index[1]], mesh->position[index[0]]);
	v3d_sub(e2, mesh->position[index[2]], mesh->position[index[0]]);
	v3d_cross(n, e1, e2);
	if (v3d_normalize(n, n) == 0)
		v3d_set(n, 0, 0, 0);
	v3f_set(normal, (float)n[0], (float)n[1], (float)n[2]);
}

static void shading_normal(const struct psr_mesh *mesh, uint32_t prim, double u, double v, float normal[3])
{
	const uint32_t *index = mesh->triangle[prim];
	const float weight[3] = { (float)(1 - u - v), (float)u, (float)v };
	float geometric[3];

	face_normal(mesh, prim, geometric);
	v3f_set(normal, 0, 0, 0);
	for (int i = 0; i < 3; i++)
		v3f_add_scaled(normal, normal, weight[i], mesh->normal[index[i]]);
	if (v3f_normalize(normal, normal) == 0)
		v3f_set(normal, geometric[0], geometric[1], geometric[2]);
	else if (v3f_dot(normal, geometric) < 0)
		v3f_scale(normal, normal, -1);
}

void surface_face(float normal[3], const float facing[3])
{
	float height = v3f_dot(normal, facing);

	if (height >= LEAST_HEIGHT)
		return;
	v3f_add_scaled(normal, normal, LEAST_HEIGHT - height, facing);
	if (v3f_normalize(normal, normal) == 0)
		v3f_set(normal, facing[0], facing[1], facing[2]);
}

uint64_t surface_attr(const struct surface *surface, const struct surface_place *place, double diameter,
                      const float facing[3])
{
	const struct psr_mesh *mesh = surface->mesh;
	float rgba[4], normal[3];

	(void)diameter;
	texture_base_color(mesh, place->prim, place->u, place->v, rgba);
	shading_normal(mesh, place->prim, place->u, place->v, normal);
	if (place->is_back)
		v3f_scale(normal, normal, -1);
	surface_face(normal, facing);
	return material_attr(&mesh->material[mesh->triangle_material[place->prim]], rgba) | psr_direction_encode(normal);
}

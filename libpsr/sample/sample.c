#include <math.h>
#include "../base/vec.h"
#include "material.h"
#include "psr/direction.h"
#include "sample.h"
#include "texture.h"

/* The quantised normals are up to 1.27 degrees off; one at this height still faces the projection. */
#define LEAST_HEIGHT 0.03f

float sample_cosine(const struct ray_scene *scene, const struct psr_projection *projection,
                    const struct lattice_sample *sample)
{
	float cosine = v3f_dot(ray_scene_normal(scene, sample->surface & ~LATTICE_BACK), projection->axis[2]);

	cosine = (sample->surface & LATTICE_BACK) != 0 ? -cosine : cosine;
	return cosine > 0 ? cosine < 1 ? cosine : 1 : 0;
}

void sample_position(const struct lattice *lattice, uint32_t block, unsigned s, float position[3])
{
	const struct psr_projection *p = &lattice->projection;
	double x, y, z = (double)lattice->sample[block][s].z;

	lattice_position(p, lattice->col[block], lattice->row[block], s, &x, &y);
	for (int k = 0; k < 3; k++)
		position[k] = (float)(x * (double)p->axis[0][k] + y * (double)p->axis[1][k] + z * (double)p->axis[2][k]);
}

/* Barycentric coordinates of the sample on the primitive that it met. */
static void locate(const struct ray_scene *scene, const struct lattice *lattice, uint32_t block, unsigned s, double *u,
                   double *v)
{
	const struct psr_projection *projection = &lattice->projection;
	struct ray ray;
	double x, y;

	lattice_position(projection, lattice->col[block], lattice->row[block], s, &x, &y);
	lattice_ray(projection, x, y, &ray);
	ray_locate(scene, &ray, lattice->sample[block][s].surface & ~LATTICE_BACK, u, v);
}

static void shading_normal(const struct psr_mesh *mesh, const float geometric[3], uint32_t prim, double u, double v,
                           float normal[3])
{
	const uint32_t *index = mesh->triangle[prim];
	const float weight[3] = { (float)(1 - u - v), (float)u, (float)v };

	v3f_set(normal, 0, 0, 0);
	for (int i = 0; i < 3; i++)
		v3f_add_scaled(normal, normal, weight[i], mesh->normal[index[i]]);
	if (v3f_normalize(normal, normal) == 0)
		v3f_set(normal, geometric[0], geometric[1], geometric[2]);
	else if (v3f_dot(normal, geometric) < 0)
		v3f_scale(normal, normal, -1);
}

uint64_t sample_attr(const struct psr_mesh *mesh, const struct ray_scene *scene, const struct lattice *lattice,
                     uint32_t block, unsigned s)
{
	uint32_t surface = lattice->sample[block][s].surface, prim = surface & ~LATTICE_BACK;
	const float *view = lattice->projection.axis[2];
	float rgba[4], normal[3], height;
	double u, v;

	locate(scene, lattice, block, s, &u, &v);
	texture_base_color(mesh, prim, u, v, rgba);
	shading_normal(mesh, ray_scene_normal(scene, prim), prim, u, v, normal);
	if ((surface & LATTICE_BACK) != 0)
		v3f_scale(normal, normal, -1);
	height = v3f_dot(normal, view);
	if (height < LEAST_HEIGHT) {
		v3f_add_scaled(normal, normal, LEAST_HEIGHT - height, view);
		if (v3f_normalize(normal, normal) == 0)
			v3f_set(normal, view[0], view[1], view[2]);
	}
	return material_attr(&mesh->material[mesh->triangle_material[prim]], rgba)
	       | psr_direction_encode(normal);
}

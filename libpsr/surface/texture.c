#include <math.h>
#include "filter.h"
#include "texture.h"

int texture_place(const struct psr_mesh *mesh, const struct psr_texture *texture, uint32_t triangle, double u, double v,
                  double st[2])
{
	const float (*uv)[2] = (const float(*)[2])mesh->uv[texture->uv_set];
	const double weight[3] = { 1 - u - v, u, v };
	double at[2] = { 0, 0 };

	for (int i = 0; uv != NULL && i < 3; i++)
		for (int k = 0; k < 2; k++)
			at[k] += weight[i] * (double)uv[mesh->triangle[triangle][i]][k];
	for (int k = 0; k < 2; k++) {
		const float *row = texture->transform + 3 * k;

		st[k] = (double)row[0] * at[0] + (double)row[1] * at[1] + (double)row[2];
	}
	return isfinite(st[0]) && isfinite(st[1]);
}

void texture_sides(const struct psr_mesh *mesh, const struct psr_texture *texture, uint32_t triangle, double side[2][2])
{
	const float (*uv)[2] = (const float(*)[2])mesh->uv[texture->uv_set];
	const uint32_t *index = mesh->triangle[triangle];

	for (int i = 0; i < 2; i++) {
		double d[2] = { 0, 0 };

		for (int k = 0; uv != NULL && k < 2; k++)
			d[k] = (double)uv[index[i + 1]][k] - (double)uv[index[0]][k];
		for (int k = 0; k < 2; k++)
			side[i][k] = (double)texture->transform[3 * k] * d[0] + (double)texture->transform[3 * k + 1] * d[1];
	}
}

void texture_plain_color(const struct psr_mesh *mesh, uint32_t prim, double u, double v, float rgba[4])
{
	const struct psr_material *material = &mesh->material[texture_material(mesh, prim)];
	const double weight[3] = { 1 - u - v, u, v };

	for (int c = 0; c < 4; c++) {
		double sum = 1;

		if (prim >= mesh->n_triangles) {
			sum = mesh->point_color != NULL ? (double)mesh->point_color[prim - mesh->n_triangles][c] : 1;
		} else if (mesh->color != NULL) {
			sum = 0;
			for (int i = 0; i < 3; i++)
				sum += weight[i] * (double)mesh->color[mesh->triangle[prim][i]][c];
		}
		rgba[c] = material->base_color[c] * (float)sum;
		rgba[c] = rgba[c] > 0 ? rgba[c] < 1 ? rgba[c] : 1 : 0;
	}
}

void texture_base_color(const struct psr_mesh *mesh, uint32_t prim, double u, double v, float rgba[4])
{
	const struct psr_texture *texture = &mesh->material[texture_material(mesh, prim)].base_texture;
	double st[2];
	float texel[4];

	texture_plain_color(mesh, prim, u, v, rgba);
	if (prim >= mesh->n_triangles || texture->image < 0 || !texture_place(mesh, texture, prim, u, v, st))
		return;
	filter_point(&mesh->image[texture->image], MIP_COLOR, texture, st, texel);
	for (int c = 0; c < 4; c++)
		rgba[c] *= texel[c];
}

int texture_is_absent(const struct psr_mesh *mesh, uint32_t prim, double u, double v)
{
	const struct psr_material *material = &mesh->material[texture_material(mesh, prim)];
	float rgba[4];

	if (material->alpha == PSR_ALPHA_OPAQUE)
		return 0;
	texture_base_color(mesh, prim, u, v, rgba);
	return rgba[3] < (material->alpha == PSR_ALPHA_MASK ? material->alpha_cutoff : 0.5f);
}

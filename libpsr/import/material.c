#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "import.h"

#define MAX_FACTOR 1e6f /* of emission and of texture transforms: keeps their products finite */

static void no_texture(struct psr_texture *texture)
{
	*texture = (struct psr_texture){ .image = -1, .transform = { 1, 0, 0, 0, 1, 0 } };
}

void psr_material_default(struct psr_material *material)
{
	memset(material, 0, sizeof *material);
	for (int c = 0; c < 4; c++)
		material->base_color[c] = 1;
	material->roughness = 1;
	material->occlusion_strength = 1;
	material->normal_scale = 1;
	for (int c = 0; c < 3; c++)
		material->specular[c] = 1;
	material->glossiness = 1;
	material->alpha_cutoff = 0.5f;
	no_texture(&material->base_texture);
	no_texture(&material->metallic_roughness_texture);
	no_texture(&material->emissive_texture);
	no_texture(&material->occlusion_texture);
	no_texture(&material->normal_texture);
	no_texture(&material->specular_texture);
}

static float clamp(float x, float low, float high, float otherwise)
{
	return !isfinite(x) ? otherwise : x < low ? low : x > high ? high : x;
}

static void tidy_texture(struct psr_texture *t)
{
	static const float identity[6] = { 1, 0, 0, 0, 1, 0 };
	int is_finite = 1;

	for (int i = 0; i < 6; i++)
		is_finite &= isfinite(t->transform[i]) && fabsf(t->transform[i]) <= MAX_FACTOR;
	if (!is_finite)
		memcpy(t->transform, identity, sizeof identity);
}

static void textures_of(struct psr_texture *out[6], struct psr_material *m)
{
	out[0] = &m->base_texture;
	out[1] = &m->metallic_roughness_texture;
	out[2] = &m->emissive_texture;
	out[3] = &m->occlusion_texture;
	out[4] = &m->normal_texture;
	out[5] = &m->specular_texture;
}

void import_material_tidy(struct psr_material *m)
{
	struct psr_texture *texture[6];

	for (int c = 0; c < 4; c++)
		m->base_color[c] = clamp(m->base_color[c], 0.0f, 1.0f, 1.0f);
	for (int c = 0; c < 3; c++) {
		m->emissive[c] = clamp(m->emissive[c], 0.0f, MAX_FACTOR, 0.0f);
		m->specular[c] = clamp(m->specular[c], 0.0f, 1.0f, 1.0f);
		m->phong[c] = clamp(m->phong[c], 0.0f, 1.0f, 0.0f);
	}
	m->phong_exponent = clamp(m->phong_exponent, 0.0f, MAX_FACTOR, 0.0f);
	m->metallic = clamp(m->metallic, 0.0f, 1.0f, 0.0f);
	m->roughness = clamp(m->roughness, 0.0f, 1.0f, 1.0f);
	m->glossiness = clamp(m->glossiness, 0.0f, 1.0f, 1.0f);
	m->occlusion_strength = clamp(m->occlusion_strength, 0.0f, 1.0f, 1.0f);
	m->normal_scale = clamp(m->normal_scale, -MAX_FACTOR, MAX_FACTOR, 1.0f);
	m->alpha_cutoff = clamp(m->alpha_cutoff, 0.0f, 2.0f, 0.5f);
	textures_of(texture, m);
	for (int i = 0; i < 6; i++)
		tidy_texture(texture[i]);
}

int import_mesh_drop_images(struct import_mesh *im, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	struct psr_texture *texture[6];
	int *target = calloc((size_t)mesh->n_images + 1, sizeof *target);
	uint32_t kept = 0;

	if (target == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for %u images", im->path, mesh->n_images);
	for (uint32_t m = 0; m < mesh->n_materials; m++) {
		textures_of(texture, &mesh->material[m]);
		for (int i = 0; i < 6; i++) {
			assert(texture[i]->image >= -1 && texture[i]->image < (int)mesh->n_images);
			if (texture[i]->image >= 0)
				target[texture[i]->image] = 1;
		}
	}
	for (uint32_t i = 0; i < mesh->n_images; i++) {
		if (!target[i]) {
			free(mesh->image[i].rgba);
			continue;
		}
		mesh->image[kept] = mesh->image[i];
		target[i] = (int)kept++;
	}
	for (uint32_t m = 0; m < mesh->n_materials; m++) {
		textures_of(texture, &mesh->material[m]);
		for (int i = 0; i < 6; i++)
			if (texture[i]->image >= 0)
				texture[i]->image = target[texture[i]->image];
	}
	mesh->n_images = kept;
	free(target);
	return PSR_OK;
}

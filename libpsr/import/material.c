#include <math.h>
#include <string.h>
#include "import.h"

#define MAX_FACTOR 1e6f /* of emission, and of what stretches textures: keeps products of them finite */

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

void import_material_tidy(struct psr_material *m)
{
	for (int c = 0; c < 4; c++)
		m->base_color[c] = clamp(m->base_color[c], 0.0f, 1.0f, 1.0f);
	for (int c = 0; c < 3; c++) {
		m->emissive[c] = clamp(m->emissive[c], 0.0f, MAX_FACTOR, 0.0f);
		m->specular[c] = clamp(m->specular[c], 0.0f, 1.0f, 1.0f);
	}
	m->metallic = clamp(m->metallic, 0.0f, 1.0f, 0.0f);
	m->roughness = clamp(m->roughness, 0.0f, 1.0f, 1.0f);
	m->glossiness = clamp(m->glossiness, 0.0f, 1.0f, 1.0f);
	m->occlusion_strength = clamp(m->occlusion_strength, 0.0f, 1.0f, 1.0f);
	m->normal_scale = clamp(m->normal_scale, -MAX_FACTOR, MAX_FACTOR, 1.0f);
	m->alpha_cutoff = clamp(m->alpha_cutoff, 0.0f, 2.0f, 0.5f);
	tidy_texture(&m->base_texture);
	tidy_texture(&m->metallic_roughness_texture);
	tidy_texture(&m->emissive_texture);
	tidy_texture(&m->occlusion_texture);
	tidy_texture(&m->normal_texture);
	tidy_texture(&m->specular_texture);
}

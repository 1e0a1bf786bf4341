#include <string.h>
#include "base/direction.h"
#include "base/mem.h"
#include "base/vec.h"
#include "filter.h"
#include "material.h"
#include "mip.h"
#include "normal.h"
#include "psr/error.h"
#include "surface.h"
#include "texture.h"

/* The quantised normals are up to 1.27 degrees off; one at this height still faces the projection. */
#define LEAST_HEIGHT 0.03f

/* Rounding to a mip map's 16 bits shortens a unit vector by half a step along each axis at most. */
#define NORMAL_ROUNDING (0.87 / 32767)

/* A place on a triangle, for all of its textures. */
struct footprint {
	const struct surface *surface;
	const struct surface_place *place;
	const struct psr_material *material;
	struct plane plane;
	int has_area;
	double radius; /* of the circle, object units */
};

static enum mip_kind base_kind(const struct psr_material *material)
{
	return material->alpha == PSR_ALPHA_OPAQUE ? MIP_COLOR : MIP_COVERED;
}

static struct mip *mip_of(const struct surface *surface, int image, enum mip_kind kind)
{
	return &surface->mip[(size_t)image * MIP_KINDS + kind];
}

static int need(struct surface *surface, const struct psr_texture *texture, enum mip_kind kind, uint8_t *is_plain)
{
	struct mip *mip;

	if (texture->image < 0)
		return PSR_OK;
	*is_plain = 0;
	mip = mip_of(surface, texture->image, kind);
	return mip->image != NULL ? PSR_OK : mip_init(mip, &surface->mesh->image[texture->image], kind);
}

static int prepare_material(struct surface *surface, uint32_t i)
{
	const struct psr_material *m = &surface->mesh->material[i];
	uint8_t *is_plain = &surface->is_plain[i];
	struct material_values values;
	int rc;

	material_values_default(&values, m);
	surface->plain_word[i] = material_word(m, &values);
	*is_plain = 1;
	rc = need(surface, &m->base_texture, base_kind(m), is_plain);
	if (m->unlit)
		return rc;
	if (rc == PSR_OK)
		rc = m->is_specular_glossiness ? need(surface, &m->specular_texture, MIP_COLOR, is_plain)
		                               : need(surface, &m->metallic_roughness_texture, MIP_LINEAR, is_plain);
	if (rc == PSR_OK)
		rc = need(surface, &m->emissive_texture, MIP_COLOR, is_plain);
	if (rc == PSR_OK)
		rc = need(surface, &m->occlusion_texture, MIP_LINEAR, is_plain);
	if (rc == PSR_OK)
		rc = need(surface, &m->normal_texture, MIP_NORMAL, is_plain);
	return rc;
}

int surface_init(struct surface *surface, const struct psr_mesh *mesh, double scale)
{
	size_t n_mips = (size_t)mesh->n_images * MIP_KINDS;
	int rc = PSR_OK;

	*surface = (struct surface){ .mesh = mesh, .scale = scale };
	surface->mip = psr_alloc_array(n_mips, sizeof *surface->mip);
	surface->plain_word = psr_alloc_array(mesh->n_materials, sizeof *surface->plain_word);
	surface->is_plain = psr_alloc_array(mesh->n_materials, sizeof *surface->is_plain);
	if (surface->mip != NULL)
		memset(surface->mip, 0, n_mips * sizeof *surface->mip);
	if (surface->mip == NULL || surface->plain_word == NULL || surface->is_plain == NULL)
		return PSR_ERR_MEMORY;
	for (uint32_t i = 0; i < mesh->n_materials && rc == PSR_OK; i++)
		rc = prepare_material(surface, i);
	return rc;
}

void surface_fini(struct surface *surface)
{
	for (size_t i = 0; surface->mip != NULL && i < (size_t)surface->mesh->n_images * MIP_KINDS; i++)
		mip_fini(&surface->mip[i]);
	psr_free(surface->mip);
	psr_free(surface->plain_word);
	psr_free(surface->is_plain);
	*surface = (struct surface){ .mesh = NULL };
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

/* Computes the mean of a texture over the circle, and filter_look_up()'s share; 0 if there is no texture. */
static int look_up(const struct footprint *footprint, const struct psr_texture *texture, enum mip_kind kind,
                   float out[4], double *share, double jacobian[2][2])
{
	const struct psr_mesh *mesh = footprint->surface->mesh;
	const struct surface_place *place = footprint->place;
	double st[2], side[2][2], axes[2][2];

	if (texture->image < 0 || !texture_place(mesh, texture, place->prim, place->u, place->v, st))
		return 0;
	memset(jacobian, 0, 4 * sizeof **jacobian);
	if (footprint->has_area) {
		texture_sides(mesh, texture, place->prim, (double(*)[2])side);
		normal_jacobian(&footprint->plane, (const double(*)[2])side, jacobian);
	}
	for (int i = 0; i < 4; i++)
		axes[i / 2][i % 2] = jacobian[i / 2][i % 2] * footprint->radius;
	*share = filter_look_up(mip_of(footprint->surface, texture->image, kind), texture, st, (const double(*)[2])axes,
	                        out);
	return 1;
}

static void add_base(const struct footprint *footprint, float base[3])
{
	enum mip_kind kind = base_kind(footprint->material);
	double share, jacobian[2][2];
	float texel[4];

	if (!look_up(footprint, &footprint->material->base_texture, kind, texel, &share, jacobian))
		return;
	for (int c = 0; c < 3; c++)
		base[c] *= kind == MIP_COLOR ? texel[c] : texel[3] > 0 ? texel[c] / texel[3] : 0;
}

static void add_textures(const struct footprint *footprint, struct material_values *values)
{
	const struct psr_material *m = footprint->material;
	double share, jacobian[2][2];
	float texel[4];

	if (m->is_specular_glossiness) {
		if (look_up(footprint, &m->specular_texture, MIP_COLOR, texel, &share, jacobian)) {
			for (int c = 0; c < 3; c++)
				values->specular[c] *= texel[c];
			values->glossiness *= texel[3];
		}
	} else if (look_up(footprint, &m->metallic_roughness_texture, MIP_LINEAR, texel, &share, jacobian)) {
		values->roughness *= texel[1];
		values->metallic *= texel[2];
	}
	if (look_up(footprint, &m->emissive_texture, MIP_COLOR, texel, &share, jacobian))
		for (int c = 0; c < 3; c++)
			values->emission[c] *= texel[c];
	if (look_up(footprint, &m->occlusion_texture, MIP_LINEAR, texel, &share, jacobian))
		values->occlusion = 1 + m->occlusion_strength * (texel[0] - 1);
}

/* Applies the normal map; returns the variance of its normals within the circle. */
static double map_normal(const struct footprint *footprint, float normal[3])
{
	const struct psr_material *m = footprint->material;
	double share, jacobian[2][2], length;
	float mapped[4];

	if (!look_up(footprint, &m->normal_texture, MIP_NORMAL, mapped, &share, jacobian))
		return 0;
	length = (double)v3f_length(mapped);
	mapped[0] *= m->normal_scale;
	mapped[1] *= m->normal_scale;
	normal_map(footprint->surface->mesh, footprint->place, &footprint->plane, (const double(*)[2])jacobian, mapped,
	           normal);
	if (length + NORMAL_ROUNDING >= 1)
		return 0;
	/* The scale stretches small angles by as much. Where everything cancels out no lobe is left, and any number will
	 * do. */
	share *= (double)m->normal_scale * (double)m->normal_scale;
	return share * (1 - NORMAL_ROUNDING - length) / (length > 1e-3 ? length : 1e-3);
}

static uint64_t textured_word(const struct surface *surface, const struct surface_place *place, double diameter,
                              const struct psr_material *material, float normal[3])
{
	struct footprint footprint = { .surface = surface, .place = place, .material = material,
		                           .radius = diameter / 2 * surface->scale };
	struct material_values values;
	float rgba[4];

	footprint.has_area = normal_plane(surface->mesh, place->prim, &footprint.plane);
	material_values_default(&values, material);
	texture_plain_color(surface->mesh, place->prim, place->u, place->v, rgba);
	v3f_set(values.base, rgba[0], rgba[1], rgba[2]);
	add_base(&footprint, values.base);
	if (!material->unlit) {
		add_textures(&footprint, &values);
		values.spread = map_normal(&footprint, normal);
	}
	return material_word(material, &values);
}

static uint64_t colored_word(const struct surface *surface, const struct surface_place *place,
                             const struct psr_material *material)
{
	struct material_values values;
	float rgba[4];

	material_values_default(&values, material);
	texture_plain_color(surface->mesh, place->prim, place->u, place->v, rgba);
	v3f_set(values.base, rgba[0], rgba[1], rgba[2]);
	return material_word(material, &values);
}

uint64_t surface_look(const struct surface *surface, const struct surface_place *place, double diameter,
                      float normal[3])
{
	const struct psr_mesh *mesh = surface->mesh;
	uint32_t i = texture_material(mesh, place->prim);
	const float *point_normal;
	uint64_t word;

	if (place->prim < mesh->n_triangles) {
		normal_interpolate(mesh, place->prim, place->u, place->v, normal);
		word = surface->is_plain[i] ? mesh->color == NULL ? surface->plain_word[i]
		                                                  : colored_word(surface, place, &mesh->material[i])
		                            : textured_word(surface, place, diameter, &mesh->material[i], normal);
	} else {
		point_normal = mesh->point_normal[place->prim - mesh->n_triangles];
		v3f_set(normal, point_normal[0], point_normal[1], point_normal[2]);
		word = mesh->point_color == NULL ? surface->plain_word[i]
		                                 : colored_word(surface, place, &mesh->material[i]);
	}
	if (place->is_back)
		v3f_scale(normal, normal, -1);
	return word;
}

float surface_opacity(const struct surface *surface, const struct surface_place *place, double diameter)
{
	const struct psr_mesh *mesh = surface->mesh;
	const struct psr_material *material = &mesh->material[texture_material(mesh, place->prim)];
	struct footprint footprint = { .surface = surface, .place = place, .material = material,
		                 .radius = diameter / 2 * surface->scale };
	double share, jacobian[2][2];
	float rgba[4], texel[4];

	if (material->alpha != PSR_ALPHA_BLEND)
		return 1;
	texture_plain_color(mesh, place->prim, place->u, place->v, rgba);
	if (place->prim >= mesh->n_triangles)
		return rgba[3];
	footprint.has_area = normal_plane(mesh, place->prim, &footprint.plane);
	return look_up(&footprint, &material->base_texture, MIP_COVERED, texel, &share, jacobian) ? rgba[3] * texel[3]
	                                                                                           : rgba[3];
}

uint64_t surface_attr(const struct surface *surface, const struct surface_place *place, double diameter,
                      const float facing[3])
{
	float normal[3];
	uint64_t word = surface_look(surface, place, diameter, normal);

	surface_face(normal, facing);
	return word | psr_direction_encode(normal);
}

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/mem.h"
#include "base/vec.h"
#include "source.h"
#include "surface/validate.h"

#define DIELECTRIC 0.04

static int add_pyramid(struct psr_source *source, const struct psr_texture *texture, enum pyramid_kind kind)
{
	struct pyramid *pyramid;

	if (texture->image < 0)
		return PSR_OK;
	pyramid = &source->pyramid[(size_t)texture->image * PYRAMID_KINDS + kind];
	return pyramid->image != NULL ? PSR_OK : pyramid_init(pyramid, &source->mesh->image[texture->image], kind);
}

static enum pyramid_kind base_kind(const struct psr_material *m)
{
	return m->alpha == PSR_ALPHA_OPAQUE ? PYRAMID_COLOR : PYRAMID_COVERED;
}

static int add_pyramids(struct psr_source *source)
{
	const size_t n = (size_t)source->mesh->n_images * PYRAMID_KINDS;
	int rc = PSR_OK;

	source->pyramid = calloc(n + 1, sizeof *source->pyramid);
	if (source->pyramid == NULL)
		return PSR_ERR_MEMORY;
	for (uint32_t i = 0; i < source->mesh->n_materials && rc == PSR_OK; i++) {
		const struct psr_material *m = &source->mesh->material[i];
		const struct {
			const struct psr_texture *texture;
			enum pyramid_kind kind;
		} use[] = { { &m->base_texture, base_kind(m) },
			        { &m->metallic_roughness_texture, PYRAMID_DATA },
			        { &m->specular_texture, PYRAMID_COLOR },
			        { &m->emissive_texture, PYRAMID_COLOR },
			        { &m->occlusion_texture, PYRAMID_DATA },
			        { &m->normal_texture, PYRAMID_NORMAL } };

		for (size_t k = 0; k < sizeof use / sizeof use[0] && rc == PSR_OK; k++)
			rc = add_pyramid(source, use[k].texture, use[k].kind);
	}
	return rc;
}

static int add_solid(struct psr_source *source)
{
	const struct psr_mesh *mesh = source->mesh;

	source->solid = *mesh;
	source->solid.material = psr_alloc_array(mesh->n_materials, sizeof *mesh->material);
	if (source->solid.material == NULL)
		return PSR_ERR_MEMORY;
	for (uint32_t i = 0; i < mesh->n_materials; i++) {
		source->solid.material[i] = mesh->material[i];
		source->solid.material[i].alpha = PSR_ALPHA_OPAQUE;
		source->is_layered |= mesh->material[i].alpha != PSR_ALPHA_OPAQUE;
	}
	return PSR_OK;
}

int psr_source_create(struct psr_source **out, const struct psr_mesh *mesh, struct psr_error *err)
{
	struct psr_source *source;
	int rc = validate_mesh(mesh, err);

	if (rc != PSR_OK)
		return rc;
	source = calloc(1, sizeof *source);
	if (source == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for the ray tracer");
	source->mesh = mesh;
	rc = validate_bound_mesh(mesh, source->origin, &source->scale, err);
	if (rc == PSR_OK && (add_solid(source) != PSR_OK || add_pyramids(source) != PSR_OK))
		rc = psr_fail(err, PSR_ERR_MEMORY, "no memory for the mesh's textures");
	if (rc == PSR_OK)
		rc = ray_scene_create(&source->scene, &source->solid, source->origin, source->scale, err);
	if (rc != PSR_OK) {
		psr_source_destroy(source);
		return rc;
	}
	brdf_albedo_init(&source->albedo);
	*out = source;
	return PSR_OK;
}

void psr_source_destroy(struct psr_source *source)
{
	if (source == NULL)
		return;
	ray_scene_destroy(source->scene);
	for (size_t i = 0; source->pyramid != NULL && i < (size_t)source->mesh->n_images * PYRAMID_KINDS; i++)
		pyramid_fini(&source->pyramid[i]);
	free(source->pyramid);
	psr_free(source->solid.material);
	free(source);
}

/* A place on a primitive, and what lies around it. */
struct place {
	const struct psr_source *source;
	const struct psr_material *material;
	const uint32_t *index;  /* corners; NULL on discs */
	double weight[3];       /* of the corners */
	double edge[2][3];      /* corners 1 and 2 less corner 0, inner units */
	double spread[2][2];    /* how (u, v) changes to the ray's neighbours */
};

static uint32_t material_of(const struct psr_mesh *mesh, uint32_t prim)
{
	return prim < mesh->n_triangles ? mesh->triangle_material[prim] : mesh->point_material[prim - mesh->n_triangles];
}

static void place_at(const struct psr_source *source, const struct ray_hit *hit, struct place *place)
{
	const struct psr_mesh *mesh = source->mesh;
	double corner[3][3];

	*place = (struct place){ .source = source, .material = &mesh->material[material_of(mesh, hit->prim)],
		                     .weight = { 1 - hit->u - hit->v, hit->u, hit->v } };
	if (hit->prim >= mesh->n_triangles)
		return;
	place->index = mesh->triangle[hit->prim];
	ray_scene_corners(source->scene, hit->prim, corner);
	v3d_sub(place->edge[0], corner[1], corner[0]);
	v3d_sub(place->edge[1], corner[2], corner[0]);
}

/* Finds where the neighbours of a ray meet the triangle's plane. One that meets it nowhere in front sees as far as the
 * texture's coarsest level. */
static void spread_over(struct place *place, const struct source_ray *ray, const struct ray_hit *hit)
{
	double normal[3], corner[3], met[3];
	const double far = 1e3;

	if (place->index == NULL)
		return;
	v3d_cross(normal, place->edge[0], place->edge[1]);
	const double area2 = v3d_dot(normal, normal);
	v3d_add_scaled(met, ray->ray.origin, hit->t, ray->ray.direction);
	for (int i = 0; i < 2; i++) {
		const struct ray *beside = &ray->beside[i];
		double to[3], across[3];

		v3d_sub(to, met, beside->origin);
		const double t = v3d_dot(to, normal) / v3d_dot(beside->direction, normal);
		if (!(t > 0 && t < 10 * hit->t)) {
			place->spread[i][0] = place->spread[i][1] = far;
			continue;
		}
		v3d_add_scaled(corner, beside->origin, t, beside->direction);
		v3d_sub(corner, corner, met);
		v3d_cross(across, corner, place->edge[1]);
		place->spread[i][0] = v3d_dot(across, normal) / area2;
		v3d_cross(across, place->edge[0], corner);
		place->spread[i][1] = v3d_dot(across, normal) / area2;
		for (int k = 0; k < 2; k++)
			if (!(fabs(place->spread[i][k]) < far))
				place->spread[i][k] = far;
	}
}

/* Finds a texture's (s, t) at the place, and how it changes along the triangle's two edges from corner 0. */
static int locate(const struct place *place, const struct psr_texture *texture, double st[2], double along[2][2])
{
	const float (*uv)[2] = (const float(*)[2])place->source->mesh->uv[texture->uv_set];
	const float *m = texture->transform;
	double at[3][2];

	memset(along, 0, 4 * sizeof **along);
	for (int i = 0; i < 3; i++) {
		const double u = uv != NULL ? (double)uv[place->index[i]][0] : 0;
		const double v = uv != NULL ? (double)uv[place->index[i]][1] : 0;

		at[i][0] = (double)m[0] * u + (double)m[1] * v + (double)m[2];
		at[i][1] = (double)m[3] * u + (double)m[4] * v + (double)m[5];
	}
	for (int k = 0; k < 2; k++) {
		st[k] = place->weight[0] * at[0][k] + place->weight[1] * at[1][k] + place->weight[2] * at[2][k];
		along[0][k] = at[1][k] - at[0][k];
		along[1][k] = at[2][k] - at[0][k];
	}
	return isfinite(st[0]) && isfinite(st[1]) && isfinite(along[0][0] + along[0][1] + along[1][0] + along[1][1]);
}

/* Returns 0 if the material has no such texture here. */
static int look_up(const struct place *place, const struct psr_texture *texture, enum pyramid_kind kind, float out[4])
{
	double st[2], along[2][2], axes[2][2];

	if (place->index == NULL || texture->image < 0 || !locate(place, texture, st, along))
		return 0;
	for (int i = 0; i < 2; i++)
		for (int k = 0; k < 2; k++)
			axes[i][k] = place->spread[i][0] * along[0][k] + place->spread[i][1] * along[1][k];
	pyramid_mean(&place->source->pyramid[(size_t)texture->image * PYRAMID_KINDS + kind], texture, st,
	             (const double(*)[2])axes, out);
	return 1;
}

static double within_1(double x)
{
	return fmin(fmax(x, 0), 1);
}

/* The base colour's factor: the material's times that of vertices or points. */
static void plain_base(const struct place *place, uint32_t prim, double rgba[4])
{
	const struct psr_mesh *mesh = place->source->mesh;

	for (int c = 0; c < 4; c++) {
		double factor = 1;

		if (place->index == NULL) {
			factor = mesh->point_color != NULL ? (double)mesh->point_color[prim - mesh->n_triangles][c] : 1;
		} else if (mesh->color != NULL) {
			factor = 0;
			for (int i = 0; i < 3; i++)
				factor += place->weight[i] * (double)mesh->color[place->index[i]][c];
		}
		rgba[c] = within_1((double)place->material->base_color[c] * factor);
	}
}

/* The mask of a MASK material is the texture's as magnified: the rays of a pixel are its filter. */
static double opacity_of(const struct place *place, double alpha)
{
	const struct psr_material *m = place->material;
	struct place sharp = *place;
	float texel[4];

	if (m->alpha == PSR_ALPHA_OPAQUE)
		return 1;
	if (m->alpha == PSR_ALPHA_MASK)
		memset(sharp.spread, 0, sizeof sharp.spread);
	if (look_up(&sharp, &m->base_texture, PYRAMID_COVERED, texel))
		alpha *= (double)texel[3];
	return m->alpha == PSR_ALPHA_MASK ? !(alpha < (double)m->alpha_cutoff) : within_1(alpha);
}

double source_opacity(const struct psr_source *source, const struct ray_hit *hit)
{
	struct place place;
	double rgba[4];

	place_at(source, hit, &place);
	plain_base(&place, hit->prim, rgba);
	return opacity_of(&place, rgba[3]);
}

/* Finds the normal of the vertices, or the face's; the front's. */
static void interpolate(const struct place *place, const double face[3], double normal[3])
{
	v3d_set(normal, 0, 0, 0);
	for (int i = 0; place->index != NULL && i < 3; i++)
		for (int k = 0; k < 3; k++)
			normal[k] += place->weight[i] * (double)place->source->mesh->normal[place->index[i]][k];
	if (v3d_normalize(normal, normal) == 0)
		v3d_set(normal, face[0], face[1], face[2]);
}

/* Finds the directions in which a normal map's x and y grow: the mesh's tangents, or those of the texture's (s, t).
 * Returns 0 if there are none. */
static int tangents(const struct place *place, const double normal[3], double x[3], double y[3])
{
	const struct psr_mesh *mesh = place->source->mesh;
	double st[2], along[2][2], hand = 0;

	v3d_set(x, 0, 0, 0);
	if (mesh->tangent != NULL) {
		hand = (double)mesh->tangent[place->index[0]][3];
		for (int i = 0; i < 3; i++)
			for (int k = 0; k < 3; k++)
				x[k] += place->weight[i] * (double)mesh->tangent[place->index[i]][k];
	}
	if (hand != 0 && v3d_dot(x, x) > 0) {
		v3d_add_scaled(x, x, -v3d_dot(x, normal), normal);
		v3d_cross(y, normal, x);
		v3d_scale(y, y, hand);
		return v3d_normalize(x, x) > 0 && v3d_normalize(y, y) > 0;
	}
	if (!locate(place, &place->material->normal_texture, st, along))
		return 0;
	const double det = along[0][0] * along[1][1] - along[0][1] * along[1][0];
	if (!(fabs(det) > 0))
		return 0;
	/* dP/ds and -dP/dt: +y is up, towards -t. */
	for (int k = 0; k < 3; k++) {
		x[k] = (place->edge[0][k] * along[1][1] - place->edge[1][k] * along[0][1]) / det;
		y[k] = (place->edge[0][k] * along[1][0] - place->edge[1][k] * along[0][0]) / det;
	}
	v3d_add_scaled(x, x, -v3d_dot(x, normal), normal);
	if (v3d_normalize(x, x) == 0)
		return 0;
	/* As with given tangents the three are at right angles; y says only on which side. */
	double across[3];
	v3d_cross(across, normal, x);
	v3d_scale(y, across, v3d_dot(across, y) < 0 ? -1 : 1);
	return 1;
}

/* Tilts the normal by the normal map. Where the map's normals differ within the footprint the highlight is wider by
 * their variance (Toksvig 2005). */
static void tilt(const struct place *place, double normal[3], double *alpha)
{
	const double scale = (double)place->material->normal_scale;
	double x[3], y[3], tilted[3];
	float mapped[4];

	if (place->index == NULL || !look_up(place, &place->material->normal_texture, PYRAMID_NORMAL, mapped) ||
	    !tangents(place, normal, x, y))
		return;
	v3d_scale(tilted, normal, (double)mapped[2]);
	v3d_add_scaled(tilted, tilted, (double)mapped[0] * scale, x);
	v3d_add_scaled(tilted, tilted, (double)mapped[1] * scale, y);
	const double length = sqrt((double)(mapped[0] * mapped[0] + mapped[1] * mapped[1] + mapped[2] * mapped[2]));
	const double rounding = 0.01; /* of 8-bit codes */
	if (length < 1 - rounding)
		*alpha = sqrt(within_1(*alpha * *alpha + 2 * scale * scale * (1 - length) / fmax(length, 0.01)));
	if (v3d_normalize(tilted, tilted) > 0)
		v3d_set(normal, tilted[0], tilted[1], tilted[2]);
}

static void set_reflection(const struct place *place, const double base[3], struct brdf *brdf)
{
	const struct psr_material *m = place->material;
	double roughness = (double)m->roughness, metallic = (double)m->metallic, most = 0;
	double specular[3] = { (double)m->specular[0], (double)m->specular[1], (double)m->specular[2] };
	float texel[4];

	if (m->is_specular_glossiness) {
		roughness = 1 - (double)m->glossiness;
		if (look_up(place, &m->specular_texture, PYRAMID_COLOR, texel)) {
			roughness = 1 - (double)m->glossiness * (double)texel[3];
			for (int c = 0; c < 3; c++)
				specular[c] *= (double)texel[c];
		}
		for (int c = 0; c < 3; c++)
			most = fmax(most, specular[c]);
	} else if (look_up(place, &m->metallic_roughness_texture, PYRAMID_DATA, texel)) {
		roughness *= (double)texel[1];
		metallic *= (double)texel[2];
	}
	for (int c = 0; c < 3; c++) {
		brdf->diffuse[c] = base[c] * (1 - (m->is_specular_glossiness ? most : metallic));
		brdf->layer[c] = m->is_specular_glossiness ? specular[c] : DIELECTRIC;
		brdf->f0[c] = m->is_specular_glossiness ? specular[c] : DIELECTRIC + (base[c] - DIELECTRIC) * metallic;
	}
	brdf->alpha = roughness * roughness;
	if (!m->is_phong)
		return;
	brdf->is_phong = 1;
	brdf->exponent = (double)m->phong_exponent;
	v3d_set(brdf->phong, (double)m->phong[0], (double)m->phong[1], (double)m->phong[2]);
	v3d_set(brdf->diffuse, base[0], base[1], base[2]);
}

void source_look_at(const struct psr_source *source, const struct source_ray *ray, const struct ray_hit *hit,
                    struct source_look *look)
{
	const float *front = ray_scene_normal(source->scene, hit->prim);
	const double side = hit->is_back ? -1 : 1;
	double rgba[4];
	struct place place;
	float texel[4];

	*look = (struct source_look){ .occlusion = 1 };
	place_at(source, hit, &place);
	spread_over(&place, ray, hit);
	const struct psr_material *m = place.material;
	plain_base(&place, hit->prim, rgba);
	look->opacity = opacity_of(&place, rgba[3]);
	if (look_up(&place, &m->base_texture, base_kind(m), texel))
		for (int c = 0; c < 3; c++)
			rgba[c] *= m->alpha == PSR_ALPHA_OPAQUE ? (double)texel[c]
			           : texel[3] > 0               ? (double)(texel[c] / texel[3])
			                                        : 0;
	v3d_set(look->face, (double)front[0], (double)front[1], (double)front[2]);
	v3d_set(look->base, rgba[0], rgba[1], rgba[2]);
	look->is_unlit = m->unlit;
	look->is_textured = m->base_texture.image >= 0;
	interpolate(&place, look->face, look->normal);
	/* Some files' normals contradict the order of their corners, which tells the side. */
	const double turned = v3d_dot(look->normal, look->face) < 0 ? -side : side;
	set_reflection(&place, look->base, &look->brdf);
	tilt(&place, look->normal, &look->brdf.alpha);
	v3d_scale(look->face, look->face, side);
	v3d_scale(look->normal, look->normal, turned);
	const int has_glow = look_up(&place, &m->emissive_texture, PYRAMID_COLOR, texel);
	for (int c = 0; c < 3; c++)
		look->emission[c] = (double)m->emissive[c] * (has_glow ? (double)texel[c] : 1);
	if (look_up(&place, &m->occlusion_texture, PYRAMID_DATA, texel))
		look->occlusion = 1 + (double)m->occlusion_strength * ((double)texel[0] - 1);
}

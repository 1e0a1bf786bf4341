#include <assert.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "import.h"

void psr_mesh_destroy(struct psr_mesh *mesh)
{
	if (mesh == NULL)
		return;
	for (uint32_t i = 0; i < mesh->n_images; i++)
		free(mesh->image[i].rgba);
	free(mesh->position);
	free(mesh->normal);
	free(mesh->uv[0]);
	free(mesh->color);
	free(mesh->triangle);
	free(mesh->triangle_material);
	free(mesh->material);
	free(mesh->image);
	free(mesh);
}

int import_mesh_init(struct import_mesh *im, const char *path, struct psr_error *err)
{
	memset(im, 0, sizeof *im);
	im->path = path;
	im->mesh = calloc(1, sizeof *im->mesh);
	return im->mesh == NULL ? psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a mesh", path) : PSR_OK;
}

void import_mesh_fini(struct import_mesh *im)
{
	psr_mesh_destroy(im->mesh);
	im->mesh = NULL;
}

/* realloc of *array, a pointer of any type, which stays as it was on failure; n * size cannot overflow below the
 * limits of import.h. */
static int resize(void *array, uint64_t n, size_t size)
{
	void *block;

	memcpy(&block, array, sizeof block);
	block = realloc(block, n > 0 ? (size_t)n * size : 1);
	if (block == NULL)
		return 0;
	memcpy(array, &block, sizeof block);
	return 1;
}

static uint64_t next_capacity(uint64_t capacity, uint64_t needed, uint64_t max)
{
	uint64_t grown = capacity + capacity / 2;

	if (grown < needed)
		grown = needed;
	return grown < max ? grown : max;
}

static int reserve(struct import_mesh *im, uint64_t n_vertices, uint64_t n_triangles)
{
	struct psr_mesh *mesh = im->mesh;

	if (n_vertices > im->vertex_capacity) {
		uint64_t n = next_capacity(im->vertex_capacity, n_vertices, IMPORT_MAX_VERTICES);

		if (!resize(&mesh->position, n, sizeof *mesh->position) || !resize(&mesh->normal, n, sizeof *mesh->normal) ||
		    (mesh->uv[0] != NULL && !resize(&mesh->uv[0], n, sizeof *mesh->uv[0])) ||
		    (mesh->color != NULL && !resize(&mesh->color, n, sizeof *mesh->color)))
			return 0;
		im->vertex_capacity = n;
	}
	if (n_triangles > im->triangle_capacity) {
		uint64_t n = next_capacity(im->triangle_capacity, n_triangles, IMPORT_MAX_TRIANGLES);

		if (!resize(&mesh->triangle, n, sizeof *mesh->triangle) ||
		    !resize(&mesh->triangle_material, n, sizeof *mesh->triangle_material))
			return 0;
		im->triangle_capacity = n;
	}
	return 1;
}

static void fill_white(float (*color)[4], uint64_t first, uint64_t end)
{
	for (uint64_t i = first; i < end; i++)
		for (int c = 0; c < 4; c++)
			color[i][c] = 1.0f;
}

int import_mesh_grow(struct import_mesh *im, uint64_t n_vertices, uint64_t n_triangles, int has_uv, int has_color,
                     struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	uint64_t old_v = mesh->n_vertices, old_t = mesh->n_triangles;

	if (n_vertices > IMPORT_MAX_VERTICES - old_v || n_triangles > IMPORT_MAX_TRIANGLES - old_t)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: more than %llu vertices or %llu triangles", im->path,
		                (unsigned long long)IMPORT_MAX_VERTICES, (unsigned long long)IMPORT_MAX_TRIANGLES);
	if (!reserve(im, old_v + n_vertices, old_t + n_triangles))
		goto no_memory;
	if (has_uv && mesh->uv[0] == NULL) {
		mesh->uv[0] = calloc(im->vertex_capacity > 0 ? im->vertex_capacity : 1, sizeof *mesh->uv[0]);
		if (mesh->uv[0] == NULL)
			goto no_memory;
	}
	if (has_color && mesh->color == NULL) {
		mesh->color = malloc(im->vertex_capacity > 0 ? im->vertex_capacity * sizeof *mesh->color : 1);
		if (mesh->color == NULL)
			goto no_memory;
		fill_white(mesh->color, 0, old_v);
	}
	if (n_vertices > 0) {
		memset(mesh->position + old_v, 0, n_vertices * sizeof *mesh->position);
		memset(mesh->normal + old_v, 0, n_vertices * sizeof *mesh->normal);
		if (mesh->uv[0] != NULL)
			memset(mesh->uv[0] + old_v, 0, n_vertices * sizeof *mesh->uv[0]);
		if (mesh->color != NULL)
			fill_white(mesh->color, old_v, old_v + n_vertices);
	}
	if (n_triangles > 0) {
		memset(mesh->triangle + old_t, 0, n_triangles * sizeof *mesh->triangle);
		memset(mesh->triangle_material + old_t, 0, n_triangles * sizeof *mesh->triangle_material);
	}
	mesh->n_vertices = (uint32_t)(old_v + n_vertices);
	mesh->n_triangles = (uint32_t)(old_t + n_triangles);
	return PSR_OK;
no_memory:
	return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for %llu vertices and %llu triangles", im->path,
	                (unsigned long long)(old_v + n_vertices), (unsigned long long)(old_t + n_triangles));
}

int import_mesh_add_material(struct import_mesh *im, const struct psr_material *material, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;

	if (mesh->n_materials >= IMPORT_MAX_MATERIALS)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: more than %d materials", im->path, IMPORT_MAX_MATERIALS);
	if (!resize(&mesh->material, (uint64_t)mesh->n_materials + 1, sizeof *mesh->material))
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a material", im->path);
	mesh->material[mesh->n_materials] = *material;
	return (int)mesh->n_materials++;
}

int import_mesh_add_image(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, const char *name,
                          struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	struct psr_image image;
	int rc = import_image_decode(&image, bytes, n_bytes, name, IMPORT_MAX_PIXELS - im->n_pixels, err);

	if (rc != PSR_OK)
		return rc;
	if (!resize(&mesh->image, (uint64_t)mesh->n_images + 1, sizeof *mesh->image)) {
		free(image.rgba);
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for an image", im->path);
	}
	im->n_pixels += (uint64_t)image.width * image.height;
	mesh->image[mesh->n_images] = image;
	return (int)mesh->n_images++;
}

void import_mesh_warn(struct import_mesh *im, const char *format, ...)
{
	char *warning = im->mesh->warning, text[PSR_ERROR_TEXT];
	size_t used = strlen(warning), n;
	va_list args;

	va_start(args, format);
	vsnprintf(text, sizeof text, format, args);
	va_end(args);
	n = strlen(text);
	if (strstr(warning, text) != NULL || used + 2 + n + 1 > sizeof im->mesh->warning)
		return;
	if (used > 0) {
		memcpy(warning + used, "; ", 2);
		used += 2;
	}
	memcpy(warning + used, text, n + 1);
}

static float clamp(float x, float low, float high, float otherwise)
{
	return !isfinite(x) ? otherwise : x < low ? low : x > high ? high : x;
}

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

static void tidy_material(struct psr_material *m, uint32_t n_images)
{
	for (int c = 0; c < 4; c++)
		m->base_color[c] = clamp(m->base_color[c], 0.0f, 1.0f, 1.0f);
	m->metallic = clamp(m->metallic, 0.0f, 1.0f, 0.0f);
	m->roughness = clamp(m->roughness, 0.0f, 1.0f, 1.0f);
	m->alpha_cutoff = clamp(m->alpha_cutoff, 0.0f, 2.0f, 0.5f);
	assert(m->base_texture.image >= -1 && m->base_texture.image < (int)n_images);
	(void)n_images;
}

int import_mesh_finish(struct psr_mesh **out, struct import_mesh *im, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	int rc = import_mesh_repair(im, err);

	if (rc != PSR_OK)
		return rc;
	if (mesh->n_triangles == 0)
		return psr_fail(err, PSR_ERR_FORMAT,
		                "%s: no triangle to draw (%u degenerate or not finite, %u points and lines were left out)",
			im->path,
		                mesh->n_dropped_triangles, mesh->n_dropped_primitives);
	assert(mesh->n_materials > 0);
	for (uint32_t i = 0; i < mesh->n_materials; i++)
		tidy_material(&mesh->material[i], mesh->n_images);
	/* Shrinking cannot fail in a way that matters: the old block stays. */
	(void)resize(&mesh->position, mesh->n_vertices, sizeof *mesh->position);
	(void)resize(&mesh->normal, mesh->n_vertices, sizeof *mesh->normal);
	if (mesh->uv[0] != NULL)
		(void)resize(&mesh->uv[0], mesh->n_vertices, sizeof *mesh->uv[0]);
	if (mesh->color != NULL)
		(void)resize(&mesh->color, mesh->n_vertices, sizeof *mesh->color);
	(void)resize(&mesh->triangle, mesh->n_triangles, sizeof *mesh->triangle);
	(void)resize(&mesh->triangle_material, mesh->n_triangles, sizeof *mesh->triangle_material);
	*out = mesh;
	im->mesh = NULL;
	return PSR_OK;
}

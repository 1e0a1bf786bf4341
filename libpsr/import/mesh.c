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
	free(mesh->tangent);
	for (int set = 0; set < PSR_UV_SETS; set++)
		free(mesh->uv[set]);
	free(mesh->color);
	free(mesh->triangle);
	free(mesh->triangle_material);
	import_patches_destroy(mesh->patch, mesh->n_patches);
	free(mesh->triangle_patch);
	free(mesh->point);
	free(mesh->point_normal);
	free(mesh->point_radius);
	free(mesh->point_color);
	free(mesh->point_material);
	free(mesh->camera);
	free(mesh->light);
	free(mesh->material);
	free(mesh->image);
	free(mesh);
}

int import_mesh_init(struct import_mesh *im, const char *path, struct psr_error *err)
{
	memset(im, 0, sizeof *im);
	im->path = path;
	psr_import_options_default(&im->options);
	im->mesh = calloc(1, sizeof *im->mesh);
	return im->mesh == NULL ? psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a mesh", path) : PSR_OK;
}

void import_mesh_fini(struct import_mesh *im)
{
	psr_mesh_destroy(im->mesh);
	im->mesh = NULL;
}

int import_resize(void *array, uint64_t n, size_t size)
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

static int put_column(struct import_column *out, int n, void *array, size_t size)
{
	void *block;

	memcpy(&block, array, sizeof block);
	if (block == NULL)
		return n;
	out[n] = (struct import_column){ array, size };
	return n + 1;
}

int import_vertex_columns(struct import_column out[IMPORT_MAX_COLUMNS], struct psr_mesh *mesh)
{
	int n = 0;

	n = put_column(out, n, &mesh->position, sizeof *mesh->position);
	n = put_column(out, n, &mesh->normal, sizeof *mesh->normal);
	for (int set = 0; set < PSR_UV_SETS; set++)
		n = put_column(out, n, &mesh->uv[set], sizeof *mesh->uv[set]);
	n = put_column(out, n, &mesh->tangent, sizeof *mesh->tangent);
	return put_column(out, n, &mesh->color, sizeof *mesh->color);
}

int import_point_columns(struct import_column out[IMPORT_MAX_COLUMNS], struct psr_mesh *mesh)
{
	int n = 0;

	n = put_column(out, n, &mesh->point, sizeof *mesh->point);
	n = put_column(out, n, &mesh->point_normal, sizeof *mesh->point_normal);
	n = put_column(out, n, &mesh->point_radius, sizeof *mesh->point_radius);
	n = put_column(out, n, &mesh->point_material, sizeof *mesh->point_material);
	return put_column(out, n, &mesh->point_color, sizeof *mesh->point_color);
}

void *import_column_at(const struct import_column *column, uint64_t i)
{
	char *block;

	memcpy(&block, column->array, sizeof block);
	return block + i * column->size;
}

static int resize_columns(const struct import_column *column, int n, uint64_t n_elements)
{
	for (int i = 0; i < n; i++)
		if (!import_resize(column[i].array, n_elements, column[i].size))
			return 0;
	return 1;
}

static void clear_columns(const struct import_column *column, int n, uint64_t first, uint64_t n_elements)
{
	for (int i = 0; i < n && n_elements > 0; i++)
		memset(import_column_at(&column[i], first), 0, n_elements * column[i].size);
}

static void fill_white(float (*color)[4], uint64_t first, uint64_t end)
{
	for (uint64_t i = first; color != NULL && i < end; i++)
		for (int c = 0; c < 4; c++)
			color[i][c] = 1.0f;
}

/* Allocates n zero elements at *array, a pointer of any type, if it is wanted and NULL. */
static int create(void *array, int wanted, uint64_t n, size_t size)
{
	void *block;

	memcpy(&block, array, sizeof block);
	if (block != NULL || !wanted)
		return 1;
	block = calloc(n > 0 ? (size_t)n : 1, size);
	memcpy(array, &block, sizeof block);
	return block != NULL;
}

static int create_vertex_columns(struct import_mesh *im, unsigned has)
{
	struct psr_mesh *mesh = im->mesh;
	const uint64_t n = im->vertex_capacity;
	const int new_color = mesh->color == NULL;

	for (unsigned set = 0; set < PSR_UV_SETS; set++)
		if (!create(&mesh->uv[set], (has & IMPORT_HAS_UV0 << set) != 0, n, sizeof *mesh->uv[set]))
			return 0;
	if (!create(&mesh->tangent, (has & IMPORT_HAS_TANGENT) != 0, n, sizeof *mesh->tangent) ||
	    !create(&mesh->color, (has & IMPORT_HAS_COLOR) != 0, n, sizeof *mesh->color))
		return 0;
	if (new_color)
		fill_white(mesh->color, 0, mesh->n_vertices);
	return 1;
}

static int reserve(struct import_mesh *im, uint64_t n_vertices, uint64_t n_triangles)
{
	struct import_column column[IMPORT_MAX_COLUMNS];
	struct psr_mesh *mesh = im->mesh;

	if (n_vertices > im->vertex_capacity || mesh->position == NULL) {
		uint64_t n = next_capacity(im->vertex_capacity, n_vertices, IMPORT_MAX_VERTICES);

		if (!create(&mesh->position, 1, 1, sizeof *mesh->position) ||
		    !create(&mesh->normal, 1, 1, sizeof *mesh->normal) ||
		    !resize_columns(column, import_vertex_columns(column, mesh), n))
			return 0;
		im->vertex_capacity = n;
	}
	if (n_triangles > im->triangle_capacity) {
		uint64_t n = next_capacity(im->triangle_capacity, n_triangles, IMPORT_MAX_TRIANGLES);

		if (!import_resize(&mesh->triangle, n, sizeof *mesh->triangle) ||
		    !import_resize(&mesh->triangle_material, n, sizeof *mesh->triangle_material))
			return 0;
		im->triangle_capacity = n;
	}
	return 1;
}

int import_mesh_grow(struct import_mesh *im, uint64_t n_vertices, uint64_t n_triangles, unsigned has,
                     struct psr_error *err)
{
	struct import_column column[IMPORT_MAX_COLUMNS];
	struct psr_mesh *mesh = im->mesh;
	uint64_t old_v = mesh->n_vertices, old_t = mesh->n_triangles;

	if (n_vertices > IMPORT_MAX_VERTICES - old_v || n_triangles > IMPORT_MAX_TRIANGLES - old_t)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: more than %llu vertices or %llu triangles", im->path,
		                (unsigned long long)IMPORT_MAX_VERTICES, (unsigned long long)IMPORT_MAX_TRIANGLES);
	if (!reserve(im, old_v + n_vertices, old_t + n_triangles) || !create_vertex_columns(im, has))
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for %llu vertices and %llu triangles", im->path,
		                (unsigned long long)(old_v + n_vertices), (unsigned long long)(old_t + n_triangles));
	clear_columns(column, import_vertex_columns(column, mesh), old_v, n_vertices);
	fill_white(mesh->color, old_v, old_v + n_vertices);
	if (n_triangles > 0) {
		memset(mesh->triangle + old_t, 0, n_triangles * sizeof *mesh->triangle);
		memset(mesh->triangle_material + old_t, 0, n_triangles * sizeof *mesh->triangle_material);
	}
	mesh->n_vertices = (uint32_t)(old_v + n_vertices);
	mesh->n_triangles = (uint32_t)(old_t + n_triangles);
	return PSR_OK;
}

static int reserve_points(struct import_mesh *im, uint64_t n_points, int has_color)
{
	struct import_column column[IMPORT_MAX_COLUMNS];
	struct psr_mesh *mesh = im->mesh;
	const int new_color = mesh->point_color == NULL;

	if (n_points > im->point_capacity) {
		uint64_t n = next_capacity(im->point_capacity, n_points, IMPORT_MAX_POINTS);

		if (!create(&mesh->point, 1, 1, sizeof *mesh->point) ||
		    !create(&mesh->point_normal, 1, 1, sizeof *mesh->point_normal) ||
		    !create(&mesh->point_radius, 1, 1, sizeof *mesh->point_radius) ||
		    !create(&mesh->point_material, 1, 1, sizeof *mesh->point_material) ||
		    !resize_columns(column, import_point_columns(column, mesh), n))
			return 0;
		im->point_capacity = n;
	}
	if (!create(&mesh->point_color, has_color && n_points > 0, im->point_capacity, sizeof *mesh->point_color))
		return 0;
	if (new_color)
		fill_white(mesh->point_color, 0, mesh->n_points);
	return 1;
}

int import_mesh_grow_points(struct import_mesh *im, uint64_t n_points, int has_color, struct psr_error *err)
{
	struct import_column column[IMPORT_MAX_COLUMNS];
	struct psr_mesh *mesh = im->mesh;
	uint64_t old = mesh->n_points;

	if (n_points > IMPORT_MAX_POINTS - old)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: more than %llu points", im->path,
		                (unsigned long long)IMPORT_MAX_POINTS);
	if (!reserve_points(im, old + n_points, has_color))
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for %llu points", im->path,
		                (unsigned long long)(old + n_points));
	clear_columns(column, import_point_columns(column, mesh), old, n_points);
	fill_white(mesh->point_color, old, old + n_points);
	mesh->n_points = (uint32_t)(old + n_points);
	return PSR_OK;
}

void import_mesh_bounds(double low[3], double high[3], const struct psr_mesh *mesh)
{
	for (int k = 0; k < 3; k++) {
		low[k] = INFINITY;
		high[k] = -INFINITY;
		for (uint32_t v = 0; v < mesh->n_vertices; v++) {
			low[k] = fmin(low[k], mesh->position[v][k]);
			high[k] = fmax(high[k], mesh->position[v][k]);
		}
		for (uint32_t p = 0; p < mesh->n_points; p++) {
			low[k] = fmin(low[k], mesh->point[p][k]);
			high[k] = fmax(high[k], mesh->point[p][k]);
		}
	}
}

int import_mesh_add_material(struct import_mesh *im, const struct psr_material *material, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;

	if (mesh->n_materials >= IMPORT_MAX_MATERIALS)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: more than %d materials", im->path, IMPORT_MAX_MATERIALS);
	if (!import_resize(&mesh->material, (uint64_t)mesh->n_materials + 1, sizeof *mesh->material))
		return psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for a material", im->path);
	mesh->material[mesh->n_materials] = *material;
	return (int)mesh->n_materials++;
}

int import_mesh_add_pixels(struct import_mesh *im, struct psr_image *image, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	const uint64_t n = (uint64_t)image->width * image->height;

	if (n > IMPORT_MAX_PIXELS - im->n_pixels ||
	    !import_resize(&mesh->image, (uint64_t)mesh->n_images + 1, sizeof *mesh->image)) {
		free(image->rgba);
		return n > IMPORT_MAX_PIXELS - im->n_pixels ?
		       psr_fail(err, PSR_ERR_LIMIT, "%s: the images have more than %llu pixels", im->path,
		                (unsigned long long)IMPORT_MAX_PIXELS) :
		       psr_fail(err, PSR_ERR_MEMORY, "%s: no memory for an image", im->path);
	}
	im->n_pixels += n;
	mesh->image[mesh->n_images] = *image;
	return (int)mesh->n_images++;
}

int import_mesh_add_image(struct import_mesh *im, const uint8_t *bytes, size_t n_bytes, const char *name,
                          struct psr_error *err)
{
	struct psr_image image;
	int rc = import_image_decode(&image, bytes, n_bytes, name, IMPORT_MAX_PIXELS - im->n_pixels, err);

	return rc == PSR_OK ? import_mesh_add_pixels(im, &image, err) : rc;
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

/* If shrinking fails, the old block stays, which does no harm. */
static void shrink(struct psr_mesh *mesh)
{
	struct import_column column[IMPORT_MAX_COLUMNS];

	(void)resize_columns(column, import_vertex_columns(column, mesh), mesh->n_vertices);
	(void)resize_columns(column, import_point_columns(column, mesh), mesh->n_points);
	(void)import_resize(&mesh->triangle, mesh->n_triangles, sizeof *mesh->triangle);
	(void)import_resize(&mesh->triangle_material, mesh->n_triangles, sizeof *mesh->triangle_material);
}

int import_mesh_finish(struct psr_mesh **out, struct import_mesh *im, struct psr_error *err)
{
	struct psr_mesh *mesh = im->mesh;
	int rc = import_mesh_repair(im, err);

	if (rc != PSR_OK)
		return rc;
	if (mesh->n_triangles == 0 && mesh->n_points == 0)
		return psr_fail(
			err, PSR_ERR_FORMAT,
			"%s: no triangle or point to draw (%u faces without area, duplicate or not finite, and %u "
			"lines and points were left out)",
			im->path, mesh->n_dropped_triangles, mesh->n_dropped_primitives);
	if (mesh->n_points > 0) {
		rc = import_cloud_finish(im, err);
		if (rc != PSR_OK)
			return rc;
	}
	assert(mesh->n_materials > 0);
	for (uint32_t i = 0; i < mesh->n_materials; i++)
		import_material_tidy(&mesh->material[i]);
	rc = import_mesh_drop_images(im, err);
	if (rc != PSR_OK)
		return rc;
	shrink(mesh);
	*out = mesh;
	im->mesh = NULL;
	return PSR_OK;
}

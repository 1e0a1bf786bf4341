#include "glb.h"

#include <cjson/cJSON.h>
#include <stdlib.h>
#include <string.h>
#include "glb_parts.h"
#include "image.h"

static void sorted_fini(struct glb_sorted *sorted)
{
	free(sorted->vertex);
	free(sorted->index);
	free(sorted->vertex_first);
	free(sorted->index_first);
}

static uint32_t group_of(const struct shape *shape, uint32_t triangle)
{
	return shape->triangle_part[triangle] * shape->n_materials + shape->triangle_material[triangle];
}

static int sorted_init(struct glb_sorted *sorted, const struct shape *shape)
{
	uint32_t *number = malloc(sizeof *number * shape->n_vertices);
	uint32_t n_indices = 0;

	sorted->n_groups = shape->n_parts * shape->n_materials;
	sorted->n_vertices = 0;
	sorted->vertex = malloc(sizeof *sorted->vertex * 3 * shape->n_triangles);
	sorted->index = malloc(sizeof *sorted->index * 3 * shape->n_triangles);
	sorted->vertex_first = malloc(sizeof *sorted->vertex_first * (sorted->n_groups + 1));
	sorted->index_first = malloc(sizeof *sorted->index_first * (sorted->n_groups + 1));
	if (number == NULL || sorted->vertex == NULL || sorted->index == NULL || sorted->vertex_first == NULL ||
	    sorted->index_first == NULL) {
		free(number);
		return PSR_ERR_MEMORY;
	}
	for (uint32_t g = 0; g < sorted->n_groups; g++) {
		memset(number, 0xff, sizeof *number * shape->n_vertices);
		sorted->vertex_first[g] = sorted->n_vertices;
		sorted->index_first[g] = n_indices;
		for (uint32_t t = 0; t < shape->n_triangles; t++) {
			for (int k = 0; k < 3 && group_of(shape, t) == g; k++) {
				uint32_t v = shape->triangle[t][k];

				if (number[v] == UINT32_MAX) {
					number[v] = sorted->n_vertices - sorted->vertex_first[g];
					sorted->vertex[sorted->n_vertices++] = v;
				}
				sorted->index[n_indices++] = number[v];
			}
		}
	}
	sorted->vertex_first[sorted->n_groups] = sorted->n_vertices;
	sorted->index_first[sorted->n_groups] = n_indices;
	free(number);
	return PSR_OK;
}

/* Only shapes with pictures have places. */
static void make_layout(struct glb_layout *layout, const struct shape *shape, const struct glb_sorted *sorted)
{
	/* shape.c keeps counts below 2^26, so all of this fits 32 bits */
	layout->start[GLB_NORMALS] = 12 * sorted->n_vertices;
	layout->start[GLB_INDICES] = 24 * sorted->n_vertices;
	layout->start[GLB_PLACES] = layout->start[GLB_INDICES] + 12 * shape->n_triangles;
	layout->start[GLB_POSITIONS] = 0;
	layout->n_views = GLB_PLACES;
	layout->bytes = layout->start[GLB_PLACES];
	if (shape->n_images > 0) {
		layout->n_views = GLB_IMAGES + shape->n_images;
		layout->start[GLB_IMAGES] = layout->start[GLB_PLACES] + 8 * sorted->n_vertices;
		for (uint32_t i = 0; i < shape->n_images; i++)
			layout->start[GLB_IMAGES + i + 1] =
				layout->start[GLB_IMAGES + i] + (((uint32_t)image_png_bytes(shape->image[i].size) + 3) & ~3u);
		layout->bytes = layout->start[layout->n_views];
	}
}

static void put_u32(uint8_t **at, uint32_t v)
{
	for (int k = 0; k < 4; k++)
		*(*at)++ = (uint8_t)(v >> 8 * k);
}

static void put_floats(uint8_t **at, const float *v, int n)
{
	uint32_t bits;

	for (int k = 0; k < n; k++) {
		memcpy(&bits, &v[k], sizeof bits);
		put_u32(at, bits);
	}
}

/* `bin` is all zeros */
static void put_bin(uint8_t *bin, const struct shape *shape, const struct glb_sorted *sorted,
                    const struct glb_layout *layout)
{
	uint8_t *at = bin;

	for (uint32_t i = 0; i < sorted->n_vertices; i++)
		put_floats(&at, shape->position[sorted->vertex[i]], 3);
	for (uint32_t i = 0; i < sorted->n_vertices; i++)
		put_floats(&at, shape->normal[sorted->vertex[i]], 3);
	for (uint32_t i = 0; i < 3 * shape->n_triangles; i++)
		put_u32(&at, sorted->index[i]);
	for (uint32_t i = 0; i < sorted->n_vertices && shape->n_images > 0; i++)
		put_floats(&at, shape->uv[sorted->vertex[i]], 2);
	for (uint32_t i = 0; i < shape->n_images; i++)
		image_png(bin + layout->start[GLB_IMAGES + i], shape->image[i].size, shape->image[i].rgb);
}

int glb_encode(uint8_t **bytes, size_t *n_bytes, const struct shape *shape, const char *name, struct psr_error *err)
{
	struct glb_sorted sorted;
	struct glb_layout layout;
	uint32_t n_json, padded;
	char *json = NULL;
	uint8_t *file = NULL, *at;
	int code = shape_check(shape, err);

	if (code != PSR_OK)
		return code;
	if (shape->n_triangles == 0)
		return psr_fail(err, PSR_ERR_ARG, "the mesh '%s' has no triangles", name);
	code = sorted_init(&sorted, shape);
	if (code == PSR_OK) {
		make_layout(&layout, shape, &sorted);
		json = glb_json(shape, &sorted, &layout, name);
		n_json = json == NULL ? 0 : (uint32_t)strlen(json);
		padded = (n_json + 3) & ~3u;
		file = json == NULL ? NULL : calloc(1, (size_t)28 + padded + layout.bytes);
		code = file == NULL ? PSR_ERR_MEMORY : PSR_OK;
	}
	if (code == PSR_OK) {
		at = file;
		put_u32(&at, 0x46546c67); /* "glTF" */
		put_u32(&at, 2);
		put_u32(&at, 28 + padded + layout.bytes);
		put_u32(&at, padded);
		put_u32(&at, 0x4e4f534a); /* "JSON" */
		memset(at, ' ', padded);
		memcpy(at, json, n_json);
		at += padded;
		put_u32(&at, layout.bytes);
		put_u32(&at, 0x004e4942); /* "BIN" */
		put_bin(at, shape, &sorted, &layout);
		*bytes = file;
		*n_bytes = (size_t)28 + padded + layout.bytes;
	} else {
		psr_fail(err, code, "no memory to write '%s' as glTF", name);
	}
	cJSON_free(json);
	sorted_fini(&sorted);
	return code;
}

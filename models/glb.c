#include "glb.h"

#include <cjson/cJSON.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "base/srgb.h"

enum { GLTF_FLOAT = 5126, GLTF_UINT = 5125, GLTF_VERTICES = 34962, GLTF_INDICES = 34963 };

/* Vertices and triangles sorted by material, in the order in which they were made. */
struct sorted {
	uint32_t n_vertices;   /* a vertex that two materials use counts twice */
	uint32_t *vertex;      /* sorted index -> index in the shape */
	uint32_t *index;       /* 3 a triangle, relative to the first vertex of its material */
	uint32_t *vertex_first, *index_first; /* n_materials + 1 */
};

static void sorted_fini(struct sorted *sorted)
{
	free(sorted->vertex);
	free(sorted->index);
	free(sorted->vertex_first);
	free(sorted->index_first);
}

static int sorted_init(struct sorted *sorted, const struct shape *shape)
{
	uint32_t *number = malloc(sizeof *number * shape->n_vertices);
	uint32_t n_indices = 0;

	sorted->n_vertices = 0;
	sorted->vertex = malloc(sizeof *sorted->vertex * 3 * shape->n_triangles);
	sorted->index = malloc(sizeof *sorted->index * 3 * shape->n_triangles);
	sorted->vertex_first = malloc(sizeof *sorted->vertex_first * (shape->n_materials + 1));
	sorted->index_first = malloc(sizeof *sorted->index_first * (shape->n_materials + 1));
	if (number == NULL || sorted->vertex == NULL || sorted->index == NULL || sorted->vertex_first == NULL ||
	    sorted->index_first == NULL) {
		free(number);
		return PSR_ERR_MEMORY;
	}
	for (uint32_t m = 0; m < shape->n_materials; m++) {
		memset(number, 0xff, sizeof *number * shape->n_vertices);
		sorted->vertex_first[m] = sorted->n_vertices;
		sorted->index_first[m] = n_indices;
		for (uint32_t t = 0; t < shape->n_triangles; t++) {
			for (int k = 0; k < 3 && shape->triangle_material[t] == m; k++) {
				uint32_t v = shape->triangle[t][k];
				if (number[v] == UINT32_MAX) {
					number[v] = sorted->n_vertices - sorted->vertex_first[m];
					sorted->vertex[sorted->n_vertices++] = v;
				}
				sorted->index[n_indices++] = number[v];
			}
		}
	}
	sorted->vertex_first[shape->n_materials] = sorted->n_vertices;
	sorted->index_first[shape->n_materials] = n_indices;
	free(number);
	return PSR_OK;
}

static void put_u32(uint8_t **at, uint32_t v)
{
	for (int k = 0; k < 4; k++)
		*(*at)++ = (uint8_t)(v >> 8 * k);
}

static void put_floats(uint8_t **at, const float v[3])
{
	uint32_t bits;

	for (int k = 0; k < 3; k++) {
		memcpy(&bits, &v[k], sizeof bits);
		put_u32(at, bits);
	}
}

static void put_bin(uint8_t **at, const struct shape *shape, const struct sorted *sorted)
{
	for (uint32_t i = 0; i < sorted->n_vertices; i++)
		put_floats(at, shape->position[sorted->vertex[i]]);
	for (uint32_t i = 0; i < sorted->n_vertices; i++)
		put_floats(at, shape->normal[sorted->vertex[i]]);
	for (uint32_t i = 0; i < 3 * shape->n_triangles; i++)
		put_u32(at, sorted->index[i]);
}

static cJSON *add_object(cJSON *array)
{
	cJSON *item = cJSON_CreateObject();

	if (!cJSON_AddItemToArray(array, item)) {
		cJSON_Delete(item);
		return NULL;
	}
	return item;
}

static void add_numbers(cJSON *object, const char *name, const double *v, int n)
{
	cJSON *array = cJSON_AddArrayToObject(object, name);

	for (int k = 0; k < n; k++)
		cJSON_AddItemToArray(array, cJSON_CreateNumber(v[k]));
}

static void add_material(cJSON *materials, const struct shape_material *m)
{
	cJSON *material = add_object(materials), *pbr;
	double color[4] = { 0, 0, 0, 1 };

	for (int k = 0; k < 3; k++)
		color[k] = psr_srgb_to_linear[m->color >> (16 - 8 * k) & 255];
	cJSON_AddStringToObject(material, "name", m->name);
	pbr = cJSON_AddObjectToObject(material, "pbrMetallicRoughness");
	add_numbers(pbr, "baseColorFactor", color, 4);
	cJSON_AddNumberToObject(pbr, "metallicFactor", m->metallic);
	cJSON_AddNumberToObject(pbr, "roughnessFactor", m->roughness);
	if (m->two_sided)
		cJSON_AddTrueToObject(material, "doubleSided");
}

static cJSON *add_accessor(cJSON *accessors, int view, double offset, int component, uint32_t count, const char *type)
{
	cJSON *accessor = add_object(accessors);

	cJSON_AddNumberToObject(accessor, "bufferView", view);
	cJSON_AddNumberToObject(accessor, "byteOffset", offset);
	cJSON_AddNumberToObject(accessor, "componentType", component);
	cJSON_AddNumberToObject(accessor, "count", count);
	cJSON_AddStringToObject(accessor, "type", type);
	return accessor;
}

static void add_bounds(cJSON *accessor, const struct shape *shape, const uint32_t *vertex, uint32_t n)
{
	double low[3], high[3];

	for (int k = 0; k < 3; k++) {
		low[k] = high[k] = shape->position[vertex[0]][k];
		for (uint32_t i = 1; i < n; i++) {
			double x = shape->position[vertex[i]][k];
			low[k] = x < low[k] ? x : low[k];
			high[k] = x > high[k] ? x : high[k];
		}
	}
	add_numbers(accessor, "min", low, 3);
	add_numbers(accessor, "max", high, 3);
}

static void add_primitives(cJSON *primitives, cJSON *accessors, const struct shape *shape, const struct sorted *sorted)
{
	for (uint32_t m = 0; m < shape->n_materials; m++) {
		uint32_t first = sorted->vertex_first[m], n = sorted->vertex_first[m + 1] - first;
		uint32_t index = sorted->index_first[m], n_indices = sorted->index_first[m + 1] - index;
		int number = cJSON_GetArraySize(accessors);
		if (n_indices == 0)
			continue;
		cJSON *position = add_accessor(accessors, 0, 12.0 * first, GLTF_FLOAT, n, "VEC3");
		add_bounds(position, shape, sorted->vertex + first, n);
		add_accessor(accessors, 1, 12.0 * first, GLTF_FLOAT, n, "VEC3");
		add_accessor(accessors, 2, 4.0 * index, GLTF_UINT, n_indices, "SCALAR");
		cJSON *primitive = add_object(primitives);
		cJSON *attributes = cJSON_AddObjectToObject(primitive, "attributes");
		cJSON_AddNumberToObject(attributes, "POSITION", number);
		cJSON_AddNumberToObject(attributes, "NORMAL", number + 1);
		cJSON_AddNumberToObject(primitive, "indices", number + 2);
		cJSON_AddNumberToObject(primitive, "material", m);
	}
}

static void add_view(cJSON *views, double offset, double length, int target)
{
	cJSON *view = add_object(views);

	cJSON_AddNumberToObject(view, "buffer", 0);
	cJSON_AddNumberToObject(view, "byteOffset", offset);
	cJSON_AddNumberToObject(view, "byteLength", length);
	cJSON_AddNumberToObject(view, "target", target);
}

/* The JSON chunk, to be freed with cJSON_free; NULL if memory ran out. */
static char *make_json(const struct shape *shape, const struct sorted *sorted, const char *name, uint32_t n_bin)
{
	static const double one_node[] = { 0 };
	cJSON *root = cJSON_CreateObject(), *item;
	double vertex_bytes = 12.0 * sorted->n_vertices;
	char *text;

	item = cJSON_AddObjectToObject(root, "asset");
	cJSON_AddStringToObject(item, "version", "2.0");
	cJSON_AddStringToObject(item, "generator", "psr-model " PSR_VERSION);
	cJSON_AddNumberToObject(root, "scene", 0);
	add_numbers(add_object(cJSON_AddArrayToObject(root, "scenes")), "nodes", one_node, 1);
	item = add_object(cJSON_AddArrayToObject(root, "nodes"));
	cJSON_AddStringToObject(item, "name", name);
	cJSON_AddNumberToObject(item, "mesh", 0);
	item = cJSON_AddArrayToObject(root, "materials");
	for (uint32_t m = 0; m < shape->n_materials; m++)
		add_material(item, &shape->material[m]);
	item = add_object(cJSON_AddArrayToObject(root, "meshes"));
	cJSON_AddStringToObject(item, "name", name);
	item = cJSON_AddArrayToObject(item, "primitives");
	add_primitives(item, cJSON_AddArrayToObject(root, "accessors"), shape, sorted);
	item = cJSON_AddArrayToObject(root, "bufferViews");
	add_view(item, 0, vertex_bytes, GLTF_VERTICES);
	add_view(item, vertex_bytes, vertex_bytes, GLTF_VERTICES);
	add_view(item, 2 * vertex_bytes, 12.0 * shape->n_triangles, GLTF_INDICES);
	item = add_object(cJSON_AddArrayToObject(root, "buffers"));
	cJSON_AddNumberToObject(item, "byteLength", n_bin);
	text = cJSON_PrintUnformatted(root);
	cJSON_Delete(root);
	return text;
}

int glb_encode(uint8_t **bytes, size_t *n_bytes, const struct shape *shape, const char *name, struct psr_error *err)
{
	struct sorted sorted;
	uint32_t n_bin, n_json, padded;
	char *json = NULL;
	uint8_t *file = NULL, *at;
	int code = shape_check(shape, err);

	if (code != PSR_OK)
		return code;
	if (shape->n_triangles == 0)
		return psr_fail(err, PSR_ERR_ARG, "the mesh '%s' has no triangles", name);
	code = sorted_init(&sorted, shape);
	if (code == PSR_OK) {
		/* shape.c keeps counts below 2^26, so this fits 32 bits */
		n_bin = 24 * sorted.n_vertices + 12 * shape->n_triangles;
		json = make_json(shape, &sorted, name, n_bin);
		n_json = json == NULL ? 0 : (uint32_t)strlen(json);
		padded = (n_json + 3) & ~3u;
		file = json == NULL ? NULL : malloc((size_t)28 + padded + n_bin);
		code = file == NULL ? PSR_ERR_MEMORY : PSR_OK;
	}
	if (code == PSR_OK) {
		at = file;
		put_u32(&at, 0x46546c67); /* "glTF" */
		put_u32(&at, 2);
		put_u32(&at, 28 + padded + n_bin);
		put_u32(&at, padded);
		put_u32(&at, 0x4e4f534a); /* "JSON" */
		memset(at, ' ', padded);
		memcpy(at, json, n_json);
		at += padded;
		put_u32(&at, n_bin);
		put_u32(&at, 0x004e4942); /* "BIN" */
		put_bin(&at, shape, &sorted);
		*bytes = file;
		*n_bytes = (size_t)28 + padded + n_bin;
	} else {
		psr_fail(err, code, "out of memory while '%s' was written as glTF", name);
	}
	cJSON_free(json);
	sorted_fini(&sorted);
	return code;
}

int glb_write(const char *path, const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	size_t room = strlen(path) + 8;
	char *temporary = malloc(room);
	mode_t mask;
	int fd, done;
	FILE *file;

	if (temporary == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "out of memory while '%s' was written", path);
	snprintf(temporary, room, "%s.XXXXXX", path);
	fd = mkstemp(temporary);
	file = fd < 0 ? NULL : fdopen(fd, "wb");
	if (file == NULL) {
		psr_fail(err, PSR_ERR_IO, "'%s' cannot be written: %s", path, strerror(errno));
		if (fd >= 0) {
			close(fd);
			unlink(temporary);
		}
		free(temporary);
		return PSR_ERR_IO;
	}
	umask(mask = umask(0));
	done = fwrite(bytes, 1, n_bytes, file) == n_bytes && fflush(file) == 0 && fsync(fd) == 0 &&
	       fchmod(fd, 0666 & ~mask) == 0;
	done = fclose(file) == 0 && done;
	done = done && rename(temporary, path) == 0;
	if (!done) {
		psr_fail(err, PSR_ERR_IO, "'%s' cannot be written: %s", path, strerror(errno));
		unlink(temporary);
	}
	free(temporary);
	return done ? PSR_OK : PSR_ERR_IO;
}

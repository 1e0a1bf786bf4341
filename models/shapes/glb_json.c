#include "glb_parts.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/srgb.h"
#include "image.h"

enum { GLTF_FLOAT = 5126, GLTF_UINT = 5125, GLTF_VERTICES = 34962, GLTF_INDICES = 34963 };

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

/* The number of a material's picture, or -1. */
static int image_of(const struct shape *shape, uint32_t material)
{
	for (uint32_t i = 0; i < shape->n_images; i++) {
		if (shape->image[i].material == material)
			return (int)i;
	}
	return -1;
}

static void add_material(cJSON *materials, const struct shape *shape, uint32_t number)
{
	const struct shape_material *m = &shape->material[number];
	cJSON *material = add_object(materials), *pbr;
	double color[4] = { 0, 0, 0, 1 };
	int image = image_of(shape, number);

	for (int k = 0; k < 3; k++)
		color[k] = psr_srgb_to_linear[m->color >> (16 - 8 * k) & 255];
	cJSON_AddStringToObject(material, "name", m->name);
	pbr = cJSON_AddObjectToObject(material, "pbrMetallicRoughness");
	add_numbers(pbr, "baseColorFactor", color, 4);
	if (image >= 0)
		cJSON_AddNumberToObject(cJSON_AddObjectToObject(pbr, "baseColorTexture"), "index", image);
	cJSON_AddNumberToObject(pbr, "metallicFactor", m->metallic);
	cJSON_AddNumberToObject(pbr, "roughnessFactor", m->roughness);
	if (m->two_sided)
		cJSON_AddTrueToObject(material, "doubleSided");
}

static void add_images(cJSON *root, const struct shape *shape)
{
	cJSON *textures, *images;

	if (shape->n_images == 0)
		return;
	textures = cJSON_AddArrayToObject(root, "textures");
	images = cJSON_AddArrayToObject(root, "images");
	for (uint32_t i = 0; i < shape->n_images; i++) {
		cJSON *image = add_object(images);

		cJSON_AddNumberToObject(add_object(textures), "source", i);
		cJSON_AddNumberToObject(image, "bufferView", GLB_IMAGES + i);
		cJSON_AddStringToObject(image, "mimeType", "image/png");
	}
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

static void add_primitives(cJSON *primitives, cJSON *accessors, const struct shape *shape,
                           const struct glb_sorted *sorted,
                           uint32_t part)
{
	for (uint32_t m = 0; m < shape->n_materials; m++) {
		uint32_t group = part * shape->n_materials + m;
		uint32_t first = sorted->vertex_first[group], n = sorted->vertex_first[group + 1] - first;
		uint32_t index = sorted->index_first[group], n_indices = sorted->index_first[group + 1] - index;
		int number = cJSON_GetArraySize(accessors), has_image = image_of(shape, m) >= 0;

		if (n_indices == 0)
			continue;
		cJSON *position = add_accessor(accessors, GLB_POSITIONS, 12.0 * first, GLTF_FLOAT, n, "VEC3");
		add_bounds(position, shape, sorted->vertex + first, n);
		add_accessor(accessors, GLB_NORMALS, 12.0 * first, GLTF_FLOAT, n, "VEC3");
		add_accessor(accessors, GLB_INDICES, 4.0 * index, GLTF_UINT, n_indices, "SCALAR");
		if (has_image)
			add_accessor(accessors, GLB_PLACES, 8.0 * first, GLTF_FLOAT, n, "VEC2");
		cJSON *primitive = add_object(primitives);
		cJSON *attributes = cJSON_AddObjectToObject(primitive, "attributes");
		cJSON_AddNumberToObject(attributes, "POSITION", number);
		cJSON_AddNumberToObject(attributes, "NORMAL", number + 1);
		if (has_image)
			cJSON_AddNumberToObject(attributes, "TEXCOORD_0", number + 3);
		cJSON_AddNumberToObject(primitive, "indices", number + 2);
		cJSON_AddNumberToObject(primitive, "material", m);
	}
}

/* Parts without triangles have no mesh: mesh[part] is -1. */
static void add_meshes(cJSON *root, const struct shape *shape, const struct glb_sorted *sorted, const char *name,
                       int *mesh)
{
	cJSON *meshes = cJSON_AddArrayToObject(root, "meshes"), *accessors = cJSON_AddArrayToObject(root, "accessors");
	char text[64];
	int n = 0;

	for (uint32_t part = 0; part < shape->n_parts; part++) {
		uint32_t first = part * shape->n_materials;

		mesh[part] = -1;
		if (sorted->index_first[first] == sorted->index_first[first + shape->n_materials])
			continue;
		mesh[part] = n++;
		snprintf(text, sizeof text, part == 0 ? "%s" : "%s, part %u", name, part);
		cJSON *item = add_object(meshes);
		cJSON_AddStringToObject(item, "name", text);
		add_primitives(cJSON_AddArrayToObject(item, "primitives"), accessors, shape, sorted, part);
	}
}

/* Node 0 is the whole, with part 0 as its mesh and the instances as its children. */
static void add_nodes(cJSON *root, const struct shape *shape, const char *name, const int *mesh)
{
	cJSON *nodes = cJSON_AddArrayToObject(root, "nodes"), *whole = add_object(nodes), *children = NULL;

	cJSON_AddStringToObject(whole, "name", name);
	if (mesh[0] >= 0)
		cJSON_AddNumberToObject(whole, "mesh", mesh[0]);
	if (shape->n_instances > 0)
		children = cJSON_AddArrayToObject(whole, "children");
	for (uint32_t i = 0; i < shape->n_instances; i++) {
		const struct shape_instance *instance = &shape->instance[i];
		double columns[16] = { [15] = 1 };
		cJSON *node = add_object(nodes);

		for (int k = 0; k < 3; k++) {
			for (int j = 0; j < 3; j++)
				columns[4 * j + k] = instance->m[k][j];
			columns[12 + k] = instance->move[k];
		}
		cJSON_AddItemToArray(children, cJSON_CreateNumber(i + 1));
		cJSON_AddNumberToObject(node, "mesh", mesh[instance->part]);
		add_numbers(node, "matrix", columns, 16);
	}
}

/* The target is left out for pictures. */
static void add_views(cJSON *root, const struct shape *shape, const struct glb_layout *layout)
{
	cJSON *views = cJSON_AddArrayToObject(root, "bufferViews");

	for (uint32_t i = 0; i < layout->n_views; i++) {
		uint32_t end = i + 1 < layout->n_views ? layout->start[i + 1] : layout->bytes;
		cJSON *view = add_object(views);

		cJSON_AddNumberToObject(view, "buffer", 0);
		cJSON_AddNumberToObject(view, "byteOffset", layout->start[i]);
		if (i < GLB_IMAGES) {
			cJSON_AddNumberToObject(view, "byteLength", end - layout->start[i]);
			cJSON_AddNumberToObject(view, "target", i == GLB_INDICES ? GLTF_INDICES : GLTF_VERTICES);
		} else {
			cJSON_AddNumberToObject(view, "byteLength", (double)image_png_bytes(shape->image[i - GLB_IMAGES].size));
		}
	}
}

char *glb_json(const struct shape *shape, const struct glb_sorted *sorted, const struct glb_layout *layout,
               const char *name)
{
	static const double one_node[] = { 0 };
	int *mesh = malloc(sizeof *mesh * shape->n_parts);
	cJSON *root, *item;
	char *text;

	if (mesh == NULL)
		return NULL;
	root = cJSON_CreateObject();
	item = cJSON_AddObjectToObject(root, "asset");
	cJSON_AddStringToObject(item, "version", "2.0");
	cJSON_AddStringToObject(item, "generator", "psr-model " PSR_VERSION);
	cJSON_AddNumberToObject(root, "scene", 0);
	add_numbers(add_object(cJSON_AddArrayToObject(root, "scenes")), "nodes", one_node, 1);
	add_meshes(root, shape, sorted, name, mesh);
	add_nodes(root, shape, name, mesh);
	item = cJSON_AddArrayToObject(root, "materials");
	for (uint32_t m = 0; m < shape->n_materials; m++)
		add_material(item, shape, m);
	add_images(root, shape);
	add_views(root, shape, layout);
	item = add_object(cJSON_AddArrayToObject(root, "buffers"));
	cJSON_AddNumberToObject(item, "byteLength", layout->bytes);
	text = cJSON_PrintUnformatted(root);
	cJSON_Delete(root);
	free(mesh);
	return text;
}

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <cjson/cJSON.h>
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "models/commands.h"
#include "models/shapes/generators.h"
#include "models/shapes/glb.h"
#include "models/shapes/surfaces.h"

static uint32_t u32_at(const uint8_t *bytes)
{
	return bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static float float_at(const uint8_t *bytes)
{
	uint32_t bits = u32_at(bytes);
	float f;

	memcpy(&f, &bits, sizeof f);
	return f;
}

static void encode(const struct generator *generator, uint8_t **bytes, size_t *n_bytes, struct shape *shape)
{
	shape_init(shape);
	generator->make(shape);
	assert_int_equal(glb_encode(bytes, n_bytes, shape, generator->name, NULL), PSR_OK);
}

static int number(const cJSON *object, const char *name)
{
	const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);

	assert_true(cJSON_IsNumber(item));
	return item->valueint;
}

static const cJSON *item_of(const cJSON *object, const char *name)
{
	const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);

	assert_non_null(item);
	return item;
}

static void header_and_chunks_have_the_lengths_that_they_claim(void **state)
{
	(void)state;
	for (size_t g = 0; g < n_generators; g++) {
		struct shape shape;
		uint8_t *bytes;
		size_t n_bytes;
		uint32_t n_json, n_bin;
		encode(&generators[g], &bytes, &n_bytes, &shape);
		assert_memory_equal(bytes, "glTF\2\0\0\0", 8);
		assert_int_equal(u32_at(bytes + 8), n_bytes);
		n_json = u32_at(bytes + 12);
		assert_memory_equal(bytes + 16, "JSON", 4);
		assert_int_equal(n_json % 4, 0);
		n_bin = u32_at(bytes + 20 + n_json);
		assert_memory_equal(bytes + 24 + n_json, "BIN\0", 4);
		assert_int_equal(n_bin % 4, 0);
		assert_int_equal(28 + n_json + n_bin, n_bytes);
		free(bytes);
		shape_fini(&shape);
	}
}

/* The bytes of an accessor, once it is known to lie within its view and the view within the chunk. */
static const uint8_t *accessor_bytes(const cJSON *root, int index, uint32_t n_bin, const uint8_t *bin, int component,
                                     const char *type, uint32_t *count)
{
	const cJSON *accessor = cJSON_GetArrayItem(item_of(root, "accessors"), index);
	const cJSON *view;
	uint32_t size = strcmp(type, "VEC3") == 0 ? 12 : 4;

	assert_non_null(accessor);
	view = cJSON_GetArrayItem(item_of(root, "bufferViews"), number(accessor, "bufferView"));
	assert_non_null(view);
	*count = (uint32_t)number(accessor, "count");
	assert_int_equal(number(accessor, "componentType"), component);
	assert_string_equal(item_of(accessor, "type")->valuestring, type);
	assert_int_equal(number(accessor, "byteOffset") % 4, 0);
	assert_true((uint32_t)number(accessor, "byteOffset") + *count * size <= (uint32_t)number(view, "byteLength"));
	assert_true((uint32_t)(number(view, "byteOffset") + number(view, "byteLength")) <= n_bin);
	return bin + number(view, "byteOffset") + number(accessor, "byteOffset");
}

static void check_primitive(const cJSON *root, const cJSON *primitive, const uint8_t *bin, uint32_t n_bin,
                            uint32_t *n_triangles)
{
	const cJSON *attributes = item_of(primitive, "attributes");
	int at = number(attributes, "POSITION");
	const cJSON *accessor = cJSON_GetArrayItem(item_of(root, "accessors"), at);
	uint32_t n, n_normals, n_indices;
	const uint8_t *position = accessor_bytes(root, at, n_bin, bin, 5126, "VEC3", &n);
	const uint8_t *index = accessor_bytes(root, number(primitive, "indices"), n_bin, bin, 5125, "SCALAR", &n_indices);

	accessor_bytes(root, number(attributes, "NORMAL"), n_bin, bin, 5126, "VEC3", &n_normals);
	assert_int_equal(n, n_normals);
	assert_int_equal(n_indices % 3, 0);
	*n_triangles += n_indices / 3;
	for (uint32_t i = 0; i < n_indices; i++)
		assert_true(u32_at(index + 4 * i) < n);
	for (int k = 0; k < 3; k++) {
		float low = float_at(position + 4 * k), high = low;
		for (uint32_t i = 0; i < n; i++) {
			float x = float_at(position + 12 * i + 4 * k);
			low = x < low ? x : low;
			high = x > high ? x : high;
		}
		assert_true((float)cJSON_GetArrayItem(item_of(accessor, "min"), k)->valuedouble == low);
		assert_true((float)cJSON_GetArrayItem(item_of(accessor, "max"), k)->valuedouble == high);
	}
	assert_true(number(primitive, "material") < cJSON_GetArraySize(item_of(root, "materials")));
}

static void json_describes_the_bytes_and_loses_no_triangle(void **state)
{
	(void)state;
	for (size_t g = 0; g < n_generators; g++) {
		struct shape shape;
		uint8_t *bytes;
		size_t n_bytes;
		uint32_t n_json, n_triangles = 0;
		cJSON *root;
		const cJSON *mesh, *primitive;
		encode(&generators[g], &bytes, &n_bytes, &shape);
		n_json = u32_at(bytes + 12);
		root = cJSON_ParseWithLength((const char *)bytes + 20, n_json);
		assert_non_null(root);
		assert_string_equal(item_of(item_of(root, "asset"), "version")->valuestring, "2.0");
		assert_int_equal(cJSON_GetArraySize(item_of(root, "materials")), shape.n_materials);
		assert_int_equal(number(cJSON_GetArrayItem(item_of(root, "buffers"), 0), "byteLength"), n_bytes - 28 - n_json);
		cJSON_ArrayForEach(mesh, item_of(root, "meshes"))
			cJSON_ArrayForEach(primitive, item_of(mesh, "primitives"))
				check_primitive(root, primitive, bytes + 28 + n_json, (uint32_t)(n_bytes - 28 - n_json), &n_triangles);
		assert_int_equal(n_triangles, shape.n_triangles);
		cJSON_Delete(root);
		free(bytes);
		shape_fini(&shape);
	}
}

static void the_same_generator_gives_the_same_file(void **state)
{
	(void)state;
	for (size_t g = 0; g < n_generators; g++) {
		struct shape first, second;
		uint8_t *a, *b;
		size_t n_a, n_b;
		encode(&generators[g], &a, &n_a, &first);
		encode(&generators[g], &b, &n_b, &second);
		assert_int_equal(n_a, n_b);
		assert_memory_equal(a, b, n_a);
		free(a);
		free(b);
		shape_fini(&first);
		shape_fini(&second);
	}
}

static void shape_without_triangles_is_refused(void **state)
{
	struct psr_error err = { 0 };
	struct shape shape;
	uint8_t *bytes = NULL;
	size_t n_bytes;

	(void)state;
	shape_init(&shape);
	assert_int_equal(glb_encode(&bytes, &n_bytes, &shape, "nothing", &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "'nothing'"));
	shape.failed = 1;
	assert_int_equal(glb_encode(&bytes, &n_bytes, &shape, "nothing", &err), PSR_ERR_MEMORY);
	assert_null(bytes);
}

static void sheets_are_double_sided_and_solids_are_not(void **state)
{
	static const struct shape_material sheet = { "sheet", 0xff0080, 0, 1, 1 }, solid = { "solid", 0, 0, 1, 0 };
	static const double half[3] = { 1, 1, 1 };
	struct shape shape;
	uint8_t *bytes;
	size_t n_bytes;
	cJSON *root;
	const cJSON *materials, *color;

	(void)state;
	shape_init(&shape);
	shape_material(&shape, &sheet);
	surface_box(&shape, half);
	shape_material(&shape, &solid);
	surface_box(&shape, half);
	assert_int_equal(shape.n_triangles, 24);
	assert_int_equal(glb_encode(&bytes, &n_bytes, &shape, "boxes", NULL), PSR_OK);
	root = cJSON_ParseWithLength((const char *)bytes + 20, u32_at(bytes + 12));
	materials = item_of(root, "materials");
	assert_true(cJSON_IsTrue(item_of(cJSON_GetArrayItem(materials, 0), "doubleSided")));
	assert_null(cJSON_GetObjectItemCaseSensitive(cJSON_GetArrayItem(materials, 1), "doubleSided"));
	color = item_of(item_of(cJSON_GetArrayItem(materials, 0), "pbrMetallicRoughness"), "baseColorFactor");
	assert_true(cJSON_GetArrayItem(color, 0)->valuedouble == 1 && cJSON_GetArrayItem(color, 1)->valuedouble == 0);
	/* code 128 of sRGB is 0.2159 in linear light */
	assert_true(cJSON_GetArrayItem(color, 2)->valuedouble > 0.215 && cJSON_GetArrayItem(color, 2)->valuedouble < 0.217);
	cJSON_Delete(root);
	free(bytes);
	shape_fini(&shape);
}

static int make_folder(void **state)
{
	char name[] = "/tmp/psr-models-XXXXXX";

	*state = mkdtemp(name) == NULL ? NULL : strdup(name);
	return *state == NULL;
}

static int count_files(const char *folder)
{
	DIR *dir = opendir(folder);
	int n = 0;

	assert_non_null(dir);
	for (const struct dirent *entry = readdir(dir); entry != NULL; entry = readdir(dir))
		n += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
	closedir(dir);
	return n;
}

static int remove_folder(void **state)
{
	rmdir(*state);
	free(*state);
	return 0;
}

static int run(const char *name, const char *output)
{
	char *argv[] = { (char *)"make", (char *)name, (char *)"-o", (char *)output, NULL };

	return cmd_make(output == NULL ? 2 : 4, argv);
}

static void make_command_has_the_documented_exit_codes(void **state)
{
	char path[256];

	snprintf(path, sizeof path, "%s/no/such/folder.glb", (const char *)*state);
	assert_int_equal(run("teapot", path), 3);
	assert_int_equal(run("teapott", path), 2);
	assert_int_equal(run("teapot", NULL), 2);
	assert_int_equal(count_files(*state), 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(header_and_chunks_have_the_lengths_that_they_claim),
		cmocka_unit_test(json_describes_the_bytes_and_loses_no_triangle),
		cmocka_unit_test(the_same_generator_gives_the_same_file),
		cmocka_unit_test(shape_without_triangles_is_refused),
		cmocka_unit_test(sheets_are_double_sided_and_solids_are_not),
		cmocka_unit_test_setup_teardown(make_command_has_the_documented_exit_codes, make_folder, remove_folder),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

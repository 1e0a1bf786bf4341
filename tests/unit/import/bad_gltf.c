#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "gltf.h"

static void refuse_glb(const char *json, int code, const char *words)
{
	write_glb("bad.glb", json);
	refuse("bad.glb", code, words);
}

/* The same after one piece of the JSON was exchanged. */
static void refuse_in(const char *json, const char *from, const char *to, int code, const char *words)
{
	char changed[8192];
	const char *at = strstr(json, from);

	if (at == NULL)
		fail_msg("no %s", from);
	snprintf(changed, sizeof changed, "%.*s%s%s", (int)(at - json), json, to, at + strlen(from));
	refuse_glb(changed, code, words);
}

static void refuse_changed(const char *from, const char *to, int code, const char *words)
{
	refuse_in(SQUARE, from, to, code, words);
}

static void accessors_that_lie_are_refused(void **state)
{
	(void)state;
	const char *position = "'type':'VEC3','count':4}";

	refuse_changed(position, "'type':'VEC3','count':5}", PSR_ERR_FORMAT, "reach behind the end of bufferViews[0]");
	refuse_changed(position, "'type':'VEC3','count':134217728}", PSR_ERR_FORMAT, "reach behind the end");
	refuse_changed(position, "'type':'VEC3','count':2147483647}", PSR_ERR_LIMIT, "2147483647 elements");
	refuse_changed(position, "'type':'VEC3','count':4294967300}", PSR_ERR_FORMAT, "count is not an integer");
	refuse_changed(position, "'type':'VEC3','count':-4}", PSR_ERR_FORMAT, "count is not an integer");
	refuse_changed(position, "'type':'VEC3','count':4.5}", PSR_ERR_FORMAT, "count is not an integer");
	refuse_changed(position, "'type':'VEC3','count':'4'}", PSR_ERR_FORMAT, "count is not an integer");
	refuse_changed(position, "'type':'VEC3','count':0}", PSR_ERR_FORMAT, "POSITION has 0");
	refuse_changed(position, "'type':'VEC3','count':4,'byteOffset':1}", PSR_ERR_FORMAT, "reach behind");
	refuse_changed(position, "'type':'VEC3','count':4,'byteOffset':9007199254740992}", PSR_ERR_FORMAT, "reach behind");
	refuse_changed(position, "'type':'VEC3','count':4,'byteOffset':18446744073709551604}", PSR_ERR_FORMAT,
	               "byteOffset is not an integer");
	refuse_changed(position, "'type':'VEC2','count':4}", PSR_ERR_FORMAT, "has 2 components, expected 3");
	refuse_changed("'componentType':5126", "'componentType':5130", PSR_ERR_FORMAT, "component type 5130");
	refuse_changed("'accessors':[{'bufferView':0", "'accessors':[{'bufferView':77", PSR_ERR_FORMAT, "buffer view 77");
	refuse_changed("'accessors':[{'bufferView':0,", "'accessors':[{", PSR_ERR_FORMAT, "has no data");
}

static void buffers_and_views_that_lie_are_refused(void **state)
{
	(void)state;
	const char *view = "'byteOffset':0,'byteLength':48}", *buffer = "{'byteLength':344}";

	refuse_changed(view, "'byteOffset':300,'byteLength':48}", PSR_ERR_FORMAT, "bufferViews[0]: 48 bytes from byte 300");
	refuse_changed(view, "'byteOffset':9007199254740990,'byteLength':9007199254740990}", PSR_ERR_FORMAT,
	               "bufferViews[0]");
	refuse_changed(view, "'byteOffset':0,'byteLength':48,'byteStride':3}", PSR_ERR_FORMAT, "byteStride");
	refuse_changed(view, "'byteOffset':0,'byteLength':48,'byteStride':252}", PSR_ERR_FORMAT, "reach behind");
	refuse_changed("{'buffer':0,", "{'buffer':3,", PSR_ERR_FORMAT, "buffer 3 does not exist");
	refuse_changed(buffer, "{'byteLength':348}", PSR_ERR_FORMAT, "buffers[0] promises 348 bytes");
	refuse_changed(buffer, "{'byteLength':9007199254740992}", PSR_ERR_FORMAT, "buffers[0] promises");
	refuse_changed(buffer, "{}", PSR_ERR_FORMAT, "buffers[0] has no byteLength");
	refuse_changed(buffer, "{'byteLength':344},{'byteLength':344}", PSR_ERR_FORMAT, "buffers[1] has neither");
	refuse_changed(buffer, "{'byteLength':344,'uri':'data:;base64,AA$A'}", PSR_ERR_FORMAT, "not base64");
	refuse_changed(buffer, "{'byteLength':344,'uri':'data:,hello'}", PSR_ERR_UNSUPPORTED, "not base64");
}

static void indices_out_of_range_are_refused(void **state)
{
	(void)state;
	refuse_glb(PRIMITIVE("'attributes':{'POSITION':0},'indices':4"), PSR_ERR_FORMAT, "indices must be scalars");
	refuse_glb(PRIMITIVE("'attributes':{'POSITION':0},'indices':0"), PSR_ERR_FORMAT, "indices must be scalars");
	refuse_glb(PRIMITIVE("'attributes':{'POSITION':0},'indices':99"), PSR_ERR_FORMAT, "out of bounds");
	refuse_glb(PRIMITIVE("'attributes':{'POSITION':99}"), PSR_ERR_FORMAT, "accessor 99 does not exist");
	refuse_glb(PRIMITIVE("'attributes':{'POSITION':0,'NORMAL':-1}"), PSR_ERR_FORMAT, "NORMAL is not an integer");
	refuse_glb(PRIMITIVE(LIST ",'material':0"), PSR_ERR_FORMAT, "material 0 does not exist");
	refuse_glb(PRIMITIVE(LIST ",'mode':7"), PSR_ERR_FORMAT, "mode 7");
	refuse_glb(PRIMITIVE("'indices':1"), PSR_ERR_FORMAT, "has no attributes");
	/* indices read from the bytes of positions: 0x3f80 is far above 4 */
	refuse_changed("{'bufferView':1,", "{'bufferView':0,'byteOffset':12,", PSR_ERR_FORMAT, "but POSITION has 4");
	refuse_in(PRIMITIVE("'attributes':{'POSITION':0,'NORMAL':2},'indices':1"),
	          "{'bufferView':2,'componentType':5126,'type':'VEC3','count':4}",
	          "{'bufferView':2,'componentType':5126,'type':'VEC3','count':3}", PSR_ERR_FORMAT,
	          "NORMAL has 3 elements where POSITION has 4");
}

static void sparse_accessors_that_lie_are_refused(void **state)
{
	(void)state;
	static const char *const change[][3] = {
		{ "'sparse':{'count':1", "'sparse':{'count':5", "5 sparse values of 4" },
		{ "'sparse':{'count':1", "'sparse':{'count':2", "sparse.values" },
		{ "'componentType':5125}", "'componentType':5126}", "they must be unsigned integers" },
		{ "'indices':{'bufferView':8", "'indices':{'bufferView':80", "buffer view 80" },
		{ "'indices':{'bufferView':8,'byteOffset':0", "'indices':{'bufferView':8,'byteOffset':4", "sparse index" },
	};

	for (size_t i = 0; i < sizeof change / sizeof change[0]; i++)
		refuse_in(PRIMITIVE("'attributes':{'POSITION':8},'indices':1"), change[i][0], change[i][1], PSR_ERR_FORMAT,
		          change[i][2]);
}

static void nodes_that_form_no_tree_are_refused(void **state)
{
	(void)state;
	const char *nodes = "'nodes':[{'mesh':0}]";

	refuse_changed(nodes, "'nodes':[{'mesh':0,'children':[0]}]", PSR_ERR_FORMAT, "nodes[0] is reached twice");
	refuse_changed(nodes, "'nodes':[{'children':[1]},{'children':[2]},{'children':[0]}]", PSR_ERR_FORMAT,
	               "reached twice");
	refuse_changed(nodes, "'nodes':[{'children':[1,1]},{'mesh':0}]", PSR_ERR_FORMAT, "nodes[1] is reached twice");
	refuse_changed(nodes, "'nodes':[{'children':[9]}]", PSR_ERR_FORMAT, "node 9 does not exist");
	refuse_changed(nodes, "'nodes':[{'mesh':1}]", PSR_ERR_FORMAT, "mesh 1 does not exist");
	refuse_changed(nodes, "'nodes':[{'mesh':0,'scale':[1,1]}]", PSR_ERR_FORMAT, "scale has 2 numbers");
	refuse_changed(nodes, "'nodes':[{'mesh':0,'matrix':[1]}]", PSR_ERR_FORMAT, "matrix has 1 numbers");
	refuse_changed(nodes, "'nodes':[{'mesh':0,'rotation':[0,0,0,0]}]", PSR_ERR_FORMAT, "rotation");
	refuse_changed("'scene':0", "'scene':1", PSR_ERR_FORMAT, "scene 1 does not exist");
	refuse_glb("{" HEAD ",'meshes':[{'primitives':[{" LIST "}]}],'nodes':[{'children':[1]},{'children':[0]}]}",
	           PSR_ERR_FORMAT, "cycle");
}

static void vertices_beyond_doubles_leave_no_triangle(void **state)
{
	(void)state;
	refuse_changed("'nodes':[{'mesh':0}]",
	               "'nodes':[{'children':[1],'scale':[1e200,1,1]},{'mesh':0,'scale':[1e200,1,1]}]",
	               PSR_ERR_FORMAT, "2 faces without area, duplicate or not finite");
}

static void required_extensions_that_are_missing_are_named(void **state)
{
	(void)state;
	refuse_changed("'asset'", "'extensionsRequired':['EXT_meshopt_compression'],'asset'", PSR_ERR_UNSUPPORTED,
	               "EXT_meshopt_compression");
	refuse_changed("'version':'2.0'", "'version':'1.0'", PSR_ERR_UNSUPPORTED, "glTF 1.0");
	refuse_changed("'version':'2.0'", "'version':'3.0'", PSR_ERR_UNSUPPORTED, "3.0");
}

static void files_outside_of_the_folder_are_not_read(void **state)
{
	(void)state;
	uint8_t bin[BIN_BYTES];
	char outside[1024], json[2048];

	make_bin(bin);
	snprintf(outside, sizeof outside, "%s/x.bin", test_root);
	write_bytes(outside, bin, sizeof bin);
	assert_int_equal(symlink(outside, path_of("link.bin")), 0);
	refuse_changed("{'byteLength':344}", "{'byteLength':344,'uri':'../x.bin'}", PSR_ERR_UNSUPPORTED, "outside");
	refuse_changed("{'byteLength':344}", "{'byteLength':344,'uri':'%2e%2e/x.bin'}", PSR_ERR_UNSUPPORTED, "outside");
	refuse_changed("{'byteLength':344}", "{'byteLength':344,'uri':'link.bin'}", PSR_ERR_UNSUPPORTED, "outside");
	refuse_changed("{'byteLength':344}", "{'byteLength':344,'uri':'/etc/passwd'}", PSR_ERR_UNSUPPORTED, "outside");
	refuse_changed("{'byteLength':344}", "{'byteLength':344,'uri':'http://localhost/x.bin'}", PSR_ERR_UNSUPPORTED,
	               "only files");
	refuse_changed("{'byteLength':344}", "{'byteLength':344,'uri':'none.bin'}", PSR_ERR_NOT_FOUND, "none.bin");
	refuse_changed("{'byteLength':344}", "{'byteLength':344,'uri':'a%00b'}", PSR_ERR_FORMAT, "zero byte");
	snprintf(json, sizeof json, "{'byteLength':344,'uri':'%s'}", outside);
	refuse_changed("{'byteLength':344}", json, PSR_ERR_UNSUPPORTED, "outside");
}

#define IMAGE(image) \
	"{" HEAD ",'meshes':[{'primitives':[{'attributes':{'POSITION':0,'TEXCOORD_0':3},'indices':1,'material':0}]}]," \
	"'materials':[{'pbrMetallicRoughness':{'baseColorTexture':{'index':0}}}]," image "," SCENE "}"

static void broken_images_are_named(void **state)
{
	(void)state;
	refuse_glb(IMAGE("'textures':[{'source':0}],'images':[{'bufferView':0}]"), PSR_ERR_UNSUPPORTED, "images[0]");
	refuse_glb(IMAGE("'textures':[{'source':0}],'images':[{'bufferView':99}]"), PSR_ERR_FORMAT, "images[0]");
	refuse_glb(IMAGE("'textures':[{'source':0}],'images':[{'uri':'none.png'}]"), PSR_ERR_NOT_FOUND, "none.png");
	refuse_glb(IMAGE("'textures':[{'source':0}],'images':[{}]"), PSR_ERR_FORMAT, "images[0]");
	refuse_glb(IMAGE("'textures':[{'source':4}],'images':[]"), PSR_ERR_FORMAT, "image 4 does not exist");
	refuse_glb(IMAGE("'textures':[{}],'images':[]"), PSR_ERR_UNSUPPORTED, "textures[0] has no image");
	refuse_glb(IMAGE("'images':[]"), PSR_ERR_FORMAT, "texture 0 does not exist");
	refuse_glb(IMAGE("'textures':[{'source':0}],'images':[{'uri':'../x.png'}]"), PSR_ERR_NOT_FOUND, "x.png");
}

static void json_that_is_none_is_refused(void **state)
{
	(void)state;
	char deep[4096] = "{'asset':{'version':'2.0'},'extras':";

	write_text("bad.gltf", "{'asset':{'version':'2.0'}");
	refuse("bad.gltf", PSR_ERR_FORMAT, "broken JSON");
	write_text("bad.gltf", "[]");
	refuse("bad.gltf", PSR_ERR_FORMAT, "asset");
	write_text("bad.gltf", "{'asset':3}");
	refuse("bad.gltf", PSR_ERR_FORMAT, "asset");
	write_text("bad.gltf", "{'asset':{'version':'2.0'},'meshes':{}}");
	refuse("bad.gltf", PSR_ERR_FORMAT, "meshes is not an array");
	write_text("bad.gltf", "{'asset':{'version':'2.0'},'meshes':[7]}");
	refuse("bad.gltf", PSR_ERR_FORMAT, "meshes[0] is not an object");
	write_text("bad.gltf", "{'asset':{'version':'2.0'}}");
	refuse("bad.gltf", PSR_ERR_FORMAT, "no triangle");
	memset(deep + strlen(deep), '[', 3000);
	write_text("bad.gltf", deep);
	refuse("bad.gltf", PSR_ERR_LIMIT, "nested deeper");
	write_text("bad.gltf", "");
	refuse("bad.gltf", PSR_ERR_FORMAT, "empty");
}

/* 140 nodes with the same million of vertices are refused before the first is placed. */
static void too_many_instances_are_refused(void **state)
{
	(void)state;
	struct psr_mesh *mesh;
	struct psr_error err;
	size_t n_nodes = 140, n_vertices = 1000000, n = 0, n_bytes = 12 * n_vertices;
	char *json = malloc(8192);
	uint8_t *bin = calloc(n_bytes, 1);

	assert_non_null(json);
	assert_non_null(bin);
	n += (size_t)sprintf(json + n,
	                     "{'asset':{'version':'2.0'},'buffers':[{'byteLength':%zu,'uri':'big.bin'}],"
	                     "'bufferViews':[{'buffer':0,'byteLength':%zu}],'accessors':[{'bufferView':0,"
	                     "'componentType':5126,'type':'VEC3','count':%zu}],'meshes':[{'primitives':["
	                     "{'attributes':{'POSITION':0}}]}],'nodes':[{'mesh':0}",
	                     n_bytes, n_bytes, n_vertices);
	for (size_t i = 1; i < n_nodes; i++)
		n += (size_t)sprintf(json + n, ",{'mesh':0}");
	sprintf(json + n, "]}");
	write_bytes(path_of("big.bin"), bin, n_bytes);
	write_text("big.gltf", json);
	free(bin);
	free(json);
	assert_int_equal(psr_mesh_import(&mesh, path_of("big.gltf"), NULL, &err), PSR_ERR_LIMIT);
	unlink(path_of("big.bin"));
}

static void a_glb_cut_anywhere_is_refused(void **state)
{
	(void)state;
	size_t n;
	uint8_t *glb = make_glb(SQUARE, &n);

	for (size_t cut = 0; cut < n; cut++) {
		struct psr_mesh *mesh = NULL;
		struct psr_error err = { 0, "" };

		write_bytes(path_of("cut.glb"), glb, cut);
		if (psr_mesh_import(&mesh, path_of("cut.glb"), NULL, &err) != PSR_ERR_FORMAT)
			fail_msg("cut at %zu: %d %s", cut, err.code, err.text);
		assert_null(mesh);
	}
	free(glb);
}

static uint32_t next_random(uint32_t *seed)
{
	*seed ^= *seed << 13;
	*seed ^= *seed >> 17;
	*seed ^= *seed << 5;
	return *seed;
}

/* Some stay valid: then the mesh has to be what psr/mesh.h promises. */
static void import_changed(const uint8_t *glb, size_t n)
{
	struct psr_mesh *mesh = NULL;
	struct psr_error err = { 0, "" };
	int rc;

	write_bytes(path_of("changed.glb"), glb, n);
	rc = psr_mesh_import(&mesh, path_of("changed.glb"), NULL, &err);
	if (rc != PSR_OK) {
		assert_true(rc < 0 && err.code == rc && err.text[0] != '\0' && mesh == NULL);
		return;
	}
	assert_true(mesh->n_triangles > 0 && mesh->n_materials > 0);
	for (uint32_t t = 0; t < mesh->n_triangles; t++) {
		assert_true(mesh->triangle_material[t] < mesh->n_materials);
		for (int c = 0; c < 3; c++)
			assert_true(mesh->triangle[t][c] < mesh->n_vertices);
	}
	for (uint32_t v = 0; v < mesh->n_vertices; v++)
		for (int c = 0; c < 3; c++)
			assert_true(mesh->position[v][c] - mesh->position[v][c] == 0.0);
	psr_mesh_destroy(mesh);
}

static void changed_bytes_never_break_the_importer(void **state)
{
	(void)state;
	struct stat st;
	FILE *file = fopen("tests/data/import/quad_draco.glb", "rb");
	uint32_t seed = 2463534242u;
	size_t n[2];
	uint8_t *glb[2] = { make_glb(IMAGE("'textures':[{'source':0}],'images':[{'bufferView':9}]"), &n[0]), NULL };

	assert_non_null(file);
	assert_int_equal(fstat(fileno(file), &st), 0);
	n[1] = (size_t)st.st_size;
	glb[1] = malloc(n[1]);
	assert_non_null(glb[1]);
	assert_int_equal(fread(glb[1], 1, n[1], file), n[1]);
	fclose(file);
	for (int i = 0; i < 2; i++) {
		uint8_t *changed = malloc(n[i]);

		assert_non_null(changed);
		for (int round = 0; round < 2000; round++) {
			memcpy(changed, glb[i], n[i]);
			for (uint32_t k = next_random(&seed) % 3 + 1; k > 0; k--)
				changed[next_random(&seed) % n[i]] = (uint8_t)(next_random(&seed) >> 8);
			import_changed(changed, n[i]);
		}
		free(changed);
		free(glb[i]);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(accessors_that_lie_are_refused),
		cmocka_unit_test(buffers_and_views_that_lie_are_refused),
		cmocka_unit_test(indices_out_of_range_are_refused),
		cmocka_unit_test(sparse_accessors_that_lie_are_refused),
		cmocka_unit_test(nodes_that_form_no_tree_are_refused),
		cmocka_unit_test(vertices_beyond_doubles_leave_no_triangle),
		cmocka_unit_test(required_extensions_that_are_missing_are_named),
		cmocka_unit_test(files_outside_of_the_folder_are_not_read),
		cmocka_unit_test(broken_images_are_named),
		cmocka_unit_test(json_that_is_none_is_refused),
		cmocka_unit_test(too_many_instances_are_refused),
		cmocka_unit_test(a_glb_cut_anywhere_is_refused),
		cmocka_unit_test(changed_bytes_never_break_the_importer),
	};

	return cmocka_run_group_tests_name("import_bad_gltf", tests, make_folder, remove_folder);
}

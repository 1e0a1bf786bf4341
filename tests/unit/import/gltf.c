#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "gltf.h"

/* The face's normal by its winding, not normalized. */
static void face_normal(double n[3], const struct psr_mesh *m, uint32_t t)
{
	const double *a = m->position[m->triangle[t][0]], *b = m->position[m->triangle[t][1]];
	const double *c = m->position[m->triangle[t][2]];

	for (int i = 0; i < 3; i++) {
		int j = (i + 1) % 3, k = (i + 2) % 3;

		n[i] = (b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j]);
	}
}

/* Two triangles that cover the unit square and look along +z. */
static void assert_square(const struct psr_mesh *m)
{
	assert_int_equal(m->n_triangles, 2);
	for (uint32_t t = 0; t < 2; t++) {
		double n[3];

		face_normal(n, m, t);
		assert_true(n[0] == 0.0 && n[1] == 0.0 && n[2] == 1.0);
	}
}

static void assert_box(const struct psr_mesh *m, double x0, double y0, double z0, double x1, double y1, double z1)
{
	const double low[3] = { x0, y0, z0 }, high[3] = { x1, y1, z1 };

	for (int i = 0; i < 3; i++) {
		double a = INFINITY, b = -INFINITY;

		for (uint32_t v = 0; v < m->n_vertices; v++) {
			a = fmin(a, m->position[v][i]);
			b = fmax(b, m->position[v][i]);
		}
		/* sums of a few products of numbers below 64 in double */
		assert_true(fabs(a - low[i]) < 1e-13 && fabs(b - high[i]) < 1e-13);
	}
}

static void list_strip_and_fan_give_the_same_square(void **state)
{
	(void)state;
	static const char *const json[] = {
		SQUARE,
		PRIMITIVE("'attributes':{'POSITION':0},'indices':5,'mode':5"),
		PRIMITIVE("'attributes':{'POSITION':0},'indices':6,'mode':6"),
		PRIMITIVE("'attributes':{'POSITION':0},'mode':6"),
		PRIMITIVE("'attributes':{'POSITION':7},'indices':1"),
	};

	for (size_t i = 0; i < sizeof json / sizeof json[0]; i++) {
		struct psr_mesh *m = import_glb(json[i]);

		assert_square(m);
		assert_box(m, 0, 0, 0, 1, 1, 0);
		assert_int_equal(m->n_vertices, 4);
		assert_int_equal(m->n_materials, 1);
		assert_string_equal(m->warning, "");
		psr_mesh_destroy(m);
	}
}

static void missing_normals_stay_zero(void **state)
{
	(void)state;
	struct psr_mesh *m = import_glb(SQUARE);

	for (uint32_t v = 0; v < m->n_vertices; v++)
		assert_true(m->normal[v][0] == 0.0f && m->normal[v][1] == 0.0f && m->normal[v][2] == 0.0f);
	assert_null(m->uv[0]);
	assert_null(m->color);
	psr_mesh_destroy(m);
}

static void hierarchy_applies_the_parent_after_the_child(void **state)
{
	(void)state;
	struct psr_mesh *m = import_glb("{" HEAD ",'meshes':[{'primitives':[{" LIST "}]}],'nodes':["
	                                "{'translation':[10,0,0],'children':[1]},{'scale':[2,3,1],'children':[2]},"
	                                "{'mesh':0,'translation':[1,1,4]}],'scenes':[{'nodes':[0]}]}");

	assert_box(m, 12, 3, 4, 14, 6, 4);
	psr_mesh_destroy(m);
}

static void matrix_and_rotation_turn_the_same_way(void **state)
{
	(void)state;
	/* a quarter turn about +z: (1,0) -> (0,1) */
	static const char *const node[] = {
		"'rotation':[0,0,0.70710678118654752,0.70710678118654752]",
		"'matrix':[0,1,0,0,-1,0,0,0,0,0,1,0,0,0,0,1]",
	};

	for (int i = 0; i < 2; i++) {
		char json[4096];

		snprintf(json, sizeof json, "{" HEAD ",'meshes':[{'primitives':[{" LIST "}]}],'nodes':[{'mesh':0,%s}]}",
		         node[i]);
		struct psr_mesh *m = import_glb(json);

		assert_box(m, -1, 0, 0, 0, 1, 0);
		psr_mesh_destroy(m);
	}
}

static void mirrored_nodes_keep_faces_and_normals_on_one_side(void **state)
{
	(void)state;
	struct psr_mesh *m = import_glb("{" HEAD ",'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':2},"
	                                "'indices':1}]}],'nodes':[{'mesh':0,'scale':[-2,1,1]},"
	                                "{'mesh':0,'scale':[1,1,-1]}],'scenes':[{'nodes':[0,1]}]}");
	double n[3];

	assert_int_equal(m->n_triangles, 4);
	for (uint32_t t = 0; t < 4; t++) {
		const float *vertex_normal = m->normal[m->triangle[t][0]];
		float side = t < 2 ? 1.0f : -1.0f;

		face_normal(n, m, t);
		assert_true(n[2] * side > 0.0);
		assert_true(vertex_normal[0] == 0.0f && vertex_normal[1] == 0.0f && vertex_normal[2] == side);
	}
	psr_mesh_destroy(m);
}

static void normals_go_with_the_inverse_transpose(void **state)
{
	(void)state;
	/* Shear z += x: the square becomes z = x, whose normal is (-1,0,1)/sqrt 2. */
	struct psr_mesh *m = import_glb("{" HEAD ",'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':2},"
	                                "'indices':1}]}],'nodes':[{'mesh':0,'matrix':[1,0,1,0,0,1,0,0,0,0,1,0,0,0,0,1]}]}");

	for (uint32_t v = 0; v < m->n_vertices; v++) {
		assert_true(fabs(m->normal[v][0] + sqrt(0.5)) < 1e-7 && m->normal[v][1] == 0.0f);
		assert_true(fabs(m->normal[v][2] - sqrt(0.5)) < 1e-7); /* half a step of a float below 1 */
	}
	psr_mesh_destroy(m);
}

static void one_mesh_stands_where_each_of_its_nodes_is(void **state)
{
	(void)state;
	struct psr_mesh *m = import_glb("{" HEAD ",'meshes':[{'primitives':[{" LIST "}]}],'nodes':[{'mesh':0},"
	                                "{'mesh':0,'translation':[5,0,0]},{'mesh':0,'translation':[99,0,0]}],"
	                                "'scenes':[{'nodes':[2]},{'nodes':[0,1]}],'scene':1}");

	assert_int_equal(m->n_triangles, 4);
	assert_int_equal(m->n_vertices, 8);
	assert_box(m, 0, 0, 0, 6, 1, 0);
	psr_mesh_destroy(m);
}

static void without_scenes_every_root_is_drawn(void **state)
{
	(void)state;
	struct psr_mesh *m = import_glb("{" HEAD ",'meshes':[{'primitives':[{" LIST "}]}],"
	                                "'nodes':[{'mesh':0},{'children':[0],'translation':[0,0,7]},{'mesh':0}]}");

	assert_int_equal(m->n_triangles, 4);
	assert_box(m, 0, 0, 0, 1, 1, 7);
	psr_mesh_destroy(m);
}

static void sparse_values_replace_those_of_the_view(void **state)
{
	(void)state;
	struct psr_mesh *m = import_glb(PRIMITIVE("'attributes':{'POSITION':8},'indices':1"));

	assert_box(m, 0, 0, 0, 1, 3, 0);
	psr_mesh_destroy(m);
}

static void normalized_bytes_are_linear_colors(void **state)
{
	(void)state;
	struct psr_mesh *m = import_glb(PRIMITIVE("'attributes':{'POSITION':0,'COLOR_0':4},'indices':1"));

	assert_non_null(m->color);
	for (uint32_t v = 0; v < m->n_vertices; v++) {
		assert_true(m->color[v][0] == 1.0f && m->color[v][1] == 128.0f / 255.0f);
		assert_true(m->color[v][2] == 0.0f && m->color[v][3] == 1.0f);
	}
	psr_mesh_destroy(m);
}

#define TEXTURED(material, extra) \
	"{" HEAD ",'meshes':[{'primitives':[{'attributes':{'POSITION':0,'TEXCOORD_0':3,'TEXCOORD_1':9},'indices':1," \
	"'material':0}]}],'images':[{'bufferView':9,'mimeType':'image/bmp'}],'samplers':[{'wrapS':33071,'wrapT':33648}]," \
	"'textures':[{'source':0,'sampler':0}],'materials':[" material "]," extra SCENE "}"

static void textures_have_their_first_row_on_top(void **state)
{
	(void)state;
	static const uint8_t top[16] = { 0, 0, 255, 255, 0, 255, 0, 255, 255, 255, 255, 255, 0, 0, 0, 255 };
	struct psr_mesh *m = import_glb(TEXTURED("{'pbrMetallicRoughness':{'baseColorFactor':[0.5,0.25,1,1],"
	                                         "'baseColorTexture':{'index':0},'metallicFactor':0.5,"
	                                         "'roughnessFactor':0.25}}", ""));
	const struct psr_material *material = &m->material[0];

	assert_int_equal(m->n_images, 1);
	assert_true(m->image[0].width == 4 && m->image[0].height == 2);
	assert_memory_equal(m->image[0].rgba, top, sizeof top);
	assert_true(m->image[0].rgba[16] == 255 && m->image[0].rgba[17] == 0);
	assert_int_equal(material->base_texture.image, 0);
	assert_int_equal(material->base_texture.wrap_s, PSR_WRAP_CLAMP);
	assert_int_equal(material->base_texture.wrap_t, PSR_WRAP_MIRROR);
	assert_true(material->base_color[0] == 0.5f && material->base_color[1] == 0.25f && material->base_color[2] == 1.0f);
	assert_true(material->metallic == 0.5f && material->roughness == 0.25f);
	assert_true(!material->two_sided && !material->unlit && material->alpha == PSR_ALPHA_OPAQUE);
	assert_non_null(m->uv[0]);
	assert_true(m->uv[0][m->triangle[0][0]][0] == 0.0f && m->uv[0][m->triangle[0][0]][1] == 1.0f);
	psr_mesh_destroy(m);
}

static void alpha_sides_and_unlit_are_kept(void **state)
{
	(void)state;
	struct psr_mesh *m = import_glb(TEXTURED("{'alphaMode':'MASK','alphaCutoff':0.75,'doubleSided':true,"
	                                         "'extensions':{'KHR_materials_unlit':{}}}", ""));

	assert_int_equal(m->material[0].alpha, PSR_ALPHA_MASK);
	assert_true(m->material[0].alpha_cutoff == 0.75f);
	assert_true(m->material[0].two_sided && m->material[0].unlit);
	assert_int_equal(m->material[0].base_texture.image, -1);
	assert_int_equal(m->n_images, 0);
	psr_mesh_destroy(m);
}

static void lines_are_counted_not_drawn(void **state)
{
	(void)state;
	struct psr_mesh *m = import_glb("{" HEAD ",'meshes':[{'primitives':[{" LIST "},{'attributes':{'POSITION':0},"
	                                "'mode':1},{'attributes':{'POSITION':0},'mode':2},{'attributes':{'POSITION':0},"
	                                "'indices':1,'mode':3}]}]," SCENE "}");

	assert_square(m);
	assert_int_equal(m->n_dropped_primitives, 2 + 4 + 5);
	assert_string_equal(m->warning, "lines were left out: 11");
	psr_mesh_destroy(m);
}

static void degenerate_triangles_and_their_vertices_are_dropped(void **state)
{
	(void)state;
	/* the fan's indices as a list: one triangle, and 3 alone; then the same collapsed by a node of scale 0 */
	struct psr_mesh *m = import_glb("{" HEAD ",'meshes':[{'primitives':[{'attributes':{'POSITION':0},'indices':6}]},"
	                                "{'primitives':[{" LIST "}]}],'nodes':[{'mesh':0},{'mesh':1,'scale':[0,1,1]}]}");

	assert_int_equal(m->n_triangles, 1);
	assert_int_equal(m->n_vertices, 3);
	assert_int_equal(m->n_dropped_triangles, 2);
	psr_mesh_destroy(m);
}

static void draco_gives_positions_normals_and_colors(void **state)
{
	(void)state;
	struct psr_mesh *m;
	struct psr_error err = { 0, "" };

	if (psr_mesh_import(&m, "tests/data/import/quad_draco.glb", NULL, &err) != PSR_OK)
		fail_msg("%s", err.text);
	assert_square(m);
	assert_box(m, 0, 0, 0, 1, 1, 0);
	for (uint32_t v = 0; v < m->n_vertices; v++) {
		/* octahedral normals of 8 bits keep the axes */
		assert_true(m->normal[v][0] == 0.0f && m->normal[v][1] == 0.0f && m->normal[v][2] == 1.0f);
		assert_true(fabsf(m->color[v][1] - 128.0f / 255.0f) < 1e-7f && m->color[v][3] == 1.0f);
	}
	psr_mesh_destroy(m);
}

static void json_with_data_uris_and_files_reads_the_same(void **state)
{
	(void)state;
	uint8_t bin[BIN_BYTES];
	char json[4096];

	make_bin(bin);
	write_bytes(path_of("a b+c.bin"), bin, sizeof bin);
	snprintf(json, sizeof json, "%s", SQUARE);
	char *at = strstr(json, "{'byteLength':344}");
	memmove(at + 17 + 23, at + 17, strlen(at + 17) + 1);
	memcpy(at + 17, ",'uri':'a%20b+c.bin'   ", 23);
	write_text("square.gltf", json);
	struct psr_mesh *m = import("square.gltf");
	assert_square(m);
	psr_mesh_destroy(m);
	/* by its content, whatever the name */
	write_text("square.model", json);
	m = import("square.model");
	assert_square(m);
	psr_mesh_destroy(m);
	/* one triangle: 36 zero bytes but for two coordinates of 1 */
	write_text("triangle.gltf",
	           "{'asset':{'version':'2.0'},'buffers':[{'byteLength':36,'uri':'data:application/octet-stream;base64,"
	           "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA'}],'bufferViews':[{'buffer':0,'byteLength':36}],"
	           "'accessors':[{'bufferView':0,'componentType':5126,'type':'VEC3','count':3}],"
	           "'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]}");
	m = import("triangle.gltf");
	assert_int_equal(m->n_triangles, 1);
	assert_box(m, 0, 0, 0, 1, 1, 0);
	psr_mesh_destroy(m);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(list_strip_and_fan_give_the_same_square),
		cmocka_unit_test(missing_normals_stay_zero),
		cmocka_unit_test(hierarchy_applies_the_parent_after_the_child),
		cmocka_unit_test(matrix_and_rotation_turn_the_same_way),
		cmocka_unit_test(mirrored_nodes_keep_faces_and_normals_on_one_side),
		cmocka_unit_test(normals_go_with_the_inverse_transpose),
		cmocka_unit_test(one_mesh_stands_where_each_of_its_nodes_is),
		cmocka_unit_test(without_scenes_every_root_is_drawn),
		cmocka_unit_test(sparse_values_replace_those_of_the_view),
		cmocka_unit_test(normalized_bytes_are_linear_colors),
		cmocka_unit_test(textures_have_their_first_row_on_top),
		cmocka_unit_test(alpha_sides_and_unlit_are_kept),
		cmocka_unit_test(lines_are_counted_not_drawn),
		cmocka_unit_test(degenerate_triangles_and_their_vertices_are_dropped),
		cmocka_unit_test(draco_gives_positions_normals_and_colors),
		cmocka_unit_test(json_with_data_uris_and_files_reads_the_same),
	};

	return cmocka_run_group_tests_name("import_gltf", tests, make_folder, remove_folder);
}

#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "gltf_build.h"

#define MESH(...) "'meshes':[{'primitives':[{" __VA_ARGS__ "}]}],'nodes':[{'mesh':0}]"

/* A material with a normal map, which makes the importer read tangents; view `view` is its image. */
#define MAPPED(view) \
	",'images':[{'bufferView':" view "}],'textures':[{'source':0}],'materials':[{'normalTexture':{'index':0}}]"

static int put_image(struct built *b)
{
	static const uint8_t black[12];
	uint8_t bmp[80];

	return put_view(b, bmp, make_bmp(bmp, 4, 1, black, 12), 0);
}

static void quantized_positions_are_read_as_written(void **state)
{
	(void)state;
	static const int8_t i8[12] = { -128, 0, 0, 0, 127, 0, 0, 0, 0, 64, 0, 0 };
	static const uint8_t u8[12] = { 0, 0, 0, 0, 255, 0, 0, 0, 0, 51, 0, 0 };
	static const int16_t i16[12] = { -32768, 0, 0, 0, 32767, 0, 0, 0, 0, 16384, 0, 0 };
	static const uint16_t u16[12] = { 0, 0, 0, 0, 65535, 0, 0, 0, 0, 13107, 0, 0 };
	const struct {
		const void *bytes;
		size_t n;
		int component;
		double plain[3], normalized[3]; /* x of the first and the second vertex, y of the third */
	} kinds[] = { { i8, sizeof i8, I8, { -128, 127, 64 }, { -1, 1, 64.0 / 127 } },
		      { u8, sizeof u8, U8, { 0, 255, 51 }, { 0, 1, 0.2 } },
		      { i16, sizeof i16, I16, { -32768, 32767, 16384 }, { -1, 1, 16384.0 / 32767 } },
		      { u16, sizeof u16, U16, { 0, 65535, 13107 }, { 0, 1, 0.2 } } };

	for (int i = 0; i < 8; i++) {
		const int k = i / 2;
		const double *x = i % 2 ? kinds[k].normalized : kinds[k].plain;
		struct built b = { .n_bin = 0 };

		put_list(&b, kinds[k].bytes, kinds[k].n, (int)kinds[k].n / 3, kinds[k].component, "VEC3", 3,
		         i % 2 ? ",'normalized':true" : "");
		struct psr_mesh *m = import_built(&b, MESH("'attributes':{'POSITION':0}")
		                                  ",'extensionsRequired':['KHR_mesh_quantization']");

		assert_int_equal(m->n_vertices, 3);
		/* fractions are floats below 1: 2^-25 off */
		NEAR(m->position[0], 0x1p-25, x[0], 0, 0);
		NEAR(m->position[1], 0x1p-25, x[1], 0, 0);
		NEAR(m->position[2], 0x1p-25, 0, x[2], 0);
		psr_mesh_destroy(m);
	}
}

static void quantized_normals_tangents_and_coordinates_are_read(void **state)
{
	(void)state;
	static const int8_t normal[12] = { 0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0 };
	static const int16_t tangent[12] = { 32767, 0, 0, -32767, 0, 32767, 0, 32767, -32768, 0, 0, 32767 };
	static const uint16_t uv[6] = { 0, 65535, 13107, 0, 0, 26214 };
	static const uint8_t plain_uv[12] = { 3, 200, 0, 0, 0, 0, 0, 0, 255, 1, 0, 0 };
	struct built b;

	put_triangle(&b);
	PUT_NORMALIZED(&b, normal, 4, I8, "VEC3", 3);
	PUT_NORMALIZED(&b, tangent, 0, I16, "VEC4", 3);
	PUT_NORMALIZED(&b, uv, 0, U16, "VEC2", 3);
	put_list(&b, plain_uv, sizeof plain_uv, 4, U8, "VEC2", 3, "");
	assert_int_equal(put_image(&b), 5);
	struct psr_mesh *m = import_built(
		&b, MESH("'attributes':{'POSITION':0,'NORMAL':1,'TANGENT':2,'TEXCOORD_0':3,'TEXCOORD_1':4},'material':0")
		",'images':[{'bufferView':5}],'textures':[{'source':0}],'materials':[{'normalTexture':{'index':0},"
		"'occlusionTexture':{'index':0,'texCoord':1}}]");

	for (uint32_t v = 0; v < 3; v++)
		NEAR_F(m->normal[v], 0, 0, 0, 1);
	NEAR_F(m->tangent[vertex_at(m, 0, 0, 0)], 0, 1, 0, 0, -1);
	NEAR_F(m->tangent[vertex_at(m, 1, 0, 0)], 0, 0, 1, 0, 1);
	NEAR_F(m->tangent[vertex_at(m, 0, 1, 0)], 0, -1, 0, 0, 1);
	NEAR_F(m->uv[0][vertex_at(m, 0, 0, 0)], 0, 0, 1);
	NEAR_F(m->uv[0][vertex_at(m, 1, 0, 0)], 0x1p-26, 0.2, 0);
	NEAR_F(m->uv[0][vertex_at(m, 0, 1, 0)], 0x1p-26, 0, 0.4);
	NEAR_F(m->uv[1][vertex_at(m, 0, 0, 0)], 0, 3, 200);
	NEAR_F(m->uv[1][vertex_at(m, 0, 1, 0)], 0, 255, 1);
	psr_mesh_destroy(m);
}

static void colors_of_every_kind_are_the_same(void **state)
{
	(void)state;
	static const float f3[9] = { 1, 0.2f, 0, 1, 0.2f, 0, 1, 0.2f, 0 };
	static const float f4[12] = { 1, 0.2f, 0, 0.4f, 1, 0.2f, 0, 0.4f, 1, 0.2f, 0, 0.4f };
	static const uint8_t b3[12] = { 255, 51, 0, 9, 255, 51, 0, 9, 255, 51, 0, 9 };
	static const uint8_t b4[12] = { 255, 51, 0, 102, 255, 51, 0, 102, 255, 51, 0, 102 };
	static const uint16_t s3[12] = { 65535, 13107, 0, 9, 65535, 13107, 0, 9, 65535, 13107, 0, 9 };
	static const uint16_t s4[12] = { 65535, 13107, 0, 26214, 65535, 13107, 0, 26214, 65535, 13107, 0, 26214 };
	struct built b;

	put_triangle(&b);
	PUT(&b, f3, F32, "VEC3", 3);
	PUT(&b, f4, F32, "VEC4", 3);
	PUT_NORMALIZED(&b, b3, 4, U8, "VEC3", 3);
	PUT_NORMALIZED(&b, b4, 0, U8, "VEC4", 3);
	PUT_NORMALIZED(&b, s3, 8, U16, "VEC3", 3);
	PUT_NORMALIZED(&b, s4, 0, U16, "VEC4", 3);
	PUT(&b, b4, U8, "VEC4", 3); /* not normalized, which glTF does not allow and files do */
	for (int i = 1; i <= 7; i++) {
		char rest[256];

		snprintf(rest, sizeof rest, MESH("'attributes':{'POSITION':0,'COLOR_0':%d}"), i);
		struct psr_mesh *m = import_built(&b, rest);

		for (uint32_t v = 0; v < 3; v++)
			NEAR_F(m->color[v], 0x1p-26, 1, 0.2, 0, i == 7 || i % 2 == 0 ? 0.4 : 1);
		psr_mesh_destroy(m);
	}
}

/* One primitive has colors, coordinates and tangents, the other has none: white, 0,0 and 0. */
static void what_a_primitive_lacks_is_neutral(void **state)
{
	(void)state;
	static const float color[12] = { 0.5, 0.5, 0.5, 1, 0.5, 0.5, 0.5, 1, 0.5, 0.5, 0.5, 1 };
	static const float uv[6] = { 1, 2, 3, 4, 5, 6 };
	static const float normal[9] = { 0, 0, 1, 0, 0, 1, 0, 0, 1 }, tangent[12] = { 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1 };
	struct built b;

	put_triangle(&b);
	PUT(&b, color, F32, "VEC4", 3);
	PUT(&b, uv, F32, "VEC2", 3);
	PUT(&b, normal, F32, "VEC3", 3);
	PUT(&b, tangent, F32, "VEC4", 3);
	assert_int_equal(put_image(&b), 5);
	for (int first = 0; first < 2; first++) {
		static const char full[] = "{'attributes':{'POSITION':0,'COLOR_0':1,'TEXCOORD_0':2,'NORMAL':3,'TANGENT':4},"
		                           "'material':0}";
		char rest[1024];

		snprintf(rest, sizeof rest, "'meshes':[{'primitives':[%s,%s]},{'primitives':[{'attributes':{'POSITION':0}}]}],"
		         "'nodes':[{'mesh':0},{'mesh':1,'translation':[0,0,5]}]" MAPPED("5"),
		         first ? "{'attributes':{'POSITION':0}}" : full, first ? full : "{'attributes':{'POSITION':0}}");
		struct psr_mesh *m = import_built(&b, rest);
		uint32_t v = vertex_at(m, 0, 0, 5);

		assert_int_equal(m->n_triangles, 3);
		NEAR_F(m->color[v], 0, 1, 1, 1, 1);
		NEAR_F(m->uv[0][v], 0, 0, 0);
		NEAR_F(m->tangent[v], 0, 0, 0, 0, 0);
		v = m->triangle[first][0];
		NEAR_F(m->color[v], 0, 0.5, 0.5, 0.5, 1);
		NEAR_F(m->uv[0][v], 0, 1, 2);
		NEAR_F(m->tangent[v], 0, 1, 0, 0, 1);
		psr_mesh_destroy(m);
	}
}

/* Seen in a mirror: the bitangent, handedness times normal x tangent, is the mirror image of the bitangent. */
static void tangents_go_with_the_surface_through_mirrors(void **state)
{
	(void)state;
	static const float normal[9] = { 0, 0, 1, 0, 0, 1, 0, 0, 1 };
	static const float tangent[12] = { 0.6f, 0.8f, 0, 1, 0.6f, 0.8f, 0, 1, 0.6f, 0.8f, 0, 1 };
	struct built b;

	put_triangle(&b);
	PUT(&b, normal, F32, "VEC3", 3);
	PUT(&b, tangent, F32, "VEC4", 3);
	assert_int_equal(put_image(&b), 3);
	for (int i = 0; i < 3; i++) {
		static const double scale[3][3] = { { 1, 1, 1 }, { -1, 1, 1 }, { 1, 1, -1 } };
		const double *s = scale[i];
		char rest[1024];

		snprintf(rest, sizeof rest, "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':1,'TANGENT':2},"
		         "'material':0}]}],'nodes':[{'mesh':0,'scale':[%g,%g,%g]}]" MAPPED("3"), s[0], s[1], s[2]);
		struct psr_mesh *m = import_built(&b, rest);
		const float *n = m->normal[0], *t = m->tangent[0];

		/* 0.6f and 0.8f are 2^-26 off, so that they are not of unit length, and again after it is made one */
		NEAR_F(t, 0x1p-23, 0.6 * s[0], 0.8 * s[1], 0, s[0] * s[1] * s[2]);
		NEAR_F(n, 0, 0, 0, s[2]);
		/* before: (0,0,1) x (0.6,0.8,0) = (-0.8,0.6,0) */
		const double bitangent[3] = { t[3] * (n[1] * t[2] - n[2] * t[1]), t[3] * (n[2] * t[0] - n[0] * t[2]),
			                      t[3] * (n[0] * t[1] - n[1] * t[0]) };
		NEAR(bitangent, 0x1p-23, -0.8 * s[0], 0.6 * s[1], 0);
		psr_mesh_destroy(m);
	}
}

static void tangents_without_normals_or_a_normal_map_are_left_out(void **state)
{
	(void)state;
	static const float tangent[12] = { 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1 };
	struct built b;

	put_triangle(&b);
	PUT(&b, tangent, F32, "VEC4", 3);
	assert_int_equal(put_image(&b), 2);
	struct psr_mesh *m = import_built(&b, MESH("'attributes':{'POSITION':0,'TANGENT':1},'material':0") MAPPED("2"));

	assert_null(m->tangent);
	psr_mesh_destroy(m);
}

static void points_become_a_cloud(void **state)
{
	(void)state;
	static const uint8_t color[12] = { 255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 51 };
	static const float normal[9] = { 0, 0, 2, 1, 1, 0, 0, 3, 4 };
	static const uint16_t index[2] = { 2, 0 };
	struct built b;

	put_triangle(&b);
	PUT_NORMALIZED(&b, color, 0, U8, "VEC4", 3);
	PUT(&b, normal, F32, "VEC3", 3);
	PUT(&b, index, U16, "SCALAR", 2);
	struct psr_mesh *m = import_built(
		&b, "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'NORMAL':2},'mode':0}]},{'primitives':["
		"{'attributes':{'POSITION':0,'NORMAL':2,'COLOR_0':1},'indices':3,'mode':0,'material':0}]}],"
		"'materials':[{'pbrMetallicRoughness':{'baseColorFactor':[0.5,0.25,1,1]}}],"
		"'nodes':[{'mesh':0,'scale':[1,2,1],'translation':[0,0,3]},{'mesh':1,'scale':[1,2,1]}]");

	assert_int_equal(m->n_points, 5);
	assert_int_equal(m->n_triangles, 0);
	assert_int_equal(m->n_dropped_primitives, 0);
	NEAR(m->point[0], 0, 0, 0, 3);
	NEAR(m->point[1], 0, 1, 0, 3);
	NEAR(m->point[2], 0, 0, 2, 3);
	NEAR(m->point[3], 0, 0, 2, 0);
	NEAR(m->point[4], 0, 0, 0, 0);
	NEAR_F(m->point_color[0], 0, 1, 1, 1, 1);
	NEAR_F(m->point_color[3], 0x1p-26, 0, 0, 1, 0.2);
	NEAR_F(m->point_color[4], 0, 1, 0, 0, 1);
	/* normals go with the inverse transpose, to unit length: (1, 1/2, 0) and (0, 3/2, 4); 2^-24 off below 1 */
	NEAR_F(m->point_normal[0], 0, 0, 0, 1);
	NEAR_F(m->point_normal[1], 0x1p-24, 1 / sqrt(1.25), 0.5 / sqrt(1.25), 0);
	NEAR_F(m->point_normal[3], 0x1p-24, 0, 1.5 / sqrt(18.25), 4 / sqrt(18.25));
	for (uint32_t p = 0; p < m->n_points; p++)
		assert_true(m->point_radius[p] > 0.0f);
	NEAR_F(m->material[m->point_material[4]].base_color, 0, 0.5, 0.25, 1, 1);
	psr_mesh_destroy(m);
}

static void points_have_no_textures(void **state)
{
	(void)state;
	static const float uv[6];
	struct built b;

	put_triangle(&b);
	PUT(&b, uv, F32, "VEC2", 3);
	assert_int_equal(put_image(&b), 2);
	struct psr_mesh *m = import_built(
		&b, "'meshes':[{'primitives':[{'attributes':{'POSITION':0,'TEXCOORD_0':1},'material':0},"
		"{'attributes':{'POSITION':0,'TEXCOORD_0':1},'mode':0,'material':0}]}],'images':[{'bufferView':2}],"
		"'textures':[{'source':0}],'materials':[{'pbrMetallicRoughness':{'baseColorTexture':{'index':0}}}]");

	assert_int_equal(m->n_triangles, 1);
	assert_int_equal(m->n_points, 3);
	assert_true(m->material[m->triangle_material[0]].base_texture.image == 0);
	assert_true(m->material[m->point_material[0]].base_texture.image == -1);
	assert_non_null(strstr(m->warning, "textures of points"));
	psr_mesh_destroy(m);
}

static void points_that_are_not_finite_are_left_out(void **state)
{
	(void)state;
	const float position[12] = { 0, 0, 0, NAN, 0, 0, 0, INFINITY, 0, 5, 6, 7 };
	struct built b = { .n_bin = 0 };

	PUT(&b, position, F32, "VEC3", 4);
	struct psr_mesh *m = import_built(&b, MESH("'attributes':{'POSITION':0},'mode':0"));

	assert_int_equal(m->n_points, 2);
	NEAR(m->point[1], 0, 5, 6, 7);
	assert_int_equal(m->n_dropped_primitives, 2);
	assert_string_equal(m->warning, "points that are not finite were left out: 2");
	psr_mesh_destroy(m);
}

static void broken_faces_are_left_out_and_counted(void **state)
{
	(void)state;
	const float position[21] = { 0, 0, 0, 1, 0, 0, 0, 1, 0, NAN, 0, 0, 0, 0, INFINITY, 2, 0, 0, 9, 9, 9 };
	/* good, turned, turned again, not finite (2), without area (2: in line, and one vertex twice), from behind: good */
	static const uint8_t index[24] = { 0, 1, 2, 1, 2, 0, 2, 0, 1, 0, 1, 3, 4, 1, 2, 0, 1, 5, 0, 0, 2, 0, 2, 1 };
	struct built b = { .n_bin = 0 };

	PUT(&b, position, F32, "VEC3", 7);
	PUT(&b, index, U8, "SCALAR", 24);
	struct psr_mesh *m = import_built(&b, MESH("'attributes':{'POSITION':0},'indices':1"));

	assert_int_equal(m->n_triangles, 2);
	assert_int_equal(m->n_vertices, 3); /* 9,9,9 is not used */
	assert_int_equal(m->n_dropped_triangles, 6);
	assert_string_equal(m->warning, "faces without area were left out: 2; faces with a corner that is not finite were "
	                                "left out: 2; duplicate faces were left out: 2");
	psr_mesh_destroy(m);
	/* the same faces of another material stay; of another mesh at the same place they go */
	b = (struct built){ .n_bin = 0 };
	put_triangle(&b);
	m = import_built(&b, "'meshes':[{'primitives':[{'attributes':{'POSITION':0}},{'attributes':{'POSITION':0},"
	                     "'material':0},{'attributes':{'POSITION':0}}]}],'materials':[{}],"
	                     "'nodes':[{'mesh':0},{'mesh':0}]");
	assert_int_equal(m->n_triangles, 2);
	assert_int_equal(m->n_dropped_triangles, 4);
	psr_mesh_destroy(m);
}

static void attributes_that_are_not_finite_become_neutral(void **state)
{
	(void)state;
	const float normal[9] = { NAN, 0, 1, INFINITY, 0, 0, 0, 0, 3e38f }, uv[6] = { NAN, 1, 1, -INFINITY, 2, 3 };
	const float color[12] = { NAN, -1, 7, INFINITY, 0, 0, 0, 0, 1, 1, 1, 1 };
	const float tangent[12] = { 0, 0, 0, 1, NAN, 0, 0, 1, 0, 3, 0, -7 };
	struct built b;

	put_triangle(&b);
	PUT(&b, normal, F32, "VEC3", 3);
	PUT(&b, uv, F32, "VEC2", 3);
	PUT(&b, color, F32, "VEC4", 3);
	PUT(&b, tangent, F32, "VEC4", 3);
	assert_int_equal(put_image(&b), 5);
	struct psr_mesh *m = import_built(
		&b, MESH("'attributes':{'POSITION':0,'NORMAL':1,'TEXCOORD_0':2,'COLOR_0':3,'TANGENT':4},'material':0")
		MAPPED("5"));

	NEAR_F(m->normal[vertex_at(m, 0, 0, 0)], 0, 0, 0, 0);
	NEAR_F(m->normal[vertex_at(m, 1, 0, 0)], 0, 0, 0, 0);
	NEAR_F(m->normal[vertex_at(m, 0, 1, 0)], 0, 0, 0, 1);
	NEAR_F(m->uv[0][vertex_at(m, 0, 0, 0)], 0, 0, 0);
	NEAR_F(m->uv[0][vertex_at(m, 1, 0, 0)], 0, 0, 0);
	NEAR_F(m->uv[0][vertex_at(m, 0, 1, 0)], 0, 2, 3);
	NEAR_F(m->color[vertex_at(m, 0, 0, 0)], 0, 1, 0, 1, 1);
	NEAR_F(m->tangent[vertex_at(m, 0, 0, 0)], 0, 0, 0, 0, 0);
	NEAR_F(m->tangent[vertex_at(m, 1, 0, 0)], 0, 0, 0, 0, 0);
	NEAR_F(m->tangent[vertex_at(m, 0, 1, 0)], 0, 0, 1, 0, -1);
	psr_mesh_destroy(m);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(quantized_positions_are_read_as_written),
		cmocka_unit_test(quantized_normals_tangents_and_coordinates_are_read),
		cmocka_unit_test(colors_of_every_kind_are_the_same),
		cmocka_unit_test(what_a_primitive_lacks_is_neutral),
		cmocka_unit_test(tangents_go_with_the_surface_through_mirrors),
		cmocka_unit_test(tangents_without_normals_or_a_normal_map_are_left_out),
		cmocka_unit_test(points_become_a_cloud),
		cmocka_unit_test(points_have_no_textures),
		cmocka_unit_test(points_that_are_not_finite_are_left_out),
		cmocka_unit_test(broken_faces_are_left_out_and_counted),
		cmocka_unit_test(attributes_that_are_not_finite_become_neutral),
	};

	return cmocka_run_group_tests_name("import_gltf_vertex", tests, make_folder, remove_folder);
}

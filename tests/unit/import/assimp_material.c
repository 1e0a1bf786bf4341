#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "base/srgb.h"
#include "files.h"

/* A picture of w x h (w a multiple of 4) whose every channel, red green blue, is what `value` says at x, y. */
static void write_picture(const char *name, uint32_t w, uint32_t h, const uint8_t (*rgb)[3])
{
	uint8_t bgr[1024], bmp[2048];
	size_t n = 0;

	for (uint32_t y = h; y-- > 0;) /* rows from the bottom up */
		for (uint32_t x = 0; x < w; x++)
			for (int c = 3; c-- > 0;)
				bgr[n++] = rgb[y * w + x][c];
	write_bytes(path_of(name), bmp, make_bmp(bmp, w, h, bgr, n));
}

/* TGA, 32 bits, top row first. */
static void write_with_alpha(const char *name, uint8_t w, uint8_t h, const uint8_t (*rgba)[4])
{
	uint8_t tga[512] = { [2] = 2, [12] = w, [14] = h, [16] = 32, [17] = 0x28 };
	size_t n = 18;

	for (int i = 0; i < w * h; i++) {
		tga[n++] = rgba[i][2];
		tga[n++] = rgba[i][1];
		tga[n++] = rgba[i][0];
		tga[n++] = rgba[i][3];
	}
	write_bytes(path_of(name), tga, n);
}

static struct psr_mesh *import_mtl(const char *mtl)
{
	char text[1024];

	snprintf(text, sizeof text, "newmtl a\n%s", mtl);
	write_text("a.mtl", text);
	write_text("a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n");
	return import("a.obj");
}

static const struct psr_material *only_material(const struct psr_mesh *m)
{
	return &m->material[m->triangle_material[0]];
}

static void assert_alphas(const struct psr_image *image, const uint8_t *alpha)
{
	for (uint32_t i = 0; i < image->width * image->height; i++)
		assert_int_equal(image->rgba[4 * i + 3], alpha[i]);
}

static void opacity_maps_become_the_alpha_of_the_base_texture(void **state)
{
	(void)state;
	static const uint8_t red[4][3] = { { 200, 0, 0 }, { 200, 0, 0 }, { 100, 0, 0 }, { 100, 0, 0 } };
	static const uint8_t open[4][3] = { { 0, 0, 0 }, { 255, 255, 255 }, { 255, 255, 255 }, { 0, 0, 0 } };
	static const uint8_t half[4][3] = { { 0, 0, 0 }, { 128, 128, 128 }, { 128, 128, 128 }, { 255, 255, 255 } };

	write_picture("red.bmp", 4, 1, red);
	write_picture("open.bmp", 4, 1, open);
	write_picture("half.bmp", 4, 1, half);
	struct psr_mesh *m = import_mtl("Kd 1 1 1\nmap_Kd red.bmp\nmap_d open.bmp\n");
	const struct psr_material *a = only_material(m);

	assert_int_equal(a->alpha, PSR_ALPHA_MASK);
	assert_int_equal(m->n_images, 1); /* those that it is made of are gone */
	assert_int_equal(a->base_texture.image, 0);
	assert_alphas(&m->image[0], (const uint8_t[]){ 0, 255, 255, 0 });
	assert_true(m->image[0].rgba[0] == 200 && m->image[0].rgba[8] == 100 && m->image[0].rgba[1] == 0);
	psr_mesh_destroy(m);
	/* half of it is half open: no cut-out */
	m = import_mtl("Kd 1 1 1\nmap_Kd red.bmp\nmap_d half.bmp\n");
	assert_int_equal(only_material(m)->alpha, PSR_ALPHA_BLEND);
	assert_alphas(&m->image[0], (const uint8_t[]){ 0, 128, 128, 255 });
	psr_mesh_destroy(m);
	/* without a base texture it is white */
	m = import_mtl("Kd 1 0 0\nmap_d open.bmp\n");
	assert_alphas(&m->image[only_material(m)->base_texture.image], (const uint8_t[]){ 0, 255, 255, 0 });
	assert_true(m->image[0].rgba[0] == 255 && m->image[0].rgba[1] == 255);
	assert_non_null(m->uv[0]);
	psr_mesh_destroy(m);
}

static void an_opacity_map_of_another_size_is_stretched(void **state)
{
	(void)state;
	static const uint8_t red[4][3] = { { 200, 0, 0 }, { 200, 0, 0 }, { 200, 0, 0 }, { 200, 0, 0 } };
	uint8_t fine[16][3];

	for (int i = 0; i < 16; i++)
		fine[i][0] = fine[i][1] = fine[i][2] = i % 8 < 4 ? 0 : 255;
	write_picture("red.bmp", 4, 1, red);
	write_picture("fine.bmp", 8, 2, (const uint8_t(*)[3])fine);
	struct psr_mesh *m = import_mtl("Kd 1 1 1\nmap_Kd red.bmp\nmap_d fine.bmp\n");

	assert_true(m->image[0].width == 8 && m->image[0].height == 2);
	assert_alphas(&m->image[0], (const uint8_t[]){ 0, 0, 0, 0, 255, 255, 255, 255, 0, 0, 0, 0, 255, 255, 255, 255 });
	assert_int_equal(m->image[0].rgba[0], 200);
	psr_mesh_destroy(m);
}

static void a_texture_cut_out_by_its_own_alpha_is_a_mask(void **state)
{
	(void)state;
	static const uint8_t leaf[4][4] = { { 0, 99, 0, 0 }, { 0, 99, 0, 255 }, { 0, 99, 0, 255 }, { 0, 99, 0, 0 } };
	static const uint8_t gloss[4][4] = { { 0, 99, 0, 80 }, { 0, 99, 0, 90 }, { 0, 99, 0, 80 }, { 0, 99, 0, 120 } };

	write_with_alpha("leaf.tga", 4, 1, leaf);
	write_with_alpha("gloss.tga", 4, 1, gloss);
	struct psr_mesh *m = import_mtl("Kd 1 1 1\nmap_Kd leaf.tga\n");

	assert_int_equal(only_material(m)->alpha, PSR_ALPHA_MASK);
	assert_true(only_material(m)->alpha_cutoff == 0.5f);
	psr_mesh_destroy(m);
	/* the same file as both is not squared */
	m = import_mtl("Kd 1 1 1\nmap_Kd gloss.tga\nmap_d gloss.tga\n");
	assert_alphas(&m->image[only_material(m)->base_texture.image], (const uint8_t[]){ 80, 90, 80, 120 });
	assert_int_equal(only_material(m)->alpha, PSR_ALPHA_BLEND);
	psr_mesh_destroy(m);
	/* an alpha that cuts nothing out may mean anything */
	m = import_mtl("Kd 1 1 1\nmap_Kd gloss.tga\n");
	assert_int_equal(only_material(m)->alpha, PSR_ALPHA_OPAQUE);
	psr_mesh_destroy(m);
}

static void emission_has_a_color_and_a_map(void **state)
{
	(void)state;
	static const uint8_t red[4][3] = { { 200, 0, 0 }, { 200, 0, 0 }, { 200, 0, 0 }, { 200, 0, 0 } };

	write_picture("red.bmp", 4, 1, red);
	struct psr_mesh *m = import_mtl("Kd 0 0 0\nKe 1 0.5 0\nmap_Ke red.bmp\n");
	const struct psr_material *a = only_material(m);

	assert_true(a->emissive[0] == 1.0f && a->emissive[1] == psr_srgb_to_linear[128] && a->emissive[2] == 0.0f);
	assert_true(a->emissive_texture.image == 0 && a->base_texture.image == -1);
	psr_mesh_destroy(m);
	m = import_mtl("Kd 0 0 0\nmap_Ke red.bmp\n");
	assert_true(only_material(m)->emissive[0] == 1.0f && only_material(m)->emissive[2] == 1.0f);
	psr_mesh_destroy(m);
	m = import_mtl("Kd 1 1 1\n");
	assert_true(only_material(m)->emissive[0] == 0.0f && only_material(m)->emissive_texture.image == -1);
	psr_mesh_destroy(m);
}

/* By what they hold, whatever the file calls them. */
static void bump_maps_are_used_where_they_hold_normals(void **state)
{
	(void)state;
	/* (0,0,1), (0.6,0,0.8), (0,-0.6,0.8), (-0.6,0,0.8) */
	static const uint8_t normals[4][3] = { { 128, 128, 255 }, { 204, 128, 230 }, { 128, 51, 230 }, { 51, 128, 230 } };
	static const uint8_t heights[4][3] = { { 0, 0, 0 }, { 201, 201, 201 }, { 201, 201, 201 }, { 255, 255, 255 } };
	static const char *const keys[] = { "bump", "map_bump", "norm" };

	write_picture("normals.bmp", 4, 1, normals);
	write_picture("heights.bmp", 4, 1, heights);
	for (int i = 0; i < 3; i++) {
		char mtl[128];

		snprintf(mtl, sizeof mtl, "Kd 1 1 1\n%s normals.bmp\n", keys[i]);
		struct psr_mesh *m = import_mtl(mtl);

		assert_int_equal(only_material(m)->normal_texture.image, 0);
		assert_string_equal(m->warning, "");
		assert_non_null(m->uv[0]);
		psr_mesh_destroy(m);
		snprintf(mtl, sizeof mtl, "Kd 1 1 1\n%s heights.bmp\n", keys[i]);
		m = import_mtl(mtl);
		assert_int_equal(only_material(m)->normal_texture.image, -1);
		assert_int_equal(m->n_images, 0);
		assert_string_equal(m->warning, "bump maps that hold heights were left out");
		psr_mesh_destroy(m);
	}
}

static void maps_of_metal_and_roughness_become_one(void **state)
{
	(void)state;
	static const uint8_t rough[4][3] = { { 10, 0, 0 }, { 20, 0, 0 }, { 30, 0, 0 }, { 40, 0, 0 } };
	static const uint8_t metal[4][3] = { { 1, 0, 0 }, { 2, 0, 0 }, { 3, 0, 0 }, { 4, 0, 0 } };

	write_picture("rough.bmp", 4, 1, rough);
	write_picture("metal.bmp", 4, 1, metal);
	struct psr_mesh *m = import_mtl("Kd 1 1 1\nmap_Pr rough.bmp\nmap_Pm metal.bmp\n");
	const struct psr_material *a = only_material(m);

	assert_int_equal(m->n_images, 1);
	assert_int_equal(a->metallic_roughness_texture.image, 0);
	for (int i = 0; i < 4; i++)
		assert_true(m->image[0].rgba[4 * i + 1] == 10 * (i + 1) && m->image[0].rgba[4 * i + 2] == i + 1);
	assert_true(a->roughness == 1.0f && a->metallic == 1.0f);
	psr_mesh_destroy(m);
	m = import_mtl("Kd 1 1 1\nPr 0.5\nPm 0.25\nmap_Pr rough.bmp\n");
	a = only_material(m);
	assert_true(a->roughness == 0.5f && a->metallic == 0.25f);
	assert_true(m->image[0].rgba[1] == 10 && m->image[0].rgba[2] == 255);
	psr_mesh_destroy(m);
}

#define SOURCE(id, n, stride, names, numbers) \
	"<source id='" id "'><float_array id='" id "a' count='" n "'>" numbers \
	"</float_array><technique_common><accessor " \
	"source='#" id "a' count='3' stride='" stride "'>" names "</accessor></technique_common></source>"
#define XYZ "<param name='X' type='float'/><param name='Y' type='float'/><param name='Z' type='float'/>"
#define ST "<param name='S' type='float'/><param name='T' type='float'/>"
#define IMAGE(id, file) "<image id='" id "'><init_from>" file "</init_from></image>"
#define PARAMS(id) \
	"<newparam sid='" id "f'><surface type='2D'><init_from>" id "</init_from></surface></newparam>" \
	"<newparam sid='" id "s'><sampler2D><source>" id "f</source></sampler2D></newparam>"

static void a_collada_material_may_use_two_sets_of_coordinates(void **state)
{
	(void)state;
	static const uint8_t red[4][3] = { { 200, 0, 0 }, { 200, 0, 0 }, { 200, 0, 0 }, { 200, 0, 0 } };

	write_picture("one.bmp", 4, 1, red);
	write_picture("two.bmp", 4, 1, red);
	write_text("two.dae",
	           "<?xml version='1.0'?><COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'>"
	           "<asset><up_axis>Y_UP</up_axis></asset><library_images>" IMAGE("one", "one.bmp") IMAGE("two", "two.bmp")
	           "</library_images><library_effects><effect id='e'><profile_COMMON>" PARAMS("one") PARAMS("two")
	           "<technique sid='t'><phong><emission><texture texture='twos' texcoord='UV1'/></emission>"
	           "<diffuse><texture texture='ones' texcoord='UV0'/></diffuse></phong></technique>"
	           "</profile_COMMON></effect>"
	           "</library_effects><library_materials><material id='m'><instance_effect url='#e'/></material>"
	           "</library_materials><library_geometries><geometry id='g'><mesh>"
	           SOURCE("p", "9", "3", XYZ, "0 0 0 1 0 0 0 1 0") SOURCE("u", "6", "2", ST, "0 0 1 0 0 1")
	           SOURCE("w", "6", "2", ST, "0.5 0.5 0.25 0.5 0.5 0.75")
	           "<vertices id='v'><input semantic='POSITION' source='#p'/></vertices><triangles count='1' material='M'>"
	           "<input semantic='VERTEX' source='#v' offset='0'/>"
	           "<input semantic='TEXCOORD' source='#u' offset='1' set='0'/>"
	           "<input semantic='TEXCOORD' source='#w' offset='2' set='1'/><p>0 0 0 1 1 1 2 2 2</p></triangles></mesh>"
	           "</geometry></library_geometries><library_visual_scenes><visual_scene id='s'><node id='n'>"
	           "<instance_geometry url='#g'><bind_material><technique_common><instance_material symbol='M' target='#m'>"
	           "<bind_vertex_input semantic='UV0' input_semantic='TEXCOORD' input_set='0'/>"
	           "<bind_vertex_input semantic='UV1' input_semantic='TEXCOORD' input_set='1'/></instance_material>"
	           "</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>"
	           "<scene><instance_visual_scene url='#s'/></scene></COLLADA>");
	struct psr_mesh *m = import("two.dae");
	const struct psr_material *a = only_material(m);

	assert_int_equal(a->base_texture.uv_set, 0);
	assert_int_equal(a->emissive_texture.uv_set, 1);
	assert_true(a->base_texture.image >= 0 && a->emissive_texture.image >= 0);
	assert_non_null(m->uv[0]);
	assert_non_null(m->uv[1]);
	for (uint32_t v = 0; v < 3; v++) {
		const double x = m->position[v][0], y = m->position[v][1];

		assert_true(m->uv[0][v][0] == (float)x && m->uv[0][v][1] == 1.0f - (float)y);
		assert_true(m->uv[1][v][0] == (x > 0 ? 0.25f : 0.5f) && m->uv[1][v][1] == (y > 0 ? 0.25f : 0.5f));
	}
	psr_mesh_destroy(m);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(opacity_maps_become_the_alpha_of_the_base_texture),
		cmocka_unit_test(an_opacity_map_of_another_size_is_stretched),
		cmocka_unit_test(a_texture_cut_out_by_its_own_alpha_is_a_mask),
		cmocka_unit_test(emission_has_a_color_and_a_map),
		cmocka_unit_test(bump_maps_are_used_where_they_hold_normals),
		cmocka_unit_test(maps_of_metal_and_roughness_become_one),
		cmocka_unit_test(a_collada_material_may_use_two_sets_of_coordinates),
	};

	return cmocka_run_group_tests_name("import_assimp_material", tests, make_folder, remove_folder);
}

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/srgb.h"
#include "base/vec.h"
#include "base/direction.h"
#include "model/blocks.h"
#include "surface/material.h"
#include "surface/surface.h"
#include "meshes.h"

/* Quantised normals are up to this far off, radians (base/direction.h). */
#define NORMAL_ERROR 0.0222

static const float up[3] = { 0, 0, 1 };

/* The word at a place of the square's lower left triangle, under a circle of this diameter. */
static uint64_t attr_at(const struct psr_mesh *mesh, double u, double v, double diameter, int is_back)
{
	const struct surface_place place = { .prim = 0, .is_back = is_back, .u = u, .v = v };
	const float down[3] = { 0, 0, -1 };
	struct surface surface;
	uint64_t attr;

	assert_int_equal(surface_init(&surface, mesh, 1), PSR_OK);
	attr = surface_attr(&surface, &place, diameter, is_back ? down : up);
	surface_fini(&surface);
	return attr;
}

static uint64_t attr_of(const struct psr_mesh *mesh, double diameter)
{
	return attr_at(mesh, 0.3, 0.3, diameter, 0);
}

#define LOOK_BITS (~UINT64_C(0x7fff))

/* A square whose image is one texel, which no slot uses yet. */
static struct psr_mesh *one_texel(int r, int g, int b, int a)
{
	const uint8_t texel[4] = { (uint8_t)r, (uint8_t)g, (uint8_t)b, (uint8_t)a };
	struct psr_mesh *mesh = meshes_square(1);

	meshes_texture(mesh, 1, 1, texel);
	mesh->material->base_texture.image = -1;
	return mesh;
}

static struct material_values values_of(const struct psr_mesh *mesh)
{
	struct material_values values;

	material_values_default(&values, mesh->material);
	return values;
}

static void assert_look(const struct psr_mesh *mesh, const struct material_values *values)
{
	for (int i = 0; i < 3; i++)
		assert_int_equal(attr_of(mesh, i * 0.5) & LOOK_BITS, material_word(mesh->material, values));
}

static void base_textures_are_coded(void **state)
{
	struct psr_mesh *mesh = one_texel(10, 100, 200, 255);

	(void)state;
	mesh->material->base_texture.image = 0;
	assert_int_equal(PSR_ATTR_BASE(attr_of(mesh, 0)), 10 | 100 << 8 | 200 << 16);
	assert_int_equal(PSR_ATTR_BASE(attr_of(mesh, 1)), 10 | 100 << 8 | 200 << 16);
	meshes_free(mesh);
}

static void far_textures_are_their_linear_mean(void **state)
{
	uint8_t rgba[32 * 32 * 4];
	struct psr_mesh *mesh = meshes_square(1);

	(void)state;
	for (int i = 0; i < 32 * 32; i++)
		memset(rgba + 4 * i, (i + i / 32) & 1 ? 255 : 0, 4);
	meshes_texture(mesh, 32, 32, rgba);
	/* A circle with a diameter of half the square: 8 texels around its centre. */
	assert_int_equal(PSR_ATTR_BASE(attr_of(mesh, 1)), psr_linear_to_srgb(0.5f) * 0x10101u);
	meshes_free(mesh);
}

static void the_circle_counts_in_inner_units(void **state)
{
	const uint8_t rgba[] = { 0, 0, 0, 255, 255, 255, 255, 255 };
	struct psr_mesh *mesh = meshes_square(1);
	const struct surface_place place = { .prim = 0, .u = 0.1, .v = 0.1 };
	struct surface one, ten;

	(void)state;
	meshes_texture(mesh, 2, 1, rgba);
	assert_int_equal(surface_init(&one, mesh, 1), PSR_OK);
	assert_int_equal(surface_init(&ten, mesh, 10), PSR_OK);
	assert_true(surface_attr(&one, &place, 0.6, up) == surface_attr(&ten, &place, 0.06, up));
	assert_true(surface_attr(&one, &place, 0.06, up) != surface_attr(&ten, &place, 0.06, up));
	surface_fini(&one);
	surface_fini(&ten);
	meshes_free(mesh);
}

static void roughness_is_green_and_metal_is_blue(void **state)
{
	struct psr_mesh *mesh = one_texel(13, 102, 51, 7);
	struct material_values values;

	(void)state;
	mesh->material->metallic = 1;
	mesh->material->roughness = 0.9f;
	mesh->material->metallic_roughness_texture.image = 0;
	values = values_of(mesh);
	values.roughness = 0.9f * 0.4f;
	values.metallic = 0.2f;
	assert_look(mesh, &values);
	meshes_free(mesh);
}

static void specular_glossiness_is_coded_color_and_linear_alpha(void **state)
{
	struct psr_mesh *mesh = one_texel(188, 100, 0, 153);
	struct material_values values;

	(void)state;
	mesh->material->is_specular_glossiness = 1;
	mesh->material->specular_texture.image = 0;
	mesh->material->metallic_roughness_texture.image = 0; /* not read */
	values = values_of(mesh);
	for (int c = 0; c < 3; c++)
		values.specular[c] = psr_srgb_to_linear[mesh->image->rgba[c]];
	values.glossiness = 0.6f;
	assert_look(mesh, &values);
	meshes_free(mesh);
}

static void emission_and_occlusion_have_their_textures(void **state)
{
	struct psr_mesh *mesh = one_texel(51, 120, 220, 255);
	struct material_values values;

	(void)state;
	mesh->material->occlusion_texture.image = 0;
	mesh->material->occlusion_strength = 0.5f;
	values = values_of(mesh);
	values.occlusion = 0.6f; /* 1 + 0.5 (0.2 - 1) */
	assert_look(mesh, &values);
	mesh->material->emissive_texture.image = 0;
	for (int c = 0; c < 3; c++) {
		mesh->material->emissive[c] = 0.5f;
		values.emission[c] = 0.5f * psr_srgb_to_linear[mesh->image->rgba[c]];
	}
	assert_look(mesh, &values);
	meshes_free(mesh);
}

static void unlit_materials_have_their_base_color_alone(void **state)
{
	struct psr_mesh *mesh = one_texel(51, 120, 220, 255);
	uint64_t attr;

	(void)state;
	mesh->material->unlit = 1;
	mesh->material->base_texture.image = 0;
	mesh->material->occlusion_texture.image = 0;
	mesh->material->normal_texture.image = 0;
	attr = attr_of(mesh, 0.1);
	assert_int_equal(PSR_ATTR_BASE(attr), 51 | 120 << 8 | 220 << 16);
	assert_int_equal(PSR_ATTR_UNLIT(attr), 1);
	assert_int_equal(PSR_ATTR_NORMAL(attr), psr_direction_encode(up));
	meshes_free(mesh);
}

static void uv_sets_and_transforms_choose_the_place(void **state)
{
	const uint8_t rgba[] = { 1, 1, 1, 255, 2, 2, 2, 255, 3, 3, 3, 255, 4, 4, 4, 255 };
	struct psr_mesh *mesh = meshes_square(1);
	struct psr_texture *texture = &mesh->material->base_texture;

	(void)state;
	meshes_texture(mesh, 2, 2, rgba);
	texture->is_nearest = 1;
	/* u = 0.4, v = 0.9 */
	assert_int_equal(PSR_ATTR_BASE(attr_at(mesh, 0.3, 0.1, 0, 0)), 0x030303);
	memcpy(texture->transform, (float[]){ 0, 1, 0, 1, 0, 0 }, sizeof texture->transform); /* 0.9, 0.4 */
	assert_int_equal(PSR_ATTR_BASE(attr_at(mesh, 0.3, 0.1, 0, 0)), 0x020202);
	memcpy(texture->transform, (float[]){ 1, 0, 0.3f, 0, 1, 0 }, sizeof texture->transform); /* 0.7, 0.9 */
	assert_int_equal(PSR_ATTR_BASE(attr_at(mesh, 0.3, 0.1, 0, 0)), 0x040404);
	texture->uv_set = 1; /* there is none: 0, 0, which is moved to 0.3, 0 */
	assert_int_equal(PSR_ATTR_BASE(attr_at(mesh, 0.3, 0.1, 0, 0)), 0x010101);
	meshes_free(mesh);
}

static void clear_neighbors_do_not_bleed(void **state)
{
	uint8_t rgba[16 * 16 * 4] = { 0 };
	struct psr_mesh *mesh = meshes_square(1);

	(void)state;
	for (int i = 0; i < 256; i++) { /* columns of solid 100 and of clear white */
		memset(rgba + 4 * i, i & 1 ? 255 : 100, 4);
		rgba[4 * i + 3] = i & 1 ? 0 : 255;
	}
	meshes_texture(mesh, 16, 16, rgba);
	mesh->material->alpha = PSR_ALPHA_MASK;
	for (double diameter = 0.001; diameter < 3; diameter *= 1.3)
		assert_int_equal(PSR_ATTR_BASE(attr_of(mesh, diameter)), 0x646464);
	mesh->material->alpha = PSR_ALPHA_OPAQUE; /* where glTF ignores it: half of each */
	assert_int_equal(PSR_ATTR_BASE(attr_of(mesh, 1)),
	                 psr_linear_to_srgb((1 + psr_srgb_to_linear[100]) / 2) * 0x10101u);
	meshes_free(mesh);
}

/* Angle between the normal of a word and a direction. */
static double angle_to(uint64_t attr, double x, double y, double z)
{
	const float *n = psr_direction_table()[PSR_ATTR_NORMAL(attr)];
	double d[3] = { x, y, z }, m[3] = { (double)n[0], (double)n[1], (double)n[2] };

	v3d_normalize(d, d);
	v3d_sub(d, d, m);
	return 2 * asin(v3d_length(d) / 2);
}

static struct psr_mesh *bumpy(int r, int g, int b)
{
	struct psr_mesh *mesh = one_texel(r, g, b, 255);

	mesh->material->normal_texture.image = 0;
	return mesh;
}

/* 128 is 1/255 and not 0. */
static void a_flat_normal_map_leaves_the_normal(void **state)
{
	struct psr_mesh *mesh = bumpy(128, 128, 255);

	(void)state;
	for (int i = 0; i < 3; i++) {
		assert_true(angle_to(attr_of(mesh, i * 0.5), 0, 0, 1) < NORMAL_ERROR + sqrt(2) / 255);
		assert_int_equal(attr_of(mesh, i * 0.5) & LOOK_BITS, material_word(mesh->material, &(struct material_values){
			.base = { 1, 1, 1 }, .roughness = 1, .occlusion = 1 }));
	}
	meshes_free(mesh);
}

static void remap_uv(struct psr_mesh *mesh, float a, float b, float c, float d)
{
	for (uint32_t i = 0; i < mesh->n_vertices; i++) {
		float u = mesh->uv[0][i][0], v = mesh->uv[0][i][1];

		mesh->uv[0][i][0] = a * u + b * v;
		mesh->uv[0][i][1] = c * u + d * v;
	}
}

/* Red leans to growing u, which is +x on the square, and green to falling v, which is +y: 218 is 0.71, as much as z. */
static void normal_maps_lean_along_the_texture(void **state)
{
	static const struct {
		float uv[4];
		double red[2], green[2];
	} layout[] = {
		{ { 1, 0, 0, 1 }, { 1, 0 }, { 0, 1 } },
		{ { -1, 0, 0, 1 }, { -1, 0 }, { 0, 1 } },   /* mirrored */
		{ { 1, 0, 0, -1 }, { 1, 0 }, { 0, -1 } },   /* mirrored the other way */
		{ { -3, 0, 0, -0.2f }, { -1, 0 }, { 0, -1 } },
		{ { 0, 1, 1, 0 }, { 0, -1 }, { -1, 0 } },   /* u and v exchanged, which mirrors, too */
		{ { 0, -1, 1, 0 }, { 0, 1 }, { -1, 0 } },   /* turned */
	};
	struct psr_mesh *red = bumpy(218, 128, 218), *green = bumpy(128, 218, 218);
	double off = NORMAL_ERROR + sqrt(2) / 255;

	(void)state;
	for (size_t i = 0; i < sizeof layout / sizeof layout[0]; i++) {
		const float *m = layout[i].uv;
		const double *r = layout[i].red, *g = layout[i].green;
		float undo = m[0] * m[3] - m[1] * m[2];

		remap_uv(red, m[0], m[1], m[2], m[3]);
		remap_uv(green, m[0], m[1], m[2], m[3]);
		assert_true(angle_to(attr_of(red, 0.1), r[0], r[1], 1) < off);
		assert_true(angle_to(attr_of(green, 0.1), g[0], g[1], 1) < off);
		remap_uv(red, m[3] / undo, -m[1] / undo, -m[2] / undo, m[0] / undo);
		remap_uv(green, m[3] / undo, -m[1] / undo, -m[2] / undo, m[0] / undo);
		/* The texture's own transform does the same. */
		memcpy(red->material->normal_texture.transform, (float[]){ m[0], m[1], 0, m[2], m[3], 0 }, 6 * sizeof *m);
		assert_true(angle_to(attr_of(red, 0.1), r[0], r[1], 1) < off);
		memcpy(red->material->normal_texture.transform, (float[]){ 1, 0, 0, 0, 1, 0 }, 6 * sizeof *m);
	}
	meshes_free(red);
	meshes_free(green);
}

static void given_tangents_go_first(void **state)
{
	struct psr_mesh *red = bumpy(218, 128, 218), *green = bumpy(128, 218, 218);
	float tangent[4][4];
	double off = NORMAL_ERROR + sqrt(2) / 255;

	(void)state;
	red->tangent = green->tangent = tangent;
	for (int side = -1; side <= 1; side += 2) {
		for (int i = 0; i < 4; i++)
			memcpy(tangent[i], (float[]){ 0, 1, 0, (float)side }, sizeof tangent[i]);
		assert_true(angle_to(attr_of(red, 0), 0, 1, 1) < off);
		assert_true(angle_to(attr_of(green, 0), -side, 0, 1) < off);
		/* Normals that point inwards are turned, and the texture stays where it is. */
		for (uint32_t i = 0; i < green->n_vertices; i++)
			green->normal[i][2] = -1;
		assert_true(angle_to(attr_of(green, 0), side, 0, 1) < off);
		for (uint32_t i = 0; i < green->n_vertices; i++)
			green->normal[i][2] = 1;
	}
	red->tangent = green->tangent = NULL;
	meshes_free(red);
	meshes_free(green);
}

static void a_bump_is_a_dent_from_behind(void **state)
{
	struct psr_mesh *mesh = bumpy(218, 128, 218);

	(void)state;
	mesh->material->two_sided = 1;
	assert_true(angle_to(attr_at(mesh, 0.2, 0.2, 0, 1), -1, 0, -1) < NORMAL_ERROR + sqrt(2) / 255);
	meshes_free(mesh);
}

static void the_normal_scale_stretches_the_slope(void **state)
{
	struct psr_mesh *mesh = bumpy(218, 128, 218);

	(void)state;
	mesh->material->normal_scale = 0.5f;
	assert_true(angle_to(attr_of(mesh, 0), 0.5, 0, 1) < NORMAL_ERROR + sqrt(2) / 255);
	mesh->material->normal_scale = 0;
	assert_true(angle_to(attr_of(mesh, 0), 0, 0, 1) < NORMAL_ERROR);
	meshes_free(mesh);
}

/* Texels that lean to +x and -x by turns. */
static struct psr_mesh *ribs(double *cosine)
{
	uint8_t rgba[32 * 32 * 4];
	struct psr_mesh *mesh = meshes_square(1);

	for (int i = 0; i < 32 * 32; i++)
		memcpy(rgba + 4 * i, (uint8_t[]){ i & 1 ? 155 : 100, 128, 252, 255 }, 4);
	meshes_texture(mesh, 32, 32, rgba);
	mesh->material->base_texture.image = -1;
	mesh->material->normal_texture.image = 0;
	mesh->material->roughness = 0.2f;
	/* x = +-55 / 255, y = 1 / 255, z = 249 / 255: cosine to the mean */
	*cosine = sqrt((1.0 + 249 * 249) / (55.0 * 55 + 1 + 249 * 249));
	return mesh;
}

static void unseen_bumps_widen_the_highlight(void **state)
{
	double cosine;
	struct psr_mesh *mesh = ribs(&cosine);

	(void)state;
	for (int i = 0; i < 2; i++) {
		/* A scale of one half makes a quarter of the variance. The 16 bits of the mean move its length by 3e-5 at most,
		 * and the fourth power of roughness by twice that, here 1e-4 / (4 roughness^3) < 0.01 of roughness: 2 codes. */
		const double spread = (1 - cosine) / cosine / (i == 0 ? 1 : 4), widened = material_widened(0.2, spread);
		const uint64_t attr = attr_of(mesh, 1);

		assert_true(6e-5 / (4 * widened * widened * widened) < 0.01 && widened > 0.3);
		assert_true(fabs((double)PSR_ATTR_ROUGHNESS(attr) - 255 * widened) < 0.01 * 255);
		assert_true(angle_to(attr, 0, 0, 1) < NORMAL_ERROR + sqrt(2) / 255);
		mesh->material->normal_scale = 0.5f;
	}
	meshes_free(mesh);
}

static void bumps_that_are_seen_leave_it_sharp(void **state)
{
	double cosine;
	struct psr_mesh *mesh = ribs(&cosine);

	(void)state;
	assert_int_equal(PSR_ATTR_ROUGHNESS(attr_of(mesh, 0)), 51);
	assert_int_equal(PSR_ATTR_ROUGHNESS(attr_of(mesh, 1e-5)), 51);
	meshes_free(mesh);
}

static void points_have_colors_and_normals_of_their_own(void **state)
{
	double point[2][3] = { { 0, 0, 0 }, { 1, 0, 0 } };
	float normal[2][3] = { { 0, 0, 1 }, { 0.6f, 0, 0.8f } }, radius[2] = { 1, 1 };
	float color[2][4] = { { 1, 1, 1, 1 }, { 0.5f, 0.25f, 1, 1 } };
	uint32_t material[2] = { 0, 0 };
	struct psr_mesh *mesh = one_texel(9, 9, 9, 255);
	struct surface_place place = { .prim = mesh->n_triangles + 1 };
	const float down[3] = { 0, 0, -1 };
	struct surface surface;
	struct material_values values;

	(void)state;
	mesh->n_points = 2;
	mesh->point = point;
	mesh->point_normal = normal;
	mesh->point_radius = radius;
	mesh->point_material = material;
	mesh->material->base_color[0] = 0.5f;
	mesh->material->base_texture.image = 0; /* not of points */
	assert_int_equal(surface_init(&surface, mesh, 1), PSR_OK);
	values = values_of(mesh);
	assert_true((surface_attr(&surface, &place, 1, up) & LOOK_BITS) == material_word(mesh->material, &values));
	mesh->point_color = color;
	for (int c = 0; c < 3; c++)
		values.base[c] *= color[1][c];
	assert_true((surface_attr(&surface, &place, 1, up) & LOOK_BITS) == material_word(mesh->material, &values));
	assert_true(angle_to(surface_attr(&surface, &place, 1, up), 0.6, 0, 0.8) < NORMAL_ERROR);
	place.is_back = 1;
	assert_true(angle_to(surface_attr(&surface, &place, 1, down), -0.6, 0, -0.8) < NORMAL_ERROR);
	surface_fini(&surface);
	mesh->n_points = 0;
	meshes_free(mesh);
}

/* Triangles with no area or no uv, seen from anywhere: always a word that faces its view. */
static void every_sample_faces_its_view(void **state)
{
	const float (*table)[3] = psr_direction_table();
	uint64_t seed = 11;
	double cosine;

	(void)state;
	for (int i = 0; i < 2000; i++) {
		struct psr_mesh *mesh = ribs(&cosine);
		const struct surface_place place = { .prim = 0,
			                                 .u = 0.5 * meshes_random(&seed),
			                                 .v = 0.5 * meshes_random(&seed) };
		const float *facing = table[(size_t)(meshes_random(&seed) * PSR_DIRECTIONS)];
		struct surface surface;
		uint64_t attr;

		for (uint32_t k = 0; k < 3; k++) {
			uint32_t vertex = mesh->triangle[0][k];

			for (int c = 0; c < 3; c++)
				mesh->position[vertex][c] = floor(3 * meshes_random(&seed));
			for (int c = 0; c < 2; c++)
				mesh->uv[0][vertex][c] = (float)floor(3 * meshes_random(&seed));
		}
		assert_int_equal(surface_init(&surface, mesh, 1), PSR_OK);
		attr = surface_attr(&surface, &place, 0.2, facing);
		assert_true(v3f_dot(table[PSR_ATTR_NORMAL(attr)], facing) > 0);
		surface_fini(&surface);
		meshes_free(mesh);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(base_textures_are_coded),
		cmocka_unit_test(far_textures_are_their_linear_mean),
		cmocka_unit_test(the_circle_counts_in_inner_units),
		cmocka_unit_test(roughness_is_green_and_metal_is_blue),
		cmocka_unit_test(specular_glossiness_is_coded_color_and_linear_alpha),
		cmocka_unit_test(emission_and_occlusion_have_their_textures),
		cmocka_unit_test(unlit_materials_have_their_base_color_alone),
		cmocka_unit_test(uv_sets_and_transforms_choose_the_place),
		cmocka_unit_test(clear_neighbors_do_not_bleed),
		cmocka_unit_test(a_flat_normal_map_leaves_the_normal),
		cmocka_unit_test(normal_maps_lean_along_the_texture),
		cmocka_unit_test(given_tangents_go_first),
		cmocka_unit_test(a_bump_is_a_dent_from_behind),
		cmocka_unit_test(the_normal_scale_stretches_the_slope),
		cmocka_unit_test(unseen_bumps_widen_the_highlight),
		cmocka_unit_test(bumps_that_are_seen_leave_it_sharp),
		cmocka_unit_test(points_have_colors_and_normals_of_their_own),
		cmocka_unit_test(every_sample_faces_its_view),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

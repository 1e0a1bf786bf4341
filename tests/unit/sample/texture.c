#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/srgb.h"
#include "surface/texture.h"
#include "meshes.h"

/* Half an ulp for each of the four products and sums of numbers up to 1. */
#define EPSILON 1e-6f

/* 2x1 texels: black and white; the square's lower left triangle is primitive 0. */
static struct psr_mesh *two_texels(enum psr_wrap wrap)
{
	static const uint8_t texels[] = { 0, 0, 0, 255, 255, 255, 255, 255 };
	struct psr_mesh *mesh = meshes_square(1);

	meshes_texture(mesh, 2, 1, texels);
	mesh->material->base_texture.wrap_s = wrap;
	mesh->material->base_texture.wrap_t = wrap;
	return mesh;
}

/* The colour where the texture's s has this value. */
static float look_up(struct psr_mesh *mesh, float s)
{
	float rgba[4];

	for (uint32_t i = 0; i < mesh->n_vertices; i++)
		mesh->uv[0][i][0] = s;
	texture_base_color(mesh, 0, 0.25, 0.25, rgba);
	return rgba[0];
}

static void texels_blend_in_linear_light(void **state)
{
	struct psr_mesh *mesh = two_texels(PSR_WRAP_CLAMP);

	(void)state;
	assert_float_equal(look_up(mesh, 0.25f), 0, EPSILON);
	assert_float_equal(look_up(mesh, 0.5f), 0.5, EPSILON);
	assert_float_equal(look_up(mesh, 0.75f), 1, EPSILON);
	meshes_free(mesh);
}

static void wrap_modes_differ_at_the_border(void **state)
{
	struct psr_mesh *mesh = two_texels(PSR_WRAP_CLAMP);

	(void)state;
	assert_float_equal(look_up(mesh, 0), 0, EPSILON);
	assert_float_equal(look_up(mesh, 7), 1, EPSILON);
	mesh->material->base_texture.wrap_s = PSR_WRAP_REPEAT;
	assert_float_equal(look_up(mesh, 0), 0.5, EPSILON);
	assert_float_equal(look_up(mesh, -0.25f), 1, EPSILON);
	assert_float_equal(look_up(mesh, 3.25f), 0, EPSILON);
	mesh->material->base_texture.wrap_s = PSR_WRAP_MIRROR;
	assert_float_equal(look_up(mesh, 1.25f), 1, EPSILON);
	assert_float_equal(look_up(mesh, 1.75f), 0, EPSILON);
	assert_float_equal(look_up(mesh, -0.75f), 1, EPSILON);
	meshes_free(mesh);
}

static void coordinates_without_a_fraction_stay_inside(void **state)
{
	static const float wild[] = { 1e10f, -1e10f, 1e38f, -1e38f, 16777217.0f };
	static const enum psr_wrap wraps[] = { PSR_WRAP_CLAMP, PSR_WRAP_REPEAT, PSR_WRAP_MIRROR };

	(void)state;
	for (size_t w = 0; w < 3; w++) {
		struct psr_mesh *mesh = two_texels(wraps[w]);

		for (size_t i = 0; i < sizeof wild / sizeof wild[0]; i++) {
			float value = look_up(mesh, wild[i]);

			assert_true(value >= 0 && value <= 1);
		}
		assert_float_equal(look_up(mesh, NAN), 1, EPSILON); /* no texture, but the factor */
		assert_float_equal(look_up(mesh, INFINITY), 1, EPSILON);
		meshes_free(mesh);
	}
}

static void v_grows_downwards(void **state)
{
	static const uint8_t texels[] = { 255, 0, 0, 255, 0, 0, 255, 255 }; /* red above blue */
	struct psr_mesh *mesh = meshes_square(1);
	float rgba[4];

	(void)state;
	meshes_texture(mesh, 1, 2, texels);
	mesh->material->base_texture.wrap_s = mesh->material->base_texture.wrap_t = PSR_WRAP_CLAMP;
	texture_base_color(mesh, 1, 0, 1, rgba); /* the square's upper left corner */
	assert_float_equal(rgba[0], 1, EPSILON);
	texture_base_color(mesh, 0, 0, 0, rgba); /* lower left */
	assert_float_equal(rgba[2], 1, EPSILON);
	meshes_free(mesh);
}

static void factor_and_vertex_color_multiply(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);
	float rgba[4];

	(void)state;
	mesh->color = calloc(mesh->n_vertices, sizeof *mesh->color);
	for (uint32_t i = 0; i < mesh->n_vertices; i++)
		for (int c = 0; c < 4; c++)
			mesh->color[i][c] = i == 0 ? 1.0f : 0.5f;
	mesh->material->base_color[1] = 0.25f;
	texture_base_color(mesh, 0, 0.5, 0.5, rgba);
	assert_float_equal(rgba[0], 0.5, EPSILON);
	assert_float_equal(rgba[1], 0.125, EPSILON);
	texture_base_color(mesh, 0, 0, 0, rgba);
	assert_float_equal(rgba[0], 1, EPSILON);
	meshes_free(mesh);
}

static void mask_and_blend_have_their_own_cutoffs(void **state)
{
	struct psr_mesh *mesh = meshes_square(1);

	(void)state;
	mesh->material->base_color[3] = 0.4f;
	assert_false(texture_is_absent(mesh, 0, 0.2, 0.2));
	mesh->material->alpha = PSR_ALPHA_BLEND;
	assert_true(texture_is_absent(mesh, 0, 0.2, 0.2));
	mesh->material->alpha = PSR_ALPHA_MASK;
	mesh->material->alpha_cutoff = 0.4f;
	assert_false(texture_is_absent(mesh, 0, 0.2, 0.2));
	mesh->material->alpha_cutoff = 0.41f;
	assert_true(texture_is_absent(mesh, 0, 0.2, 0.2));
	meshes_free(mesh);
}

static void points_have_alpha_of_their_own(void **state)
{
	float color[2][4] = { { 1, 1, 1, 0.8f }, { 1, 1, 1, 0.4f } };
	uint32_t material[2] = { 0, 0 };
	struct psr_mesh *mesh = two_texels(PSR_WRAP_CLAMP);

	(void)state;
	mesh->n_points = 2;
	mesh->point_color = color;
	mesh->point_material = material;
	mesh->material->alpha = PSR_ALPHA_BLEND;
	assert_false(texture_is_absent(mesh, mesh->n_triangles, 0, 0));
	assert_true(texture_is_absent(mesh, mesh->n_triangles + 1, 0, 0));
	meshes_free(mesh);
}

static void masks_cut_where_the_texture_crosses_the_cutoff(void **state)
{
	static const uint8_t texels[] = { 9, 9, 9, 0, 9, 9, 9, 255 };
	struct psr_mesh *mesh = meshes_square(1);

	(void)state;
	meshes_texture(mesh, 2, 1, texels);
	mesh->material->base_texture.wrap_s = PSR_WRAP_CLAMP;
	mesh->material->alpha = PSR_ALPHA_MASK;
	for (int i = 0; i < 3; i++) {
		double cut = 0.2 + 0.3 * i, s = 0.25 + 0.5 * cut; /* from texel centre to texel centre */

		mesh->material->alpha_cutoff = (float)cut;
		assert_true(texture_is_absent(mesh, 0, s - 1e-4, 0));
		assert_false(texture_is_absent(mesh, 0, s + 1e-4, 0));
	}
	meshes_free(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(texels_blend_in_linear_light),
		cmocka_unit_test(wrap_modes_differ_at_the_border),
		cmocka_unit_test(coordinates_without_a_fraction_stay_inside),
		cmocka_unit_test(v_grows_downwards),
		cmocka_unit_test(factor_and_vertex_color_multiply),
		cmocka_unit_test(mask_and_blend_have_their_own_cutoffs),
		cmocka_unit_test(points_have_alpha_of_their_own),
		cmocka_unit_test(masks_cut_where_the_texture_crosses_the_cutoff),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

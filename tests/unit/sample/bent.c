/* Shading normals far from those of their faces: normal maps, and smoothed normals of wide faces. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/srgb.h"
#include "base/direction.h"
#include "render/stages.h"
#include "surface/lobe.h"
#include "model.h"

#define SIDE 64
#define DEGREE 0.017453292519943295

static const float half_grey = 0.5f;
static unsigned cull_tests = PSR_CULL_ALL;

/* The square whose normal map tilts all of it towards +x. */
static struct psr_mesh *tilted_square(double degrees, int is_two_sided)
{
	struct psr_mesh *mesh = meshes_square(1);
	const uint8_t texel[4] = { (uint8_t)lrint((sin(degrees * DEGREE) + 1) * 127.5), 128,
		                       (uint8_t)lrint((cos(degrees * DEGREE) + 1) * 127.5), 255 };

	meshes_texture(mesh, 1, 1, texel);
	mesh->material->base_texture.image = -1;
	mesh->material->normal_texture.image = 0;
	mesh->material->two_sided = is_two_sided;
	for (int c = 0; c < 3; c++)
		mesh->material->base_color[c] = half_grey;
	return mesh;
}

struct view {
	double eye[3], to_light[3];
	int has_shadow;
};

/* Orthographic, of what is within 0.9 of the origin across. Returns how many pixels are covered. */
static int draw(const struct psr_model *model, const struct view *view, uint8_t rgb[3 * SIDE * SIDE],
                float depth[SIDE * SIDE])
{
	const struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_light light = { .color = { 1, 1, 1 }, .casts_shadow = view->has_shadow };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1 };
	struct psr_frame frame = { .width = SIDE, .height = SIDE, .rgb = rgb, .depth = depth };
	struct psr_renderer *renderer;
	struct render_settings settings;
	int n = 0;

	scene.camera = (struct psr_camera){ .kind = PSR_CAMERA_ORTHOGRAPHIC, .ortho_height = 1.8, .up = { 0, 1, 0 } };
	memcpy(scene.camera.eye, view->eye, sizeof view->eye);
	v3d_scale(light.direction, view->to_light, -1);
	render_settings_default(&settings, SIDE, SIDE);
	settings.cull_tests = cull_tests;
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(renderer_draw(renderer, &scene, &settings, NULL, &frame, NULL), PSR_OK);
	psr_renderer_destroy(renderer);
	for (int i = 0; i < SIDE * SIDE; i++)
		n += depth[i] < INFINITY;
	return n;
}

/* What a rough dielectric shows whose normal is tilted so far from +z towards +x. */
static double expected_light(const struct view *view, double degrees)
{
	const struct look look = { .base = { half_grey, half_grey, half_grey }, .reflectance = (float)MATERIAL_DIELECTRIC,
		                       .roughness = 1, .open = 1 };
	const double normal[3] = { sin(degrees * DEGREE), 0, cos(degrees * DEGREE) };
	double to_eye[3], light[3];

	v3d_normalize(to_eye, view->eye);
	lobe_reflect(light, &look, normal, view->to_light, to_eye);
	return light[0];
}

/* Stored normals are off by 1.27 degrees at most (base/direction.h) and the map's texels by half a step of 1/127.5 in
 * each of three components, 0.39 degrees: 0.029 radians, of which light changes by as much times at most 0.5: 0.48 are
 * scattered, the rest is mirrored by a rough lobe. The albedo is coded in 8 bits, and so is the picture: half a code at
 * 188 of 255 is 0.0022 each, as linear light grows by 0.0045 a code there. */
#define TOLERANCE (0.5 * 0.029 + 2 * 0.0023)

static void assert_lit(const struct psr_mesh *mesh, const struct view *view, double expected)
{
	struct psr_model *model = model_build(mesh, SIDE);
	static uint8_t rgb[3 * SIDE * SIDE];
	static float depth[SIDE * SIDE];

	assert_int_equal(draw(model, view, rgb, depth), SIDE * SIDE);
	for (int i = 0; i < 3 * SIDE * SIDE; i++)
		assert_float_equal(psr_srgb_to_linear[rgb[i]], expected, TOLERANCE);
	psr_model_unref(model);
}

static void normal_maps_tilt_as_far_as_they_say(void **state)
{
	static const double tilt[] = { 0, 15, 35, 60 };
	const struct view view = { { 0, 0, 4 }, { sin(60 * DEGREE), 0, cos(60 * DEGREE) }, 0 };

	(void)state;
	for (size_t i = 0; i < sizeof tilt / sizeof *tilt; i++) {
		struct psr_mesh *mesh = tilted_square(tilt[i], 0);

		assert_lit(mesh, &view, expected_light(&view, tilt[i]));
		meshes_free(mesh);
	}
}

/* Its normals face away from an eye on the left, by which it was drawn or left out, and turned to that eye. */
static void steep_normals_neither_hide_nor_turn_a_face(void **state)
{
	const struct view left = { { -4 * sin(80 * DEGREE), 0, 4 * cos(80 * DEGREE) }, { 1, 0, 0 }, 0 };
	struct psr_mesh *mesh[2] = { tilted_square(60, 0), tilted_square(60, 1) };
	struct psr_model *model[2] = { model_build(mesh[0], SIDE), model_build(mesh[1], SIDE) };
	static uint8_t rgb[2][3 * SIDE * SIDE];
	static float depth[SIDE * SIDE];
	/* Two units wide, foreshortened; a pixel at each side may be drawn or not, and as samples are over a pixel apart,
	 * a cell of two pixels beyond. */
	const int across = (int)(2 * cos(80 * DEGREE) / (1.8 / SIDE));

	(void)state;
	for (int i = 0; i < 2; i++) {
		int n = draw(model[i], &left, rgb[i], depth);

		assert_in_range(n, (across - 1) * SIDE, (across + 2 + 4) * SIDE);
		for (int k = 0; k < SIDE * SIDE; k++)
			if (abs(k % SIDE - SIDE / 2) < across / 2 - 1)
				assert_float_equal(psr_srgb_to_linear[rgb[i][3 * k]], expected_light(&left, 60), TOLERANCE);
		psr_model_unref(model[i]);
		meshes_free(mesh[i]);
	}
}

static void a_back_is_lit_by_the_normal_turned(void **state)
{
	const struct view behind = { { 0, 0, -4 }, { -1, 0, 0 }, 0 };
	struct psr_mesh *mesh = tilted_square(60, 1);

	(void)state;
	assert_lit(mesh, &behind, expected_light(&behind, 60 + 180)); /* turned to the eye */
	meshes_free(mesh);
}

static void a_steep_normal_casts_no_shadow_on_its_own_face(void **state)
{
	static const double to_light[] = { -40, 0, 60, 80 };
	struct psr_mesh *mesh = tilted_square(45, 0);

	(void)state;
	for (size_t i = 0; i < sizeof to_light / sizeof *to_light; i++) {
		const double a = to_light[i] * DEGREE;
		const struct view view = { { 0, 0, 4 }, { sin(a), 0, cos(a) }, 1 };

		assert_lit(mesh, &view, expected_light(&view, 45));
	}
	meshes_free(mesh);
}

static void light_from_behind_does_not_reach_a_steep_normal(void **state)
{
	const struct view view = { { 0, 0, 4 }, { sin(100 * DEGREE), 0, cos(100 * DEGREE) }, 1 };
	struct psr_mesh *mesh = tilted_square(45, 0);

	(void)state;
	assert_lit(mesh, &view, 0);
	meshes_free(mesh);
}

/* A sphere of wide faces, whose normals are smooth: at its rim they face away where the faces do not. */
static void cones_off_change_no_bit_of_bent_blocks(void **state)
{
	const double center[3] = { 0, 0, 0 };
	struct psr_mesh *mesh = meshes_sphere(4, center, 1);
	struct psr_model *model = model_build(mesh, SIDE);
	const struct psr_blocks *b = psr_model_blocks(model);
	static uint8_t rgb[2][3 * SIDE * SIDE];
	static float depth[2][SIDE * SIDE];

	(void)state;
	assert_non_null(b->traits);
	for (int i = 0; i < 2; i++) {
		const struct view view = { { 1, 2, 3 }, { 0, 0, 1 }, 0 };

		cull_tests = i == 0 ? PSR_CULL_ALL : PSR_CULL_MASKS | PSR_CULL_OCCLUSION;
		draw(model, &view, rgb[i], depth[i]);
	}
	cull_tests = PSR_CULL_ALL;
	assert_memory_equal(rgb[0], rgb[1], sizeof rgb[0]);
	assert_memory_equal(depth[0], depth[1], sizeof depth[0]);
	psr_model_unref(model);
	meshes_free(mesh);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(normal_maps_tilt_as_far_as_they_say),
		cmocka_unit_test(steep_normals_neither_hide_nor_turn_a_face),
		cmocka_unit_test(a_back_is_lit_by_the_normal_turned),
		cmocka_unit_test(a_steep_normal_casts_no_shadow_on_its_own_face),
		cmocka_unit_test(light_from_behind_does_not_reach_a_steep_normal),
		cmocka_unit_test(cones_off_change_no_bit_of_bent_blocks),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

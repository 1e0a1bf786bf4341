/* Shading normals far from those of their faces: normal maps, and smoothed normals of wide faces. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/srgb.h"
#include "psr/direction.h"
#include "psr/render.h"
#include "sample_model.h"

#define SIDE 64
#define DEGREE 0.017453292519943295

static const float half_grey = 0.5f;

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
	mesh->material->is_specular_glossiness = 1; /* of which there is nothing specular */
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
	struct psr_settings settings;
	int n = 0;

	scene.camera = (struct psr_camera){ .kind = PSR_CAMERA_ORTHOGRAPHIC, .ortho_height = 1.8, .up = { 0, 1, 0 } };
	memcpy(scene.camera.eye, view->eye, sizeof view->eye);
	v3d_scale(light.direction, view->to_light, -1);
	psr_settings_default(&settings, SIDE, SIDE);
	assert_int_equal(psr_renderer_create(&renderer), PSR_OK);
	assert_int_equal(psr_render(renderer, &scene, &settings, NULL, &frame, NULL), PSR_OK);
	psr_renderer_destroy(renderer);
	for (int i = 0; i < SIDE * SIDE; i++)
		n += depth[i] < INFINITY;
	return n;
}

/* Stored normals are off by 1.27 degrees at most (psr/direction.h) and the map's texels by half a step of 1/127.5 in
 * each of three components, 0.39 degrees: 0.029 radians, of which light changes by as much times at most the albedo.
 * The albedo is coded in 8 bits, and so is the picture: half a code at 188 of 255 is 0.0022 each, as linear light grows
 * by 0.0045 a code there. */
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

		assert_lit(mesh, &view, 0.5 * cos((60 - tilt[i]) * DEGREE));
		meshes_free(mesh);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(normal_maps_tilt_as_far_as_they_say),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

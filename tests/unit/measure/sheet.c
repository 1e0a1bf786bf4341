/* Layers of glass have no holes. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "psr/build.h"
#include "psr/render.h"

#define N 24    /* squares a side of the sheet */
#define SIDE 400

/* A sheet with a bump, which lets half of the light through. */
static struct psr_model *make_sheet(void)
{
	static double position[(N + 1) * (N + 1)][3];
	static uint32_t triangle[2 * N * N][3];
	struct psr_build_options options;
	struct psr_model *model;
	struct psr_mesh *mesh;
	uint32_t n = 0;

	for (uint32_t v = 0; v < (N + 1) * (N + 1); v++) {
		const double x = v % (N + 1) * (2.0 / N) - 1, y = v / (N + 1) * (2.0 / N) - 1;

		v3d_set(position[v], x, y, 0.6 * exp(-1.5 * (x * x + y * y)));
		if (v % (N + 1) == N || v / (N + 1) == N)
			continue;
		memcpy(triangle[n++], (uint32_t[]){ v, v + 1, v + N + 2 }, sizeof *triangle);
		memcpy(triangle[n++], (uint32_t[]){ v, v + N + 2, v + N + 1 }, sizeof *triangle);
	}
	assert_int_equal(psr_mesh_create(&mesh, (const double (*)[3])position, (N + 1) * (N + 1),
	                                 (const uint32_t (*)[3])triangle, n, NULL), PSR_OK);
	mesh->material[0].base_color[3] = 0.5f;
	mesh->material[0].alpha = PSR_ALPHA_BLEND;
	mesh->material[0].two_sided = 1;
	psr_build_options_default(&options);
	options.resolution = 400;
	assert_int_equal(psr_model_build(&model, mesh, &options, NULL, NULL), PSR_OK);
	psr_mesh_destroy(mesh);
	return model;
}

/* Pixels that are darker than half of what is around them, on all sides: light is even and the background black. */
static size_t count_holes(const struct psr_frame *frame, size_t *n_inside)
{
	size_t n = 0;

	for (int y = 1; y < SIDE - 1; y++)
		for (int x = 1; x < SIDE - 1; x++) {
			const uint8_t *at = frame->rgb + 3 * (y * SIDE + x);
			const int left = at[-3], right = at[3], above = at[-3 * SIDE], below = at[3 * SIDE];

			if (left < 40 || right < 40 || above < 40 || below < 40)
				continue;
			++*n_inside;
			n += at[0] < 0.5 * left && at[0] < 0.5 * right && at[0] < 0.5 * above && at[0] < 0.5 * below;
		}
	return n;
}

static void no_pixel_of_a_sheet_is_left_out(void **state)
{
	struct psr_model *model = make_sheet();
	struct psr_instance instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .ambient = { 1, 1, 1 } };
	struct psr_renderer *renderer;
	struct psr_settings settings;
	struct psr_frame frame;
	size_t n_inside = 0;

	(void)state;
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(psr_frame_alloc(&frame, SIDE, SIDE, 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH, NULL), PSR_OK);
	psr_settings_default(&settings, SIDE, SIDE);
	scene.camera = (struct psr_camera){ .up = { 0, 1, 0 }, .kind = PSR_CAMERA_PERSPECTIVE, .fov_y = 0.6 };
	for (int view = 0; view < 12; view++) {
		const double around = 0.5236 * view, above = 0.3 + 0.09 * view;

		v3d_set(scene.camera.eye, 5 * cos(above) * sin(around), 5 * sin(above), 5 * cos(above) * cos(around));
		assert_int_equal(psr_render(renderer, &scene, &settings, NULL, &frame, NULL), PSR_OK);
		assert_int_equal(count_holes(&frame, &n_inside), 0);
	}
	assert_true(n_inside > 100000);
	psr_frame_free(&frame);
	psr_renderer_destroy(renderer);
	psr_model_unref(model);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(no_pixel_of_a_sheet_is_left_out),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

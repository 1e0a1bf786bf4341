/* Settings that no client can choose: the switches of studies and measurements. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include "render/stages.h"
#include "tests/unit/lib/shapes.h"

#define SIDE 160
#define PIXELS (SIDE * SIDE)
#define PLANES (1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_BLOCK | 1u << PSR_PLANE_WEIGHT)

struct stage {
	struct psr_model *model;
	struct psr_instance instance;
	struct psr_light light;
	struct psr_scene scene;
	struct psr_renderer *renderer;
	struct psr_frame frame;
};

/* A sphere whose samples are `magnification` pixels apart. */
static int stage_make(struct stage *s, uint32_t resolution, double magnification)
{
	const struct shape_options options = { .resolution = resolution, .diffuse = 0xc0c0c0, .scale = 1 };

	memset(s, 0, sizeof *s);
	s->model = shape_build(&options, 0.9);
	s->instance = (struct psr_instance){ .model = s->model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	s->light = (struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { 1, -1, -1 }, .color = { 1, 1, 1 } };
	s->scene = (struct psr_scene){ .instance = &s->instance, .n_instances = 1, .light = &s->light, .n_lights = 1,
		                           .ambient = { 0.2, 0.2, 0.2 }, .background = { 1, 0, 0 } };
	s->scene.camera = (struct psr_camera){ .kind = PSR_CAMERA_ORTHOGRAPHIC, .eye = { 0, 0, 4 }, .up = { 0, 1, 0 } };
	s->scene.camera.ortho_height = psr_model_info(s->model)->spacing * SIDE / magnification;
	if (psr_renderer_create(&s->renderer, NULL) != PSR_OK)
		return PSR_ERR_MEMORY;
	return psr_frame_alloc(&s->frame, SIDE, SIDE, PLANES, NULL);
}

static void stage_fini(struct stage *s)
{
	psr_frame_free(&s->frame);
	psr_renderer_destroy(s->renderer);
	psr_model_unref(s->model);
}

static void draw(struct stage *s, const struct render_settings *settings)
{
	struct psr_error err;

	if (renderer_draw(s->renderer, &s->scene, settings, NULL, &s->frame, &err) != PSR_OK)
		fail_msg("%s", err.text);
}

static void the_door_refuses_what_is_out_of_range(void **state)
{
	struct render_settings settings;
	struct psr_error err;
	struct stage s;

	(void)state;
	assert_int_equal(stage_make(&s, 64, 1), PSR_OK);
	for (int i = 0; i < 4; i++) {
		render_settings_default(&settings, SIDE, SIDE);
		settings.cell_bias = i == 0 ? -5 : i == 1 ? 5 : 0;
		settings.shadow_side = i == 2 ? 63 : i == 3 ? PSR_MAX_SHADOW_SIDE + 1 : 64;
		assert_int_equal(renderer_draw(s.renderer, &s.scene, &settings, NULL, &s.frame, &err), PSR_ERR_ARG);
		assert_non_null(strstr(err.text, i < 2 ? "cells" : "shadow maps"));
	}
	stage_fini(&s);
}

static void a_bias_moves_depth_buffers_and_no_sample(void **state)
{
	struct render_settings settings;
	struct stage s;

	(void)state;
	assert_int_equal(stage_make(&s, 64, 0.9 * 4), PSR_OK);
	render_settings_default(&settings, SIDE, SIDE);
	draw(&s, &settings);
	const uint64_t n_inside = s.frame.report.count[PSR_STAGE_WARP];
	for (settings.cell_bias = -1; settings.cell_bias <= 1; settings.cell_bias++) {
		int n = 0;

		draw(&s, &settings);
		assert_int_equal(s.frame.report.count[PSR_STAGE_WARP], n_inside);
		for (int i = 0; i < PIXELS; i++) {
			if (s.frame.block[3 * i] == 255)
				continue;
			assert_int_equal(s.frame.block[3 * i + 1], 2 + settings.cell_bias);
			n++;
		}
		assert_true(n > 0);
	}
	stage_fini(&s);
}

static void without_fill_gaps_show_the_background_and_other_pixels_stay(void **state)
{
	struct render_settings settings;
	struct stage s;
	uint8_t *filled = malloc(3 * PIXELS);
	int n_gaps = 0, n_whole = 0;

	(void)state;
	assert_int_equal(stage_make(&s, 64, 2), PSR_OK);
	render_settings_default(&settings, SIDE, SIDE);
	draw(&s, &settings);
	memcpy(filled, s.frame.rgb, 3 * PIXELS);
	assert_int_equal(s.frame.report.effect[PSR_EFFECT_FILL].why, PSR_WHY_RAN);
	settings.no_fill = 1;
	draw(&s, &settings);
	assert_int_equal(s.frame.report.effect[PSR_EFFECT_FILL].why, PSR_WHY_OFF);
	assert_int_equal(s.frame.report.n_filled, 0);
	for (int i = 0; i < PIXELS; i++) {
		const uint8_t *rgb = s.frame.rgb + 3 * i, background[3] = { 255, 0, 0 };

		if (s.frame.weight[i] == 0) {
			assert_memory_equal(rgb, background, 3);
			n_gaps += memcmp(rgb, filled + 3 * i, 3) != 0;
		} else if (s.frame.weight[i] == 255) {
			assert_memory_equal(rgb, filled + 3 * i, 3);
			n_whole++;
		}
	}
	assert_true(n_gaps > 0 && n_whole > 0);
	free(filled);
	stage_fini(&s);
}

static uint64_t bytes_with_shadows_of(uint32_t side)
{
	struct render_settings settings;
	struct stage s;

	assert_int_equal(stage_make(&s, 256, 1), PSR_OK);
	s.light.casts_shadow = 1;
	render_settings_default(&settings, SIDE, SIDE);
	settings.shadow_side = side;
	draw(&s, &settings);
	assert_int_equal(s.frame.report.n_shadow_maps_drawn, 1);
	const uint64_t n_bytes = psr_renderer_bytes(s.renderer);
	stage_fini(&s);
	return n_bytes;
}

static void a_shadow_map_has_at_most_the_side_of_the_settings(void **state)
{
	(void)state;
	/* A texel has two bytes; the map is square, and has as many as the picture unless it may not. */
	const uint64_t whole = bytes_with_shadows_of(SIDE), less = bytes_with_shadows_of(64);
	assert_true(whole >= less + 2 * (SIDE * SIDE - 64 * 64));
	assert_int_equal(bytes_with_shadows_of(PSR_MAX_SHADOW_SIDE), whole);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_door_refuses_what_is_out_of_range),
		cmocka_unit_test(a_bias_moves_depth_buffers_and_no_sample),
		cmocka_unit_test(without_fill_gaps_show_the_background_and_other_pixels_stay),
		cmocka_unit_test(a_shadow_map_has_at_most_the_side_of_the_settings),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

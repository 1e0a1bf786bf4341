/* Fine pictures: smooth ones of twice the size, averaged. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/srgb.h"
#include "render/render.h"
#include "tests/unit/lib/threads.h"

#define PLANES (1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH)

static struct psr_model *teapot, *knot; /* blocks; an octree */
static struct psr_instance instance;
static struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .direction = { -1, -2, -3 }, .color = { 1, 0.9, 0.8 } };

static int open_model(void **state)
{
	(void)state;
	return psr_model_read(&teapot, "tests/golden/teapot.psr", NULL)
	       || psr_model_read(&knot, "tests/golden/knot.psr", NULL);
}

static int close_model(void **state)
{
	(void)state;
	psr_model_unref(teapot);
	psr_model_unref(knot);
	return 0;
}

/* Draws octrees as splats, which are never too coarse for a fine picture. */
static void draw_model(struct psr_frame *frame, struct psr_model *model, uint32_t width, uint32_t height,
                       enum psr_smooth smooth, struct psr_pool *pool)
{
	const struct psr_model_info *info = psr_model_info(model);
	struct psr_scene scene = { .instance = &instance, .n_instances = 1, .light = &light, .n_lights = 1,
		                       .ambient = { 0.1, 0.1, 0.1 }, .background = { 0.01, 0.02, 0.03 } };
	struct psr_settings settings;
	struct psr_renderer *renderer;

	instance = (struct psr_instance){ .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	psr_camera_frame(&scene.camera, info->box_min, info->box_max, info->up, 0.6, (double)width / height);
	psr_settings_default(&settings, width, height);
	settings.smooth = smooth;
	settings.with_splats = 1;
	assert_int_equal(psr_frame_alloc(frame, width, height, PLANES, NULL), PSR_OK);
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(psr_render(renderer, &scene, &settings, pool, frame, NULL), PSR_OK);
	psr_renderer_destroy(renderer);
}

static void draw(struct psr_frame *frame, uint32_t width, uint32_t height, enum psr_smooth smooth, struct psr_pool *pool)
{
	draw_model(frame, teapot, width, height, smooth, pool);
}

/* The code whose light is nearest to the mean of four, with light in steps of 2^-16. */
static uint8_t mean(const struct psr_frame *twice, uint32_t x, uint32_t y, int c)
{
	uint32_t sum = 0;

	for (uint32_t j = 0; j < 2; j++)
		for (uint32_t i = 0; i < 2; i++) {
			const uint8_t code = twice->rgb[3 * ((size_t)(2 * y + j) * twice->width + 2 * x + i) + (size_t)c];

			sum += (uint32_t)lround((double)psr_srgb_to_linear[code] * 65535);
		}
	return psr_srgb_of_16_bits()[(sum + 2) / 4];
}

static float nearest(const struct psr_frame *twice, uint32_t x, uint32_t y)
{
	const float *top = twice->depth + 2 * (size_t)y * twice->width + 2 * x, *bottom = top + twice->width;

	return fminf(fminf(top[0], top[1]), fminf(bottom[0], bottom[1]));
}

static void assert_mean_of(const struct psr_frame *fine, const struct psr_frame *twice)
{
	for (uint32_t y = 0; y < fine->height; y++)
		for (uint32_t x = 0; x < fine->width; x++) {
			const size_t at = (size_t)y * fine->width + x;

			for (int c = 0; c < 3; c++)
				assert_int_equal(fine->rgb[3 * at + (size_t)c], mean(twice, x, y, c));
			assert_true(fine->depth[at] == nearest(twice, x, y));
		}
}

static void a_pixel_is_the_mean_of_four_of_a_smooth_picture_of_twice_the_size(void **state)
{
	struct psr_frame fine, twice;

	(void)state;
	draw(&fine, 64, 48, PSR_SMOOTH_FINE, NULL);
	draw(&twice, 128, 96, PSR_SMOOTH_EDGES, NULL);
	assert_mean_of(&fine, &twice);
	psr_frame_free(&fine);
	psr_frame_free(&twice);
}

static void a_fine_octree_is_of_splats_as_the_smooth_one_is(void **state)
{
	struct psr_frame fine, twice;

	(void)state;
	draw_model(&fine, knot, 160, 120, PSR_SMOOTH_FINE, NULL);
	draw_model(&twice, knot, 320, 240, PSR_SMOOTH_EDGES, NULL);
	assert_int_equal(fine.report.effect[PSR_EFFECT_SPLATS].why, PSR_WHY_RAN);
	assert_mean_of(&fine, &twice);
	psr_frame_free(&fine);
	psr_frame_free(&twice);
}

/* Of a teapot of 64 steps: about .85 pixels between samples at 64x48, 1.4 at 104x78, and 2.1 at 160x120. */
static void samples_too_far_apart_are_drawn_smooth(void **state)
{
	static const uint32_t width[] = { 64, 104, 160 };

	(void)state;
	for (int i = 0; i < 3; i++) {
		struct psr_frame fine, smooth;

		draw(&fine, width[i], width[i] * 3 / 4, PSR_SMOOTH_FINE, NULL);
		draw(&smooth, width[i], width[i] * 3 / 4, PSR_SMOOTH_EDGES, NULL);
		const size_t n = 3 * (size_t)fine.width * fine.height;

		assert_int_equal(fine.report.effect[PSR_EFFECT_FINE].why, i < 2 ? PSR_WHY_RAN : PSR_WHY_VOID);
		assert_int_equal(fine.report.effect[PSR_EFFECT_FINE].count, i < 2 ? n / 3 : 0);
		assert_int_equal(smooth.report.effect[PSR_EFFECT_FINE].why, PSR_WHY_OFF);
		assert_int_equal(memcmp(fine.rgb, smooth.rgb, n) == 0, i == 2);
		assert_int_equal(memcmp(fine.depth, smooth.depth, n / 3 * sizeof *fine.depth) == 0, i == 2);
		psr_frame_free(&fine);
		psr_frame_free(&smooth);
	}
}

/* The finer picture has two windows in each direction, of 2048x1024 pixels, which overlap by 128. */
static void windows_have_no_seams(void **state)
{
	struct psr_frame fine, twice;

	(void)state;
	draw_model(&fine, knot, 1100, 560, PSR_SMOOTH_FINE, NULL);
	draw_model(&twice, knot, 2200, 1120, PSR_SMOOTH_EDGES, NULL);
	assert_mean_of(&fine, &twice);
	psr_frame_free(&fine);
	psr_frame_free(&twice);
}

static void threads_and_instruction_sets_draw_the_same_bytes(void **state)
{
	const size_t n = 64 * 48;
	struct psr_frame one;

	(void)state;
	draw(&one, 64, 48, PSR_SMOOTH_FINE, NULL);
	for (int isa = 0; isa < PSR_N_ISAS; isa++) {
		if (simd_of((enum psr_isa)isa) == NULL)
			continue;
		psr_isa_cap((enum psr_isa)isa);
		for (int threads = 2; threads <= 3; threads++) {
			struct psr_pool *pool;
			struct psr_frame frame;

			assert_int_equal(psr_pool_create(&pool, threads, NULL), PSR_OK);
			draw(&frame, 64, 48, PSR_SMOOTH_FINE, pool);
			assert_memory_equal(frame.rgb, one.rgb, 3 * n);
			assert_memory_equal(frame.depth, one.depth, n * sizeof *one.depth);
			psr_frame_free(&frame);
			psr_pool_destroy(pool);
		}
	}
	psr_isa_cap(PSR_N_ISAS - 1);
	psr_frame_free(&one);
}

static void other_planes_and_smoothings_are_refused(void **state)
{
	struct psr_scene scene = { .camera = { .kind = PSR_CAMERA_PERSPECTIVE, .eye = { 0, 0, 9 }, .up = { 0, 1, 0 },
		                                   .fov_y = 0.5 } };
	struct psr_settings settings;
	struct psr_renderer *renderer;
	struct psr_frame frame;
	struct psr_error err;

	(void)state;
	psr_settings_default(&settings, 16, 16);
	settings.smooth = PSR_SMOOTH_FINE;
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(psr_frame_alloc(&frame, 16, 16, PLANES | 1u << PSR_PLANE_NORMAL, NULL), PSR_OK);
	assert_int_equal(psr_render(renderer, &scene, &settings, NULL, &frame, &err), PSR_ERR_UNSUPPORTED);
	psr_frame_free(&frame);
	assert_int_equal(psr_frame_alloc(&frame, 16, 16, PLANES, NULL), PSR_OK);
	settings.smooth = PSR_SMOOTH_FINE + 1;
	assert_int_equal(psr_render(renderer, &scene, &settings, NULL, &frame, &err), PSR_ERR_ARG);
	psr_frame_free(&frame);
	psr_renderer_destroy(renderer);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_pixel_is_the_mean_of_four_of_a_smooth_picture_of_twice_the_size),
		cmocka_unit_test(a_fine_octree_is_of_splats_as_the_smooth_one_is),
		cmocka_unit_test(samples_too_far_apart_are_drawn_smooth),
		cmocka_unit_test(windows_have_no_seams),
		cmocka_unit_test(threads_and_instruction_sets_draw_the_same_bytes),
		cmocka_unit_test(other_planes_and_smoothings_are_refused),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, open_model, close_model);
}

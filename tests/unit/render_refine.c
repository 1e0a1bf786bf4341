/* Stills: passes of ever finer sub-pixels ([G] 9.1.1). */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/srgb.h"
#include "psr/pool.h"
#include "psr/render.h"
#include "render/render.h"
#include "tests/unit/lib/shapes.h"

static struct psr_model *sphere, *teapot;

static int open_models(void **state)
{
	const struct shape_options options = { .resolution = 128, .diffuse = 0xffffff, .unlit = 1, .cones = 1, .scale = 1 };
	struct psr_error err;

	(void)state;
	sphere = shape_build(&options, 0.9);
	return psr_model_read(&teapot, "tests/golden/teapot.psr", &err);
}

static int close_models(void **state)
{
	(void)state;
	psr_model_unref(sphere);
	psr_model_unref(teapot);
	return 0;
}

struct still {
	struct psr_instance instance;
	struct psr_light light;
	struct psr_scene scene;
	struct psr_settings settings;
	struct psr_frame frame;
	struct psr_renderer *renderer;
	struct psr_refiner *refiner;
};

static void still_make(struct still *s, const struct psr_model *model, uint32_t width, uint32_t height)
{
	const struct psr_model_info *info = psr_model_info(model);

	memset(s, 0, sizeof *s);
	s->instance = (struct psr_instance){ .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	s->light =
		(struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { -1, -2, -3 }, .color = { 1, 0.9, 0.8 } };
	s->scene = (struct psr_scene){ .instance = &s->instance, .n_instances = 1, .light = &s->light, .n_lights = 1,
		                           .ambient = { 0.1, 0.1, 0.1 } };
	psr_camera_frame(&s->scene.camera, info->box_min, info->box_max, info->up, 0.6, (double)width / height);
	psr_settings_default(&s->settings, width, height);
	s->frame = (struct psr_frame){ .width = width, .height = height, .rgb = malloc((size_t)width * height * 3),
		                           .depth = malloc((size_t)width * height * sizeof(float)) };
	assert_int_equal(psr_renderer_create(&s->renderer), PSR_OK);
	assert_int_equal(psr_refiner_create(&s->refiner, s->renderer), PSR_OK);
}

static void still_clear(struct still *s)
{
	free(s->frame.rgb);
	free(s->frame.depth);
	psr_refiner_destroy(s->refiner);
	psr_renderer_destroy(s->renderer);
}

static void refine(struct still *s, unsigned pass, struct psr_pool *pool)
{
	struct psr_error err;

	assert_int_equal(psr_refine(s->refiner, &s->scene, &s->settings, pass, pool, NULL, NULL, &s->frame, &err), PSR_OK);
}

static int same_frames(const struct still *a, const struct still *b)
{
	const size_t n = (size_t)a->frame.width * a->frame.height;

	return memcmp(a->frame.rgb, b->frame.rgb, 3 * n) == 0 &&
	       memcmp(a->frame.depth, b->frame.depth, n * sizeof(float)) == 0;
}

/* What a white, unlit sphere before black covers, in pixels: the mean light is the covered share. */
static double area_of(const struct still *s)
{
	double area = 0;

	for (size_t i = 0; i < (size_t)s->frame.width * s->frame.height; i++)
		area += (double)psr_srgb_to_linear[s->frame.rgb[3 * i]];
	return area;
}

/* The disc's area is known. A rim grows it: of half the diagonal of a sub-pixel at most, since samples keep those that
 * they are in, and of what splats reach beyond the disc. Where a sphere turns away, splats are within their slope's
 * limit of edge-on: they rise by at most (1 - sin(atan 0.7)) of a radius of 0.6 steps over the sphere, which falls; no
 * more than a quarter of a step. A step is `pixels` pixels here. */
static void the_area_of_a_sphere_converges(void **state)
{
	struct still s;
	double last = INFINITY;

	(void)state;
	still_make(&s, sphere, 160, 160);
	s.scene.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
	s.scene.camera.ortho_height = 2.5;
	const double pixel = 2.5 / 160, radius = 0.9 / pixel, truth = 3.14159265358979323846 * radius * radius;
	const double pixels = psr_model_info(sphere)->spacing / pixel;
	for (unsigned pass = 0; pass <= 3; pass++) {
		refine(&s, pass, NULL);
		const double error = fabs(area_of(&s) - truth);
		const double rim = 0.71 / (1 << pass) + (pass ? 0.25 * pixels : 0);
		assert_true(error <= 2 * 3.14159265358979323846 * radius * rim);
		assert_true(error < last);
		last = error;
	}
	still_clear(&s);
}

static void pass_0_is_the_plain_frame(void **state)
{
	struct still s, plain;
	struct psr_error err;

	(void)state;
	still_make(&s, teapot, 200, 150);
	still_make(&plain, teapot, 200, 150);
	refine(&s, 0, NULL);
	assert_int_equal(psr_render(plain.renderer, &plain.scene, &plain.settings, NULL, &plain.frame, &err), PSR_OK);
	assert_true(same_frames(&s, &plain));
	still_clear(&s);
	still_clear(&plain);
}

/* 560 x 300 x 4 are 2,240 x 1,200 sub-pixels: four windows. */
static void threads_and_instruction_sets_draw_the_same_bytes(void **state)
{
	static const enum psr_isa isas[] = { PSR_ISA_C, PSR_ISA_AVX2, PSR_ISA_AVX512 };
	struct still s, other;
	struct psr_pool *pool;

	(void)state;
	still_make(&s, teapot, 560, 300);
	still_make(&other, teapot, 560, 300);
	assert_int_equal(psr_pool_create(&pool, 3, 0), PSR_OK);
	renderer_use(s.renderer, simd_of(PSR_ISA_C));
	refine(&s, 2, NULL);
	for (size_t i = 0; i < 3; i++) {
		if (simd_of(isas[i]) == NULL)
			continue;
		renderer_use(other.renderer, simd_of(isas[i]));
		refine(&other, 2, pool);
		assert_true(same_frames(&s, &other));
	}
	psr_pool_destroy(pool);
	still_clear(&s);
	still_clear(&other);
}

/* A pixel's sub-pixels are the same whether a window's border is near or not: 512 x 256 x 4 fill one window, twice as
 * many pixels of the same size need nine. What a window rounds otherwise is a sample's place by some 2^-12 of a
 * sub-pixel, so that hardly one sample in a thousand falls into another, which changes a pixel by a sixteenth of what
 * is seen beside it. */
static void windows_have_no_seams(void **state)
{
	struct still one, nine;
	uint32_t n_changed = 0, n_drawn = 0;

	(void)state;
	still_make(&one, teapot, 512, 256);
	still_make(&nine, teapot, 1024, 512);
	one.scene.camera.kind = nine.scene.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
	one.scene.camera.ortho_height = psr_model_info(teapot)->scale * 1.6;
	nine.scene.camera.ortho_height = 2 * one.scene.camera.ortho_height;
	refine(&one, 2, NULL);
	refine(&nine, 2, NULL);
	for (uint32_t y = 0; y < 256; y++)
		for (uint32_t x = 0; x < 512; x++) {
			const uint8_t *a = one.frame.rgb + 3 * (y * 512 + x),
						  *b = nine.frame.rgb + 3 * ((y + 128) * 1024 + x + 256);
			int most = 0;

			for (int c = 0; c < 3; c++)
				most = abs(a[c] - b[c]) > most ? abs(a[c] - b[c]) : most;
			n_changed += most > 16;
			n_drawn += isfinite(one.frame.depth[y * 512 + x]);
		}
	assert_true(n_drawn > 10000);
	assert_true(n_changed * 1000 <= n_drawn);
	still_clear(&one);
	still_clear(&nine);
}

static void depth_is_that_of_the_nearest_sub_pixel(void **state)
{
	struct still s;

	(void)state;
	still_make(&s, sphere, 100, 100);
	s.scene.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
	s.scene.camera.ortho_height = 2.5;
	for (int k = 0; k < 3; k++)
		s.scene.camera.eye[k] = k == 2 ? 3 : 0;
	memset(s.scene.camera.target, 0, sizeof s.scene.camera.target);
	refine(&s, 3, NULL);
	/* The sphere's front is at 3 - 0.9, and within a pixel of 0.025 about the middle falls by 0.025^2 / 2 / 0.9; depth
	 * steps and the rims of splats add some 2^-14 and a quarter of a step of the lattice. */
	const float z = s.frame.depth[50 * 100 + 50];
	assert_true(fabsf(z - 2.1f) <= 0.0004f + 0x1p-14f + 0.25f * (float)psr_model_info(sphere)->spacing);
	assert_true(isinf(s.frame.depth[0]));
	still_clear(&s);
}

static int count_down(void *userdata)
{
	int *left = userdata;

	return (*left)-- == 0;
}

static void a_pass_ends_between_windows_when_nobody_waits(void **state)
{
	struct still s;
	struct psr_error err;
	int left = 2;

	(void)state;
	still_make(&s, sphere, 560, 300);
	assert_int_equal(psr_refine(s.refiner, &s.scene, &s.settings, 2, NULL, count_down, &left, &s.frame, &err),
	                 PSR_ERR_CANCELLED);
	assert_int_equal(left, -1);
	left = 4;
	assert_int_equal(psr_refine(s.refiner, &s.scene, &s.settings, 2, NULL, count_down, &left, &s.frame, &err), PSR_OK);
	assert_int_equal(left, 0); /* four windows */
	still_clear(&s);
}

static void the_door_refuses_what_is_no_still(void **state)
{
	struct still s;
	struct psr_error err;

	(void)state;
	still_make(&s, sphere, 64, 64);
	assert_int_equal(psr_refine(s.refiner, &s.scene, &s.settings, PSR_MAX_PASS + 1, NULL, NULL, NULL, &s.frame, &err),
	                 PSR_ERR_LIMIT);
	s.frame.width = 32;
	assert_int_equal(psr_refine(s.refiner, &s.scene, &s.settings, 1, NULL, NULL, NULL, &s.frame, &err), PSR_ERR_ARG);
	s.frame.width = 64;
	s.settings.window = (struct psr_window){ 128, 128, 0, 0 };
	assert_int_equal(psr_refine(s.refiner, &s.scene, &s.settings, 1, NULL, NULL, NULL, &s.frame, &err), PSR_ERR_ARG);
	s.settings.window = (struct psr_window){ 128, 0, 0, 0 };
	assert_int_equal(psr_render(s.renderer, &s.scene, &s.settings, NULL, &s.frame, &err), PSR_ERR_ARG);
	s.settings.window = (struct psr_window){ 128, 128, -PSR_MAX_SIDE - 1, 0 };
	assert_int_equal(psr_render(s.renderer, &s.scene, &s.settings, NULL, &s.frame, &err), PSR_ERR_ARG);
	s.settings.window = (struct psr_window){ 0, 0, 0, 0 };
	s.settings.width = 0;
	assert_int_equal(psr_refine(s.refiner, &s.scene, &s.settings, 1, NULL, NULL, NULL, &s.frame, &err), PSR_ERR_ARG);
	still_clear(&s);
}

/* A hole of 5 x 5 pixels in a surface, one that shows another surface far behind, and a notch at the surface's end. */
static void holes_between_discs_are_closed_and_notches_are_not(void **state)
{
	enum { WIDTH = 80, HEIGHT = 40 };
	static const struct {
		uint32_t x, y;
		float z;
	} places[] = { { 10, 10, INFINITY }, { 30, 20, 9 }, { 55, 10, INFINITY } };
	const struct plan plan = { .gap_scale = { [1] = 1.03f, [4] = 1.24f } };
	uint64_t *word = malloc(WIDTH * HEIGHT * sizeof *word);
	uint16_t weight[WIDTH * HEIGHT];
	uint8_t bricks[6] = { 0 };
	struct psr_zstack stack = { .width = WIDTH, .height = HEIGHT, .word = word };

	(void)state;
	assert_non_null(word);
	for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
		const uint32_t x = i % WIDTH, y = i / WIDTH;
		float z = x < 60 ? 2 : INFINITY;
		for (size_t p = 0; p < sizeof places / sizeof *places; p++)
			z = x - places[p].x < 5 && y - places[p].y < 5 ? places[p].z : z;
		uint32_t bits;
		memcpy(&bits, &z, sizeof bits);
		word[i] = (uint64_t)bits << 32;
		weight[i] = WEIGHT_ONE;
	}
	assert_int_equal(splat_close(&plan, &stack, 0, BRICK, weight, bricks), 2 * 25);
	for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
		const uint32_t x = i % WIDTH, y = i / WIDTH;
		const int is_hole =
			(x - places[0].x < 5 && y - places[0].y < 5) || (x - places[1].x < 5 && y - places[1].y < 5);
		assert_int_equal(weight[i], is_hole ? 0 : WEIGHT_ONE);
	}
	assert_true(bricks[0] && bricks[1] && !bricks[2]);
	free(word);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_area_of_a_sphere_converges),
		cmocka_unit_test(pass_0_is_the_plain_frame),
		cmocka_unit_test(threads_and_instruction_sets_draw_the_same_bytes),
		cmocka_unit_test(windows_have_no_seams),
		cmocka_unit_test(depth_is_that_of_the_nearest_sub_pixel),
		cmocka_unit_test(a_pass_ends_between_windows_when_nobody_waits),
		cmocka_unit_test(the_door_refuses_what_is_no_still),
		cmocka_unit_test(holes_between_discs_are_closed_and_notches_are_not),
	};
	return cmocka_run_group_tests(tests, open_models, close_models);
}

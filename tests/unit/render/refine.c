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
#include "base/direction.h"
#include "base/pool.h"
#include "render/splat.h"
#include "tests/unit/lib/shapes.h"
#include "tests/unit/lib/threads.h"

static struct psr_model *sphere, *fine_sphere, *teapot;

static int open_models(void **state)
{
	const struct shape_options options = { .resolution = 128, .diffuse = 0xffffff, .unlit = 1, .cones = 1, .scale = 1 };
	const struct shape_options finer = { .resolution = 512, .diffuse = 0xffffff, .unlit = 1, .cones = 1, .scale = 1 };
	struct psr_error err;

	(void)state;
	sphere = shape_build(&options, 0.9);
	fine_sphere = shape_build(&finer, 0.9);
	return psr_model_read(&teapot, "tests/golden/teapot.psr", &err);
}

static int close_models(void **state)
{
	(void)state;
	psr_model_unref(sphere);
	psr_model_unref(fine_sphere);
	psr_model_unref(teapot);
	return 0;
}

struct still {
	struct psr_instance instance;
	struct psr_light light;
	struct psr_scene scene;
	struct render_settings settings;
	struct psr_frame frame;
	struct psr_renderer *renderer;
	struct refiner *refiner;
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
	render_settings_default(&s->settings, width, height);
	s->frame = (struct psr_frame){ .width = width, .height = height, .rgb = malloc((size_t)width * height * 3),
		                           .depth = malloc((size_t)width * height * sizeof(float)) };
	assert_int_equal(psr_renderer_create(&s->renderer, NULL), PSR_OK);
	assert_int_equal(refiner_create(&s->refiner, s->renderer, NULL), PSR_OK);
}

static void still_clear(struct still *s)
{
	free(s->frame.rgb);
	free(s->frame.depth);
	refiner_destroy(s->refiner);
	psr_renderer_destroy(s->renderer);
}

static void refine(struct still *s, unsigned pass, struct psr_pool *pool)
{
	struct psr_error err;

	s->settings.pass = pass;
	assert_int_equal(refiner_draw(s->refiner, &s->scene, &s->settings, pool, &s->frame, &err), PSR_OK);
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

/* The disc's area is known. In pass 0 a rim grows it, of half the diagonal of a pixel at most, since samples fill those
 * that they are in. In later passes what splats reach beyond the disc does, and half the diagonal of a sub-pixel, whose
 * centre stands for all of it. Where a sphere turns away, splats are within their slope's limit of edge-on: they rise by
 * at most (1 - sin(atan 0.7)) of a radius of 0.6 steps over the sphere, which falls; no more than a quarter of a step. A
 * step is `pixels` pixels here. */
static void the_area_of_a_sphere_is_that_of_its_disc(void **state)
{
	struct still s;
	double plain = INFINITY;

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
		assert_true(pass == 0 || error < plain);
		plain = pass == 0 ? error : plain;
	}
	still_clear(&s);
}

/* The area of the sub-pixels whose centres are on a disc in the middle, in pixels. */
static double area_by_centers(const struct still *s, unsigned pass, double radius)
{
	const double side = s->frame.width * (double)(1u << pass);
	uint64_t n = 0;

	for (uint32_t y = 0; y < (uint32_t)side; y++)
		for (uint32_t x = 0; x < (uint32_t)side; x++)
			n += hypot(x + 0.5 - side / 2, y + 0.5 - side / 2) <= radius * (1u << pass);
	return (double)n / (double)(1u << 2 * pass);
}

/* Between the centres of sub-pixels on the disc, and on one that is a quarter of a step of the lattice larger (above):
 * a sub-pixel is lit if a splat covers its centre, and not because a sample lies in it. The averages are of 8 bits: half
 * a code of the rim's light, of which no code is steeper than 1/110. */
static void samples_finer_than_sub_pixels_do_not_widen_edges(void **state)
{
	struct still s;

	(void)state;
	still_make(&s, fine_sphere, 160, 160);
	s.scene.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
	s.scene.camera.ortho_height = 2.5;
	const double pixel = 2.5 / 160, radius = 0.9 / pixel, rim = 0.25 * psr_model_info(fine_sphere)->spacing / pixel;
	for (unsigned pass = 1; pass <= 2; pass++) {
		const double codes = 2 * 3.14159265358979323846 * radius * 1.5 * 0.5 / 110;
		refine(&s, pass, NULL);
		assert_true(area_of(&s) >= area_by_centers(&s, pass, radius) - codes);
		assert_true(area_of(&s) <= area_by_centers(&s, pass, radius + rim) + codes);
	}
	still_clear(&s);
}

/* Pixels four or more inside of what pass 0 covers have the same colour before any background. */
static void no_background_shows_through_a_surface(void **state)
{
	enum { SIDE = 150, INSIDE = 4 }; /* at which the golden teapot's samples are a pixel apart, or little more */
	struct still s;
	uint8_t *red = malloc(3 * SIDE * SIDE);

	(void)state;
	still_make(&s, teapot, SIDE, SIDE);
	float *plain = malloc(SIDE * SIDE * sizeof *plain);
	refine(&s, 0, NULL);
	memcpy(plain, s.frame.depth, SIDE * SIDE * sizeof *plain);
	for (unsigned pass = 0; pass <= PSR_MAX_PASS; pass++) {
		uint32_t n_inside = 0;
		for (int k = 0; k < 3; k++)
			s.scene.background[k] = k == 0;
		refine(&s, pass, NULL);
		memcpy(red, s.frame.rgb, 3 * SIDE * SIDE);
		for (int k = 0; k < 3; k++)
			s.scene.background[k] = k == 2;
		refine(&s, pass, NULL);
		for (int y = INSIDE; y < SIDE - INSIDE; y++)
			for (int x = INSIDE; x < SIDE - INSIDE; x++) {
				int is_inside = 1;
				for (int i = 0; i < (2 * INSIDE + 1) * (2 * INSIDE + 1); i++)
					is_inside &= isfinite(plain[(y - INSIDE + i / (2 * INSIDE + 1)) * SIDE + x - INSIDE +
					                            i % (2 * INSIDE + 1)]) != 0;
				n_inside += (uint32_t)is_inside;
				if (is_inside)
					assert_memory_equal(red + 3 * (y * SIDE + x), s.frame.rgb + 3 * (y * SIDE + x), 3);
			}
		assert_true(n_inside > 1000);
	}
	free(plain);
	free(red);
	still_clear(&s);
}

static void depth_alone_is_refined_and_pays_for_no_color(void **state)
{
	struct still s;

	(void)state;
	still_make(&s, teapot, 200, 150);
	for (unsigned pass = 0; pass <= 2; pass++) {
		float *all = malloc(200 * 150 * sizeof *all);
		uint8_t *rgb = s.frame.rgb;
		refine(&s, pass, NULL);
		assert_true(s.frame.report.count[PSR_STAGE_RESOLVE] > 0 && s.frame.report.count[PSR_STAGE_SHADE] > 0);
		memcpy(all, s.frame.depth, 200 * 150 * sizeof *all);
		memset(s.frame.depth, 0, 200 * 150 * sizeof *all);
		s.frame.rgb = NULL;
		refine(&s, pass, NULL);
		s.frame.rgb = rgb;
		assert_memory_equal(s.frame.depth, all, 200 * 150 * sizeof *all);
		assert_int_equal(s.frame.report.count[PSR_STAGE_RESOLVE], 0);
		assert_int_equal(s.frame.report.count[PSR_STAGE_SHADE], 0);
		free(all);
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
	assert_int_equal(renderer_draw(plain.renderer, &plain.scene, &plain.settings, NULL, &plain.frame, &err), PSR_OK);
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
	assert_int_equal(psr_pool_create(&pool, 3, NULL), PSR_OK);
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

static void the_public_call_draws_passes_too(void **state)
{
	struct psr_settings settings;
	struct still s, same;
	struct psr_error err;

	(void)state;
	still_make(&s, sphere, 80, 60);
	still_make(&same, sphere, 80, 60);
	psr_settings_default(&settings, 80, 60);
	for (settings.pass = 0; settings.pass <= 2; settings.pass++) {
		const uint64_t before = psr_renderer_bytes(same.renderer);

		refine(&s, settings.pass, NULL);
		assert_int_equal(psr_render(same.renderer, &same.scene, &settings, NULL, &same.frame, &err), PSR_OK);
		assert_true(same_frames(&s, &same));
		assert_int_equal(psr_renderer_bytes(same.renderer) > before + refiner_bytes(s.refiner) / 2, settings.pass == 1);
	}
	settings.pass = PSR_MAX_PASS + 1;
	assert_int_equal(psr_render(same.renderer, &same.scene, &settings, NULL, &same.frame, &err), PSR_ERR_LIMIT);
	still_clear(&s);
	still_clear(&same);
}

static int count_question(void *userdata)
{
	++*(int *)userdata;
	return 0;
}

/* A plain frame's outline takes questions, too. */
static void passes_find_the_outline_once_for_each_still(void **state)
{
	struct still s;
	int n = 0, n_with_outline = 0;

	(void)state;
	still_make(&s, teapot, 160, 120);
	s.settings.cancel = (struct psr_cancel){ count_question, &n };
	for (int change = 0; change <= 8; change++) {
		struct psr_camera *camera = &s.scene.camera;

		camera->fov_y -= change == 1 ? 0.01 : 0;
		camera->eye[0] += change == 2 ? 0.25 : 0;
		camera->up[0] += change == 3 ? 0.1 : 0;
		s.instance.translation[1] += change == 4 ? 0.1 : 0;
		s.instance.model = change == 5 ? sphere : s.instance.model;
		s.settings.spacing_px *= change == 6 ? 2 : 1;
		s.settings.gap_threshold += change == 7 ? 2 : 0;
		s.settings.cull_tests ^= change == 8 ? PSR_CULL_MASKS : 0;
		for (unsigned pass = 1; pass <= 2; pass++)
			for (int again = 0; again <= 1; again++) {
				struct still fresh;

				n = 0;
				refine(&s, pass, NULL);
				if (pass == 1 && again)
					assert_true(n < n_with_outline);
				n_with_outline = n;
				still_make(&fresh, s.instance.model, 160, 120);
				fresh.scene = s.scene;
				fresh.settings = s.settings;
				fresh.settings.cancel = (struct psr_cancel){ 0 };
				refine(&fresh, pass, NULL);
				assert_true(same_frames(&s, &fresh));
				still_clear(&fresh);
			}
	}
	still_clear(&s);
}

static void the_door_refuses_what_is_no_still(void **state)
{
	struct still s;
	struct psr_error err;

	(void)state;
	still_make(&s, sphere, 64, 64);
	s.settings.pass = PSR_MAX_PASS + 1;
	assert_int_equal(refiner_draw(s.refiner, &s.scene, &s.settings, NULL, &s.frame, &err), PSR_ERR_LIMIT);
	s.settings.pass = 1;
	s.frame.width = 32;
	assert_int_equal(refiner_draw(s.refiner, &s.scene, &s.settings, NULL, &s.frame, &err), PSR_ERR_ARG);
	s.frame.width = 64;
	s.settings.window = (struct psr_window){ 128, 128, 0, 0 };
	assert_int_equal(refiner_draw(s.refiner, &s.scene, &s.settings, NULL, &s.frame, &err), PSR_ERR_ARG);
	s.settings.window = (struct psr_window){ 128, 0, 0, 0 };
	assert_int_equal(renderer_draw(s.renderer, &s.scene, &s.settings, NULL, &s.frame, &err), PSR_ERR_ARG);
	s.settings.window = (struct psr_window){ 128, 128, -PSR_MAX_SIDE - 1, 0 };
	assert_int_equal(renderer_draw(s.renderer, &s.scene, &s.settings, NULL, &s.frame, &err), PSR_ERR_ARG);
	s.settings.window = (struct psr_window){ 0, 0, 0, 0 };
	s.settings.width = 0;
	assert_int_equal(refiner_draw(s.refiner, &s.scene, &s.settings, NULL, &s.frame, &err), PSR_ERR_ARG);
	still_clear(&s);
}

/* A surface with a sample in each cell of 8 x 8 pixels, and in it holes: of 5 x 5 pixels, one of which shows another
 * surface far behind, a crack of 3 pixels, open at its end, and a slot of three cells without samples. A notch at the
 * surface's end. */
static void holes_between_discs_are_closed_and_slots_and_notches_are_not(void **state)
{
	enum { WIDTH = 160, HEIGHT = 160, LEVEL = 3, CELLS = WIDTH / 8 + 2 };
	static const struct {
		uint32_t x, y, width, height, is_closed;
		float z;
	} places[] = {
		{ 42, 44, 5, 5, 1, INFINITY }, { 60, 52, 5, 5, 1, 9 },         { 64, 76, WIDTH, 3, 0, INFINITY },
		{ 64, 120, 24, 24, 0, INFINITY }, { 115, 20, 5, 5, 0, INFINITY },
	};
	const struct plan plan = { .gap_scale = { [1] = 1.03f, [LEVEL] = 1.12f, [4] = 1.24f } };
	uint64_t *word = malloc(WIDTH * HEIGHT * sizeof *word);
	uint16_t *weight = malloc(WIDTH * HEIGHT * sizeof *weight);
	float *cell = malloc(CELLS * CELLS * sizeof *cell);
	uint8_t bricks[WIDTH / BRICK * HEIGHT / BRICK] = { 0 };
	const struct gaps_map map = { weight, bricks };
	struct psr_zstack stack = { .width = WIDTH, .height = HEIGHT, .word = word, .levels = 1 << LEVEL };
	const struct splat_picture picture = { .simd = simd_of(PSR_ISA_C), .plan = &plan, .stack = &stack };

	(void)state;
	assert_true(word && weight && cell);
	stack.level[LEVEL].z = cell;
	stack.level[LEVEL].width = stack.level[LEVEL].height = CELLS;
	for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
		const uint32_t x = i % WIDTH, y = i / WIDTH;
		float z = x < 120 ? 2 : INFINITY;
		for (size_t p = 0; p < sizeof places / sizeof *places; p++)
			z = x - places[p].x < places[p].width && y - places[p].y < places[p].height && x < 120 ? places[p].z : z;
		uint32_t bits;
		memcpy(&bits, &z, sizeof bits);
		word[i] = (uint64_t)bits << 32 | (z < INFINITY ? 0 : 0xffffffff);
		weight[i] = WEIGHT_ONE;
	}
	for (uint32_t i = 0; i < CELLS * CELLS; i++) {
		const uint32_t x = (i % CELLS - 1) * 8, y = (i / CELLS - 1) * 8;
		cell[i] = x < 120 && y < HEIGHT && !(x - 64 < 24 && y - 120 < 24) ? 2 : INFINITY;
	}
	uint32_t n_closed = 0;
	for (uint32_t y = 0; y < HEIGHT; y += BRICK)
		n_closed += splat_close(&picture, y, y + BRICK, &map);
	for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
		const uint32_t x = i % WIDTH, y = i / WIDTH;
		int is_closed = 0;
		for (size_t p = 0; p < sizeof places / sizeof *places; p++)
			if (x - places[p].x < places[p].width && y - places[p].y < places[p].height && x < 120)
				is_closed = (int)places[p].is_closed;
		/* The crack's own end is enclosed as far as a hole is looked across. */
		if (!(y - 76 < 3 && x - 64 < 8))
			assert_int_equal(weight[i], is_closed ? 0 : WEIGHT_ONE);
	}
	assert_in_range(n_closed, 2 * 25, 2 * 25 + 3 * 8);
	assert_true(bricks[WIDTH / BRICK + 1] && !bricks[4]);
	free(word);
	free(weight);
	free(cell);
}

/* Seen 45 degrees from the side, a square is a rectangle. A sample of the square reaches 0.6 steps of its projection, and
 * a step that is at most 37 degrees from the square is 1.25 spacings long on it. Samples are at most a step inside of
 * the sides: 0.4 steps are short of them at most. A sub-pixel's centre stands for half its diagonal besides. Discs
 * across tilted normals would leave the square open. */
static void discs_lie_on_the_plane_of_their_neighbors_whatever_the_normals(void **state)
{
	enum { SIDE = 160 };
	const double degree = 3.14159265358979323846 / 180, tilt[] = { 0, 40 * degree, -40 * degree, 60 * degree };

	(void)state;
	for (size_t t = 0; t < sizeof tilt / sizeof *tilt; t++) {
		const struct shape_options options = { .resolution = 128, .diffuse = 0xffffff, .unlit = 1, .two_sided = 1,
			                                   .cones = 1, .scale = 1, .tilt = tilt[t] };
		struct psr_model *square = shape_build(&options, 0);
		struct still s;
		still_make(&s, square, SIDE, SIDE);
		s.scene.camera = (struct psr_camera){ .eye = { 3, 0, 3 }, .up = { 0, 1, 0 }, .kind = PSR_CAMERA_ORTHOGRAPHIC,
			                                  .ortho_height = 2.5 };
		const double pixel = 2.5 / SIDE, reach = 1.25 * 0.6 * psr_model_info(square)->spacing;
		for (unsigned pass = 1; pass <= 3; pass++) {
			const double sub = 0.71 * pixel / (1 << pass), half_x = 0.7 * sqrt(0.5), half_y = 0.7;
			const double outer_x = half_x + reach * sqrt(0.5) + sub, outer_y = half_y + reach + sub;
			uint32_t n_open = 0, n_beyond = 0;
			refine(&s, pass, NULL);
			for (uint32_t i = 0; i < SIDE * SIDE; i++) {
				const double x = fabs((i % SIDE + 0.5) * pixel - 1.25), y = fabs((i / SIDE + 0.5) * pixel - 1.25);
				const double half = pixel / 2;
				const double inner_x = 2 * half_x - outer_x, inner_y = 2 * half_y - outer_y;
				n_open += x < inner_x - half && y < inner_y - half && s.frame.rgb[3 * i] < 255;
				n_beyond += (x > outer_x + half || y > outer_y + half) && s.frame.rgb[3 * i] > 0;
			}
			assert_int_equal(n_open, 0);
			assert_int_equal(n_beyond, 0);
		}
		still_clear(&s);
		psr_model_unref(square);
	}
}

/* Such a crack is closed where the plain frame covers all around, and nowhere else. */
static void cracks_are_closed_inside_of_the_plain_frame(void **state)
{
	enum { WIDTH = 64, HEIGHT = 32, CELLS_X = WIDTH / 8 + 2, CELLS_Y = HEIGHT / 8 + 2 };
	const struct plan plan = { .gap_scale = { [1] = 1.03f, [3] = 1.12f, [4] = 1.24f } };
	uint64_t word[WIDTH * HEIGHT];
	uint16_t weight[WIDTH * HEIGHT];
	float cell[CELLS_X * CELLS_Y];
	uint8_t bricks[2], is_inside[WIDTH / 8 * HEIGHT / 8];
	const struct gaps_map map = { weight, bricks };
	struct psr_zstack stack = { .width = WIDTH, .height = HEIGHT, .word = word, .levels = 1 << 3 };
	const struct inside inside = { is_inside, WIDTH / 8, 0, 0, 3 };
	const struct splat_picture picture = { .simd = simd_of(PSR_ISA_C), .plan = &plan, .stack = &stack, .inside = &inside };

	(void)state;
	stack.level[3].z = cell;
	stack.level[3].width = CELLS_X;
	stack.level[3].height = CELLS_Y;
	for (uint32_t i = 0; i < CELLS_X * CELLS_Y; i++)
		cell[i] = 2;
	for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
		const float z = 2;
		uint32_t bits;
		memcpy(&bits, &z, sizeof bits);
		word[i] = i / WIDTH == 12 ? PSR_WORD_EMPTY : (uint64_t)bits << 32;
		weight[i] = WEIGHT_ONE;
	}
	for (uint32_t i = 0; i < sizeof is_inside; i++)
		is_inside[i] = i % (WIDTH / 8) < 4;
	assert_int_equal(splat_close(&picture, 0, HEIGHT, &map), WIDTH / 2);
	for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
		assert_int_equal(weight[i], i / WIDTH == 12 && i % WIDTH < WIDTH / 2 ? 0 : WEIGHT_ONE);
}

/* Of a gap of so many rows, all across a picture whose cells are eight pixels wide and all have samples, between what
 * has depth 2 and faces along normal[0], and what has another depth and normal: how many rows are closed. */
static uint32_t n_rows_closed(uint32_t n_rows, float beyond, const float normal[2][3])
{
	enum { WIDTH = 64, HEIGHT = 32, CELLS_X = WIDTH / 8 + 2, CELLS_Y = HEIGHT / 8 + 2, FIRST = 12 };
	const struct psr_run run = { 0, 0 };
	const uint64_t mask = 3, attr[2] = { psr_direction_encode(normal[0]), psr_direction_encode(normal[1]) };
	const uint16_t offset = 0;
	const struct psr_blocks blocks = { .n_blocks = 1, .run = &run, .mask = &mask, .attr_offset = &offset,
		                               .attr = attr };
	struct plan_instance instance = { .cull = { .blocks = &blocks },
		                              .turn = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } } };
	const struct plan plan = { .gap_scale = { [1] = 1.03f, [3] = 1.12f, [4] = 1.24f }, .n_instances = 1,
		                       .instance = &instance };
	uint64_t word[WIDTH * HEIGHT];
	uint16_t weight[WIDTH * HEIGHT];
	float cell[CELLS_X * CELLS_Y];
	uint8_t bricks[2], is_inside[WIDTH / 8 * HEIGHT / 8];
	const struct gaps_map map = { weight, bricks };
	struct psr_zstack stack = { .width = WIDTH, .height = HEIGHT, .word = word, .levels = 1 << 3 };
	const struct inside inside = { is_inside, WIDTH / 8, 0, 0, 3 };
	const struct splat_picture picture = { .simd = simd_of(PSR_ISA_C), .plan = &plan, .stack = &stack, .inside = &inside };

	stack.level[3].z = cell;
	stack.level[3].width = CELLS_X;
	stack.level[3].height = CELLS_Y;
	memset(is_inside, 1, sizeof is_inside);
	for (uint32_t i = 0; i < CELLS_X * CELLS_Y; i++)
		cell[i] = 2;
	for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
		const uint32_t y = i / WIDTH;
		const float z = y < FIRST ? 2 : beyond;
		uint32_t bits;
		memcpy(&bits, &z, sizeof bits);
		word[i] = y - FIRST < n_rows ? PSR_WORD_EMPTY : (uint64_t)bits << 32 | (y >= FIRST);
		weight[i] = WEIGHT_ONE;
	}
	const uint32_t n_closed = splat_close(&picture, 0, HEIGHT, &map);
	assert_int_equal(n_closed % WIDTH, 0);
	return n_closed / WIDTH;
}

/* A cell is one to two samples wide, a crack at most half a cell: four rows. */
static void gaps_as_wide_as_samples_stay_open(void **state)
{
	static const float same[2][3] = { { 0, 0, -1 }, { 0, 0, -1 } };

	(void)state;
	assert_int_equal(n_rows_closed(4, 2, same), 4);
	assert_int_equal(n_rows_closed(5, 2, same), 0);
}

/* As rims of two round bars beside each other, or a bar before a wall. */
static void gaps_between_what_turns_away_stay_open(void **state)
{
	static const float same[2][3] = { { 0, 0, -1 }, { 0, 0, -1 } };
	static const float bars[2][3] = { { 0, 0.8f, -0.6f }, { 0, -0.8f, -0.6f } };

	(void)state;
	assert_int_equal(n_rows_closed(3, 2, same), 3);
	assert_int_equal(n_rows_closed(3, 2, bars), 0);
	assert_int_equal(n_rows_closed(3, 2.2f, same), 3);
	assert_int_equal(n_rows_closed(3, 2.3f, same), 0); /* beyond level 3's threshold, 2.24 */
	assert_int_equal(n_rows_closed(1, 2.2f, bars), 1); /* too narrow to tell */
}

/* Where samples are magnified, cells about a crack may have none, and what is before nothing on one side of a surface's
 * end stays so. The surface is x < 48, and row 12 its crack; everything is inside. */
static void cracks_of_magnified_samples_are_closed_beside_empty_cells(void **state)
{
	enum { WIDTH = 64, HEIGHT = 32, CELLS_X = WIDTH / 8 + 2, CELLS_Y = HEIGHT / 8 + 2, END = 48 };
	const struct plan plan = { .gap_scale = { [1] = 1.03f, [3] = 1.12f, [4] = 1.24f } };
	uint64_t word[WIDTH * HEIGHT];
	float cell[CELLS_X * CELLS_Y];
	struct psr_zstack stack = { .width = WIDTH, .height = HEIGHT, .word = word, .levels = 1 << 3 };

	(void)state;
	stack.level[3].z = cell;
	stack.level[3].width = CELLS_X;
	stack.level[3].height = CELLS_Y;
	for (uint32_t i = 0; i < CELLS_X * CELLS_Y; i++)
		cell[i] = i / CELLS_X == 2 && i % CELLS_X <= END / 8 ? 2 : INFINITY; /* the row of cells that has the crack */
	for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
		const float z = 2;
		uint32_t bits;
		memcpy(&bits, &z, sizeof bits);
		word[i] = i / WIDTH == 12 || i % WIDTH >= END ? PSR_WORD_EMPTY : (uint64_t)bits << 32;
	}
	for (unsigned pass = 1; pass <= 2; pass++) { /* a cell is four pixels of the picture wide, and two */
		uint16_t weight[WIDTH * HEIGHT];
		uint8_t bricks[2], is_inside[WIDTH / 2 * HEIGHT / 2];
		const struct gaps_map map = { weight, bricks };
		const struct inside inside = { is_inside, WIDTH >> pass, 0, 0, pass };
		const struct splat_picture picture = { .simd = simd_of(PSR_ISA_C), .plan = &plan, .stack = &stack, .inside = &inside };
		memset(is_inside, 1, sizeof is_inside);
		for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
			weight[i] = WEIGHT_ONE;
		splat_close(&picture, 0, HEIGHT, &map);
		for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
			assert_int_equal(weight[i], pass == 1 && i / WIDTH == 12 && i % WIDTH < END ? 0 : WEIGHT_ONE);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_area_of_a_sphere_is_that_of_its_disc),
		cmocka_unit_test(samples_finer_than_sub_pixels_do_not_widen_edges),
		cmocka_unit_test(no_background_shows_through_a_surface),
		cmocka_unit_test(depth_alone_is_refined_and_pays_for_no_color),
		cmocka_unit_test(pass_0_is_the_plain_frame),
		cmocka_unit_test(threads_and_instruction_sets_draw_the_same_bytes),
		cmocka_unit_test(windows_have_no_seams),
		cmocka_unit_test(depth_is_that_of_the_nearest_sub_pixel),
		cmocka_unit_test(the_public_call_draws_passes_too),
		cmocka_unit_test(passes_find_the_outline_once_for_each_still),
		cmocka_unit_test(the_door_refuses_what_is_no_still),
		cmocka_unit_test(holes_between_discs_are_closed_and_slots_and_notches_are_not),
		cmocka_unit_test(discs_lie_on_the_plane_of_their_neighbors_whatever_the_normals),
		cmocka_unit_test(cracks_are_closed_inside_of_the_plain_frame),
		cmocka_unit_test(gaps_as_wide_as_samples_stay_open),
		cmocka_unit_test(gaps_between_what_turns_away_stay_open),
		cmocka_unit_test(cracks_of_magnified_samples_are_closed_beside_empty_cells),
	};
	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, open_models, close_models);
}

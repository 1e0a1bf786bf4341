/* Shadows: where they are, that nothing shadows itself, when maps are drawn, and what they take. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "simd/isa.h"
#include "render/shadow.h"
#include "tests/unit/lib/shapes.h"
#include "tests/unit/lib/threads.h"

#define SIDE 256
#define PIXELS (SIDE * SIDE)

static const struct shape_options FINE = { .resolution = 256, .diffuse = 0xc0c0c0, .scale = 1 };
static const struct shape_options COARSE = { .resolution = 24, .diffuse = 0xc0c0c0, .scale = 1 };

static const struct psr_light SUN = { .direction = { 0.35, 0.2, -1 }, .color = { 0.6, 0.6, 0.6 }, .casts_shadow = 1 };
static const struct psr_light SPOT = { .kind = PSR_LIGHT_SPOT,
	                                   .position = { -0.6, -0.4, 2.5 },
	                                   .direction = { 0.3, 0.2, -1 },
	                                   .color = { 0.6, 0.6, 0.6 },
	                                   .casts_shadow = 1,
	                                   .inner = 0.45,
	                                   .outer = 0.5 };
static const struct psr_light LAMP = { .kind = PSR_LIGHT_POINT,
	                                   .position = { 0.1, -0.2, 1.1 },
	                                   .color = { 0.6, 0.6, 0.6 },
	                                   .casts_shadow = 1 };

/* A floor in z = 0 with half sides of 1.4, and a square of half side 0.28 at z = 0.5 that shows the floor its front, so
 * that the camera above sees through it: what casts shadows does so from behind, too. */
struct stage {
	struct psr_model *floor, *square;
	struct psr_instance instance[2];
	struct psr_light light[PSR_MAX_LIGHTS];
	struct psr_scene scene;
	struct psr_renderer *renderer;
	struct psr_report report;
};
#define HALF_FLOOR 1.4
#define HALF_SQUARE 0.28
#define HEIGHT 0.5

/* Squares by resolution, which take most of the time to build. */
static struct psr_model *squares[257];

static struct psr_model *square_of(const struct shape_options *options)
{
	struct psr_model **square = &squares[options->resolution];
	if (!*square)
		*square = shape_build(options, 0);
	return psr_model_ref(*square);
}

static void stage_init(struct stage *s, const struct shape_options *square, const struct psr_light *light)
{
	memset(s, 0, sizeof *s);
	s->floor = square_of(&FINE);
	s->square = square_of(square);
	s->instance[0] = (struct psr_instance){ .model = s->floor, .rotation = { 0, 0, 0, 1 }, .scale = 2 };
	s->instance[1] = (struct psr_instance){ .model = s->square, .rotation = { 0, 1, 0, 0 },
		                                .translation = { 0, 0, HEIGHT }, .scale = 0.4 };
	s->light[0] = *light;
	s->scene = (struct psr_scene){ .instance = s->instance, .n_instances = 2, .light = s->light, .n_lights = 1,
		                           .ambient = { 0.1, 0.1, 0.1 } };
	s->scene.camera = (struct psr_camera){ .eye = { 0, 0, 4 },
		                                   .up = { 0, 1, 0 },
		                                   .kind = PSR_CAMERA_ORTHOGRAPHIC,
		                                   .ortho_height = 2.9 };
	assert_int_equal(psr_renderer_create(&s->renderer, NULL), PSR_OK);
}

static void stage_fini(struct stage *s)
{
	psr_renderer_destroy(s->renderer);
	psr_model_unref(s->floor);
	psr_model_unref(s->square);
}

static uint8_t *draw(struct stage *s, struct psr_pool *pool)
{
	struct render_settings settings;
	struct psr_error err;
	struct psr_frame frame = { .width = SIDE, .height = SIDE, .rgb = malloc(3 * PIXELS) };
	render_settings_default(&settings, SIDE, SIDE);
	assert_non_null(frame.rgb);
	if (renderer_draw(s->renderer, &s->scene, &settings, pool, &frame, &err))
		fail_msg("%s", err.text);
	s->report = frame.report;
	return frame.rgb;
}

static uint8_t *draw_unshadowed(struct stage *s)
{
	s->light[0].casts_shadow = 0;
	uint8_t *rgb = draw(s, NULL);
	assert_int_equal(s->report.n_shadow_maps, 0);
	s->light[0].casts_shadow = 1;
	return rgb;
}

static uint8_t *draw_dark(struct stage *s)
{
	const struct psr_light light = s->light[0];
	memset(s->light[0].color, 0, sizeof s->light[0].color);
	uint8_t *rgb = draw(s, NULL);
	s->light[0] = light;
	return rgb;
}

/* How far a place of the floor is inside of the square's shadow, as the light goes: below 0 outside. */
static double inside_shadow(const struct psr_light *l, double x, double y)
{
	double from[3] = { 0 };
	if (l->kind == PSR_LIGHT_DIRECTIONAL) {
		from[0] = x - l->direction[0] * HEIGHT / -l->direction[2];
		from[1] = y - l->direction[1] * HEIGHT / -l->direction[2];
		return HALF_SQUARE - fmax(fabs(from[0]), fabs(from[1]));
	}
	/* Back along the ray to the square's plane, and its distance there on the scale of the floor. */
	const double t = HEIGHT / l->position[2];
	from[0] = x + (l->position[0] - x) * t;
	from[1] = y + (l->position[1] - y) * t;
	return (HALF_SQUARE - fmax(fabs(from[0]), fabs(from[1]))) / (1 - t);
}

/* Every pixel further than `reach` from the analytic edge is as lit or as dark as without the square, or without the
 * light. */
static void check_edges(const struct shape_options *square, const struct psr_light *light, double reach)
{
	struct stage s;
	stage_init(&s, square, light);
	uint8_t *lit = draw_unshadowed(&s), *dark = draw_dark(&s), *got = draw(&s, NULL);
	unsigned wrong_lit = 0, wrong_dark = 0, n_lit = 0, n_dark = 0;
	assert_true(s.report.n_shadow_maps >= 1);
	for (int i = 0; i < PIXELS; i++) {
		const double x = (i % SIDE + 0.5 - SIDE / 2) * 2.9 / SIDE, y = (SIDE / 2 - i / SIDE - 0.5) * 2.9 / SIDE;
		const double depth = inside_shadow(light, x, y);
		if (fabs(x) > HALF_FLOOR - 0.02 || fabs(y) > HALF_FLOOR - 0.02 || memcmp(lit + 3 * i, dark + 3 * i, 3) == 0)
			continue;
		n_lit += depth < -reach;
		n_dark += depth > reach;
		wrong_lit += depth < -reach && memcmp(got + 3 * i, lit + 3 * i, 3) != 0;
		wrong_dark += depth > reach && memcmp(got + 3 * i, dark + 3 * i, 3) != 0;
	}
	if (wrong_lit || wrong_dark || n_lit < 10000 || n_dark < 500)
		fail_msg("%u of %u lit and %u of %u dark pixels are wrong", wrong_lit, n_lit, wrong_dark, n_dark);
	free(lit);
	free(dark);
	free(got);
	stage_fini(&s);
}

/* Width on the floor of a texel of the light's map for this picture. The axis is never further than `tilt` from the
 * floor's normal, which widens it by less than 1 / cos^2 there. */
static double texel_on_floor(const struct psr_light *light)
{
	struct stage s;
	struct shadow_bounds bounds;
	struct shadow_fit fit[SHADOW_FACES];
	stage_init(&s, &FINE, light);
	shadow_bounds_make(&bounds, &s.scene);
	shadow_fit_light(fit, light, &s.scene, &bounds, SIDE);
	stage_fini(&s);
	const struct psr_camera *c = &fit[0].camera;
	if (light->kind == PSR_LIGHT_DIRECTIONAL)
		return c->ortho_height / fit[0].height * sqrt(1 + 0.35 * 0.35 + 0.2 * 0.2);
	/* z' of the floor's places is up to twice the light's height for these lights. */
	return 2 * tan(c->fov_y / 2) / fit[0].height * 2 * light->position[2];
}

/* A texel that the square's samples fall into is within half a texel of it on each axis, and bilinear weights reach a
 * texel further: 1.5 texels of the map outside, its diagonal 1.5 sqrt(2). Inside, texels that are within the square
 * altogether have a sample each: as much. A sample of the floor is anywhere in its pixel: 0.71 pixels. */
static double reach_of(double texel)
{
	return 1.5 * sqrt(2) * texel + 0.71 * 2.9 / SIDE;
}

static void a_directional_shadow_is_where_it_should_be(void **state)
{
	(void)state;
	check_edges(&FINE, &SUN, reach_of(texel_on_floor(&SUN)));
}

static void a_spot_s_shadow_is_where_it_should_be(void **state)
{
	(void)state;
	check_edges(&FINE, &SPOT, reach_of(texel_on_floor(&SPOT)));
}

static void a_lamp_amid_the_scene_casts_around(void **state)
{
	(void)state;
	check_edges(&FINE, &LAMP, reach_of(texel_on_floor(&LAMP)));
}

/* The square has a sample every 0.033 here, which takes cells of as much. */
static void a_coarse_square_casts_without_leaks(void **state)
{
	(void)state;
	double cell = texel_on_floor(&SUN);
	while (cell < 0.4 * 2 / 24 * sqrt(1 + 0.35 * 0.35 + 0.2 * 0.2))
		cell *= 2;
	check_edges(&COARSE, &SUN, reach_of(cell));
}

/* A lamp just above the square, whose cells are of many sizes there: nothing comes through where levels meet. The
 * square's spacing is twice as wide on the floor, and cells at most twice that. */
static void levels_meet_without_leaks(void **state)
{
	(void)state;
	for (int i = 0; i < 8; i++) {
		struct shape_options square = COARSE;
		struct psr_light light = LAMP;
		square.resolution = 24 + 16 * (uint32_t)i;
		light.position[0] = -0.3 + 0.1 * i;
		light.position[1] = 0.05 * i;
		light.position[2] = 1;
		const double cell = 2 * 2 * 0.4 * 2 / square.resolution, reach = reach_of(cell);
		struct stage s;
		stage_init(&s, &square, &light);
		uint8_t *dark = draw_dark(&s), *got = draw(&s, NULL);
		unsigned n_dark = 0, n_leaks = 0;
		for (int p = 0; p < PIXELS; p++) {
			const double x = (p % SIDE + 0.5 - SIDE / 2) * 2.9 / SIDE, y = (SIDE / 2 - p / SIDE - 0.5) * 2.9 / SIDE;
			if (fabs(x) > HALF_FLOOR - 0.02 || fabs(y) > HALF_FLOOR - 0.02 || inside_shadow(&light, x, y) < reach)
				continue;
			n_dark++;
			n_leaks += memcmp(got + 3 * p, dark + 3 * p, 3) != 0;
		}
		if (n_leaks || n_dark < 1000)
			fail_msg("a square of %u: %u of %u pixels are lit", square.resolution, n_leaks, n_dark);
		free(dark);
		free(got);
		stage_fini(&s);
	}
}

/* Whatever the light's angle, down to 2.3 degrees above it. */
static void a_plane_does_not_shadow_itself(void **state)
{
	(void)state;
	for (int i = 0; i < 40; i++) {
		const double turn = 2.4 * i, slope = 0.1 + 0.5 * (i % 8) * (i % 8);
		struct psr_light light = SUN;
		struct stage s;
		light.direction[0] = cos(turn) * slope;
		light.direction[1] = sin(turn) * slope;
		if (i % 3 == 1) {
			light.kind = PSR_LIGHT_POINT;
			for (int k = 0; k < 3; k++)
				light.position[k] = -(k == 2 ? -1 : light.direction[k]) * (2.0 / (1 + slope));
		}
		stage_init(&s, i & 1 ? &FINE : &COARSE, &light);
		s.scene.instance = &s.instance[i & 1];
		s.instance[1] = (struct psr_instance){ .model = s.square, .rotation = { 0, 0, 0, 1 }, .scale = 1.5 };
		s.scene.n_instances = 1;
		uint8_t *lit = draw_unshadowed(&s), *got = draw(&s, NULL);
		assert_int_equal(s.report.n_shadow_maps_drawn, s.report.n_shadow_maps);
		unsigned n = 0;
		for (int p = 0; p < PIXELS; p++)
			n += memcmp(got + 3 * p, lit + 3 * p, 3) != 0;
		if (n)
			fail_msg("light %d: %u pixels are in shadow", i, n);
		free(lit);
		free(got);
		stage_fini(&s);
	}
}

/* A sphere shadows itself nowhere but where its stored normals, 0.7 degrees off, say that it is lit though it is not:
 * there it has at most 0.0125 of the light, and as much is allowed to be missing. */
static void a_sphere_does_not_shadow_itself(void **state)
{
	(void)state;
	static const struct psr_light *const lights[] = { &SUN, &SPOT };
	for (int i = 0; i < 2; i++) {
		struct stage s;
		struct psr_light light = *lights[i];
		light.color[0] = light.color[1] = light.color[2] = 1;
		stage_init(&s, &FINE, &light);
		struct psr_model *sphere = shape_build(&FINE, 0.95);
		s.instance[0].model = sphere;
		s.instance[0].scale = 1;
		s.scene.n_instances = 1;
		memset(s.scene.ambient, 0, sizeof s.scene.ambient);
		uint8_t *lit = draw_unshadowed(&s), *got = draw(&s, NULL);
		for (int p = 0; p < 3 * PIXELS; p++)
			/* sRGB codes up to 25 are 0.0098 linear; 0xc0 is 0.527: 0.0125 of it is below that. */
			if (got[p] != lit[p] && lit[p] > 25)
				fail_msg("light %d, pixel %d: %d instead of %d", i, p / 3, got[p], lit[p]);
		free(lit);
		free(got);
		psr_model_unref(sphere);
		stage_fini(&s);
	}
}

/* A wall that stands on the floor and is nearly along the light, which shines on both. Its samples are as much nearer
 * than the floor's, in the texel that both share, as the wall is steep. The camera is above, and near; where a pixel may
 * show a sample of the wall, whose own is less than a pixel beside it, nothing is said. */
static void faces_that_meet_do_not_shadow_each_other(void **state)
{
	(void)state;
	for (int i = 0; i < 8; i++) {
		struct stage s;
		struct psr_light light = SUN;
		const double wall = -0.5, turn = sqrt(0.5), view = 0.5, pixel = view / SIDE;
		light.direction[0] = -0.05 - 0.05 * i;
		light.direction[1] = 0.05;
		stage_init(&s, &FINE, &light);
		s.instance[1] = (struct psr_instance){ .model = s.square, .rotation = { 0, turn, 0, turn },
			                                   .translation = { wall, 0, HALF_SQUARE }, .scale = 0.4 };
		s.scene.camera.eye[0] = s.scene.camera.target[0] = wall;
		s.scene.camera.ortho_height = view;
		uint8_t *lit = draw_unshadowed(&s), *got = draw(&s, NULL);
		unsigned n = 0;
		for (int p = 0; p < PIXELS; p++) {
			const double x = wall + (p % SIDE + 0.5 - SIDE / 2) * pixel;
			n += x > wall + 2 * pixel && memcmp(got + 3 * p, lit + 3 * p, 3) != 0;
		}
		if (n)
			fail_msg("light %d: %u pixels before the wall are in shadow\n", i, n);
		free(lit);
		free(got);
		stage_fini(&s);
	}
}

static void threads_and_instructions_change_no_byte(void **state)
{
	(void)state;
	static const struct psr_light *const lights[] = { &SUN, &SPOT, &LAMP };
	const enum psr_isa best = psr_isa_get();
	uint8_t *first = NULL;
	for (int i = 0; i < PSR_N_ISAS * 2; i++) {
		struct psr_pool *pool = NULL;
		struct stage s;
		psr_isa_cap(i % PSR_N_ISAS);
		stage_init(&s, &COARSE, &SUN);
		for (int l = 0; l < 3; l++)
			s.light[l] = *lights[l];
		s.scene.n_lights = 3;
		if (i >= PSR_N_ISAS)
			assert_int_equal(psr_pool_create(&pool, 3, NULL), PSR_OK);
		uint8_t *rgb = draw(&s, pool);
		if (first)
			assert_memory_equal(rgb, first, 3 * PIXELS);
		else
			first = rgb;
		if (rgb != first)
			free(rgb);
		psr_pool_destroy(pool);
		stage_fini(&s);
	}
	free(first);
	psr_isa_cap(best);
}

/* Draws, and again with a renderer that has seen nothing. */
static void check_drawn(struct stage *s, uint32_t n_maps, uint32_t n_drawn)
{
	uint8_t *kept = draw(s, NULL);
	assert_int_equal(s->report.n_shadow_maps, n_maps);
	assert_int_equal(s->report.n_shadow_maps_drawn, n_drawn);
	assert_int_equal(s->report.count[PSR_STAGE_SHADOW] > 0, n_drawn > 0);
	struct psr_renderer *old = s->renderer;
	assert_int_equal(psr_renderer_create(&s->renderer, NULL), PSR_OK);
	uint8_t *fresh = draw(s, NULL);
	assert_int_equal(s->report.n_shadow_maps_drawn, n_maps);
	assert_memory_equal(kept, fresh, 3 * PIXELS);
	psr_renderer_destroy(s->renderer);
	s->renderer = old;
	free(kept);
	free(fresh);
}

static void maps_are_kept_while_light_and_scene_stand_still(void **state)
{
	(void)state;
	struct stage s;
	stage_init(&s, &FINE, &SUN);
	s.light[1] = SPOT;
	s.scene.n_lights = 2;
	check_drawn(&s, 2, 2);
	check_drawn(&s, 2, 0);
	s.scene.camera.eye[0] = 1;
	s.light[0].color[1] = 0.3;
	s.light[1].inner = 0.1;
	check_drawn(&s, 2, 0);
	s.light[0].direction[1] = 0.25;
	check_drawn(&s, 2, 1);
	s.light[1].casts_shadow = 0;
	check_drawn(&s, 1, 0);
	s.light[1].casts_shadow = 1;
	check_drawn(&s, 2, 1);
	s.instance[1].translation[0] = 0.01;
	check_drawn(&s, 2, 2);
	s.instance[1].model = s.floor;
	check_drawn(&s, 2, 0); /* another object of the same content */
	s.scene.n_instances = 1;
	check_drawn(&s, 2, 2);
	stage_fini(&s);
}

static void lights_that_change_nothing_have_no_map(void **state)
{
	(void)state;
	struct stage s;
	stage_init(&s, &FINE, &SUN);
	s.light[1] = SPOT;
	s.light[1].direction[2] = 1; /* away from everything */
	s.light[2] = SUN;
	memset(s.light[2].color, 0, sizeof s.light[2].color);
	s.light[3] = LAMP;
	s.light[3].casts_shadow = 0;
	s.scene.n_lights = 4;
	check_drawn(&s, 1, 1);
	s.scene.camera.target[0] = s.scene.camera.eye[0] = 50; /* nothing is in view */
	free(draw(&s, NULL));
	assert_int_equal(s.report.n_shadow_maps, 0);
	s.scene.camera.target[0] = s.scene.camera.eye[0] = 0;
	s.scene.n_instances = 0;
	free(draw(&s, NULL));
	assert_int_equal(s.report.n_shadow_maps, 0);
	stage_fini(&s);
}

static void without_color_there_are_no_maps_and_those_of_frames_before_are_kept(void **state)
{
	(void)state;
	struct stage s;
	struct render_settings settings;
	struct psr_error err;
	static uint8_t rgb[3 * 128 * 128];
	static float depth[128 * 128];
	stage_init(&s, &FINE, &SUN);
	render_settings_default(&settings, 128, 128);
	struct psr_frame frame = { .width = 128, .height = 128, .depth = depth };
	for (int i = 0; i < 4; i++) {
		frame.rgb = i % 2 ? rgb : NULL;
		assert_int_equal(renderer_draw(s.renderer, &s.scene, &settings, NULL, &frame, &err), PSR_OK);
		assert_int_equal(frame.report.n_shadow_maps, i % 2);
		assert_int_equal(frame.report.n_shadow_maps_drawn, i == 1);
		assert_int_equal(frame.report.effect[PSR_EFFECT_SHADOWS].why, i % 2 ? PSR_WHY_RAN : PSR_WHY_OFF);
	}
	stage_fini(&s);
}

static void memory_is_bounded(void **state)
{
	(void)state;
	struct stage s;
	struct render_settings settings;
	struct psr_error err;
	stage_init(&s, &FINE, &LAMP);
	render_settings_default(&settings, 4096, 8);
	static uint8_t rgb[3 * 4096 * 8];
	struct psr_frame frame = { .width = settings.width, .height = settings.height, .rgb = rgb };
	s.light[0].casts_shadow = 0;
	assert_int_equal(renderer_draw(s.renderer, &s.scene, &settings, NULL, &frame, &err), PSR_OK);
	const uint64_t before = psr_renderer_bytes(s.renderer);
	for (uint32_t n = 1; n <= PSR_MAX_LIGHTS; n += 31) {
		for (uint32_t l = 0; l < n; l++) {
			s.light[l] = LAMP;
			s.light[l].position[0] = 0.01 * l;
		}
		s.scene.n_lights = n;
		assert_int_equal(renderer_draw(s.renderer, &s.scene, &settings, NULL, &frame, &err), PSR_OK);
		assert_true(frame.report.n_shadow_maps >= 5 * n);
		/* Cells of all levels, the guard bands of up to 192 maps among them, the depths of the largest map, and what
		 * is kept of lights and instances, words of a tile, and entries of tiles. */
		const uint64_t cells = SHADOW_TEXELS * UINT64_C(2) * 5 / 3, bands = 194 * 15 * 4 * UINT64_C(2048) * 2;
		const uint64_t drawn = PSR_MAX_SHADOW_SIDE * PSR_MAX_SHADOW_SIDE * UINT64_C(4) * 5 / 3, rest = 4u << 20;
		assert_true(psr_renderer_bytes(s.renderer) - before <= cells + bands + drawn + rest);
	}
	stage_fini(&s);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_directional_shadow_is_where_it_should_be),
		cmocka_unit_test(a_spot_s_shadow_is_where_it_should_be),
		cmocka_unit_test(a_lamp_amid_the_scene_casts_around),
		cmocka_unit_test(a_coarse_square_casts_without_leaks),
		cmocka_unit_test(levels_meet_without_leaks),
		cmocka_unit_test(a_plane_does_not_shadow_itself),
		cmocka_unit_test(a_sphere_does_not_shadow_itself),
		cmocka_unit_test(faces_that_meet_do_not_shadow_each_other),
		cmocka_unit_test(threads_and_instructions_change_no_byte),
		cmocka_unit_test(maps_are_kept_while_light_and_scene_stand_still),
		cmocka_unit_test(lights_that_change_nothing_have_no_map),
		cmocka_unit_test(without_color_there_are_no_maps_and_those_of_frames_before_are_kept),
		cmocka_unit_test(memory_is_bounded),
	};
	only_threads_under_tsan();
	const int n_failed = cmocka_run_group_tests(tests, NULL, NULL);
	for (int i = 0; i <= 256; i++)
		psr_model_unref(squares[i]);
	return n_failed;
}

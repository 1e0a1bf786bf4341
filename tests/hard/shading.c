/* Light at the ends of its numbers ([G] 7.3): vectors without length, lights in and on the surface, spots of no and of
 * all angles, any attribute word, many lights, grazing shadows.
 *
 * All sums of light have terms of 0 or more, in any form of reflection. So a light never darkens a pixel, and one that
 * no surface faces changes none: these claims have the bound 0. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/random.h"
#include "base/vec.h"
#include "lib/blocks.h"
#include "simd/simd.h"
#include "tests/unit/lib/shapes.h"

#define SIDE 160
#define PIXELS (SIDE * SIDE)
#define PI 3.14159265358979323846

/* Everything that a sample can say but for its normal and the mark of unlit ones. */
static uint64_t random_word(uint64_t *seed)
{
	const uint64_t ends[] = { 0, 0xff, 0xffff };
	const uint64_t specular = random_below(seed, 2) ? ends[random_below(seed, 3)] : random_next(seed) & 0xffff;
	const uint64_t exponent = random_below(seed, 2) ? 255 * random_below(seed, 2) : random_below(seed, 256);
	const uint64_t color = random_below(seed, 3) ? random_below(seed, 1 << 24) : 0xffffff * random_below(seed, 2);

	return exponent << 56 | specular << 40 | color << 16;
}

/* A plane z = 0 of random words, whose samples fill the pixels of an orthographic picture from +z. */
static struct psr_model *plane_of_words(uint64_t *seed)
{
	const struct psr_projection projection = { { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }, 1.0f / 128 };
	const struct hard_model options = { .projection = &projection, .n_projections = 1 };
	static struct hard_block block[20 * 20];

	for (int b = 0; b < 400; b++) {
		block[b] = (struct hard_block){ .col = 8 * (b % 20 - 10), .row = 8 * (b / 20 - 10), .mask = UINT64_MAX };
		for (int i = 0; i < 64; i++) {
			const double tilt = random_in(seed, 0, 1), turn = random_in(seed, 0, 2 * PI);
			const double normal[3] = { tilt * cos(turn), tilt * sin(turn), 1 };

			block[b].attr[i] = (hard_attr(normal, 0, 0) & 0x7fff) | random_word(seed);
		}
	}
	return hard_model(&options, block, 400);
}

static struct psr_scene scene_of(const struct psr_instance *instance, const struct psr_light *light, uint32_t n)
{
	struct psr_scene scene = { .instance = instance, .n_instances = 1, .light = light, .n_lights = n,
		                       .ambient = { 0.05, 0.06, 0.07 } };

	scene.camera = (struct psr_camera){ .eye = { 0, 0, 2 }, .up = { 0, 1, 0 }, .kind = PSR_CAMERA_ORTHOGRAPHIC,
		                                .ortho_height = SIDE / 128.0 };
	return scene;
}

static struct psr_light random_light(uint64_t *seed)
{
	struct psr_light light = { .kind = (enum psr_light_kind)random_below(seed, 3), .color = { 0.3, 0.2, 0.1 },
		                       .reference = random_below(seed, 2) ? exp2(random_in(seed, -20, 20)) : 0 };

	hard_direction(light.direction, seed);
	hard_direction(light.position, seed);
	v3d_scale(light.position, light.position, exp2(random_in(seed, -20, 20)));
	light.outer = random_in(seed, 0.001, PI);
	light.inner = light.outer * random_in(seed, 0, 1);
	return light;
}

/* Returns how many bytes of colour differ; fails if one is below the other picture's. */
static size_t brighter(const struct psr_frame *frame, const struct psr_frame *dark)
{
	size_t n = 0;

	for (size_t i = 0; i < 3 * PIXELS; i++) {
		if (frame->rgb[i] < dark->rgb[i])
			fail_msg("pixel (%zu, %zu): %d with a light more, %d without", i / 3 % SIDE, i / 3 / SIDE, frame->rgb[i],
			         dark->rgb[i]);
		n += frame->rgb[i] > dark->rgb[i];
	}
	return n;
}

static void a_light_more_darkens_no_pixel_of_any_words(void **state)
{
	uint64_t seed = 1, n_lit = 0;

	(void)state;
	for (int i = 0; i < HARD_CASES(60); i++) {
		struct psr_model *model = plane_of_words(&seed);
		struct psr_instance instance = hard_place(model);
		struct psr_light light[8];
		struct psr_frame frame, before;

		for (uint32_t n = 0; n <= 8; n++) {
			const struct psr_scene scene = scene_of(&instance, light, n);

			hard_draw(&frame, &scene, SIDE, SIDE);
			n_lit += n ? brighter(&frame, &before) : 0;
			if (n)
				psr_frame_free(&before);
			before = frame;
			if (n < 8)
				light[n] = random_light(&seed);
		}
		psr_frame_free(&before);
		psr_model_unref(model);
	}
	assert_true(n_lit > 0);
}

/* Lights whose direction is as long as may be, or as short: the unit vector is the same to the last bit if lengths are
 * powers of two, so the picture is. Shorter or longer ones are refused. */
static void a_lights_direction_may_have_any_length(void **state)
{
	uint64_t seed = 2;
	struct psr_model *model = plane_of_words(&seed);
	struct psr_instance instance = hard_place(model);

	(void)state;
	for (int kind = 0; kind < 3; kind += 2) {
		struct psr_light light = random_light(&seed);
		struct psr_frame frame, plain;
		const struct psr_scene scene = scene_of(&instance, &light, 1);

		light.kind = (enum psr_light_kind)kind;
		light.direction[2] = -fabs(light.direction[2]) - 0.1;
		v3d_set(light.position, 0, 0, 1);
		hard_draw(&plain, &scene, SIDE, SIDE);
		for (int n = -90; n <= 90; n += 30) {
			const struct psr_light was = light;

			v3d_scale(light.direction, light.direction, ldexp(1, n));
			hard_draw(&frame, &scene, SIDE, SIDE);
			hard_same_planes(&frame, &plain, HARD_ALL_PLANES);
			psr_frame_free(&frame);
			light = was;
		}
		psr_frame_free(&plain);
		static const double wrong[] = { 0, 1e-300, 1e-31, 1e31, 1e300, INFINITY, NAN };
		for (size_t w = 0; w < sizeof wrong / sizeof wrong[0]; w++) {
			struct psr_error err = { 0 };

			v3d_set(light.direction, 0, 0, wrong[w]);
			assert_int_equal(psr_scene_validate(&scene, &err), PSR_ERR_ARG);
			assert_non_null(strstr(err.text, "direction"));
		}
	}
	psr_model_unref(model);
}

/* A one-sided closed surface around the light faces it nowhere, and neither does a plane whose other side it lights,
 * but for its own quantised normals' error. On the surface itself, where a pixel's place and the light are the same,
 * there is no direction: that light is 0. */
static void a_light_inside_behind_or_on_the_surface_is_finite(void **state)
{
	const struct shape_options options = { .resolution = 96, .diffuse = 0x6090c0, .scale = 1 };
	struct psr_model *ball = shape_build(&options, 0.9), *plane;
	struct psr_instance instance = hard_place(ball);
	struct psr_light light = { .kind = PSR_LIGHT_POINT, .color = { 1e9, 1e9, 1e9 }, .reference = 1e6 };
	struct psr_scene scene = scene_of(&instance, &light, 0);
	struct psr_frame frame, dark;
	uint64_t seed = 3;

	(void)state;
	scene.camera.ortho_height = 2.2;
	hard_draw(&dark, &scene, SIDE, SIDE);
	scene.n_lights = 1;
	for (int i = 0; i < 20; i++) {
		hard_direction(light.position, &seed);
		v3d_scale(light.position, light.position, i ? random_in(&seed, 0, 0.5) : 0);
		light.casts_shadow = i % 2;
		hard_draw(&frame, &scene, SIDE, SIDE);
		hard_same_planes(&frame, &dark, 1u << PSR_PLANE_COLOR);
		psr_frame_free(&frame);
	}
	psr_frame_free(&dark);
	psr_model_unref(ball);

	/* Pixel (80, 80) is centred at (1/256, -1/256), and the plane's depth is exact. */
	plane = plane_of_words(&seed);
	instance = hard_place(plane);
	scene = scene_of(&instance, &light, 0);
	light = (struct psr_light){ .position = { 1 / 256.0, -1 / 256.0, 0 }, .color = { 1, 1, 1 } };
	hard_draw(&dark, &scene, SIDE, SIDE);
	scene.n_lights = 1;
	for (int i = 0; i < 12; i++) { /* with and without fall-off and shadow, as a point and as a spot */
		light.kind = i % 2 ? PSR_LIGHT_SPOT : PSR_LIGHT_POINT;
		light.reference = (double[]){ 0, 1e-20, 1e20 }[i / 4];
		light.casts_shadow = i / 2 % 2;
		v3d_set(light.direction, 0, 0, -1);
		light.inner = light.outer = 1;
		hard_draw(&frame, &scene, SIDE, SIDE);
		brighter(&frame, &dark);
		assert_memory_equal(frame.rgb + 3 * (80 * SIDE + 80), dark.rgb + 3 * (80 * SIDE + 80), 3);
		psr_frame_free(&frame);
	}
	psr_frame_free(&dark);
	psr_model_unref(plane);
}

/* A spot of all directions is a point light, but straight behind its axis; one of next to none lights nothing but its
 * axis; one without a soft edge lights a pixel as the point light or not at all. */
static void spots_of_0_and_180_degrees_are_as_they_should(void **state)
{
	uint64_t seed = 4;
	struct psr_model *model = plane_of_words(&seed);
	struct psr_instance instance = hard_place(model);
	struct psr_frame point, dark, frame;
	struct psr_light light = { .kind = PSR_LIGHT_POINT, .position = { 0.01, 0.02, 0.4 }, .direction = { 0.3, 0.2, -1 },
		                       .color = { 0.5, 0.6, 0.7 }, .reference = 0.5 };
	struct psr_scene scene = scene_of(&instance, &light, 0);
	struct psr_error err;

	(void)state;
	hard_draw(&dark, &scene, SIDE, SIDE);
	scene.n_lights = 1;
	hard_draw(&point, &scene, SIDE, SIDE);
	light.kind = PSR_LIGHT_SPOT;
	light.inner = light.outer = PI;
	hard_draw(&frame, &scene, SIDE, SIDE);
	hard_same_planes(&frame, &point, 1u << PSR_PLANE_COLOR);
	psr_frame_free(&frame);
	light.inner = 0; /* the widest of soft edges */
	hard_draw(&frame, &scene, SIDE, SIDE);
	brighter(&frame, &dark);
	brighter(&point, &frame);
	psr_frame_free(&frame);
	light.outer = 1e-300; /* its cosine is 1, and no cosine is greater */
	hard_draw(&frame, &scene, SIDE, SIDE);
	assert_true(brighter(&frame, &dark) <= 3 * 4); /* rounding may let the axis's own pixels pass */
	psr_frame_free(&frame);
	for (double angle = 0.02; angle < PI; angle += 0.21) {
		light.inner = light.outer = angle;
		hard_draw(&frame, &scene, SIDE, SIDE);
		for (size_t p = 0; p < PIXELS; p++)
			assert_true(!memcmp(frame.rgb + 3 * p, point.rgb + 3 * p, 3)
			            || !memcmp(frame.rgb + 3 * p, dark.rgb + 3 * p, 3));
		psr_frame_free(&frame);
	}
	light.outer = light.inner = 0;
	assert_int_equal(psr_scene_validate(&scene, &err), PSR_ERR_ARG);
	psr_frame_free(&point);
	psr_frame_free(&dark);
	psr_model_unref(model);
}

/* The scene has 32 lights at most, and says so; the kernel adds up any number. Each sum of n terms of at most c is
 * within n (n + 6) / 2 roundings of 2^-24 c: a term goes through six (three products and two sums of N.L, one with the
 * colour), and each partial sum, of up to i c, through one. Normals of no length, or of denormal ones, give no light or
 * next to none. */
static void a_thousand_lights_add_up(void **state)
{
	enum { N = 1000 };
	static struct strip strip;
	static struct psr_light many[N];
	struct strip_light light[N];
	uint64_t seed = 5;
	struct psr_scene scene = scene_of(NULL, many, N);
	struct psr_error err = { 0 };

	(void)state;
	scene.n_instances = 0;
	for (int i = 0; i < N; i++)
		many[i] = random_light(&seed);
	assert_int_equal(psr_scene_validate(&scene, &err), PSR_ERR_LIMIT);
	assert_non_null(strstr(err.text, "1000 lights"));
	assert_non_null(strstr(err.text, "32"));

	memset(&strip, 0, sizeof strip);
	strip.n = STRIP;
	for (int i = 0; i < STRIP; i++) {
		double n[3];

		hard_direction(n, &seed);
		const float length = i % 8 == 0 ? 0 : i % 8 == 1 ? 0x1p-140f : 1;
		strip.nx[i] = (float)n[0] * length;
		strip.ny[i] = (float)n[1] * length;
		strip.nz[i] = (float)n[2] * length;
	}
	for (int l = 0; l < N; l++) {
		double d[3];

		hard_direction(d, &seed);
		light[l] = (struct strip_light){ .kind = PSR_LIGHT_DIRECTIONAL,
			                             .to_light = { (float)d[0], (float)d[1], (float)d[2] },
			                             .color = { 1, 0.5f, (float)random_in(&seed, 0, 1) } };
		simd_get()->strip_light(&strip, &light[l], NULL);
	}
	for (int i = 0; i < STRIP; i++) {
		const double n[3] = { (double)strip.nx[i], (double)strip.ny[i], (double)strip.nz[i] };
		double sum[3] = { 0 }, greatest = v3d_length(n);

		for (int l = 0; l < N; l++)
			for (int c = 0; c < 3; c++)
				sum[c] += (double)light[l].color[c]
				          * fmax(0, n[0] * (double)light[l].to_light[0] + n[1] * (double)light[l].to_light[1]
				                            + n[2] * (double)light[l].to_light[2]);
		const double off = N * (N + 6) / 2.0 * 0x1p-24 * greatest + N * 6 * 0x1p-149;
		assert_true(fabs((double)strip.lr[i] - sum[0]) <= off && fabs((double)strip.lg[i] - sum[1]) <= off
		            && fabs((double)strip.lb[i] - sum[2]) <= off);
	}
}

/* A flat surface does not shade itself, however flatly the light comes, down to 0.8 degrees: cells are at the depth of
 * their nearest samples, and the test takes the surface's own slope into account. Below 0.72 degrees, the error of
 * stored normals (BACK_SINE), it is not sure which side is lit. */
static void a_flat_surface_lit_at_a_grazing_angle_has_no_shadow(void **state)
{
	const uint64_t attr = hard_attr((const double[3]){ 0, 0, 1 }, 0, 0);
	static const double degrees[] = { 80, 45, 20, 10, 5, 3, 2, 1.5, 1.2, 1, 0.8 };
	struct psr_model *model =
		hard_sheet(&(struct hard_sheet){ .spacing = 1.0 / 128, .groups = 20, .levels = 1, .attr = attr });
	struct psr_instance instance = hard_place(model);
	struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .color = { 8, 8, 8 } };
	struct psr_scene scene = scene_of(&instance, &light, 1);
	struct psr_frame frame, plain;

	(void)state;
	scene.camera.ortho_height = 1;
	for (size_t i = 0; i < sizeof degrees / sizeof degrees[0]; i++)
		for (double turn = 0.1; turn < 2 * PI; turn += 0.7) {
			const double a = degrees[i] * PI / 180;

			v3d_set(light.direction, cos(a) * cos(turn), cos(a) * sin(turn), -sin(a));
			light.casts_shadow = 0;
			hard_draw(&plain, &scene, SIDE, SIDE);
			light.casts_shadow = 1;
			hard_draw(&frame, &scene, SIDE, SIDE);
			assert_int_equal(frame.report.n_shadow_maps, 1);
			hard_same_planes(&frame, &plain, 1u << PSR_PLANE_COLOR);
			psr_frame_free(&frame);
			psr_frame_free(&plain);
		}
	psr_model_unref(model);
}

/* Instances in a row, 1e4 times as long as wide: a light from above has a map of 1 : 1e4, one along the row sees them
 * all behind each other. Maps stay within their limit of texels, and the flat ones do not shade themselves. */
static void a_scene_with_shadows_may_be_1e4_times_longer_than_wide(void **state)
{
	const uint64_t attr = hard_attr((const double[3]){ 0, 0, 1 }, 0, 0);
	struct psr_model *model =
		hard_sheet(&(struct hard_sheet){ .spacing = 1.0 / 64, .groups = 12, .levels = 1, .attr = attr });
	struct psr_instance instance[64];
	struct psr_light light = { .kind = PSR_LIGHT_DIRECTIONAL, .color = { 1, 1, 1 } };
	struct psr_scene scene = scene_of(instance, &light, 1);
	struct psr_frame frame, plain;

	(void)state;
	for (int i = 0; i < 64; i++) {
		instance[i] = hard_place(model);
		instance[i].translation[0] = i * 2e4 / 63;
	}
	scene.n_instances = 64;
	scene.camera.ortho_height = 1;
	for (int i = 0; i < 4; i++) {
		v3d_set(light.direction, (double[]){ 0, 0.1, 1, 30 }[i], 0.01 * i, -1);
		light.casts_shadow = 0;
		hard_draw(&plain, &scene, SIDE, SIDE);
		light.casts_shadow = 1;
		hard_draw(&frame, &scene, SIDE, SIDE);
		assert_int_equal(frame.report.n_shadow_maps, 1);
		hard_same_planes(&frame, &plain, 1u << PSR_PLANE_COLOR);
		psr_frame_free(&frame);
		psr_frame_free(&plain);
	}
	psr_model_unref(model);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_light_more_darkens_no_pixel_of_any_words),
		cmocka_unit_test(a_lights_direction_may_have_any_length),
		cmocka_unit_test(a_light_inside_behind_or_on_the_surface_is_finite),
		cmocka_unit_test(spots_of_0_and_180_degrees_are_as_they_should),
		cmocka_unit_test(a_thousand_lights_add_up),
		cmocka_unit_test(a_flat_surface_lit_at_a_grazing_angle_has_no_shadow),
		cmocka_unit_test(a_scene_with_shadows_may_be_1e4_times_longer_than_wide),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

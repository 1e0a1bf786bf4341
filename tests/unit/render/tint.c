/* Colours by height and by what a scan tells: the right one at every pixel, whatever the light, on any threads. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/srgb.h"
#include "psr/render.h"
#include "tests/unit/lib/trees.h"

#define SIDE 96
#define RADIUS 0.9
#define HEIGHT 2.0 /* of the picture, world units */
/* A leaf's edge, and half a pixel for where its middle falls. */
#define SLACK (2.0 / 128 + HEIGHT / SIDE)

/* A sphere whose leaves have all that a scan tells. */
static struct psr_model *scanned(void)
{
	return tree_build(&(struct tree_options){ .levels = 7, .radius = RADIUS, .with_scan = 1, .keep = 1 });
}

struct scene_of {
	struct psr_instance instance;
	struct psr_light light;
	struct psr_scene scene;
};

static void look(struct scene_of *s, const struct psr_model *model, enum psr_color_by by)
{
	*s = (struct scene_of){ .instance = { .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1, .color_by = by } };
	s->light = (struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .color = { 1, 0.2, 0.5 },
		                           .direction = { 1, -1, -1 } };
	s->scene = (struct psr_scene){ .instance = &s->instance, .n_instances = 1, .light = &s->light,
		                           .camera = { .eye = { 0, 0, 4 }, .up = { 0, 1, 0 }, .kind = PSR_CAMERA_ORTHOGRAPHIC,
		                                       .ortho_height = HEIGHT } };
}

/* Returns the colours and depths of pixels that have samples; to be freed by psr_frame_free(). */
static struct psr_frame draw(const struct psr_scene *scene, int n_threads, unsigned pass)
{
	struct psr_renderer *renderer;
	struct psr_settings settings;
	struct psr_pool *pool;
	struct psr_frame frame;
	struct psr_error err;

	psr_settings_default(&settings, SIDE, SIDE);
	settings.pass = pass;
	assert_int_equal(psr_frame_alloc(&frame, SIDE, SIDE, 1 << PSR_PLANE_COLOR | 1 << PSR_PLANE_DEPTH, NULL), PSR_OK);
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(psr_pool_create(&pool, n_threads, NULL), PSR_OK);
	if (psr_render(renderer, scene, &settings, pool, &frame, &err) != PSR_OK)
		fail_msg("%s", err.text);
	psr_pool_destroy(pool);
	psr_renderer_destroy(renderer);
	return frame;
}

/* Whether a pixel's colour is this one, darkened by one factor of 0.7 to 1, to a code of each component. */
static int is_shade_of(const uint8_t rgb[3], const uint8_t of[3])
{
	double least = 0.69, most = 1.01; /* of the factor */

	for (int c = 0; c < 3; c++) {
		const double linear = (double)psr_srgb_to_linear[of[c]];
		const double low = (double)psr_srgb_to_linear[rgb[c] > 0 ? rgb[c] - 1 : 0];
		const double high = (double)psr_srgb_to_linear[rgb[c] < 255 ? rgb[c] + 1 : 255];

		if (linear <= 0)
			continue;
		least = fmax(least, low / linear);
		most = fmin(most, high / linear);
	}
	return least <= most;
}

/* The step of the ramp at y, whose range is -extent..extent. */
static unsigned step_of(double y, double extent)
{
	return (unsigned)(fmin(fmax((y / extent + 1) / 2, 0), 1) * (PSR_RAMP - 1) + 0.5);
}

static int is_on_ramp(const uint8_t rgb[3], double y, double extent)
{
	for (unsigned step = step_of(y - SLACK, extent); step <= step_of(y + SLACK, extent); step++) {
		uint8_t of[3];

		psr_ramp_color(of, step);
		if (is_shade_of(rgb, of))
			return 1;
	}
	return 0;
}

static int is_right(const uint8_t rgb[3], double x, double y, enum psr_color_by by)
{
	uint8_t one[3], other[3];

	if (by == PSR_COLOR_HEIGHT)
		return is_on_ramp(rgb, y, RADIUS);
	/* The ends of the range leave out a fiftieth of the leaves each: of a sphere, caps of a twenty-fifth of the
	 * radius. */
	if (by == PSR_COLOR_INTENSITY)
		return is_on_ramp(rgb, y, RADIUS * 0.96);
	if (by == PSR_COLOR_RETURN) {
		psr_order_color(one, PSR_RETURN_ONLY);
		return is_shade_of(rgb, one);
	}
	psr_class_color(one, 2);
	psr_class_color(other, 6);
	if (fabs(x) < SLACK)
		return is_shade_of(rgb, one) || is_shade_of(rgb, other);
	return is_shade_of(rgb, x > 0 ? one : other);
}

static void check(const struct psr_model *model, enum psr_color_by by)
{
	struct psr_frame frame, again;
	unsigned n = 0;
	struct scene_of s;

	look(&s, model, by);
	frame = draw(&s.scene, 1, 0);
	for (int y = 0; y < SIDE; y++)
		for (int x = 0; x < SIDE; x++) {
			const double right = (x + 0.5 - SIDE / 2.0) * HEIGHT / SIDE, up = -(y + 0.5 - SIDE / 2.0) * HEIGHT / SIDE;

			if (sqrt(right * right + up * up) > RADIUS - SLACK)
				continue; /* rims mix with nothing, but leaves behind the equator are seen there */
			n++;
			if (!is_right(frame.rgb + 3 * (y * SIDE + x), right, up, by))
				fail_msg("by %d: the colour at %d,%d is %d,%d,%d", by, x, y, frame.rgb[3 * (y * SIDE + x)],
				         frame.rgb[3 * (y * SIDE + x) + 1], frame.rgb[3 * (y * SIDE + x) + 2]);
		}
	assert_true(n > SIDE * SIDE / 2);
	s.scene.n_lights = 1;
	s.scene.ambient[0] = 0.5;
	again = draw(&s.scene, 3, 0);
	assert_memory_equal(again.rgb, frame.rgb, 3 * SIDE * SIDE);
	psr_frame_free(&frame);
	psr_frame_free(&again);
}

static void each_pixel_has_the_colour_of_its_number(void **state)
{
	struct psr_model *model = scanned();

	(void)state;
	for (int by = PSR_COLOR_INTENSITY; by <= PSR_COLOR_RETURN; by++)
		check(model, (enum psr_color_by)by);
	psr_model_unref(model);
}

/* From so far away that a level of averaged attributes is drawn: still two colours. */
static void coarse_levels_have_classes(void **state)
{
	struct psr_model *model = scanned();
	uint8_t one[3], other[3];
	struct psr_frame frame;
	struct scene_of s;
	unsigned n[2] = { 0, 0 };

	(void)state;
	psr_class_color(one, 2);
	psr_class_color(other, 6);
	look(&s, model, PSR_COLOR_CLASS);
	s.scene.camera.ortho_height = 8 * HEIGHT;
	frame = draw(&s.scene, 1, 0);
	for (int i = 0; i < SIDE * SIDE; i++)
		if (isfinite(frame.depth[i])) {
			n[0] += (unsigned)is_shade_of(frame.rgb + 3 * i, one);
			n[1] += (unsigned)is_shade_of(frame.rgb + 3 * i, other);
		}
	assert_true(n[0] > 30 && n[1] > 30); /* some 90 pixels are covered */
	psr_frame_free(&frame);
	psr_model_unref(model);
}

/* The mean of the same colours is the same colour: inside of the upper half of a sphere of one return. */
static void passes_keep_colours(void **state)
{
	struct psr_model *model = scanned();
	struct psr_frame frame;
	struct scene_of s;
	uint8_t only[3];

	(void)state;
	psr_order_color(only, PSR_RETURN_ONLY);
	look(&s, model, PSR_COLOR_RETURN);
	frame = draw(&s.scene, 2, 1);
	assert_true(is_shade_of(frame.rgb + 3 * (SIDE / 2 * SIDE + SIDE / 2), only));
	psr_frame_free(&frame);
	psr_model_unref(model);
}

static void streams_that_are_missing_are_named(void **state)
{
	struct psr_model *model = tree_build(&(struct tree_options){ .levels = 5, .radius = RADIUS, .keep = 1 });
	static const char *const names[] = { NULL, "intensities", "classes", NULL, "returns" };
	struct psr_error err;
	struct scene_of s;

	(void)state;
	for (int by = PSR_COLOR_OWN; by <= PSR_COLOR_RETURN; by++) {
		look(&s, model, (enum psr_color_by)by);
		if (names[by] == NULL) {
			assert_int_equal(psr_scene_validate(&s.scene, &err), PSR_OK);
			continue;
		}
		assert_int_equal(psr_scene_validate(&s.scene, &err), PSR_ERR_UNSUPPORTED);
		assert_non_null(strstr(err.text, names[by]));
		assert_non_null(strstr(err.text, "--scan"));
	}
	look(&s, model, (enum psr_color_by)(PSR_COLOR_RETURN + 1));
	assert_int_equal(psr_scene_validate(&s.scene, &err), PSR_ERR_UNSUPPORTED);
	psr_model_unref(model);
}

/* Names and colours are there for every class; neighbours in the list differ. */
static void palettes_are_whole(void **state)
{
	(void)state;
	for (unsigned c = 0; c < 256; c++) {
		uint8_t one[3], next[3];

		assert_true(psr_class_name(c)[0] != '\0');
		psr_class_color(one, c);
		psr_class_color(next, c + 1);
		assert_true(memcmp(one, next, 3) != 0);
	}
	assert_string_equal(psr_class_name(2), "ground");
	assert_string_equal(psr_class_name(9), "water");
	/* Lightness rises: of each pair of steps, 0.2126 r + 0.7152 g + 0.0722 b in linear light. */
	for (unsigned step = 0, last = 0; step < PSR_RAMP; step++) {
		uint8_t rgb[3];

		psr_ramp_color(rgb, step);
		const float r = psr_srgb_to_linear[rgb[0]], g = psr_srgb_to_linear[rgb[1]], b = psr_srgb_to_linear[rgb[2]];
		const unsigned light = (unsigned)(1e6f * (0.2126f * r + 0.7152f * g + 0.0722f * b));
		assert_true(light >= last);
		last = light;
	}
	assert_int_equal(psr_return_order(0x11), PSR_RETURN_ONLY);
	assert_int_equal(psr_return_order(0x31), PSR_RETURN_FIRST);
	assert_int_equal(psr_return_order(0x32), PSR_RETURN_BETWEEN);
	assert_int_equal(psr_return_order(0x33), PSR_RETURN_LAST);
	assert_int_equal(psr_return_order(0), PSR_RETURN_ONLY);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(each_pixel_has_the_colour_of_its_number),
		cmocka_unit_test(coarse_levels_have_classes),
		cmocka_unit_test(passes_keep_colours),
		cmocka_unit_test(streams_that_are_missing_are_named),
		cmocka_unit_test(palettes_are_whole),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

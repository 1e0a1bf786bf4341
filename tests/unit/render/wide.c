/* Light beyond white in passes above 0: a pixel is the mean of its sub-pixels, clamped at the end. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/root.h"
#include "base/srgb.h"
#include "psr/model.h"
#include "psr/render.h"
#include "tests/unit/lib/shapes.h"

#define SIDE 96

struct shown {
	uint8_t rgb[3 * SIDE * SIDE];
};

/* A sphere that scatters all light, under ambient light alone. */
static void draw(struct shown *out, const struct shape_options *options, double ambient, double background,
                 unsigned pass)
{
	struct psr_instance instance = { .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1 };
	struct psr_frame frame = { .width = SIDE, .height = SIDE, .rgb = out->rgb };
	struct psr_model *model = shape_build(options, 0.9);
	const struct psr_model_info *info = psr_model_info(model);
	struct psr_renderer *renderer;
	struct psr_settings settings;
	struct psr_error err;

	instance.model = model;
	psr_camera_frame(&scene.camera, info->box_min, info->box_max, info->up, 0.6, 1);
	for (int c = 0; c < 3; c++) {
		scene.ambient[c] = ambient;
		scene.background[c] = background;
	}
	psr_settings_default(&settings, SIDE, SIDE);
	settings.pass = pass;
	assert_int_equal(psr_renderer_create(&renderer, &err), PSR_OK);
	assert_int_equal(psr_render(renderer, &scene, &settings, NULL, &frame, &err), PSR_OK);
	psr_renderer_destroy(renderer);
	psr_model_unref(model);
}

static const struct shape_options white = { .resolution = 128, .diffuse = 0xffffff, .cones = 1, .scale = 1 };

/* Under light 1 a pixel shows the covered share s, known to half a code; under light n it shows n s. The means err by
 * less than half a code in both. So n times the light of the codes beside has the wanted code between them. */
static void rims_of_bright_things_are_bright(void **state)
{
	static const double lights[] = { 2, 4, 100 };
	static struct shown one, many;

	(void)state;
	for (unsigned pass = 1; pass <= 4; pass += 3) {
		int n_rim = 0;

		draw(&one, &white, 1, 0, pass);
		for (int k = 0; k < 3; k++) {
			draw(&many, &white, lights[k], 0, pass);
			for (size_t i = 0; i < 3 * SIDE * SIDE; i++) {
				const int code = one.rgb[i], low = code ? code - 1 : 0, high = code < 255 ? code + 1 : 255;
				const float times = (float)lights[k];

				assert_in_range(many.rgb[i], psr_linear_to_srgb(times * psr_srgb_to_linear[low]),
				                psr_linear_to_srgb(times * psr_srgb_to_linear[high]));
				n_rim += code > 20 && code < 235;
			}
		}
		assert_true(n_rim > 100);
	}
}

/* The background is light, too: black things before a bright sky get narrower. */
static void a_bright_background_shines_around_edges(void **state)
{
	const struct shape_options black = { .resolution = 128, .diffuse = 0, .cones = 1, .scale = 1 };
	static struct shown one, many;

	(void)state;
	draw(&one, &black, 0, 1, 2);
	draw(&many, &black, 0, 8, 2);
	for (size_t i = 0; i < 3 * SIDE * SIDE; i++) {
		const int code = one.rgb[i], low = code ? code - 1 : 0, high = code < 255 ? code + 1 : 255;

		assert_in_range(many.rgb[i], psr_linear_to_srgb(8 * psr_srgb_to_linear[low]),
		                psr_linear_to_srgb(8 * psr_srgb_to_linear[high]));
	}
}

/* Half a step of the root is 1/8192, of the light l so 2 sqrt(l) / 8192 and a square of that. Floats of up to 65,536
 * are off by 1/256 of a step at most, twice. */
static void codes_are_as_exact_as_they_say(void **state)
{
	(void)state;
	for (int i = 0; i <= 100000; i++) {
		const double light = 3e-8 * i * i;
		const double back = (double)psr_light_of_root(psr_root_of_light((float)light));

		assert_true(fabs(back - fmin(light, 255.99)) <= (2 * sqrt(light) + 1.0 / 8192) / 8192 * (1 + 4.0 / 256));
	}
	assert_int_equal(psr_root_of_light(NAN), 0);
	assert_int_equal(psr_root_of_light(-1), 0);
	assert_int_equal(psr_root_of_light(INFINITY), 65535);
	assert_int_equal(psr_root_of_light(1), 4096);
	for (int code = 0; code < 256; code++) {
		const uint16_t root = psr_root_of_light(psr_srgb_to_linear[code]);

		assert_int_equal(psr_linear_to_srgb(psr_light_of_root(root)), code);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rims_of_bright_things_are_bright),
		cmocka_unit_test(a_bright_background_shines_around_edges),
		cmocka_unit_test(codes_are_as_exact_as_they_say),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

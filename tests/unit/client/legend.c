/* The legend of --color-by: what it shows, where, and when it leaves a picture alone. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>
#include "client/output/legend.h"

#define W 320
#define H 240

static uint8_t rgb[3 * W * H];

static void draw(const struct legend *legend, uint32_t width, uint32_t height, int background)
{
	memset(rgb, background, sizeof rgb);
	legend_draw(legend, rgb, width, height);
}

static int count(const uint8_t color[3])
{
	int n = 0;

	for (size_t i = 0; i < (size_t)W * H; i++)
		n += memcmp(rgb + 3 * i, color, 3) == 0;
	return n;
}

static void only_classes_of_the_model_have_swatches(void **state)
{
	const struct legend legend = { .by = PSR_COLOR_CLASS, .classes = { 1 << 2 | 1 << 6, 1 << 3 } };
	uint8_t color[3];

	(void)state;
	draw(&legend, W, H, 0);
	for (unsigned c = 0; c < 23; c++) {
		psr_class_color(color, c);
		assert_int_equal(count(color), c == 2 || c == 6 ? 81 : 0);
	}
	psr_class_color(color, 64 + 3);
	assert_int_equal(count(color), 81);
}

static void only_returns_of_the_model_have_swatches(void **state)
{
	const struct legend legend = { .by = PSR_COLOR_RETURN, .orders = 1 << PSR_RETURN_FIRST | 1 << PSR_RETURN_LAST };
	uint8_t color[3];

	(void)state;
	draw(&legend, W, H, 0);
	for (unsigned o = 0; o < PSR_N_RETURN_ORDERS; o++) {
		psr_order_color(color, (enum psr_return_order)o);
		assert_int_equal(count(color), legend.orders >> o & 1 ? 81 : 0);
	}
}

static void the_ramp_rises_and_its_numbers_are_those_of_the_ends(void **state)
{
	const struct legend one = { .by = PSR_COLOR_HEIGHT, .low = 111, .high = 111.5 };
	const struct legend other = { .by = PSR_COLOR_HEIGHT, .low = 111, .high = 888 };
	uint8_t low[3], high[3], first[sizeof rgb];
	size_t at_low = 0, at_high = 0;

	(void)state;
	psr_ramp_color(low, 0);
	psr_ramp_color(high, PSR_RAMP - 1);
	draw(&one, W, H, 0);
	memcpy(first, rgb, sizeof rgb);
	for (size_t i = 0; i < (size_t)W * H; i++) {
		if (memcmp(rgb + 3 * i, low, 3) == 0)
			at_low = i / W;
		if (memcmp(rgb + 3 * i, high, 3) == 0)
			at_high = i / W;
	}
	assert_int_equal(at_low, at_high + 64); /* four intervals of 16 pixels */
	draw(&other, W, H, 0);
	assert_memory_not_equal(first, rgb, sizeof rgb);
}

/* The plate keeps a quarter of white, 63, and adds 15; the ink is 240. */
static void text_is_light_on_dark_on_any_background(void **state)
{
	const struct legend legend = { .by = PSR_COLOR_RETURN, .orders = 1 };
	const uint8_t ink[3] = { 240, 240, 240 };

	(void)state;
	for (int background = 0; background <= 255; background += 255) {
		const uint8_t plate = (uint8_t)((background + 60) / 4), color[3] = { plate, plate, plate };

		draw(&legend, W, H, background);
		assert_true(count(ink) > 50);
		assert_true(count(color) > 500);
		assert_int_equal(rgb[0], background);                       /* the upper left corner */
		assert_int_equal(rgb[3 * ((H - 1 - 6) * W + 6)], plate);    /* the plate's lower left one */
		assert_int_equal(rgb[3 * ((H - 1 - 5) * W + 6)], background); /* below it */
	}
}

static void small_pictures_and_many_classes_are_safe(void **state)
{
	struct legend legend = { .by = PSR_COLOR_CLASS, .classes = { ~0ull, ~0ull, ~0ull, ~0ull } };
	static const uint32_t size[][3] = { { 159, 120, 0 }, { 160, 119, 0 }, { 1, 1, 0 }, { W, H, 1 }, { W, 120, 1 } };

	(void)state;
	for (size_t i = 0; i < sizeof size / sizeof size[0]; i++) {
		int is_drawn = 0;

		draw(&legend, size[i][0], size[i][1], 200);
		for (size_t k = 0; k < 3 * (size_t)size[i][0] * size[i][1]; k++)
			is_drawn |= rgb[k] != 200;
		assert_int_equal(is_drawn, size[i][2]);
		for (size_t k = 3 * (size_t)size[i][0] * size[i][1]; k < sizeof rgb; k++)
			assert_int_equal(rgb[k], 200);
	}
}

static void a_frame_tells_what_the_legend_has(void **state)
{
	static struct psr_msg_frame_end end = {
		.n_entries = 2, .entry = { { .id = PSR_WIRE_REPORT_INTENSITIES, .count = 7 | 900 << 16 },
		                           { .id = PSR_WIRE_REPORT_CLASSES + 1, .count = 5 } },
	};
	static struct scene_model model[2] = { { .opened = { .up = { 0, 0, 1 }, .box_min = { 0, 0, 3 },
	                                                    .box_max = { 1, 1, 8 } } } };
	uint32_t model_of[2] = { 0, 0 };
	static struct scene scene;
	struct psr_msg_instance *instance = scene.msg.instance;
	struct legend legend;

	(void)state;
	scene.msg.n_instances = 2;
	scene.model = model;
	scene.model_of = model_of;
	assert_false(legend_find(&legend, &scene, &end));
	instance[1].color_by = PSR_WIRE_COLOR_INTENSITY;
	assert_true(legend_find(&legend, &scene, &end));
	assert_true(legend.low == 7 && legend.high == 900);
	instance[0].color_by = PSR_WIRE_COLOR_CLASS;
	assert_false(legend_find(&legend, &scene, &end));
	instance[1].color_by = PSR_WIRE_COLOR_CLASS;
	assert_true(legend_find(&legend, &scene, &end));
	assert_true(legend.classes[0] == 0 && legend.classes[1] == 5);
	instance[0].color_by = instance[1].color_by = PSR_WIRE_COLOR_HEIGHT;
	assert_true(legend_find(&legend, &scene, &end));
	assert_true(legend.low == 3 && legend.high == 8);
	model_of[1] = 1; /* its heights are others */
	assert_false(legend_find(&legend, &scene, &end));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(only_classes_of_the_model_have_swatches),
		cmocka_unit_test(only_returns_of_the_model_have_swatches),
		cmocka_unit_test(the_ramp_rises_and_its_numbers_are_those_of_the_ends),
		cmocka_unit_test(text_is_light_on_dark_on_any_background),
		cmocka_unit_test(small_pictures_and_many_classes_are_safe),
		cmocka_unit_test(a_frame_tells_what_the_legend_has),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

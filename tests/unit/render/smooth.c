/* Anti-aliasing of a frame by its own pixels ([G] 9.1.1). */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/maths.h"
#include "base/random.h"
#include "base/srgb.h"
#include "base/pool.h"
#include "render/plan.h"
#include "tests/unit/lib/shapes.h"
#include "tests/unit/lib/threads.h"

#define SIDE 7

/* A picture of SIDE x SIDE pixels: '#' white and near, '.' black and `step` behind, ' ' black and nothing; NULL: nobody
 * knows places. */
static uint32_t smooth_placed(uint8_t light[SIDE][SIDE], const char *const *row, float step, const uint8_t *place)
{
	uint8_t from[SIDE][SIDE][3], to[SIDE][SIDE][3];
	float depth[SIDE][SIDE];
	const struct smooth_target target = { .from = from[0][0], .to = to[0][0], .depth = depth[0], .width = SIDE,
		                                  .height = SIDE, .scale = 1, .offset = 0.03f, .place = place };
	for (int y = 0; y < SIDE; y++)
		for (int x = 0; x < SIDE; x++) {
			memset(from[y][x], row[y][x] == '#' ? 255 : 0, 3);
			depth[y][x] = row[y][x] == '#' ? 1 : row[y][x] == '.' ? 1 + step : INFINITY;
		}
	const uint32_t n_edges = simd_get()->smooth(&target, 0, SIDE, 0, SIDE);
	for (int y = 0; y < SIDE; y++)
		for (int x = 0; x < SIDE; x++)
			light[y][x] = to[y][x][1];
	return n_edges;
}

static uint32_t smooth(uint8_t light[SIDE][SIDE], const char *const *row, float step)
{
	return smooth_placed(light, row, step, NULL);
}

/* The code whose square is this share of white's. */
static int white(double share)
{
	return (int)(255 * sqrt(share) + 0.5);
}

static void an_edge_lets_half_of_what_is_behind_through(void **state)
{
	static const char *const beside_nothing[SIDE] = { "###    ", "###    ", "###    ", "###    ", "###    ", "###    ",
		                                            "###    " };
	static const char *const beside_far[SIDE] = { "###....", "###....", "###....", "###....", "###....", "###....",
		                                        "###...." };
	uint8_t light[SIDE][SIDE];
	(void)state;
	for (int is_far = 0; is_far < 2; is_far++) {
		assert_int_equal(smooth(light, is_far ? beside_far : beside_nothing, 0.1f), SIDE);
		for (int y = 1; y < SIDE - 1; y++) {
			assert_int_equal(light[y][1], 255);
			assert_int_equal(light[y][2], white(0.5)); /* a neighbour beside and two aslant are behind: 2 + 1 + 1 of
			                                            * 8 */
			assert_int_equal(light[y][3], 0);          /* what is in front does not come through what is behind */
		}
		assert_int_equal(light[0][2], white(5 / 8.0)); /* at the picture's border there are fewer neighbours */
	}
}

static void corners_and_lines_keep_a_quarter_at_least(void **state)
{
	static const char *const row[SIDE] = {
		"       ", " #     ", "       ", "    ###", "  #####", "  ###  ", "  ###  "
	};
	uint8_t light[SIDE][SIDE];
	(void)state;
	smooth(light, row, 0);
	assert_int_equal(light[1][1], white(0.25)); /* 12 of 8 */
	assert_int_equal(light[4][2], white(0.25)); /* 2 + 2 + 1 + 1 + 1, of two sides and what is between */
	assert_int_equal(light[3][4], white(0.25));
	assert_int_equal(light[4][4], white(6 / 8.0)); /* of two edges that turn inwards, 1 each */
}

/* 0.03 is the threshold: a surface may fall by that much from one pixel to the next. Then a pixel counts four times,
 * and each of those beside it once. */
static void neighbours_of_a_surface_are_averaged(void **state)
{
	static const char *const row[SIDE] = {
		"#######", "#######", "#######", "###.###", "#######", "#######", "#######"
	};
	uint8_t light[SIDE][SIDE];
	(void)state;
	assert_int_equal(smooth(light, row, 0.02f), 0);
	assert_int_equal(light[3][3], white(4 / 8.0));
	assert_int_equal(light[3][2], white(7 / 8.0));
	assert_int_equal(light[2][3], white(7 / 8.0));
	assert_int_equal(light[2][2], 255);
	assert_int_equal(smooth(light, row, 0.04f), 8);
	assert_int_equal(light[3][3], 0);
	assert_int_equal(light[3][2], white(6 / 8.0));
	assert_int_equal(light[2][2], white(7 / 8.0));
}

/* A quadratic B-spline, in pixels. */
static double spline(double d)
{
	const double from = fabs(d), rest = 1.5 - from;

	return from <= 0.5 ? 0.75 - d * d : rest > 0 ? rest * rest / 2 : 0;
}

/* All samples lie alike in their pixels, so that rows tell nothing: a column counts as the spline says, at the middle
 * of a quarter, and to a 64th as without places. */
static void samples_count_by_where_they_lie(void **state)
{
	static const char *const row[SIDE] = { "...#...", "...#...", "...#...", "...#...",
		                                   "...#...", "...#...", "...#..." };
	uint8_t light[SIDE][SIDE], place[SIDE * SIDE];

	(void)state;
	for (int code = 0; code < PSR_PLACE_NONE; code++) {
		memset(place, code, sizeof place);
		assert_int_equal(smooth_placed(light, row, 0, place), 0);
		for (int x = 1; x < SIDE - 1; x++) {
			const double mean = x == 3 ? 6 / 8.0 : x == 2 || x == 4 ? 1 / 8.0 : 0;
			const double share = spline(3 + (code % 4 + 0.5) / 4 - (x + 0.5));

			for (int y = 1; y < SIDE - 1; y++)
				assert_int_equal(light[y][x], white((share + mean / 64) / (1 + 1 / 64.0)));
		}
	}
}

static void samples_of_what_is_behind_count_for_nothing(void **state)
{
	static const char *const row[SIDE] = { "###....", "###....", "###....", "###....",
		                                   "###....", "###....", "###...." };
	uint8_t light[SIDE][SIDE], with[SIDE][SIDE], place[SIDE * SIDE];

	(void)state;
	for (int i = 0; i < SIDE * SIDE; i++)
		place[i] = (uint8_t)(i * 7 % PSR_PLACE_NONE);
	smooth(light, row, 0.1f);
	assert_int_equal(smooth_placed(with, row, 0.1f, place), SIDE);
	assert_memory_equal(with, light, sizeof light);
}

static void without_samples_nothing_changes(void **state)
{
	static const char *const row[SIDE] = { " #  ...", "#.#####", "##.. ##", "###.###",
		                                   "#   ###", "#######", "...####" };
	uint8_t light[SIDE][SIDE], with[SIDE][SIDE], place[SIDE * SIDE];

	(void)state;
	memset(place, PSR_PLACE_NONE, sizeof place);
	for (int is_far = 0; is_far < 2; is_far++) {
		const float step = is_far ? 0.1f : 0.02f;

		assert_int_equal(smooth(light, row, step), smooth_placed(with, row, step, place));
		assert_memory_equal(with, light, sizeof light);
	}
}

/* However a picture is cut, and however long the runs are that kernels take at a time. */
static void pieces_change_the_same_pixels_and_count_each_once(void **state)
{
	enum { WIDTH = 83, HEIGHT = 5 };
	static uint8_t from[HEIGHT][WIDTH][3], whole[HEIGHT][WIDTH][3], pieces[HEIGHT][WIDTH][3];
	static float depth[HEIGHT][WIDTH];
	struct smooth_target target = { .from = from[0][0], .to = whole[0][0], .depth = depth[0], .width = WIDTH,
		                            .height = HEIGHT, .scale = 1, .offset = 0.03f };
	uint64_t seed = 1;

	(void)state;
	for (int y = 0; y < HEIGHT; y++)
		for (int x = 0; x < WIDTH; x++) {
			memset(from[y][x], (int)random_below(&seed, 256), 3);
			depth[y][x] = random_below(&seed, 3) ? 1 : 2;
		}
	const uint32_t n_edges = simd_get()->smooth(&target, 0, WIDTH, 0, HEIGHT);
	assert_in_range(n_edges, WIDTH * HEIGHT / 4, WIDTH * HEIGHT);
	target.to = pieces[0][0];
	for (uint32_t width = 1; width <= 40; width++) {
		uint32_t n = 0;

		for (uint32_t x = 0; x < WIDTH; x += width)
			n += simd_get()->smooth(&target, x, x + width < WIDTH ? x + width : WIDTH, 0, HEIGHT);
		assert_int_equal(n, n_edges);
		assert_memory_equal(pieces, whole, sizeof whole);
	}
}

struct drawn {
	struct psr_scene scene;
	struct psr_instance instance;
	struct psr_light light;
	struct render_settings settings;
	struct psr_frame frame;
};

static void scene_make(struct drawn *d, const struct psr_model *model, uint32_t width, uint32_t height)
{
	const struct psr_model_info *info = psr_model_info(model);
	memset(d, 0, sizeof *d);
	d->instance = (struct psr_instance){ .model = model, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	d->light =
		(struct psr_light){ .kind = PSR_LIGHT_DIRECTIONAL, .direction = { -1, -2, -3 }, .color = { 1, 0.9, 0.8 } };
	d->scene = (struct psr_scene){ .instance = &d->instance, .n_instances = 1, .light = &d->light, .n_lights = 1,
		                           .background = { 0.2, 0.1, 0 } };
	psr_camera_frame(&d->scene.camera, info->box_min, info->box_max, info->up, 0.6, (double)width / height);
	render_settings_default(&d->settings, width, height);
	const size_t area = (size_t)width * height;
	d->frame = (struct psr_frame){ .width = width, .height = height, .rgb = malloc(3 * area), .depth = malloc(4 * area),
		                           .normal = malloc(6 * area), .words = malloc(8 * area), .weight = malloc(area) };
}

static void draw(struct drawn *d, int is_smooth, struct psr_pool *pool)
{
	struct psr_renderer *renderer;
	struct psr_error err;
	d->settings.smooth = is_smooth;
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	if (renderer_draw(renderer, &d->scene, &d->settings, pool, &d->frame, &err))
		fail_msg("%s", err.text);
	psr_renderer_destroy(renderer);
}

static void release(struct drawn *d)
{
	free(d->frame.rgb);
	free(d->frame.depth);
	free(d->frame.normal);
	free(d->frame.words);
	free(d->frame.weight);
}

static void only_color_changes_and_alike_for_any_threads_and_planes(void **state)
{
	const uint32_t sizes[][2] = { { 160, 120 }, { 600, 450 } };
	struct psr_model *model;
	struct psr_error err;
	struct psr_pool *pool;
	(void)state;
	assert_int_equal(psr_model_read(&model, "tests/golden/wheel.psr", &err), PSR_OK);
	assert_int_equal(psr_pool_create(&pool, 3, NULL), PSR_OK);
	for (int i = 0; i < 2; i++) {
		const uint32_t width = sizes[i][0], height = sizes[i][1];
		const size_t area = (size_t)width * height;
		struct drawn plain, one;
		scene_make(&plain, model, width, height);
		scene_make(&one, model, width, height);
		draw(&plain, 0, NULL);
		draw(&one, 1, NULL);
		assert_memory_not_equal(plain.frame.rgb, one.frame.rgb, 3 * area);
		assert_memory_equal(plain.frame.depth, one.frame.depth, 4 * area);
		assert_memory_equal(plain.frame.normal, one.frame.normal, 6 * area);
		assert_memory_equal(plain.frame.words, one.frame.words, 8 * area);
		assert_memory_equal(plain.frame.weight, one.frame.weight, area);
		assert_int_equal(plain.frame.report.effect[PSR_EFFECT_SMOOTH].why, PSR_WHY_OFF);
		assert_int_equal(one.frame.report.effect[PSR_EFFECT_SMOOTH].why, PSR_WHY_RAN);
		assert_true(one.frame.report.count[PSR_STAGE_SMOOTH] > 0);
		float *depth = plain.frame.depth;
		plain.frame.depth = NULL; /* depths that only smoothing asks for */
		draw(&plain, 1, pool);
		plain.frame.depth = depth;
		assert_memory_equal(plain.frame.rgb, one.frame.rgb, 3 * area);
		assert_int_equal(plain.frame.report.count[PSR_STAGE_SMOOTH], one.frame.report.count[PSR_STAGE_SMOOTH]);
		uint8_t *rgb = plain.frame.rgb;
		plain.frame.rgb = NULL;
		draw(&plain, 1, NULL);
		plain.frame.rgb = rgb;
		assert_int_equal(plain.frame.report.effect[PSR_EFFECT_SMOOTH].why, PSR_WHY_NOTHING);
		release(&plain);
		release(&one);
	}
	psr_pool_destroy(pool);
	psr_model_unref(model);
}

/* Light of a white, unlit sphere before black: of pixels' squares, which differ from the disc's part of them. */
static double error_of(const struct drawn *d, double radius)
{
	const uint32_t side = d->frame.width;
	double sum = 0;
	for (uint32_t y = 0; y < side; y++)
		for (uint32_t x = 0; x < side; x++) {
			int n = 0;
			for (int i = 0; i < 64; i++)
				n += hypot(x + (i % 8 + 0.5) / 8 - side / 2.0, y + (i / 8 + 0.5) / 8 - side / 2.0) <= radius;
			sum += pow((double)psr_srgb_to_linear[d->frame.rgb[3 * (y * side + x)]] - n / 64.0, 2);
		}
	return sum;
}

/* A rim pixel is full where its coverage is anything from 0 to 1, and so off by 1/3 in the mean square; half of it
 * would be by 1/12, and what its neighbours tell makes that no worse. Samples that miss a pixel of little coverage
 * leave less to gain: three times. */
static void the_rim_of_a_sphere_is_three_times_as_true(void **state)
{
	const struct shape_options options = { .resolution = 256, .diffuse = 0xffffff, .unlit = 1, .cones = 1, .scale = 1 };
	struct psr_model *sphere = shape_build(&options, 0.9);
	struct drawn d;
	(void)state;
	for (int is_perspective = 0; is_perspective < 2; is_perspective++) {
		scene_make(&d, sphere, 160, 160);
		memset(d.scene.background, 0, sizeof d.scene.background);
		double radius = 0.9 / 2.5 * 160;
		if (is_perspective) {
			double distance = 0;
			for (int k = 0; k < 3; k++)
				distance += pow(d.scene.camera.eye[k] - d.scene.camera.target[k], 2);
			const double tangent = 0.9 / sqrt(distance - 0.9 * 0.9); /* of the angle at which the sphere's outline
			                                                          * is seen */
			radius = 80 * tangent / tan(0.3);
		} else {
			d.scene.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
			d.scene.camera.ortho_height = 2.5;
		}
		draw(&d, 0, NULL);
		const double plain = error_of(&d, radius);
		draw(&d, 1, NULL);
		assert_true(3 * error_of(&d, radius) <= plain);
		release(&d);
	}
	psr_model_unref(sphere);
}

/* The square, from so many radians above its plane. Returns the pixels with something behind them, but those of its
 * outline. */
static double inner_edges(const struct psr_model *square, double above, int is_perspective, uint32_t *n_covered,
                          uint32_t *widest)
{
	const uint32_t side = 512;
	struct drawn d;
	uint32_t n_outline = 0;
	scene_make(&d, square, side, side);
	d.scene.camera = (struct psr_camera){ .eye = { 0, -2.5 * cos(above), 2.5 * sin(above) }, .up = { 0, 0, 1 },
		                                  .fov_y = 0.6, .ortho_height = 1.5,
		                                  .kind = is_perspective ? PSR_CAMERA_PERSPECTIVE : PSR_CAMERA_ORTHOGRAPHIC };
	draw(&d, 1, NULL);
	*n_covered = *widest = 0;
	for (uint32_t y = 1; y + 1 < side; y++) {
		uint32_t n = 0;
		for (uint32_t x = 1; x + 1 < side; x++) {
			const float *z = d.frame.depth + y * side + x;
			int has_none = 0;
			for (int k = 0; k < 9; k++)
				has_none |= isinf(z[(k / 3 - 1) * (int)side + k % 3 - 1]);
			n += !isinf(*z);
			n_outline += has_none && !isinf(*z);
		}
		*n_covered += n;
		*widest = n > *widest ? n : *widest;
	}
	const double n_edges = (double)d.frame.report.count[PSR_STAGE_SMOOTH];
	release(&d);
	return n_edges - n_outline;
}

/* At 10 degrees above a plane neighbours are 5.7 pixel widths apart in depth, at 2 degrees 29, where steps from 3 on
 * are edges unless the surface falls as much on both sides of the step. In the lowest row but one, and by some
 * pixels beside the outline, that is not known. */
static void a_grazed_plane_is_one_surface(void **state)
{
	const struct shape_options options = { .resolution = 1024, .diffuse = 0xffffff, .cones = 1, .two_sided = 1,
		                                   .scale = 1 };
	static const double degrees[] = { 20, 10, 5, 2 };
	struct psr_model *square = shape_build(&options, 0);
	(void)state;
	for (int i = 0; i < 8; i++) {
		uint32_t n_covered, widest;
		const double n = inner_edges(square, degrees[i / 2] * PSR_DEGREE, i % 2, &n_covered, &widest);
		if (!(n >= 0 && n <= 1.25 * widest && n_covered > 8 * widest))
			fail_msg("%g degrees above the plane: %g edges in %u pixels", degrees[i / 2], n, n_covered);
	}
	psr_model_unref(square);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_edge_lets_half_of_what_is_behind_through),
		cmocka_unit_test(corners_and_lines_keep_a_quarter_at_least),
		cmocka_unit_test(neighbours_of_a_surface_are_averaged),
		cmocka_unit_test(samples_count_by_where_they_lie),
		cmocka_unit_test(samples_of_what_is_behind_count_for_nothing),
		cmocka_unit_test(without_samples_nothing_changes),
		cmocka_unit_test(pieces_change_the_same_pixels_and_count_each_once),
		cmocka_unit_test(only_color_changes_and_alike_for_any_threads_and_planes),
		cmocka_unit_test(the_rim_of_a_sphere_is_three_times_as_true),
		cmocka_unit_test(a_grazed_plane_is_one_surface),
	};
	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}

/* The warp of whole pictures, by tiles and in turns, against one of all samples ([G] 7.1, 7.2). */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "base/direction.h"
#include "render/cull.h"
#include "render/zbuffer.h"

#define SIDE 160

static struct psr_model *wheel;

static int open_model(void **state)
{
	struct psr_error err;

	(void)state;
	return psr_model_read(&wheel, "tests/golden/wheel.psr", &err);
}

static int close_model(void **state)
{
	(void)state;
	psr_model_unref(wheel);
	return 0;
}

/* The same picture, of which the whole is one tile and every sample lowers its word and its cell. */
static void warp_plainly(struct psr_zstack *to, const struct psr_zstack *like, const struct psr_scene *scene,
                         const struct render_settings *settings)
{
	struct plan plan = { 0 };
	struct bins bins = { 0 };
	struct psr_report report = { 0 };
	struct warp_target t = { .direction = psr_direction_tens(), .stride = like->width };
	struct psr_error err;

	assert_int_equal(plan_make(&plan, scene, settings, &err), PSR_OK);
	assert_int_equal(cull_blocks(&bins, &simd_c, &plan, NULL, &report), PSR_OK);
	*to = *like;
	to->gap = 0;
	t.instance = plan.warp;
	t.near_z = plan.near_z;
	t.perspective = plan.perspective;
	t.word = to->word = malloc((size_t)to->width * to->height * sizeof *to->word);
	t.x1 = (int32_t)to->width;
	t.y1 = (int32_t)to->height;
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		if (!(to->levels >> k & 1))
			continue;
		to->level[k].z = malloc((size_t)to->level[k].width * to->level[k].height * sizeof(float));
		t.cells[k] = (struct warp_cells){
			.z = to->level[k].z, .stride = to->level[k].width, .x0 = -(1 << k), .y0 = -(1 << k),
			.x1 = (int32_t)(to->level[k].width - 1) << k, .y1 = (int32_t)(to->level[k].height - 1) << k,
		};
	}
	simd_c.warp_clear(&t, to->levels);
	simd_c.warp(&t, bins.entry, bins.tile_begin[plan.tiles_x * plan.tiles_y]);
	plan_clear(&plan);
	bins_clear(&bins);
}

static void compare(uint32_t width, uint32_t height, double nearness, int kind, uint32_t *levels)
{
	const struct psr_model_info *info = psr_model_info(wheel);
	struct psr_instance instance = { .model = wheel, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1 };
	struct render_settings settings;
	struct psr_renderer *renderer;
	struct psr_zstack *stack, plain;
	struct psr_error err;

	render_settings_default(&settings, width, height);
	settings.cull_tests &= ~(unsigned)PSR_CULL_OCCLUSION;
	psr_camera_frame(&scene.camera, info->box_min, info->box_max, info->up, 0.6, (double)width / height);
	for (int i = 0; i < 3; i++)
		scene.camera.eye[i] = scene.camera.target[i] + (scene.camera.eye[i] - scene.camera.target[i]) / nearness;
	if (kind == PSR_CAMERA_ORTHOGRAPHIC) {
		scene.camera.kind = PSR_CAMERA_ORTHOGRAPHIC;
		scene.camera.ortho_height = info->scale * 2 / nearness;
	}
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(renderer_warp(renderer, &scene, &settings, NULL, &stack, &err), PSR_OK);
	warp_plainly(&plain, stack, &scene, &settings);
	for (uint32_t y = 0; y < height; y++)
		assert_memory_equal(psr_zstack_row(stack, y), psr_zstack_row(&plain, y), width * sizeof(uint64_t));
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		if (!(stack->levels >> k & 1))
			continue;
		assert_memory_equal(stack->level[k].z, plain.level[k].z,
		                    (size_t)stack->level[k].width * stack->level[k].height * sizeof(float));
		free(plain.level[k].z);
	}
	*levels |= stack->levels;
	free(plain.word);
	psr_renderer_destroy(renderer);
}

/* Whole in the picture and cut off by its borders, where cells of the guard band count; levels alone and side by side
 * in a tile. */
static void tiles_and_turns_give_what_all_samples_give(void **state)
{
	static const uint32_t side[][2] = { { 512, 512 }, { 301, 199 }, { 1020, 130 } };
	uint32_t levels = 0;

	(void)state;
	for (size_t i = 0; i < sizeof side / sizeof side[0]; i++)
		for (double nearness = 0.25; nearness < 5; nearness *= 1.4) {
			compare(side[i][0], side[i][1], nearness, PSR_CAMERA_PERSPECTIVE, &levels);
			compare(side[i][0], side[i][1], nearness, PSR_CAMERA_ORTHOGRAPHIC, &levels);
		}
	assert_int_equal(levels & 0xe, 0xe);
}

/* 4096 bytes apart, or within a cache line of that, stores and loads of two rows are taken for each other's. */
static void rows_of_words_are_apart(void **state)
{
	(void)state;
	for (uint32_t width = 1; width <= PSR_MAX_SIDE; width++) {
		const uint32_t gap = warp_gap(width), over = (width + gap) * 8 % 4096;

		assert_true(gap <= 16);
		if (width >= 64)
			assert_true(over >= 64 && over <= 4096 - 64);
	}
}

/* A picture's words into `word`, row by row; its samples are of the levels that are a pixel apart or less where the
 * picture has SIDE pixels a row. */
static void warp_words(uint64_t *word, const struct psr_scene *scene, uint32_t finer, enum psr_smooth smooth)
{
	const uint32_t width = finer * SIDE, height = width / 4 * 3;
	struct render_settings settings;
	struct psr_renderer *renderer;
	struct psr_zstack *stack;

	render_settings_default(&settings, width, height);
	settings.cull_tests = 0;
	settings.spacing_px = finer;
	settings.smooth = smooth;
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	assert_int_equal(renderer_warp(renderer, scene, &settings, NULL, &stack, NULL), PSR_OK);
	assert_int_equal(stack->place_bits, smooth ? PSR_PLACE_BITS : 0);
	for (uint32_t y = 0; y < height; y++)
		memcpy(word + (size_t)y * width, psr_zstack_row(stack, y), width * sizeof *word);
	psr_renderer_destroy(renderer);
}

/* Lengths in pixels are four times as great there, exactly. What is nearest in a pixel is so in a part of it. */
static void places_are_pixels_of_a_picture_four_times_as_large(void **state)
{
	const struct psr_model_info *info = psr_model_info(wheel);
	struct psr_instance instance = { .model = wheel, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	struct psr_scene scene = { .instance = &instance, .n_instances = 1 };
	const size_t area = SIDE * (SIDE / 4 * 3);
	uint64_t *word = malloc(area * sizeof *word), *finer = malloc(16 * area * sizeof *finer);
	uint32_t n = 0;

	(void)state;
	for (int is_ortho = 0; is_ortho < 2; is_ortho++) {
		psr_camera_frame(&scene.camera, info->box_min, info->box_max, info->up, 0.6, 4 / 3.0);
		scene.camera.kind = is_ortho ? PSR_CAMERA_ORTHOGRAPHIC : PSR_CAMERA_PERSPECTIVE;
		scene.camera.ortho_height = 3;
		warp_words(word, &scene, 1, PSR_SMOOTH_EDGES);
		warp_words(finer, &scene, 4, PSR_SMOOTH_NONE);
		for (uint32_t y = 0; y < SIDE / 4 * 3; y++)
			for (uint32_t x = 0; x < SIDE; x++) {
				const uint64_t own = word[y * SIDE + x], place = own & (PSR_PLACE_NONE - 1);

				if (own == PSR_WORD_EMPTY)
					continue;
				const uint64_t there = finer[(4 * y + place / 4) * 4 * SIDE + 4 * x + place % 4];
				assert_int_equal(there, (own >> 32) << 32 | (uint32_t)own >> PSR_PLACE_BITS);
				n++;
			}
	}
	assert_true(n > 1000);
	free(word);
	free(finer);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(tiles_and_turns_give_what_all_samples_give),
		cmocka_unit_test(rows_of_words_are_apart),
		cmocka_unit_test(places_are_pixels_of_a_picture_four_times_as_large),
	};

	return cmocka_run_group_tests(tests, open_model, close_model);
}

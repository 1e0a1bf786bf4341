/* Frames that are cancelled: at every question that the renderer asks, and what the next frame sees of it. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include "psr/render.h"

#define MODELS 3
#define N_SHOTS 3
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
#define STRIDE 7 /* they take their time */
#else
#define STRIDE 1
#endif
#ifdef __SANITIZE_THREAD__
#define STRIDE_ALONE (7 * STRIDE) /* one thread shows it nothing */
#else
#define STRIDE_ALONE STRIDE
#endif

enum { TEAPOT, CASE, DICE }; /* CASE is of glass */
static struct psr_model *models[MODELS];

static int open_models(void **state)
{
	static const char *const path[MODELS] = { "tests/golden/teapot.psr", "tests/golden/case.psr",
		                                      "tests/golden/dice.psr" };

	(void)state;
	for (int i = 0; i < MODELS; i++)
		if (psr_model_read(&models[i], path[i], NULL))
			return -1;
	return 0;
}

static int close_models(void **state)
{
	(void)state;
	for (int i = 0; i < MODELS; i++)
		psr_model_unref(models[i]);
	return 0;
}

/* One of three frames of a renderer. The first is drawn, the second cancelled, the second or the third drawn next. */
struct shot {
	struct psr_instance instance[3];
	struct psr_light light[2];
	struct psr_scene scene;
	struct psr_settings settings;
	struct psr_frame wanted; /* as a fresh renderer draws it */
};

/* Answers 1 to one question alone. */
struct stop {
	atomic_int n_asked;
	int at;
};

static int is_cancelled(void *userdata)
{
	struct stop *stop = userdata;

	return atomic_fetch_add(&stop->n_asked, 1) == stop->at;
}

static void frame_make(struct psr_frame *frame, const struct psr_settings *settings)
{
	const size_t area = (size_t)settings->width * settings->height;

	*frame = (struct psr_frame){ .width = settings->width, .height = settings->height, .rgb = malloc(3 * area),
		                         .depth = malloc(area * sizeof *frame->depth) };
}

static void frame_clear(struct psr_frame *frame)
{
	free(frame->rgb);
	free(frame->depth);
}

/* Draws a shot into a frame of its own, and compares it. */
static void draw_whole(struct psr_renderer *renderer, const struct shot *shot, struct psr_pool *pool, int at)
{
	const size_t area = (size_t)shot->settings.width * shot->settings.height;
	struct psr_frame frame;

	frame_make(&frame, &shot->settings);
	assert_int_equal(psr_render(renderer, &shot->scene, &shot->settings, pool, &frame, NULL), PSR_OK);
	if (memcmp(frame.rgb, shot->wanted.rgb, 3 * area) != 0
	    || memcmp(frame.depth, shot->wanted.depth, area * sizeof *frame.depth) != 0)
		fail_msg("cancelled at question %d, a frame changes the next one", at);
	frame_clear(&frame);
}

/* Returns whether the frame was cancelled. */
static int draw_until(struct psr_renderer *renderer, const struct shot *shot, struct psr_pool *pool, int at)
{
	struct stop stop = { .at = at };
	struct psr_settings settings = shot->settings;
	struct psr_error err = { 0 };
	struct psr_frame frame;

	frame_make(&frame, &settings);
	settings.cancel = (struct psr_cancel){ is_cancelled, &stop };
	const int rc = psr_render(renderer, &shot->scene, &settings, pool, &frame, &err);
	frame_clear(&frame);
	assert_int_equal(rc, stop.n_asked > at ? PSR_ERR_CANCELLED : PSR_OK);
	if (rc)
		assert_string_equal(err.text, "the frame was cancelled");
	return rc != PSR_OK;
}

/* Cancels the second shot at one question after the other. */
static void cancel_everywhere(struct shot shot[N_SHOTS], struct psr_pool *pool, int stride)
{
	struct psr_renderer *renderer, *fresh;
	int n_cancelled = 0;

	for (int i = 0; i < N_SHOTS; i++) {
		frame_make(&shot[i].wanted, &shot[i].settings);
		assert_int_equal(psr_renderer_create(&fresh, NULL), PSR_OK);
		assert_int_equal(psr_render(fresh, &shot[i].scene, &shot[i].settings, NULL, &shot[i].wanted, NULL), PSR_OK);
		psr_renderer_destroy(fresh);
	}
	assert_int_equal(psr_renderer_create(&renderer, NULL), PSR_OK);
	for (int at = 0, is_over = 0; !is_over; at += stride) {
		draw_whole(renderer, &shot[0], pool, at);
		is_over = !draw_until(renderer, &shot[1], pool, at);
		draw_whole(renderer, &shot[1 + at / stride % 2], pool, at);
		n_cancelled += !is_over;
	}
	assert_true(n_cancelled >= 100 / stride);
	psr_renderer_destroy(renderer);
	for (int i = 0; i < N_SHOTS; i++)
		frame_clear(&shot[i].wanted);
}

/* A model on the left side of the picture, then on the right, then turned. All need the same depth buffers. */
static void shots_make(struct shot shot[N_SHOTS], const struct psr_model *model, uint32_t width, uint32_t height)
{
	static const double turn[N_SHOTS] = { 0.6, 0.6, -0.6 }, aside[N_SHOTS] = { -0.8, 0.8, 0.8 };
	const struct psr_model_info *info = psr_model_info(model);

	memset(shot, 0, N_SHOTS * sizeof *shot);
	for (int i = 0; i < N_SHOTS; i++) {
		struct shot *s = &shot[i];

		s->instance[0] = (struct psr_instance){ .model = model, .rotation = { 0, turn[i], 0, 0.8 }, .scale = 1 };
		s->instance[0].translation[0] = aside[i] * info->scale;
		s->light[0] = (struct psr_light){ .direction = { -1, -2, -1 }, .color = { 1, 0.9, 0.8 } };
		s->scene = (struct psr_scene){ .instance = s->instance, .n_instances = 1, .light = s->light, .n_lights = 1,
			                           .ambient = { 0.1, 0.1, 0.1 }, .background = { 0.1, 0.2, 0.3 } };
		psr_camera_frame(&s->scene.camera, info->box_min, info->box_max, info->up, 0.6, (double)width / height);
		psr_settings_default(&s->settings, width, height);
		s->settings.smooth = i == 1;
	}
}

/* Two models to either side, so that the moving one changes no camera of a light. */
static void add_sides(struct shot *shot)
{
	for (int k = 1; k < 3; k++) {
		shot->instance[k] = (struct psr_instance){ .model = models[DICE], .rotation = { 0, 0, 0, 1 }, .scale = 1 };
		for (int a = 0; a < 3; a++)
			shot->instance[k].translation[a] = k == 1 ? 4 : -4;
	}
	shot->scene.n_instances = 3;
}

static void with_pools(struct shot shot[N_SHOTS])
{
	struct psr_pool *pool;

	cancel_everywhere(shot, NULL, STRIDE_ALONE);
	assert_int_equal(psr_pool_create(&pool, 3, NULL), PSR_OK);
	cancel_everywhere(shot, pool, 5 * STRIDE);
	psr_pool_destroy(pool);
}

static void plain_and_smooth_frames_leave_no_trace(void **state)
{
	struct shot shot[N_SHOTS];

	(void)state;
	shots_make(shot, models[TEAPOT], 300, 150);
	with_pools(shot);
}

static void shadow_maps_half_drawn_are_forgotten(void **state)
{
	struct shot shot[N_SHOTS];

	(void)state;
	shots_make(shot, models[DICE], 280, 64);
	for (int i = 0; i < N_SHOTS; i++) {
		add_sides(&shot[i]);
		shot[i].light[0].casts_shadow = 1;
	}
	with_pools(shot);
}

static void maps_around_a_near_light_are_forgotten(void **state)
{
	struct shot shot[N_SHOTS];

	(void)state;
	shots_make(shot, models[DICE], 60, 40);
	for (int i = 0; i < N_SHOTS; i++) {
		add_sides(&shot[i]);
		shot[i].light[1] = (struct psr_light){ .kind = PSR_LIGHT_POINT, .position = { 0.5, 1.5, 0.5 },
			                                   .color = { 0.5, 0.5, 1 }, .casts_shadow = 1 };
		shot[i].scene.n_lights = 2;
	}
	with_pools(shot);
}

static void glass_leaves_no_trace(void **state)
{
	struct shot shot[N_SHOTS];

	(void)state;
	shots_make(shot, models[CASE], 24, 16);
	for (int i = 0; i < N_SHOTS; i++) {
		shot[i].instance[1] = shot[i].instance[2] = shot[i].instance[0];
		shot[i].instance[1].model = models[DICE];
		shot[i].instance[2].translation[1] = 0.3;
		shot[i].scene.n_instances = 3;
	}
	with_pools(shot);
}

static void passes_leave_no_trace(void **state)
{
	struct shot shot[N_SHOTS];

	(void)state;
	shots_make(shot, models[TEAPOT], 20, 12);
	shot[1].settings.pass = 2;
	shot[2].settings.pass = 1;
	with_pools(shot);
}

/* Samples are tens of pixels apart. */
static void magnified_frames_leave_no_trace(void **state)
{
	struct shot shot[N_SHOTS];

	(void)state;
	shots_make(shot, models[TEAPOT], 300, 150);
	for (int i = 0; i < N_SHOTS; i++)
		shot[i].scene.camera.fov_y = 0.1;
	with_pools(shot);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(plain_and_smooth_frames_leave_no_trace),
		cmocka_unit_test(shadow_maps_half_drawn_are_forgotten),
		cmocka_unit_test(maps_around_a_near_light_are_forgotten),
		cmocka_unit_test(glass_leaves_no_trace),
		cmocka_unit_test(passes_leave_no_trace),
		cmocka_unit_test(magnified_frames_leave_no_trace),
	};

	return cmocka_run_group_tests(tests, open_models, close_models);
}

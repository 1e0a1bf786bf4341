/* The client library against a running psrd. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "fixture.h"
#include "psr/client.h"

static char folder[PATH_MAX];
static struct daemon psrd;
static struct psr_client *client;

static int set_up(void **state)
{
	static const char *const more[] = { "--threads", "2", NULL };

	(void)state;
	folder_make(folder);
	plate_write(folder, "plate.psr", 0x2040c0);
	teapot_write(folder);
	daemon_start(&psrd, folder, more);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	daemon_stop(&psrd);
	folder_remove(folder);
	return 0;
}

static int connect_client(void **state)
{
	struct psr_error err;

	(void)state;
	if (psr_client_connect(&client, psrd.ready, "test", NULL, PATIENCE_MS, &err) != PSR_OK)
		fail_msg("%s", err.text);
	return 0;
}

static int close_client(void **state)
{
	(void)state;
	psr_client_close(client);
	return 0;
}

static struct psr_model *open_here(const char *name)
{
	char path[2 * PATH_MAX];
	struct psr_model *model;

	snprintf(path, sizeof path, "%s/%s.psr", folder, name);
	assert_int_equal(psr_model_map(&model, path, NULL), PSR_OK);
	return model;
}

/* Draws a shot here and there; every plane has the same hash. */
static void assert_same_planes(const struct psr_shot *shot, const char *name)
{
	struct psr_model *model = open_here(name);
	struct psr_frame here, there;
	struct psr_error err;

	assert_int_equal(psr_shot_draw(shot, model, &here, &err), PSR_OK);
	if (psr_client_draw(client, name, shot, &there, PATIENCE_MS, &err) != PSR_OK)
		fail_msg("%s", err.text);
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++) {
		assert_int_equal(psr_frame_plane(&here, plane) != NULL, shot->planes >> plane & 1);
		assert_int_equal(psr_frame_plane(&there, plane) != NULL, shot->planes >> plane & 1);
		if (shot->planes >> plane & 1)
			assert_true(psr_frame_hash(&here, plane) == psr_frame_hash(&there, plane));
	}
	psr_frame_free(&here);
	psr_frame_free(&there);
	psr_model_unref(model);
}

static void library_and_daemon_draw_the_same_planes(void **state)
{
	struct psr_shot shot;

	(void)state;
	psr_shot_default(&shot, 200, 150);
	shot.planes = (1u << PSR_N_PLANES) - 1;
	assert_same_planes(&shot, "teapot");
	assert_same_planes(&shot, "plate"); /* +z is up */
}

static void library_and_daemon_take_the_same_camera_lights_and_settings(void **state)
{
	const struct psr_camera camera = { .eye = { 1, 2, 6 }, .target = { 0, 0.5, 0 }, .up = { 0, 1, 0.1 },
		                               .kind = PSR_CAMERA_ORTHOGRAPHIC, .ortho_height = 4 };
	const struct psr_light light[] = {
		{ .kind = PSR_LIGHT_POINT, .position = { 3, 4, 5 }, .color = { 2.5, 2.5, 2.5 }, .reference = 3 },
		{ .kind = PSR_LIGHT_SPOT, .position = { 0, 5, 5 }, .direction = { 0, -1, -1 }, .color = { 0, 0.25, 0 },
		  .inner = 0.2, .outer = 0.4, .casts_shadow = 1 },
	};
	struct psr_shot shot;

	(void)state;
	psr_shot_default(&shot, 160, 120);
	shot.camera = &camera;
	shot.light = light;
	shot.n_lights = 2;
	shot.ambient = 0.3;
	memcpy(shot.background, "\x80\x20\x00", 3);
	shot.planes = 1 << PSR_PLANE_COLOR | 1 << PSR_PLANE_DEPTH;
	shot.settings.spacing_px = 2;
	assert_same_planes(&shot, "teapot");
	shot.settings.pass = 2;
	assert_same_planes(&shot, "teapot");
}

static void one_call_connects_opens_and_draws(void **state)
{
	struct psr_frame frame, again;
	struct psr_shot shot;
	struct psr_error err;

	(void)state;
	psr_shot_default(&shot, 64, 48);
	assert_int_equal(psr_shot_draw_at(psrd.ready, "teapot", &shot, &frame, PATIENCE_MS, &err), PSR_OK);
	assert_int_equal(psr_client_draw(client, "teapot", &shot, &again, PATIENCE_MS, &err), PSR_OK);
	assert_true(psr_frame_hash(&frame, PSR_PLANE_COLOR) == psr_frame_hash(&again, PSR_PLANE_COLOR));
	psr_frame_free(&frame);
	psr_frame_free(&again);
}

static void shots_that_nobody_can_draw_are_refused_and_the_connection_goes_on(void **state)
{
	struct psr_frame frame;
	struct psr_shot shot;
	struct psr_error err;

	(void)state;
	psr_shot_default(&shot, 64, 48);
	assert_int_equal(psr_client_draw(client, "sphere", &shot, &frame, PATIENCE_MS, &err), PSR_ERR_NOT_FOUND);
	assert_non_null(strstr(err.text, "sphere"));
	shot.settings.height = 0;
	assert_int_equal(psr_client_draw(client, "plate", &shot, &frame, PATIENCE_MS, &err), PSR_ERR_ARG);
	psr_shot_default(&shot, 64, 48);
	shot.planes = 0;
	assert_int_equal(psr_client_draw(client, "plate", &shot, &frame, PATIENCE_MS, &err), PSR_ERR_ARG);
	shot.planes = 1;
	shot.settings.pass = PSR_MAX_PASS + 1;
	assert_int_equal(psr_client_draw(client, "plate", &shot, &frame, PATIENCE_MS, &err), PSR_ERR_LIMIT);
	psr_shot_default(&shot, 64, 48);
	shot.n_lights = PSR_WIRE_MAX_LIGHTS + 1;
	assert_int_equal(psr_client_draw(client, "plate", &shot, &frame, PATIENCE_MS, &err), PSR_ERR_LIMIT);
	assert_null(frame.rgb);
	psr_shot_default(&shot, 64, 48);
	assert_int_equal(psr_client_draw(client, "plate", &shot, &frame, PATIENCE_MS, &err), PSR_OK);
	psr_frame_free(&frame);
}

static void a_closed_model_has_no_handle(void **state)
{
	struct psr_msg_preset *presets;
	struct psr_msg_opened opened;
	struct psr_event event;
	struct psr_error err;
	uint32_t n;

	(void)state;
	assert_int_equal(psr_client_open(client, "plate", PATIENCE_MS, &opened, &err), PSR_OK);
	assert_int_equal(psr_client_close_model(client, 0, &err), PSR_ERR_ARG);
	assert_int_equal(psr_client_close_model(client, opened.handle, &err), PSR_OK);
	assert_int_equal(psr_client_presets(client, opened.handle, &presets, &n, PATIENCE_MS, &err), PSR_ERR_NOT_FOUND);
	assert_int_equal(psr_client_close_model(client, opened.handle, &err), PSR_OK);
	assert_int_equal(psr_client_wait(client, PATIENCE_MS, &event, &err), 1);
	assert_int_equal(event.type, PSR_EVENT_FAILED);
	assert_int_equal(event.error.code, PSR_ERR_NOT_FOUND);
}

/* A frame of so many passes that it lasts, its first pass taken; the socket is waited for as an event loop does. */
static uint32_t begin_long_frame(void)
{
	struct psr_msg_scene *scene = calloc(1, sizeof *scene);
	struct psr_msg_frame frame = frame_default(1000, 1000);
	struct psr_msg_opened opened;
	struct psr_event event;
	struct psr_error err;
	struct pollfd watch;
	uint32_t id;
	int got;

	assert_int_equal(psr_client_open(client, "plate", PATIENCE_MS, &opened, &err), PSR_OK);
	scene_default(scene, opened.handle);
	assert_int_equal(psr_client_scene(client, scene, NULL, &err), PSR_OK);
	free(scene);
	frame.pass_limit = 4;
	assert_int_equal(psr_client_frame(client, &frame, &id, &err), PSR_OK);
	do {
		watch.fd = psr_client_fd(client, &watch.events);
		assert_true(watch.events & POLLIN);
		assert_int_equal(poll(&watch, 1, PATIENCE_MS), 1);
		got = psr_client_wait(client, 0, &event, &err);
	} while (got == 0);
	assert_int_equal(got, 1);
	assert_int_equal(event.type, PSR_EVENT_FRAME);
	assert_int_equal(event.end->is_final, 0);
	return id;
}

static void a_cancelled_frame_ends_in_one_event(void **state)
{
	struct psr_event event;
	struct psr_error err;
	uint32_t id;

	(void)state;
	id = begin_long_frame();
	assert_int_equal(psr_client_cancel(client, id + 1, &err), PSR_ERR_NOT_FOUND);
	assert_int_equal(psr_client_cancel(client, 0, &err), PSR_ERR_NOT_FOUND);
	assert_int_equal(psr_client_cancel(client, id, &err), PSR_OK);
	do
		assert_int_equal(psr_client_wait(client, PATIENCE_MS, &event, &err), 1);
	while (event.type == PSR_EVENT_FRAME); /* passes that were on their way */
	assert_int_equal(event.id, id);
	assert_int_equal(event.error.code, PSR_ERR_CANCELLED);
	assert_int_equal(psr_client_cancel(client, id, &err), PSR_ERR_NOT_FOUND);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(library_and_daemon_draw_the_same_planes, connect_client, close_client),
		cmocka_unit_test_setup_teardown(library_and_daemon_take_the_same_camera_lights_and_settings, connect_client,
		                                close_client),
		cmocka_unit_test_setup_teardown(one_call_connects_opens_and_draws, connect_client, close_client),
		cmocka_unit_test_setup_teardown(shots_that_nobody_can_draw_are_refused_and_the_connection_goes_on,
		                                connect_client, close_client),
		cmocka_unit_test_setup_teardown(a_closed_model_has_no_handle, connect_client, close_client),
		cmocka_unit_test_setup_teardown(a_cancelled_frame_ends_in_one_event, connect_client, close_client),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}

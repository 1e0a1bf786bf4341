/* Views from outside: psrd draws, the client library follows. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "fixture.h"
#include "psr/client.h"

#define VIEW 3
#define SIDE 512

static char folder[PATH_MAX];
static struct daemon psrd;
static struct psr_client *client;
static struct psr_msg_opened opened;

static int set_up(void **state)
{
	static const char *const more[] = { "--threads", "2", "--frame-timeout", "60", NULL };

	(void)state;
	folder_make(folder);
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

/* A light from the left, then from the right. */
static void send_scene(double light_x)
{
	struct psr_msg_scene *scene = malloc(sizeof *scene);
	struct psr_error err;

	assert_non_null(scene);
	scene_default(scene, opened.handle);
	scene->ambient = 0;
	scene->n_lights = 1;
	scene->light[0] = (struct psr_msg_light){ .kind = PSR_WIRE_LIGHT_POINT, .color = { 255, 255, 255 }, .intensity = 1,
		                                      .position = { light_x, 0.3, 2 }, .reference = 1 };
	assert_int_equal(psr_client_scene(client, scene, NULL, &err), PSR_OK);
	free(scene);
}

static int connect_client(void **state)
{
	struct psr_error err;

	(void)state;
	if (psr_client_connect(&client, psrd.ready, "test", NULL, PATIENCE_MS, &err) != PSR_OK
	    || psr_client_open(client, "teapot", PATIENCE_MS, &opened, &err) != PSR_OK)
		fail_msg("%s", err.text);
	send_scene(-2);
	return 0;
}

static int close_client(void **state)
{
	(void)state;
	psr_client_close(client);
	return 0;
}

static struct psr_msg_frame frame_at(double angle)
{
	struct psr_msg_frame frame = frame_default(SIDE, SIDE);

	psr_camera_frame(&frame.camera, opened.box_min, opened.box_max, opened.up, 0.5, 1);
	frame.camera.eye[0] += sin(angle) * opened.box_max[0];
	frame.color_codec = PSR_CODEC_ZSTD;
	return frame;
}

static uint32_t ask(uint16_t view, const struct psr_msg_frame *frame)
{
	struct psr_error err;
	uint32_t id;

	if (psr_client_frame_in(client, view, frame, &id, &err) != PSR_OK)
		fail_msg("%s", err.text);
	return id;
}

/* The next event that is not BEGIN. */
static struct psr_event next(void)
{
	struct psr_event event;
	struct psr_error err;

	do
		if (psr_client_wait(client, PATIENCE_MS, &event, &err) != 1)
			fail_msg("no event: %s", err.text);
	while (event.type == PSR_EVENT_BEGIN);
	return event;
}

static struct psr_event next_frame(uint32_t id, unsigned pass)
{
	struct psr_event event = next();

	if (event.type == PSR_EVENT_FAILED)
		fail_msg("%s", event.error.text);
	assert_int_equal(event.type, PSR_EVENT_FRAME);
	assert_int_equal(event.id, id);
	assert_int_equal(event.begin->pass, pass);
	return event;
}

static void acknowledge(const struct psr_event *event)
{
	assert_int_equal(psr_client_ack(client, event->id, event->begin->pass, NULL), PSR_OK);
}

static void the_last_request_of_a_movement_is_drawn(void **state)
{
	unsigned n_ends[64] = { 0 }, n_drawn = 0;
	uint32_t first = 0, last = 0;
	struct psr_event event;

	(void)state;
	for (int i = 0; i < 40; i++) {
		struct psr_msg_frame frame = frame_at(i * 0.05);

		frame.pass_limit = 1;
		last = ask(VIEW, &frame);
		first = first == 0 ? last : first;
	}
	do {
		event = next();
		assert_in_range(event.id, first, last);
		if (event.type == PSR_EVENT_FRAME) {
			n_drawn++;
			assert_true(event.id == last || event.end->is_final);
			n_ends[event.id - first] += event.end->is_final;
			acknowledge(&event);
		} else {
			assert_int_equal(event.type, PSR_EVENT_SUPERSEDED);
			n_ends[event.id - first]++;
		}
	} while (event.id != last || event.type != PSR_EVENT_FRAME || !event.end->is_final);
	for (uint32_t i = 0; i <= last - first; i++)
		assert_int_equal(n_ends[i], 1);
	assert_true(n_drawn < 40); /* those in between were left out */
}

static void a_third_frame_waits_for_an_acknowledgement(void **state)
{
	struct psr_msg_frame frame = frame_at(0);
	struct psr_event held[2], event;
	struct psr_error err;
	uint32_t id;

	(void)state;
	for (int i = 0; i < 2; i++) {
		id = ask(VIEW, &frame);
		held[i] = next_frame(id, 0);
	}
	id = ask(VIEW, &frame);
	assert_int_equal(psr_client_wait(client, 200, &event, &err), 0);
	acknowledge(&held[0]);
	event = next_frame(id, 0);
	acknowledge(&held[1]);
	acknowledge(&event);
}

static void a_paused_view_waits(void **state)
{
	struct psr_msg_frame frame = frame_at(0);
	struct psr_event event;
	struct psr_error err;
	uint32_t id, still;

	(void)state;
	assert_int_equal(psr_client_pause(client, VIEW, 1, &err), PSR_OK);
	assert_int_equal(psr_client_pause(client, 0, 1, &err), PSR_OK);
	id = ask(VIEW, &frame);
	assert_int_equal(psr_client_frame(client, &frame, &still, &err), PSR_OK);
	assert_int_equal(psr_client_wait(client, 200, &event, &err), 0);
	assert_int_equal(psr_client_pause(client, VIEW, 0, &err), PSR_OK);
	event = next_frame(id, 0);
	acknowledge(&event);
	assert_int_equal(psr_client_pause(client, 0, 0, &err), PSR_OK);
	next_frame(still, 0);
}

/* Draws the same in view 0, whose every pixel is checked by its hash, and compares. */
static void assert_as_in_view_0(const struct psr_frame *picture, const struct psr_msg_frame *asked)
{
	struct psr_msg_frame frame = *asked;
	struct psr_frame copy = *picture;
	struct psr_event event;
	struct psr_error err;
	uint32_t id;

	frame.base = 0;
	frame.flags = 0;
	assert_int_equal(psr_client_frame(client, &frame, &id, &err), PSR_OK);
	event = next_frame(id, 0);
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (asked->planes >> plane & 1)
			assert_true(psr_frame_hash(event.picture, plane) == psr_frame_hash(&copy, plane));
}

/* Camera and light stand: nothing is sent. The light moves: depth stays, and colour comes where it has changed. */
static void only_changes_to_a_base_are_sent(void **state)
{
	struct psr_msg_frame frame = frame_at(0);
	struct psr_event event, again;
	uint64_t all;
	uint32_t id;

	(void)state;
	frame.planes = 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH;
	frame.depth_format = PSR_WIRE_DEPTH_F32;
	frame.depth_codec = PSR_CODEC_ZSTD;
	id = ask(VIEW, &frame);
	event = next_frame(id, 0);
	all = event.bytes;
	acknowledge(&event);
	frame.base = psr_client_base(client, VIEW);
	assert_int_equal(frame.base, id);
	id = ask(VIEW, &frame);
	again = next_frame(id, 0);
	assert_int_equal(again.begin->base, frame.base);
	assert_in_range(again.bytes, 1, 1600); /* FRAME_BEGIN and FRAME_END */
	assert_as_in_view_0(again.picture, &frame);
	acknowledge(&again);
	send_scene(2);
	frame.base = psr_client_base(client, VIEW);
	id = ask(VIEW, &frame);
	event = next_frame(id, 0);
	assert_in_range(event.bytes, 2000, all - all / 5);
	assert_as_in_view_0(event.picture, &frame);
	acknowledge(&event);
}

/* A frame of a fourth of the pixels, as JPEG; then all of them, smooth and without loss; then refined ones. */
static void a_view_at_rest_gets_sharp_then_refined(void **state)
{
	struct psr_msg_frame frame = frame_at(0), smooth;
	struct psr_event event, refined;
	uint32_t id;

	(void)state;
	frame.flags = PSR_WIRE_FRAME_SHARP;
	frame.color_codec = PSR_CODEC_JPEG;
	frame.color_quality = 50;
	frame.pass_limit = 1;
	frame.budget = PSR_WIRE_BUDGET_SETTINGS;
	frame.settings = (struct psr_msg_settings){ .scale = 2, .spacing_px = 1 };
	id = ask(VIEW, &frame);
	event = next_frame(id, 0);
	assert_int_equal(event.begin->settings.scale, 2);
	assert_int_equal(event.begin->color_codec, PSR_CODEC_JPEG);
	assert_int_equal(event.end->is_final, 0);
	acknowledge(&event);
	event = next_frame(id, 1);
	assert_int_equal(event.begin->refine, 0);
	assert_true(event.begin->settings.scale == 1 && event.begin->settings.smooth);
	assert_int_equal(event.begin->color_codec, PSR_CODEC_ZSTD);
	assert_int_equal(event.end->is_final, 0);
	smooth = frame;
	smooth.color_codec = PSR_CODEC_ZSTD;
	smooth.color_quality = 0;
	smooth.pass_limit = 0;
	smooth.settings = event.begin->settings;
	refined = next_frame(id, 2);
	assert_int_equal(refined.begin->refine, 1);
	assert_true(refined.begin->settings.scale == 1 && refined.begin->settings.smooth);
	assert_int_equal(refined.begin->color_codec, PSR_CODEC_ZSTD);
	assert_int_equal(refined.end->is_final, 1);
	assert_as_in_view_0(event.picture, &smooth);
	acknowledge(&event);
	acknowledge(&refined);
}

static void frames_of_all_scales_have_their_hashes(void **state)
{
	struct psr_msg_frame frame = frame_at(0);

	(void)state;
	frame.planes = 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH | 1u << PSR_PLANE_ID;
	frame.depth_format = PSR_WIRE_DEPTH_F32;
	frame.depth_codec = frame.data_codec = PSR_CODEC_ZSTD;
	frame.budget = PSR_WIRE_BUDGET_SETTINGS;
	for (unsigned scale = 1; scale <= 4; scale *= 2) {
		struct psr_event event;

		frame.settings = (struct psr_msg_settings){ .scale = (uint8_t)scale, .spacing_px = 1 };
		event = next_frame(ask(VIEW, &frame), 0);
		assert_int_equal(event.checked, frame.planes);
		acknowledge(&event);
	}
}

/* The client reads nothing while a sharp frame of more than 60 MB waits for it, and then moves on: the frame never
 * comes, its id ends, and the view goes on. Three times, as two frames may be unacknowledged. */
static void unsent_sharp_frames_make_way_for_a_newer_one(void **state)
{
	(void)state;
	for (int round = 0; round < 3; round++) {
		struct psr_msg_frame frame = frame_at(0.1 * round);
		struct psr_event event;
		const uint64_t drawn = stat_of(&psrd, PSR_STAT_FRAMES);
		uint64_t before;
		uint32_t id, newer;

		frame.width = frame.height = 2400;
		frame.planes = 1u << PSR_PLANE_COLOR | 1u << PSR_PLANE_DEPTH | 1u << PSR_PLANE_NORMAL | 1u << PSR_PLANE_ID;
		frame.depth_format = PSR_WIRE_DEPTH_F32;
		frame.flags = PSR_WIRE_FRAME_SHARP | PSR_WIRE_FRAME_NO_HASHES;
		frame.color_codec = PSR_CODEC_RAW;
		frame.budget = PSR_WIRE_BUDGET_SETTINGS;
		frame.settings = (struct psr_msg_settings){ .scale = 4, .spacing_px = 1 };
		id = ask(VIEW, &frame);
		event = next_frame(id, 0);
		acknowledge(&event);
		before = psr_client_bytes_received(client);
		while (stat_of(&psrd, PSR_STAT_FRAMES) < drawn + 2) /* the sharp one, too: it is in the queue */
			usleep(5000);
		frame = frame_at(1);
		newer = ask(VIEW, &frame);
		event = next();
		assert_int_equal(event.type, PSR_EVENT_SUPERSEDED);
		assert_int_equal(event.id, id);
		event = next_frame(newer, 0);
		acknowledge(&event);
		assert_in_range(psr_client_bytes_received(client) - before, 0, 45000000); /* what sockets hold, and the newer one */
	}
}

/* 400 instances and 16 shadow maps, 64 samples a pixel's side: more than 0.2 s anywhere. It ends then, and another
 * client does not wait for it. */
static void a_frame_over_its_time_is_refused_and_keeps_nobody_waiting(void **state)
{
	struct psr_msg_scene *scene = malloc(sizeof *scene);
	struct psr_msg_frame frame = frame_at(0), small = frame_at(0);
	static const char *const more[] = { "--threads", "2", "--frame-timeout", "2", NULL };
	const struct daemon patient = psrd;
	struct psr_client *other;
	struct psr_error err;
	struct psr_event event;

	(void)state;
	assert_non_null(scene);
	daemon_start(&psrd, folder, more);
	connect_client(NULL);
	scene_default(scene, opened.handle);
	scene_make_heavy(scene);
	assert_int_equal(psr_client_scene(client, scene, NULL, &err), PSR_OK);
	frame.width = frame.height = 2048;
	frame.budget = PSR_WIRE_BUDGET_SETTINGS;
	frame.settings = (struct psr_msg_settings){ .scale = 1, .spacing_px = 1.0 / 64 };
	ask(VIEW, &frame);
	ask(VIEW + 1, &frame);
	other = client;
	connect_client(NULL);
	small.width = small.height = 64;
	for (int i = 0; i < 20; i++) {
		event = next_frame(ask(VIEW, &small), 0);
		acknowledge(&event);
	}
	psr_client_close(client);
	client = other;
	for (int i = 0; i < 2; i++) {
		event = next();
		assert_int_equal(event.type, PSR_EVENT_FAILED);
		assert_int_equal(event.error.code, PSR_ERR_LIMIT);
		assert_non_null(strstr(event.error.text, "--frame-timeout"));
	}
	psr_client_close(client);
	daemon_stop(&psrd);
	psrd = patient;
	free(scene);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(the_last_request_of_a_movement_is_drawn, connect_client, close_client),
		cmocka_unit_test_setup_teardown(a_third_frame_waits_for_an_acknowledgement, connect_client, close_client),
		cmocka_unit_test_setup_teardown(a_paused_view_waits, connect_client, close_client),
		cmocka_unit_test_setup_teardown(only_changes_to_a_base_are_sent, connect_client, close_client),
		cmocka_unit_test_setup_teardown(a_view_at_rest_gets_sharp_then_refined, connect_client, close_client),
		cmocka_unit_test_setup_teardown(frames_of_all_scales_have_their_hashes, connect_client, close_client),
		cmocka_unit_test_setup_teardown(unsent_sharp_frames_make_way_for_a_newer_one, connect_client, close_client),
		cmocka_unit_test(a_frame_over_its_time_is_refused_and_keeps_nobody_waiting),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}

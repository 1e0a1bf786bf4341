/* The real daemon and peers that speak raw bytes: what it serves, and that bad input costs one connection at most. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <xxhash.h>
#include "psr/render.h"
#include "psr/render.h"
#include "fixture.h"

static char folder[PATH_MAX];
static struct daemon psrd;
static struct peer p;

static int set_up(void **state)
{
	static const char *const more[] = { "--threads", "2", "--handshake-timeout", "30", NULL };

	(void)state;
	folder_make(folder);
	plate_write(folder, "plate.psr", 0x2040c0);
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

static void welcome_tells_the_limits(void **state)
{
	struct psr_msg_welcome welcome;

	(void)state;
	peer_hello(&p, &psrd, &welcome);
	assert_int_equal(welcome.capabilities, PSR_CAP_REFINE | PSR_CAP_SHADOWS | PSR_CAP_BUILD | PSR_CAP_RESOLUTION |
	                                           PSR_CAP_PRESETS | PSR_CAP_OCTREE | PSR_CAP_DPOINT |
	                                           PSR_CAP_NORMAL | PSR_CAP_ID | PSR_CAP_WEIGHT | PSR_CAP_WORDS |
	                                           PSR_CAP_BLOCK | PSR_CAP_VIEWS | PSR_CAP_BASE | PSR_CAP_SETTINGS |
	                                           PSR_CAP_DEPTH_U16 | PSR_CAP_PAUSE | PSR_CAP_SHARP |
	                                           PSR_CAP_TIME_BUDGET | PSR_CAP_ERROR_BOUND | PSR_CAP_RMSE_BOUND |
	                                           PSR_CAP_BOUND | PSR_CAP_FETCH | PSR_CAP_LEVELS | PSR_CAP_COLOR_BY |
	                                           PSR_CAP_FINE | PSR_CAP_SPLATS);
	assert_int_equal(welcome.max_pixels, 16 << 20);
	assert_int_equal(welcome.max_open, 64);
	assert_int_equal(welcome.idle_timeout_ms, 600000);
	peer_close(&p);
}

static void list_names_the_model_and_its_state(void **state)
{
	struct psr_message message;
	struct psr_msg_list_entry entry;
	struct psr_msg_list_end end;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	assert_int_equal(psr_msg_list_encode(&p.buf, ++p.id, NULL), PSR_OK);
	peer_send(&p);
	peer_expect(&p, &message, PSR_MSG_LIST_ENTRY, p.id);
	assert_int_equal(psr_msg_list_entry_decode(&entry, message.payload, message.n, NULL), PSR_OK);
	assert_string_equal(entry.name, "plate");
	assert_int_equal(entry.state, PSR_ENTRY_LOADED);
	peer_expect(&p, &message, PSR_MSG_LIST_END, p.id);
	assert_int_equal(psr_msg_list_end_decode(&end, message.payload, message.n, NULL), PSR_OK);
	assert_int_equal(end.n_entries, 1);
	peer_close(&p);
}

/* Raw planes, put together from their rectangles over the background, have the hashes of FRAME_END. */
static void raw_planes_have_the_hashes_of_the_end(void **state)
{
	enum { WIDTH = 150, HEIGHT = 300 };
	struct psr_msg_frame frame = frame_default(WIDTH, HEIGHT);
	static uint8_t planes[PSR_N_PLANES][8 * WIDTH * HEIGHT], coded[8 * WIDTH * 128];
	const uint8_t *rgb = planes[PSR_PLANE_COLOR];
	const struct psr_frame got = {
		.width = WIDTH, .height = HEIGHT, .rgb = planes[PSR_PLANE_COLOR], .depth = (float *)planes[PSR_PLANE_DEPTH],
		.normal = (int16_t *)planes[PSR_PLANE_NORMAL], .id = (uint32_t *)planes[PSR_PLANE_ID],
		.block = planes[PSR_PLANE_BLOCK], .weight = planes[PSR_PLANE_WEIGHT],
		.words = (uint64_t *)planes[PSR_PLANE_WORDS], .bound = (uint16_t *)planes[PSR_PLANE_BOUND],
	};
	const unsigned n_pixels = WIDTH * HEIGHT;
	struct psr_message message;
	struct psr_msg_frame_begin begin;
	struct psr_msg_frame_end end;
	struct psr_msg_rect rect;
	int n_plate = 0;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	frame.planes = (1 << PSR_N_PLANES) - 1;
	frame.color_codec = frame.depth_codec = frame.data_codec = PSR_CODEC_RAW;
	frame.depth_format = PSR_WIRE_DEPTH_F32;
	peer_ask_frame(&p, &frame);
	peer_expect(&p, &message, PSR_MSG_FRAME_BEGIN, p.id);
	assert_int_equal(psr_msg_frame_begin_decode(&begin, message.payload, message.n, NULL), PSR_OK);
	assert_true(begin.depth_min == 0 && begin.depth_max == 0 && begin.refine == 0);
	assert_memory_equal(begin.camera.eye, frame.camera.eye, sizeof begin.camera.eye);
	assert_true(begin.camera.fov_y == frame.camera.fov_y && begin.camera.near_z == frame.camera.near_z);
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++) {
		const unsigned pixel = psr_plane_pixel_bytes(plane, PSR_WIRE_DEPTH_F32);
		const uint8_t *empty = plane == PSR_PLANE_COLOR ? begin.background : psr_plane_background(plane);

		for (unsigned i = 0; i < n_pixels; i++)
			memcpy(planes[plane] + pixel * i, empty, pixel);
	}
	for (;;) {
		assert_true(peer_next(&p, &message));
		if (message.type == PSR_MSG_FRAME_END)
			break;
		assert_int_equal(psr_msg_rect_decode(&rect, message.payload, message.n, NULL), PSR_OK);
		assert_int_equal(rect.codec, PSR_CODEC_RAW);
		assert_true(rect.x == 0 && rect.w == WIDTH && rect.y % 128 == 0 && rect.y + rect.h <= HEIGHT);
		memcpy(coded + rect.offset, rect.data, rect.bytes);
		if (rect.offset + rect.bytes == rect.total)
			memcpy(planes[rect.plane] + psr_plane_pixel_bytes(rect.plane, PSR_WIRE_DEPTH_F32) * WIDTH * rect.y, coded,
			       rect.total);
	}
	assert_int_equal(psr_msg_frame_end_decode(&end, message.payload, message.n, NULL), PSR_OK);
	assert_true(fabs(end.depth_min - 2) < 1e-3 && fabs(end.depth_max - 2) < 1e-3 && end.has_hashes);
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		assert_true(psr_frame_hash(&got, plane) == end.hash[plane]);
	for (int i = 0; i < WIDTH * HEIGHT; i++)
		n_plate += rgb[3 * i] == 0xc0 && rgb[3 * i + 1] == 0x40 && rgb[3 * i + 2] == 0x20;
	/* The plate is wider than the picture, which shows 4 tan(0.3) of its plane in height; 0.866 are covered. At either
	 * edge a sample's distance, 1/64, may be missing or too much, and a cell of the level that fits it, 4 pixels. */
	assert_true(fabs(n_plate - WIDTH * HEIGHT * 0.866 / (4 * tan(0.3)))
	            < 2 * WIDTH * (HEIGHT / 64.0 / (4 * tan(0.3)) + 4));
	peer_close(&p);
}

static void the_report_has_every_entry_in_order(void **state)
{
	struct psr_msg_frame frame = frame_default(64, 48);
	struct psr_msg_frame_end end;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	peer_expect_frame(&p, peer_ask_frame(&p, &frame), &end);
	assert_int_equal(end.n_entries, 24 + PSR_N_EFFECTS);
	for (int i = 0; i < 13; i++)
		assert_int_equal(end.entry[i].id, i + 1);
	assert_true(end.entry[12].ns > 0); /* cores' time */
	for (int i = 13; i < 23; i++)
		assert_int_equal(end.entry[i].id, i - 13 + 32);
	assert_int_equal(end.entry[23].id, PSR_WIRE_REPORT_AS_BLOCKS);
	for (int i = 24; i < 24 + PSR_N_EFFECTS; i++) {
		assert_int_equal(end.entry[i].id, i - 24 + PSR_WIRE_REPORT_EFFECTS);
		assert_true(end.entry[i].ns == PSR_WHY_RAN || end.entry[i].count == 0);
	}
	assert_int_equal(end.entry[24 + PSR_EFFECT_SPECULAR].ns, PSR_WHY_NOTHING);
	assert_int_equal(end.entry[9].count, 2);
	assert_int_equal(end.entry[18].count, PLATE_SAMPLES);
	peer_close(&p);
}

static void a_frame_without_color_is_not_lit(void **state)
{
	struct psr_msg_frame frame = frame_default(64, 48);
	struct psr_msg_scene *scene = malloc(sizeof *scene);
	struct psr_msg_frame_end end;

	(void)state;
	assert_non_null(scene);
	peer_begin(&p, &psrd, "plate");
	scene_default(scene, 1);
	scene->n_lights = 1;
	scene->light[0] = (struct psr_msg_light){ .kind = PSR_WIRE_LIGHT_DIRECTIONAL,
		                                      .flags = PSR_WIRE_LIGHT_SHADOW,
		                                      .intensity = 1,
		                                      .direction = { 0, 0, -1 },
		                                      .color = { 255, 255, 255 } };
	peer_send_scene(&p, scene);
	for (unsigned with_color = 0; with_color < 2; with_color++) {
		frame.planes = 1u << PSR_PLANE_DEPTH | (with_color ? 1u << PSR_PLANE_COLOR : 0);
		frame.color_codec = with_color ? PSR_CODEC_ZSTD : 0;
		frame.depth_format = PSR_WIRE_DEPTH_F32;
		frame.depth_codec = PSR_CODEC_ZSTD;
		peer_expect_frame(&p, peer_ask_frame(&p, &frame), &end);
		for (int i = 0; i < (int)end.n_entries; i++)
			if (end.entry[i].id == PSR_WIRE_REPORT_RESOLVE || end.entry[i].id == PSR_WIRE_REPORT_SHADE ||
			    end.entry[i].id == PSR_WIRE_REPORT_SHADOW)
				assert_int_equal(end.entry[i].count > 0, with_color);
			else if (end.entry[i].id == PSR_WIRE_REPORT_PIXELS_COVERED)
				assert_true(end.entry[i].count > 0);
	}
	peer_close(&p);
	free(scene);
}

static void a_light_that_casts_shadows_gets_a_map(void **state)
{
	struct psr_msg_scene *scene = malloc(sizeof *scene);
	struct psr_msg_frame frame = frame_default(64, 48);
	struct psr_msg_frame_end end;

	(void)state;
	assert_non_null(scene);
	peer_begin(&p, &psrd, "plate");
	scene_default(scene, 1);
	scene->n_lights = 1;
	scene->light[0] = (struct psr_msg_light){ .kind = PSR_WIRE_LIGHT_DIRECTIONAL,
		                                      .intensity = 1,
		                                      .direction = { 0, 0, -1 },
		                                      .color = { 255, 255, 255 } };
	for (unsigned casts = 0; casts < 2; casts++) {
		scene->light[0].flags = casts ? PSR_WIRE_LIGHT_SHADOW : 0;
		peer_send_scene(&p, scene);
		peer_expect_frame(&p, peer_ask_frame(&p, &frame), &end);
		assert_int_equal(end.entry[10].id, PSR_WIRE_REPORT_SHADOW);
		assert_int_equal(end.entry[10].count > 0, casts);
		assert_int_equal(end.entry[21].id, PSR_WIRE_REPORT_SHADOW_MAPS);
		assert_int_equal(end.entry[21].count, casts);
	}
	peer_close(&p);
	free(scene);
}

static void settings_are_kept_and_returned(void **state)
{
	struct psr_msg_frame frame = frame_default(64, 48);
	struct psr_msg_frame_begin begin;
	struct psr_message message;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	frame.budget = PSR_WIRE_BUDGET_SETTINGS;
	frame.settings = (struct psr_msg_settings){ .scale = 1, .smooth = 1, .spacing_px = 2.5 };
	peer_expect(&p, &message, PSR_MSG_FRAME_BEGIN, peer_ask_frame(&p, &frame));
	assert_int_equal(psr_msg_frame_begin_decode(&begin, message.payload, message.n, NULL), PSR_OK);
	assert_true(begin.settings.scale == 1 && begin.settings.smooth && begin.settings.spacing_px == 2.5);
	do
		assert_true(peer_next(&p, &message));
	while (message.type != PSR_MSG_FRAME_END);
	frame.settings.scale = 2;
	peer_expect(&p, &message, PSR_MSG_FRAME_BEGIN, peer_ask_frame(&p, &frame));
	assert_int_equal(psr_msg_frame_begin_decode(&begin, message.payload, message.n, NULL), PSR_OK);
	assert_int_equal(begin.settings.scale, 2);
	peer_close(&p);
}

static void fine_pictures_have_colors_and_depths_and_no_passes(void **state)
{
	struct psr_msg_frame frame = frame_default(64, 48);
	struct psr_msg_frame_begin begin;
	struct psr_message message;
	char text[PSR_ERROR_TEXT];

	(void)state;
	peer_begin(&p, &psrd, "plate");
	frame.budget = PSR_WIRE_BUDGET_SETTINGS;
	frame.settings = (struct psr_msg_settings){ .scale = 1, .smooth = 2, .spacing_px = 1 };
	peer_expect(&p, &message, PSR_MSG_FRAME_BEGIN, peer_ask_frame(&p, &frame));
	assert_int_equal(psr_msg_frame_begin_decode(&begin, message.payload, message.n, NULL), PSR_OK);
	assert_int_equal(begin.settings.smooth, 2);
	do
		assert_true(peer_next(&p, &message));
	while (message.type != PSR_MSG_FRAME_END);
	frame.planes |= 1 << PSR_PLANE_NORMAL;
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_UNSUPPORTED, text);
	assert_non_null(strstr(text, "other planes take"));
	frame.planes = 1 << PSR_PLANE_COLOR;
	frame.pass_limit = 1;
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_UNSUPPORTED, text);
	assert_non_null(strstr(text, "a fine picture"));
	peer_close(&p);
}

static void splats_change_no_scene_without_an_octree(void **state)
{
	struct psr_msg_frame frame = frame_default(64, 48);
	struct psr_msg_frame_begin begin;
	struct psr_msg_frame_end plain, end;
	struct psr_message message;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	frame.budget = PSR_WIRE_BUDGET_SETTINGS;
	frame.settings = (struct psr_msg_settings){ .scale = 1, .spacing_px = 1 };
	peer_expect_frame(&p, peer_ask_frame(&p, &frame), &plain);
	frame.settings.splats = 1;
	peer_expect(&p, &message, PSR_MSG_FRAME_BEGIN, peer_ask_frame(&p, &frame));
	assert_int_equal(psr_msg_frame_begin_decode(&begin, message.payload, message.n, NULL), PSR_OK);
	assert_int_equal(begin.settings.splats, 1);
	do
		assert_true(peer_next(&p, &message));
	while (message.type != PSR_MSG_FRAME_END);
	assert_int_equal(psr_msg_frame_end_decode(&end, message.payload, message.n, NULL), PSR_OK);
	assert_true(end.hash[0] == plain.hash[0]);
	for (int i = 0; i < end.n_entries; i++)
		if (end.entry[i].id == PSR_WIRE_REPORT_EFFECTS + PSR_EFFECT_SPLATS)
			assert_int_equal(end.entry[i].ns, PSR_WHY_NOTHING);
	peer_close(&p);
}

static void many_frames_at_once_are_all_answered_alike(void **state)
{
	struct psr_msg_frame frame = frame_default(96, 96);
	struct psr_message message;
	struct psr_msg_frame_end end;
	uint64_t hash = 0;
	int n = 0;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	for (int i = 0; i < 64; i++)
		peer_ask_frame(&p, &frame);
	while (n < 64) {
		assert_true(peer_next(&p, &message));
		if (message.type != PSR_MSG_FRAME_END)
			continue;
		assert_int_equal(psr_msg_frame_end_decode(&end, message.payload, message.n, NULL), PSR_OK);
		assert_true(n++ == 0 || end.hash[0] == hash);
		hash = end.hash[0];
	}
	peer_close(&p);
}

static void cancelled_frames_end_once(void **state)
{
	struct psr_msg_frame frame = frame_default(512, 512);
	struct psr_message message;
	uint32_t first;
	int n_ended = 0;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	first = p.id + 1;
	for (int i = 0; i < 20; i++)
		assert_int_equal(psr_msg_frame_encode(&p.buf, ++p.id, 0, &frame, NULL), PSR_OK);
	for (uint32_t id = first; id < first + 20; id++)
		assert_int_equal(psr_msg_cancel_encode(&p.buf, id, 0, NULL), PSR_OK);
	peer_send(&p);
	while (n_ended < 20) {
		assert_true(peer_next(&p, &message));
		n_ended += message.type == PSR_MSG_CANCELLED || message.type == PSR_MSG_FRAME_END;
	}
	frame = frame_default(32, 32);
	peer_expect_frame(&p, peer_ask_frame(&p, &frame), &(struct psr_msg_frame_end){ 0 });
	peer_close(&p);
}

static void a_cancel_keeps_the_view_of_its_id(void **state)
{
	struct psr_msg_frame frame = frame_default(512, 512);

	(void)state;
	peer_begin(&p, &psrd, "plate");
	assert_int_equal(psr_msg_frame_encode(&p.buf, ++p.id, 0, &frame, NULL), PSR_OK);
	assert_int_equal(psr_msg_cancel_encode(&p.buf, p.id + 1, 7, NULL), PSR_OK); /* of no open id: nothing */
	assert_int_equal(psr_msg_cancel_encode(&p.buf, p.id, 7, NULL), PSR_OK);
	peer_send(&p);
	peer_expect_error(&p, 0, PSR_WIRE_PROTOCOL, NULL);
	peer_expect_end(&p);
	peer_close(&p);
}

static void hashes_are_left_out_on_request(void **state)
{
	struct psr_msg_frame frame = frame_default(64, 48);
	struct psr_msg_frame_end end;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	peer_expect_frame(&p, peer_ask_frame(&p, &frame), &end);
	assert_true(end.has_hashes && end.hash[0] != 0);
	frame.flags = PSR_WIRE_FRAME_NO_HASHES;
	peer_expect_frame(&p, peer_ask_frame(&p, &frame), &end);
	assert_true(!end.has_hashes && end.hash[0] == 0);
	peer_close(&p);
}

static void passes_rise_to_the_final_one(void **state)
{
	struct psr_msg_frame frame = frame_default(200, 120);
	struct psr_msg_frame_end end;
	uint64_t hash[3];
	uint32_t id;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	peer_expect_frame(&p, peer_ask_frame(&p, &frame), &end);
	hash[0] = end.hash[PSR_PLANE_COLOR];
	frame.pass_limit = 2;
	id = peer_ask_frame(&p, &frame);
	for (unsigned pass = 0; pass <= 2; pass++) {
		assert_true(peer_expect_frame(&p, id, &end) > 0);
		assert_int_equal(end.pass, pass);
		assert_int_equal(end.is_final, pass == 2);
		if (pass == 0)
			assert_true(end.hash[PSR_PLANE_COLOR] == hash[0]);
		else
			assert_true(end.hash[PSR_PLANE_COLOR] != hash[pass - 1]);
		hash[pass] = end.hash[PSR_PLANE_COLOR];
	}
	frame = frame_default(32, 32); /* the id has ended: nothing else of it comes */
	peer_expect_frame(&p, peer_ask_frame(&p, &frame), &end);
	peer_close(&p);
}

static void passes_beyond_the_last_are_refused(void **state)
{
	struct psr_msg_frame frame = frame_default(32, 32);
	struct psr_msg_frame_end end;
	char text[PSR_ERROR_TEXT], most[32];

	(void)state;
	peer_begin(&p, &psrd, "plate");
	frame.pass_limit = PSR_MAX_PASS + 1;
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_LIMIT, text);
	snprintf(most, sizeof most, "in %d passes at most", PSR_MAX_PASS);
	assert_non_null(strstr(text, most));
	frame.pass_limit = UINT16_MAX;
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_LIMIT, NULL);
	frame.pass_limit = 0; /* the connection goes on */
	peer_expect_frame(&p, peer_ask_frame(&p, &frame), &end);
	peer_close(&p);
}

/* Whatever pass it is in: 1,000 x 1,000 pixels in 16 x 16 sub-pixels take far longer than the first. */
static void refinement_is_cancelled_at_once(void **state)
{
	struct psr_msg_frame frame = frame_default(1000, 1000);
	struct psr_msg_frame_end end;
	struct psr_message message;
	uint32_t id;
	int n_final = 0;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	frame.pass_limit = 4;
	id = peer_ask_frame(&p, &frame);
	peer_expect_frame(&p, id, &end);
	assert_int_equal(end.is_final, 0);
	assert_int_equal(psr_msg_cancel_encode(&p.buf, id, 0, NULL), PSR_OK);
	peer_send(&p);
	do {
		assert_true(peer_next(&p, &message));
		assert_int_equal(message.id, id);
		if (message.type == PSR_MSG_FRAME_END) {
			assert_int_equal(psr_msg_frame_end_decode(&end, message.payload, message.n, NULL), PSR_OK);
			n_final += end.is_final;
		}
	} while (message.type != PSR_MSG_CANCELLED);
	assert_int_equal(n_final, 0);
	frame = frame_default(32, 32);
	peer_expect_frame(&p, peer_ask_frame(&p, &frame), &end);
	assert_int_equal(end.is_final, 1);
	peer_close(&p);
}

static void ping_is_answered(void **state)
{
	struct psr_msg_ping ping = { .token = UINT64_C(0xfedcba9876543210) };
	struct psr_message message;

	(void)state;
	peer_hello(&p, &psrd, NULL);
	psr_msg_ping_encode(&p.buf, &ping, NULL);
	peer_send(&p);
	peer_expect(&p, &message, PSR_MSG_PONG, 0);
	assert_int_equal(psr_msg_ping_decode(&ping, message.payload, message.n, NULL), PSR_OK);
	assert_true(ping.token == UINT64_C(0xfedcba9876543210));
	peer_close(&p);
}

static void stats_count_what_happened(void **state)
{
	struct psr_message message;
	struct psr_msg_stats_reply reply;

	(void)state;
	expect_serves(&psrd, "plate");
	peer_hello(&p, &psrd, NULL);
	psr_msg_stats_encode(&p.buf, ++p.id, NULL);
	peer_send(&p);
	peer_expect(&p, &message, PSR_MSG_STATS_REPLY, p.id);
	assert_int_equal(psr_msg_stats_reply_decode(&reply, message.payload, message.n, NULL), PSR_OK);
	assert_int_equal(reply.n_stats, 35);
	assert_int_equal(reply.stat[3].id, PSR_STAT_MODELS);
	assert_int_equal(reply.stat[3].value, 1);
	assert_true(reply.stat[5].value >= 1);
	peer_close(&p);
}

/* ---- bad input ---- */

static void wrong_magic_is_closed_unanswered(void **state)
{
	static const char http[] = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
	uint8_t byte;

	(void)state;
	peer_connect(&p, &psrd);
	peer_write(&p, http, sizeof http - 1);
	assert_true(recv(p.fd, &byte, 1, 0) <= 0);
	peer_close(&p);
	expect_serves(&psrd, "plate");
}

static void another_version_is_refused_by_a_sentence(void **state)
{
	struct psr_msg_hello hello = { .major = 9, .minor = 1, .client = "test" };

	(void)state;
	peer_connect(&p, &psrd);
	assert_int_equal(psr_msg_hello_encode(&p.buf, &hello, NULL), PSR_OK);
	peer_send(&p);
	peer_expect_error(&p, 0, PSR_WIRE_VERSION, NULL);
	peer_expect_end(&p);
	peer_close(&p);
}

static void oversize_before_hello_is_refused(void **state)
{
	uint8_t header[24] = { 0x01, 0x04, 0, 0, PSR_MSG_HELLO };

	(void)state;
	memcpy(header + 16, PSR_HELLO_MAGIC, 8);
	peer_connect(&p, &psrd);
	peer_write(&p, header, sizeof header);
	peer_expect_error(&p, 0, PSR_WIRE_PROTOCOL, NULL);
	peer_expect_end(&p);
	peer_close(&p);
	expect_serves(&psrd, "plate");
}

static void lying_lengths_cost_the_connection(void **state)
{
	static const uint32_t lengths[] = { 0, 15, 65537, 0xffffffff };

	(void)state;
	for (size_t i = 0; i < sizeof lengths / sizeof lengths[0]; i++) {
		uint8_t header[16] = { (uint8_t)lengths[i], (uint8_t)(lengths[i] >> 8), (uint8_t)(lengths[i] >> 16),
			                   (uint8_t)(lengths[i] >> 24), PSR_MSG_LIST, 0, 0, 0, 1 };

		peer_hello(&p, &psrd, NULL);
		peer_write(&p, header, sizeof header);
		peer_expect_error(&p, 0, PSR_WIRE_PROTOCOL, NULL);
		peer_expect_end(&p);
		peer_close(&p);
	}
	expect_serves(&psrd, "plate");
}

static void ids_that_do_not_rise_cost_the_connection(void **state)
{
	(void)state;
	peer_begin(&p, &psrd, "plate");
	psr_msg_list_encode(&p.buf, p.id, NULL);
	peer_send(&p);
	peer_expect_error(&p, 0, PSR_WIRE_PROTOCOL, NULL);
	peer_expect_end(&p);
	peer_close(&p);
}

/* Encodes a good frame and then writes over bytes of its payload, as the encoder would refuse to. */
static uint32_t ask_bad_frame(size_t offset, const void *bytes, size_t n)
{
	struct psr_msg_frame frame = frame_default(64, 64);

	assert_int_equal(psr_msg_frame_encode(&p.buf, ++p.id, 0, &frame, NULL), PSR_OK);
	memcpy(p.buf.data + PSR_HEADER_SIZE + offset, bytes, n);
	peer_send(&p);
	return p.id;
}

static void bad_frames_are_refused_and_the_connection_goes_on(void **state)
{
	const double nan_value = NAN;
	const uint32_t none[2] = { 0, 0 }, huge[2] = { 100000, 100000 };
	struct psr_msg_frame frame = frame_default(64, 64);
	struct psr_msg_frame_end end;
	uint32_t id;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	id = ask_bad_frame(64 + 8, &nan_value, 8);
	peer_expect_error(&p, id, PSR_WIRE_ARG, NULL);
	id = ask_bad_frame(4, none, 8);
	peer_expect_error(&p, id, PSR_WIRE_ARG, NULL);
	id = ask_bad_frame(4, huge, 8);
	peer_expect_error(&p, id, PSR_WIRE_LIMIT, NULL);
	frame.slot = 7;
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_NOT_FOUND, NULL);
	frame = frame_default(16000, 4000); /* allowed by the protocol, not by --max-pixels */
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_LIMIT, NULL);
	frame = frame_default(64, 64);
	assert_true(peer_expect_frame(&p, peer_ask_frame(&p, &frame), &end) > 0);
	peer_close(&p);
}

static void what_is_not_offered_is_refused_by_name(void **state)
{
	struct psr_msg_scene *scene = malloc(sizeof *scene);
	struct psr_msg_frame frame = frame_default(64, 64);
	char text[PSR_ERROR_TEXT];

	(void)state;
	assert_non_null(scene);
	peer_begin(&p, &psrd, "plate");
	frame.color_codec = PSR_CODEC_PNG;
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_UNSUPPORTED, text);
	assert_non_null(strstr(text, "PNG"));
	frame = frame_default(64, 64);
	frame.budget = PSR_WIRE_BUDGET_TIME;
	frame.time_budget_us = 1000;
	frame.pass_limit = 1;
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_UNSUPPORTED, text);
	assert_non_null(strstr(text, "pass_limit 0"));
	frame = frame_default(64, 64);
	frame.flags = PSR_WIRE_FRAME_SHARP;
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_ARG, text);
	assert_non_null(strstr(text, "view above 0"));
	frame.flags = 0;
	assert_int_equal(psr_msg_frame_encode(&p.buf, ++p.id, 16, &frame, NULL), PSR_OK);
	assert_int_equal(psr_msg_pause_encode(&p.buf, ++p.id, 16, NULL), PSR_OK);
	peer_send(&p);
	peer_expect_error(&p, p.id - 1, PSR_WIRE_LIMIT, text);
	assert_non_null(strstr(text, "views 0 to 15"));
	peer_expect_error(&p, p.id, PSR_WIRE_LIMIT, text);
	assert_non_null(strstr(text, "views 0 to 15"));
	scene_default(scene, 1);
	scene->instance[0].representation = PSR_WIRE_REP_OCTREE;
	peer_send_scene(&p, scene);
	peer_expect_error(&p, p.id, PSR_WIRE_UNSUPPORTED, text);
	assert_non_null(strstr(text, "asks for representation 2 (an octree), and its model has blocks alone"));
	scene->instance[0].representation = PSR_WIRE_REP_DPOINT;
	peer_send_scene(&p, scene);
	peer_expect_error(&p, p.id, PSR_WIRE_UNSUPPORTED, text);
	assert_non_null(strstr(text, "asks for representation 3 (differential points), and its model has blocks alone"));
	/* The scene that failed has left its slot empty. */
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_NOT_FOUND, NULL);
	peer_close(&p);
	free(scene);
}

static void unknown_names_and_handles_are_not_found(void **state)
{
	struct psr_msg_close close_handle = { .handle = 77 };
	struct psr_msg_scene *scene = malloc(sizeof *scene);

	(void)state;
	assert_non_null(scene);
	peer_hello(&p, &psrd, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "no-such-model"), PSR_WIRE_NOT_FOUND, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "../plate"), PSR_WIRE_NOT_FOUND, NULL);
	psr_msg_close_encode(&p.buf, ++p.id, &close_handle, NULL);
	peer_send(&p);
	peer_expect_error(&p, p.id, PSR_WIRE_NOT_FOUND, NULL);
	scene_default(scene, 5);
	peer_send_scene(&p, scene);
	peer_expect_error(&p, p.id, PSR_WIRE_NOT_FOUND, NULL);
	peer_close(&p);
	free(scene);
}

static uint32_t ask_presets(uint32_t handle)
{
	assert_int_equal(psr_msg_presets_encode(&p.buf, ++p.id, &(struct psr_msg_presets){ handle }, NULL), PSR_OK);
	peer_send(&p);
	return p.id;
}

static void cameras_and_lights_of_a_model_are_told(void **state)
{
	struct psr_msg_opened opened;
	struct psr_msg_preset got[4];
	struct psr_msg_presets_end end;
	struct psr_message message;
	uint32_t id;

	(void)state;
	peer_hello(&p, &psrd, NULL);
	peer_expect_opened(&p, peer_ask_open(&p, "plate"), &opened);
	assert_memory_equal(opened.up, ((const double[]){ 0, 0, 1 }), sizeof opened.up);
	id = ask_presets(opened.handle);
	for (int i = 0; i < 4; i++) {
		peer_expect(&p, &message, PSR_MSG_PRESET, id);
		assert_int_equal(psr_msg_preset_decode(&got[i], message.payload, message.n, NULL), PSR_OK);
	}
	peer_expect(&p, &message, PSR_MSG_PRESETS_END, id);
	assert_int_equal(psr_msg_presets_end_decode(&end, message.payload, message.n, NULL), PSR_OK);
	assert_true(end.n_cameras == 2 && end.n_lights == 2);
	assert_int_equal(got[0].kind, PSR_WIRE_PRESET_CAMERA);
	assert_string_equal(got[0].name, "front");
	assert_int_equal(got[0].camera.kind, PSR_CAMERA_PERSPECTIVE);
	assert_true(got[0].camera.eye[2] == 3 && got[0].camera.up[1] == 1);
	assert_true(got[0].camera.fov_y == 0.5 && got[0].camera.near_z == 0.25);
	/* The view of the whole model, its own way up. */
	assert_string_equal(got[1].name, "home");
	assert_int_equal(got[1].kind, PSR_WIRE_PRESET_CAMERA);
	assert_memory_equal(got[1].camera.up, ((const double[]){ 0, 0, 1 }), sizeof got[1].camera.up);
	assert_true(got[1].camera.eye[1] < -1 && got[1].camera.eye[0] > 0 && got[1].camera.eye[2] > 0);
	/* Half of the intensity in linear light is code 188; the wire's intensity ends at a million. */
	assert_string_equal(got[2].name, "lamp");
	assert_int_equal(got[2].light.kind, PSR_WIRE_LIGHT_POINT);
	assert_memory_equal(got[2].light.color, ((const uint8_t[]){ 255, 188, 0 }), 3);
	assert_true(got[2].light.intensity == 1e6 && got[2].light.reference == 1 && got[2].light.position[2] == 3);
	assert_string_equal(got[3].name, "sun");
	assert_memory_equal(got[3].light.color, ((const uint8_t[]){ 255, 255, 255 }), 3);
	assert_true(got[3].light.intensity == 3 && got[3].light.direction[2] == -1);
	/* Another handle, and the connection goes on. */
	peer_expect_error(&p, ask_presets(opened.handle + 1), PSR_WIRE_NOT_FOUND, NULL);
	ask_presets(opened.handle);
	peer_expect(&p, &message, PSR_MSG_PRESET, p.id);
	peer_close(&p);
}

static void scenes_keep_models_that_were_closed(void **state)
{
	struct psr_msg_close close_handle = { .handle = 1 };
	struct psr_msg_frame frame = frame_default(64, 64);
	struct psr_msg_frame_end end;

	(void)state;
	peer_begin(&p, &psrd, "plate");
	psr_msg_close_encode(&p.buf, ++p.id, &close_handle, NULL);
	peer_send(&p);
	assert_true(peer_expect_frame(&p, peer_ask_frame(&p, &frame), &end) > 0);
	peer_close(&p);
}

static void half_a_message_and_the_end_is_forgotten(void **state)
{
	struct psr_msg_frame frame = frame_default(64, 64);

	(void)state;
	for (size_t n = 1; n < 176; n += 25) {
		peer_begin(&p, &psrd, "plate");
		psr_msg_frame_encode(&p.buf, ++p.id, 0, &frame, NULL);
		peer_write(&p, p.buf.data, n);
		peer_close(&p);
	}
	expect_serves(&psrd, "plate");
}

static void random_bytes_behind_hello_never_stop_the_daemon(void **state)
{
	uint64_t random = 0x9e3779b97f4a7c15u;
	uint8_t bytes[512];

	(void)state;
	for (int i = 0; i < 40; i++) {
		peer_hello(&p, &psrd, NULL);
		for (size_t k = 0; k < sizeof bytes; k++) {
			random ^= random << 13;
			random ^= random >> 7;
			random ^= random << 17;
			bytes[k] = (uint8_t)(random >> 24);
		}
		bytes[1] = bytes[2] = bytes[3] = 0; /* short messages of all types, so that payloads are reached */
		bytes[4] = (uint8_t)(i + 1);
		bytes[5] = bytes[6] = bytes[7] = 0;
		memset(bytes + 9, 0, 7);
		peer_write(&p, bytes, sizeof bytes);
		peer_close(&p);
	}
	expect_serves(&psrd, "plate");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(welcome_tells_the_limits),
		cmocka_unit_test(list_names_the_model_and_its_state),
		cmocka_unit_test(raw_planes_have_the_hashes_of_the_end),
		cmocka_unit_test(a_frame_without_color_is_not_lit),
		cmocka_unit_test(the_report_has_every_entry_in_order),
		cmocka_unit_test(a_light_that_casts_shadows_gets_a_map),
		cmocka_unit_test(settings_are_kept_and_returned),
		cmocka_unit_test(fine_pictures_have_colors_and_depths_and_no_passes),
		cmocka_unit_test(splats_change_no_scene_without_an_octree),
		cmocka_unit_test(many_frames_at_once_are_all_answered_alike),
		cmocka_unit_test(cancelled_frames_end_once),
		cmocka_unit_test(a_cancel_keeps_the_view_of_its_id),
		cmocka_unit_test(hashes_are_left_out_on_request),
		cmocka_unit_test(passes_rise_to_the_final_one),
		cmocka_unit_test(passes_beyond_the_last_are_refused),
		cmocka_unit_test(refinement_is_cancelled_at_once),
		cmocka_unit_test(ping_is_answered),
		cmocka_unit_test(stats_count_what_happened),
		cmocka_unit_test(wrong_magic_is_closed_unanswered),
		cmocka_unit_test(another_version_is_refused_by_a_sentence),
		cmocka_unit_test(oversize_before_hello_is_refused),
		cmocka_unit_test(lying_lengths_cost_the_connection),
		cmocka_unit_test(ids_that_do_not_rise_cost_the_connection),
		cmocka_unit_test(bad_frames_are_refused_and_the_connection_goes_on),
		cmocka_unit_test(what_is_not_offered_is_refused_by_name),
		cmocka_unit_test(unknown_names_and_handles_are_not_found),
		cmocka_unit_test(cameras_and_lights_of_a_model_are_told),
		cmocka_unit_test(scenes_keep_models_that_were_closed),
		cmocka_unit_test(half_a_message_and_the_end_is_forgotten),
		cmocka_unit_test(random_bytes_behind_hello_never_stop_the_daemon),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}

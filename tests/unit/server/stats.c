/* What STATS tells, by a client that knows what it did. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "plate.h"

#define MS UINT64_C(1000000)

static char bin[PATH_MAX];
static struct daemon psrd;
static struct peer p, q;

/* The source's text tells what becomes of it. */
static const char script[] =
	"#!/bin/sh\n"
	"case $(cat \"$2\") in\n"
	"good*) cp ${0%/*}/ready.psr \"$4\";;\n"
	"bad*) echo 'psr-model: not finite' >&2; exit 4;;\n"
	"slow*) exec sleep 60;;\n"
	"esac\n";

static int stop(void **state)
{
	daemon_stop(&psrd);
	return tear_down(state);
}

static void wait_for(struct peer *peer, unsigned id, uint64_t value)
{
	for (int64_t end = clock_ms() + PATIENCE_MS; peer_stat(peer, id) != value; usleep(5000))
		if (clock_ms() > end)
			fail_msg("STATS %u is %llu, not %llu", id, (unsigned long long)peer_stat(peer, id),
			         (unsigned long long)value);
}

static void time_threads_limits_and_models(void **state)
{
	static const char *const more[] = { "--threads", "2", "--max-memory", "100m", NULL };
	const int64_t before_ms = clock_ms();
	struct psr_msg_opened opened;
	int64_t end_ms;
	uint64_t uptime_us, start_us;

	(void)state;
	daemon_start(&psrd, folder, more);
	start_us = 1000 * (uint64_t)(clock_ms() - before_ms);
	peer_hello(&p, &psrd, NULL);
	usleep(20000);
	end_ms = clock_ms();
	uptime_us = peer_stat(&p, PSR_STAT_UPTIME_US);
	assert_in_range(uptime_us, 20000, 1000 * (uint64_t)(clock_ms() - end_ms) + start_us + 1000 * (uint64_t)(end_ms - before_ms));
	assert_int_equal(peer_stat(&p, PSR_STAT_THREADS), 2);
	assert_int_equal(peer_stat(&p, PSR_STAT_MEMORY_LIMIT), 100 << 20);
	assert_int_equal(peer_stat(&p, PSR_STAT_LOG_DROPPED), 0);
	assert_int_equal(peer_stat(&p, PSR_STAT_MODELS), 0);
	assert_int_equal(peer_stat(&p, PSR_STAT_MODEL_BYTES), 0);
	peer_expect_opened(&p, peer_ask_open(&p, "plate"), &opened);
	assert_int_equal(peer_stat(&p, PSR_STAT_MODELS), 1);
	assert_int_equal(peer_stat(&p, PSR_STAT_MODEL_BYTES), opened.bytes);
	assert_in_range(peer_stat(&p, PSR_STAT_MEMORY_BYTES), opened.bytes, 100 << 20);
	peer_close(&p);
}

/* Of a client, what psrd has received is what the client has sent when the reply comes. */
static void connections_and_bytes(void **state)
{
	static const char *const more[] = { "--max-clients", "2", NULL };
	struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .client = "test" };
	struct psr_message message;
	static struct peer silent, third;
	uint64_t received, sent;

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_hello(&p, &psrd, NULL);
	assert_int_equal(peer_stat(&p, PSR_STAT_CONNECTIONS), 1);
	received = peer_stat(&p, PSR_STAT_BYTES_RECEIVED);
	assert_int_equal(peer_stat(&p, PSR_STAT_BYTES_RECEIVED), received + PSR_HEADER_SIZE);
	sent = peer_stat(&p, PSR_STAT_BYTES_SENT);
	peer_expect(&p, &message, PSR_MSG_STATS_REPLY, peer_ask_stats(&p));
	assert_int_equal(peer_stat(&p, PSR_STAT_BYTES_SENT), sent + 2 * (PSR_HEADER_SIZE + message.n));
	peer_hello(&q, &psrd, NULL);
	peer_connect(&silent, &psrd);
	wait_for(&p, PSR_STAT_CONNECTIONS_NEW, 1);
	assert_int_equal(peer_stat(&p, PSR_STAT_CONNECTIONS), 3);
	peer_connect(&third, &psrd);
	assert_int_equal(psr_msg_hello_encode(&third.buf, &hello, NULL), PSR_OK);
	peer_send(&third);
	peer_expect_error(&third, 0, PSR_WIRE_BUSY, NULL);
	assert_int_equal(peer_stat(&p, PSR_STAT_CONNECTIONS_BUSY), 1);
	assert_int_equal(peer_stat(&p, PSR_STAT_DROPPED_PEERS), 1);
	assert_int_equal(peer_stat(&p, PSR_STAT_CONNECTIONS_TOTAL), 4);
	peer_close(&third);
	peer_close(&silent);
	peer_close(&q);
	wait_for(&p, PSR_STAT_CONNECTIONS, 1);
	peer_close(&p);
}

static uint32_t ask_in_view(struct peer *peer, const struct psr_msg_frame *frame)
{
	assert_int_equal(psr_msg_frame_encode(&peer->buf, ++peer->id, 1, frame, NULL), PSR_OK);
	peer_send(peer);
	return peer->id;
}

static void acknowledge(struct peer *peer, uint32_t id)
{
	const struct psr_msg_ack ack = { .pass = 0 };

	assert_int_equal(psr_msg_ack_encode(&peer->buf, id, 1, &ack, NULL), PSR_OK);
	peer_send(peer);
}

static void send_crowd(struct peer *peer)
{
	static struct psr_msg_scene scene;

	scene_default(&scene, 1);
	scene_make_heavy(&scene);
	peer_send_scene(peer, &scene);
}

/* The view is at PAUSE while requests wait: one is superseded, one cancelled. */
static void frames_and_how_they_end(void **state)
{
	static const char *const more[] = { "--threads", "1", "--frame-timeout", "0.5", NULL };
	struct psr_msg_frame frame = frame_default(64, 64), late = frame_default(2048, 2048);
	struct psr_msg_frame_end end;
	struct psr_message message;
	struct psr_msg_error error;
	uint64_t draw_us;
	uint32_t id;

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_begin(&p, &psrd, "plate");
	id = ask_in_view(&p, &frame);
	peer_expect_frame(&p, id, &end);
	acknowledge(&p, id);
	assert_int_equal(peer_stat(&p, PSR_STAT_FRAMES_ON_BASE), 0);
	frame.base = id;
	frame.camera.eye[2] = 2.1;
	id = ask_in_view(&p, &frame);
	peer_expect_frame(&p, id, &end);
	acknowledge(&p, id);
	assert_int_equal(peer_stat(&p, PSR_STAT_FRAMES_ON_BASE), 1);
	assert_int_equal(psr_msg_pause_encode(&p.buf, ++p.id, 1, NULL), PSR_OK);
	peer_send(&p);
	frame.base = 0;
	id = ask_in_view(&p, &frame);
	assert_int_equal(peer_stat(&p, PSR_STAT_FRAMES_WAITING), 1);
	ask_in_view(&p, &frame);
	peer_expect(&p, &message, PSR_MSG_SUPERSEDED, id);
	assert_int_equal(psr_msg_cancel_encode(&p.buf, id = p.id, 1, NULL), PSR_OK);
	peer_send(&p);
	peer_expect(&p, &message, PSR_MSG_CANCELLED, id);
	draw_us = peer_stat(&p, PSR_STAT_DRAW_US);
	assert_true(draw_us > 0);
	send_crowd(&p);
	late.budget = PSR_WIRE_BUDGET_SETTINGS;
	late.settings = (struct psr_msg_settings){ .scale = 1, .spacing_px = 1.0 / 64 };
	id = peer_ask_frame(&p, &late);
	do /* BEGIN and rectangles may have been sent by then */
		assert_true(peer_next(&p, &message) && message.id == id);
	while (message.type == PSR_MSG_FRAME_BEGIN || message.type == PSR_MSG_RECT);
	assert_int_equal(message.type, PSR_MSG_ERROR);
	assert_int_equal(psr_msg_error_decode(&error, message.payload, message.n, NULL), PSR_OK);
	assert_int_equal(error.code, PSR_WIRE_LIMIT);
	assert_true(peer_stat(&p, PSR_STAT_DRAW_US) >= draw_us + 500000);
	assert_int_equal(peer_stat(&p, PSR_STAT_FRAMES_TIMED_OUT), 1);
	frame.slot = 3;
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_NOT_FOUND, NULL);
	assert_int_equal(peer_stat(&p, PSR_STAT_FRAMES), 2);
	assert_int_equal(peer_stat(&p, PSR_STAT_FRAMES_FAILED), 2);
	assert_int_equal(peer_stat(&p, PSR_STAT_FRAMES_SUPERSEDED), 1);
	assert_int_equal(peer_stat(&p, PSR_STAT_FRAMES_CANCELLED), 1);
	assert_int_equal(peer_stat(&p, PSR_STAT_FRAMES_WAITING), 0);
	peer_close(&p);
}

/* From outside an answer takes no less than psrd says; and of one answer all percentiles are its time. */
static void times_of_answers(void **state)
{
	const struct psr_msg_frame frame = frame_default(400, 400);
	struct psr_msg_frame_end end;
	uint64_t start_us, outside_us, most_us;

	(void)state;
	daemon_start(&psrd, folder, NULL);
	peer_begin(&p, &psrd, "plate");
	assert_int_equal(peer_stat(&p, PSR_STAT_ANSWERED_MAX_US), 0);
	start_us = clock_ns() / 1000;
	peer_expect_frame(&p, peer_ask_frame(&p, &frame), &end);
	most_us = peer_stat(&p, PSR_STAT_ANSWERED_MAX_US);
	outside_us = clock_ns() / 1000 - start_us;
	assert_in_range(most_us, 1, outside_us);
	for (unsigned id = PSR_STAT_ANSWERED_P50_US; id <= PSR_STAT_ANSWERED_P99_US; id++)
		assert_in_range(peer_stat(&p, id), most_us - most_us / 256 - 1, most_us + most_us / 256 + 1);
	peer_close(&p);
}

/* Two readers that do not read, and one that says nothing. */
static void wait_for_dropped(uint64_t n)
{
	const int64_t end = clock_ms() + PATIENCE_MS;

	while (stat_of(&psrd, PSR_STAT_DROPPED_PEERS) < n) {
		assert_true(clock_ms() < end);
		usleep(20000);
	}
}

static void peers_that_are_too_slow(void **state)
{
	static const char *const more[] = { "--threads", "1", "--slow-timeout", "1", "--idle-timeout", "0", NULL };
	struct psr_msg_frame frame = frame_default(1000, 1000);
	static struct peer slow[2];

	(void)state;
	daemon_start(&psrd, folder, more);
	frame.color_codec = PSR_CODEC_RAW;
	frame.camera.fov_y = 0.1;
	for (int i = 0; i < 2; i++) {
		peer_begin(&slow[i], &psrd, "plate");
		for (int k = 0; k < 16; k++)
			peer_ask_frame(&slow[i], &frame);
	}
	wait_for_dropped(2);
	assert_int_equal(stat_of(&psrd, PSR_STAT_PEERS_SLOW), 2);
	assert_int_equal(stat_of(&psrd, PSR_STAT_PEERS_SILENT), 0);
	for (int i = 0; i < 2; i++)
		peer_close(&slow[i]);
}

static void peers_that_are_silent(void **state)
{
	static const char *const more[] = { "--idle-timeout", "2", NULL };

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_hello(&q, &psrd, NULL);
	wait_for_dropped(1);
	assert_int_equal(stat_of(&psrd, PSR_STAT_PEERS_SLOW), 0);
	assert_int_equal(stat_of(&psrd, PSR_STAT_PEERS_SILENT), 1);
	peer_close(&q);
}

static void builds(void **state)
{
	char program[PATH_MAX + 16], cache[PATH_MAX + 16];
	const char *argv[] = { program, "--listen", "127.0.0.1:0", "--models", folder, "--cache", cache, "--max-builds", "1",
		                   NULL };
	struct psr_msg_opened opened;
	uint32_t id[2];

	(void)state;
	builder_make(bin, script);
	file_write(folder, "good.stl", "good", 4);
	file_write(folder, "bad.stl", "bad", 3);
	file_write(folder, "slow.stl", "slow", 4);
	file_write(folder, "next.stl", "slow", 4);
	snprintf(program, sizeof program, "%s/psrd", bin);
	snprintf(cache, sizeof cache, "%s/cache", bin);
	daemon_spawn(&psrd, argv);
	daemon_wait_ready(&psrd);
	peer_hello(&p, &psrd, NULL);
	peer_hello(&q, &psrd, NULL);
	peer_expect_opened(&p, peer_ask_open(&p, "good"), &opened);
	peer_expect_open_error(&p, peer_ask_open(&p, "bad"), PSR_WIRE_FORMAT, NULL);
	assert_int_equal(peer_stat(&p, PSR_STAT_BUILDS_DONE), 1);
	assert_int_equal(peer_stat(&p, PSR_STAT_BUILDS_FAILED), 1);
	id[0] = peer_ask_open(&q, "slow");
	id[1] = peer_ask_open(&q, "next");
	wait_for(&p, PSR_STAT_BUILDS_WAITING, 1);
	assert_int_equal(peer_stat(&p, PSR_STAT_BUILDS), 1);
	for (int i = 0; i < 2; i++)
		assert_int_equal(psr_msg_cancel_encode(&q.buf, id[i], 0, NULL), PSR_OK);
	peer_send(&q);
	wait_for(&p, PSR_STAT_BUILDS_FAILED, 3);
	assert_int_equal(peer_stat(&p, PSR_STAT_BUILDS), 0);
	assert_int_equal(peer_stat(&p, PSR_STAT_BUILDS_WAITING), 0);
	assert_int_equal(peer_stat(&p, PSR_STAT_BUILDS_DONE), 1);
	peer_close(&p);
	peer_close(&q);
	folder_remove(bin);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(time_threads_limits_and_models, set_up, stop),
		cmocka_unit_test_setup_teardown(connections_and_bytes, set_up, stop),
		cmocka_unit_test_setup_teardown(frames_and_how_they_end, set_up, stop),
		cmocka_unit_test_setup_teardown(times_of_answers, set_up, stop),
		cmocka_unit_test_setup_teardown(peers_that_are_too_slow, set_up, stop),
		cmocka_unit_test_setup_teardown(peers_that_are_silent, set_up, stop),
		cmocka_unit_test_setup_teardown(builds, set_up, stop),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

/* What waits, and in which order it goes out; work in parts; a log that nobody reads. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <sys/ioctl.h>
#include "plate.h"

static struct daemon psrd;
static struct peer p, q;
static const char *const patient[] = { "--frame-timeout", "3600", NULL }; /* on a slow machine a sanitizer takes long */

/* ---- control messages and answers that wait ---- */

/* Two raw frames of 12 MB: much more than the sockets hold. */
static void ask_large_frames(struct peer *peer)
{
	struct psr_msg_frame frame = frame_default(2000, 2000);

	frame.color_codec = PSR_CODEC_RAW;
	frame.camera.fov_y = 0.1;
	peer_ask_frame(peer, &frame);
	peer_ask_frame(peer, &frame);
}

static void wait_for_frames(uint64_t n)
{
	int64_t end = clock_ms() + 4 * PATIENCE_MS;

	while (stat_of(&psrd, PSR_STAT_FRAMES) < n) {
		assert_true(clock_ms() < end);
		usleep(2000);
	}
}

static void control_messages_pass_rectangles_that_wait(void **state)
{
	static const struct psr_msg_ping ping = { .token = 77 };
	int at_stats = 0, at_pong = 0, n = 0, n_ends = 0;
	uint32_t stats;
	struct psr_message message;

	(void)state;
	daemon_start(&psrd, folder, patient);
	peer_begin(&p, &psrd, "plate");
	ask_large_frames(&p);
	wait_for_frames(2);
	psr_msg_ping_encode(&p.buf, &ping, NULL);
	stats = peer_ask_stats(&p);
	stat_of(&psrd, PSR_STAT_FRAMES); /* the server, which answers in turn, has answered before anything is read */
	while (n_ends < 2) {
		assert_true(peer_next(&p, &message));
		n++;
		n_ends += message.type == PSR_MSG_FRAME_END;
		if (message.type == PSR_MSG_PONG)
			at_pong = n;
		if (message.type == PSR_MSG_STATS_REPLY && message.id == stats)
			at_stats = n;
	}
	assert_true(at_pong > 0 && at_stats == at_pong + 1);
	assert_true(n - at_stats > 150); /* of some 370: the rest was with the kernel already */
	peer_close(&p);
	daemon_stop(&psrd);
}

/* ERROR of a request that broke the protocol comes in the place of 24 MB that nobody may read any more. */
static void what_a_broken_peer_has_not_read_is_dropped(void **state)
{
	static const uint8_t nonsense[16] = { 16, 0, 0, 0, 0xff, 0x7f };
	struct psr_message message;
	struct psr_msg_error error;
	int n_ends = 0;

	(void)state;
	daemon_start(&psrd, folder, patient);
	peer_begin(&p, &psrd, "plate");
	ask_large_frames(&p);
	wait_for_frames(2);
	peer_write(&p, nonsense, sizeof nonsense);
	do {
		assert_true(peer_next(&p, &message));
		n_ends += message.type == PSR_MSG_FRAME_END;
	} while (message.type != PSR_MSG_ERROR);
	assert_int_equal(psr_msg_error_decode(&error, message.payload, message.n, NULL), PSR_OK);
	assert_int_equal(error.code, PSR_WIRE_PROTOCOL);
	assert_in_range(n_ends, 0, 1);
	peer_expect_end(&p);
	peer_close(&p);
	daemon_stop(&psrd);
}

/* 600 KB a second of some 24 MB: more than 64 KiB in the timeout of a second, and less than a sixteenth. */
static void a_reader_that_trickles_is_dropped_for_what_it_holds(void **state)
{
	const char *const more[] = { "--slow-timeout", "1", "--frame-timeout", "3600", NULL };
	const int small = 32768; /* a large buffer would take nothing for seconds */
	static uint8_t bytes[60000];
	int64_t end = clock_ms() + PATIENCE_MS;
	ssize_t n = 1;

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_begin(&p, &psrd, "plate");
	setsockopt(p.fd, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
	ask_large_frames(&p); /* and reads at once: on a slow machine a second passes before both are drawn */
	while (stat_of(&psrd, PSR_STAT_DROPPED_PEERS) == 0) {
		assert_true(clock_ms() < end);
		if (n > 0)
			n = recv(p.fd, bytes, sizeof bytes, 0); /* 0 or less once psrd has closed */
		usleep(100000);
	}
	peer_close(&p);
	expect_serves(&psrd, "plate");
	daemon_stop(&psrd);
}

/* Frames behind one another in one queue, of which CANCEL takes one out: an id that it ends has no byte behind that. */
static void nothing_follows_the_last_message_of_an_id(void **state)
{
	struct psr_msg_frame frame = frame_default(600, 600);
	struct psr_message message;
	int is_ended[64] = { 0 }, n_ended = 0, n_cancelled = 0;
	uint32_t first;

	(void)state;
	daemon_start(&psrd, folder, patient);
	peer_begin(&p, &psrd, "plate");
	frame.color_codec = PSR_CODEC_RAW;
	frame.camera.fov_y = 0.1;
	frame.pass_limit = 2;
	first = p.id + 1;
	for (int i = 0; i < 12; i++)
		peer_ask_frame(&p, &frame);
	wait_for_frames(6); /* passes of several ids wait in the queue */
	for (uint32_t id = first; id < first + 12; id += 2)
		psr_msg_cancel_encode(&p.buf, id, 0, NULL);
	peer_send(&p);
	while (n_ended < 12) {
		struct psr_msg_frame_end end = { 0 };
		uint32_t i;

		assert_true(peer_next(&p, &message));
		i = message.id - first;
		assert_in_range(i, 0, 11);
		assert_false(is_ended[i]);
		if (message.type == PSR_MSG_FRAME_END)
			assert_int_equal(psr_msg_frame_end_decode(&end, message.payload, message.n, NULL), PSR_OK);
		is_ended[i] = message.type == PSR_MSG_CANCELLED || end.is_final;
		n_ended += is_ended[i];
		n_cancelled += message.type == PSR_MSG_CANCELLED;
	}
	assert_true(n_cancelled > 0);
	peer_draw(&p);
	peer_close(&p);
	daemon_stop(&psrd);
}

/* ---- work in parts ---- */

#define MANY 10000

static void write_many(void)
{
	char name[32];

	for (int i = 0; i < MANY; i++) {
		snprintf(name, sizeof name, "m%05d.psr", i);
		file_write(folder, name, "", 0);
	}
}

static void expect_list(struct peer *peer, uint32_t id)
{
	struct psr_message message;
	struct psr_msg_list_entry entry;
	struct psr_msg_list_end end;
	char last[PSR_WIRE_MAX_NAME + 1] = "";

	for (int i = 0; i < MANY + 1; i++) {
		peer_expect(peer, &message, PSR_MSG_LIST_ENTRY, id);
		assert_int_equal(psr_msg_list_entry_decode(&entry, message.payload, message.n, NULL), PSR_OK);
		assert_true(strcmp(last, entry.name) < 0);
		memcpy(last, entry.name, sizeof last);
	}
	peer_expect(peer, &message, PSR_MSG_LIST_END, id);
	assert_int_equal(psr_msg_list_end_decode(&end, message.payload, message.n, NULL), PSR_OK);
	assert_int_equal(end.n_entries, MANY + 1);
}

/* 64 LISTs of 10,001 models are 40 MB of answers: they wait for their reader in the catalogue, not in a queue. */
static void lists_are_answered_in_parts(void **state)
{
	struct psr_message message;
	long before;

	(void)state;
	write_many();
	daemon_start(&psrd, folder, NULL);
	peer_begin(&q, &psrd, "plate");
	peer_draw(&q);
	peer_hello(&p, &psrd, NULL);
	before = daemon_resident_kb(&psrd);
	for (int i = 0; i < 64; i++)
		psr_msg_list_encode(&p.buf, ++p.id, NULL);
	psr_msg_list_encode(&p.buf, ++p.id, NULL); /* one too many */
	peer_send(&p);
	for (int i = 0; i < 20; i++)
		peer_draw(&q);
	assert_in_range(daemon_resident_kb(&psrd) - before + 8192, 0, 2 * 8192);
	do /* behind what the kernel took, ahead of all other parts */
		assert_true(peer_next(&p, &message) && (message.type == PSR_MSG_LIST_ENTRY || message.type == PSR_MSG_ERROR));
	while (message.type != PSR_MSG_ERROR);
	assert_int_equal(message.id, 65);
	peer_close(&p);
	peer_hello(&p, &psrd, NULL);
	psr_msg_list_encode(&p.buf, ++p.id, NULL);
	psr_msg_list_encode(&p.buf, ++p.id, NULL);
	peer_send(&p);
	expect_list(&p, 1);
	expect_list(&p, 2);
	peer_close(&p);
	peer_close(&q);
	daemon_stop(&psrd);
}

static void lists_under_way_end_before_goodbye(void **state)
{
	struct psr_message message;
	int n_ended = 0;

	(void)state;
	write_many();
	daemon_start(&psrd, folder, NULL);
	peer_hello(&p, &psrd, NULL);
	for (int i = 0; i < 64; i++)
		psr_msg_list_encode(&p.buf, ++p.id, NULL);
	peer_send(&p);
	peer_expect(&p, &message, PSR_MSG_LIST_ENTRY, 1);
	kill(psrd.pid, SIGTERM);
	do {
		assert_true(peer_next(&p, &message));
		n_ended += message.type == PSR_MSG_LIST_END || message.type == PSR_MSG_ERROR;
	} while (message.type != PSR_MSG_GOODBYE);
	assert_int_equal(n_ended, 64);
	peer_close(&p);
	assert_int_equal(daemon_wait(&psrd), 0);
}

/* 20,000 messages at once, each of which is answered: another client's frame is drawn meanwhile. */
static void a_crowd_of_messages_waits_its_turn(void **state)
{
	enum { N = 20000 };
	static uint8_t bytes[N * 24];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };
	static const struct psr_msg_ping ping = { .token = 1 };
	struct psr_message message;
	pid_t writer;

	(void)state;
	daemon_start(&psrd, folder, NULL);
	peer_begin(&q, &psrd, "plate");
	peer_hello(&p, &psrd, NULL);
	for (int i = 0; i < N; i++)
		assert_int_equal(psr_msg_ping_encode(&buf, &ping, NULL), PSR_OK);
	writer = fork();
	assert_true(writer >= 0);
	if (writer == 0) {
		peer_write(&p, bytes, buf.size);
		_exit(0);
	}
	peer_draw(&q);
	for (int i = 0; i < N; i++)
		peer_expect(&p, &message, PSR_MSG_PONG, 0);
	waitpid(writer, NULL, 0);
	peer_draw(&q);
	peer_close(&p);
	peer_close(&q);
	daemon_stop(&psrd);
}

/* ---- the log ---- */

/* --verbose writes several lines a connection: 64 KiB of pipe are full after some 300. */
static void a_log_that_nobody_reads_stops_nobody_and_tells_how_many_were_lost(void **state)
{
	const char *const more[] = { "--verbose", NULL };
	static char log[1 << 18];
	size_t n_log = 0;
	ssize_t got;
	char *told;
	int n;

	(void)state;
	daemon_start(&psrd, folder, more);
	while (ioctl(psrd.errors, FIONREAD, &n) == 0 && n < 60000)
		expect_serves(&psrd, "plate");
	for (int i = 0; i < 100; i++)
		expect_serves(&psrd, "plate");
	while ((got = read(psrd.errors, log + n_log, sizeof log - 1 - n_log)) > 0)
		n_log += (size_t)got;
	expect_serves(&psrd, "plate");
	daemon_stop(&psrd);
	snprintf(log + n_log, sizeof log - n_log, "%s", psrd.log);
	told = strstr(log, " lines were lost");
	assert_non_null(told);
	assert_null(strstr(told + 1, " lines were lost"));
	while (told > log && told[-1] >= '0' && told[-1] <= '9')
		told--;
	assert_in_range(atoi(told), 100, 2000);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(control_messages_pass_rectangles_that_wait, set_up, tear_down),
		cmocka_unit_test_setup_teardown(what_a_broken_peer_has_not_read_is_dropped, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_reader_that_trickles_is_dropped_for_what_it_holds, set_up, tear_down),
		cmocka_unit_test_setup_teardown(nothing_follows_the_last_message_of_an_id, set_up, tear_down),
		cmocka_unit_test_setup_teardown(lists_are_answered_in_parts, set_up, tear_down),
		cmocka_unit_test_setup_teardown(lists_under_way_end_before_goodbye, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_crowd_of_messages_waits_its_turn, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_log_that_nobody_reads_stops_nobody_and_tells_how_many_were_lost, set_up,
		                                tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

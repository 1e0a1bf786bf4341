/* Connections that are no clients: whom a newcomer replaces, when silence ends a connection, and the daemon under
 * attack from outside. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "plate.h"
#include "server/net/doors.h"
#include "server/net/silence.h"

#define SECOND UINT64_C(1000000)

static struct daemon psrd;
static struct peer p, q;

/* ---- whom a newcomer replaces ---- */

static void the_longest_waiting_guest_makes_room(void **state)
{
	struct doors_guest guest[5] = { 0 };
	struct doors doors;

	(void)state;
	doors_init(&doors, 3, 3);
	for (int i = 0; i < 3; i++)
		assert_null(doors_enter(&doors, &guest[i], 7));
	assert_ptr_equal(doors_enter(&doors, &guest[3], 7), &guest[0]);
	doors_leave(&doors, &guest[0]);
	doors_leave(&doors, &guest[1]); /* it introduced itself */
	assert_null(doors_enter(&doors, &guest[4], 7));
	assert_ptr_equal(doors_oldest(&doors), &guest[2]);
	for (int i = 0; i < 5; i++)
		doors_leave(&doors, &guest[i]); /* for those that are gone: nothing */
	assert_true(doors.n == 0 && doors.first == NULL && doors_oldest(&doors) == NULL);
}

static void a_crowd_from_one_origin_replaces_its_own(void **state)
{
	enum { N = 64 };
	static struct doors_guest crowd[2 * N], honest[4];
	struct doors doors;

	(void)state;
	doors_init(&doors, N, N);
	for (int i = 0; i < 4; i++)
		assert_null(doors_enter(&doors, &honest[i], 100 + (uint64_t)i));
	for (int i = 0; i < 2 * N; i++) {
		struct doors_guest *leaves = doors_enter(&doors, &crowd[i], 7);

		assert_true((leaves == NULL) == (i < N - 4));
		if (leaves != NULL) {
			assert_ptr_equal(leaves, &crowd[i - (N - 4)]);
			doors_leave(&doors, leaves);
		}
		assert_true(doors.n <= N);
	}
	for (int i = 0; i < 4; i++)
		assert_non_null(honest[i].origin);
	for (int i = 0; i < 2 * N; i++)
		doors_leave(&doors, &crowd[i]);
	for (int i = 0; i < 4; i++)
		doors_leave(&doors, &honest[i]);
	assert_int_equal(doors.n, 0);
}

static void an_origin_has_its_limit_while_there_is_room_for_others(void **state)
{
	struct doors_guest guest[4] = { 0 };
	struct doors doors;

	(void)state;
	doors_init(&doors, 100, 2);
	assert_null(doors_enter(&doors, &guest[0], 7));
	assert_null(doors_enter(&doors, &guest[1], 7));
	assert_null(doors_enter(&doors, &guest[2], 8));
	assert_ptr_equal(doors_enter(&doors, &guest[3], 7), &guest[0]);
	for (int i = 0; i < 4; i++)
		doors_leave(&doors, &guest[i]);
}

static void who_has_been_refused_goes_first(void **state)
{
	struct doors_guest guest[4] = { 0 };
	struct doors doors;

	(void)state;
	doors_init(&doors, 3, 3);
	for (int i = 0; i < 3; i++)
		assert_null(doors_enter(&doors, &guest[i], 7));
	doors_hurry(&guest[2]);
	assert_ptr_equal(doors_enter(&doors, &guest[3], 7), &guest[2]);
	for (int i = 0; i < 4; i++)
		doors_leave(&doors, &guest[i]);
}

/* A flood of 10,000 connections a second: one that says HELLO within places / rate is never replaced before. */
static void a_guest_stays_as_long_as_places_last(void **state)
{
	enum { N = 1024, FLOOD = 10000 };
	static struct doors_guest flood[FLOOD], honest;
	struct doors doors;
	int at = 0;

	(void)state;
	doors_init(&doors, N, N);
	for (int i = 0; i < FLOOD; i++) {
		struct doors_guest *leaves;

		if (i == FLOOD / 2)
			doors_leave(&doors, doors_enter(&doors, &honest, 7));
		leaves = doors_enter(&doors, &flood[i], 7);
		if (leaves != NULL)
			doors_leave(&doors, leaves);
		if (leaves == &honest)
			at = i - FLOOD / 2;
	}
	assert_int_equal(at, N - 1);
	for (int i = 0; i < FLOOD; i++)
		doors_leave(&doors, &flood[i]);
}

static uint64_t origin_of_text(const char *text)
{
	struct sockaddr_storage address = { 0 };
	struct sockaddr_in *v4 = (struct sockaddr_in *)(void *)&address;
	struct sockaddr_in6 *v6 = (struct sockaddr_in6 *)(void *)&address;

	if (inet_pton(AF_INET, text, &v4->sin_addr) == 1) {
		address.ss_family = AF_INET;
	} else {
		assert_int_equal(inet_pton(AF_INET6, text, &v6->sin6_addr), 1);
		address.ss_family = AF_INET6;
	}
	return doors_origin_of(-1, &address);
}

static void this_machine_is_one_origin_and_so_is_a_network(void **state)
{
	(void)state;
	assert_int_equal(origin_of_text("127.0.0.1"), origin_of_text("127.200.3.4"));
	assert_int_equal(origin_of_text("127.0.0.1"), origin_of_text("::1"));
	assert_int_equal(origin_of_text("127.0.0.1"), origin_of_text("::ffff:127.0.0.2"));
	assert_int_equal(origin_of_text("192.0.2.1"), origin_of_text("::ffff:192.0.2.1"));
	assert_int_not_equal(origin_of_text("192.0.2.1"), origin_of_text("192.0.2.2"));
	assert_int_equal(origin_of_text("2001:db8:1:2::1"), origin_of_text("2001:db8:1:2:ffff::9"));
	assert_int_not_equal(origin_of_text("2001:db8:1:2::1"), origin_of_text("2001:db8:1:3::1"));
}

/* ---- silence ---- */

static void silence_is_asked_at_half_time_and_ends_at_full(void **state)
{
	struct silence silence;

	(void)state;
	silence_heard(&silence, 5 * SECOND);
	assert_int_equal(silence_look(&silence, 54 * SECOND, 100 * SECOND, 0), SILENCE_FINE);
	assert_int_equal(silence_look(&silence, 55 * SECOND, 100 * SECOND, 0), SILENCE_PING);
	assert_int_equal(silence_look(&silence, 56 * SECOND, 100 * SECOND, 0), SILENCE_FINE);
	assert_int_equal(silence_look(&silence, 104 * SECOND, 100 * SECOND, 0), SILENCE_FINE);
	assert_int_equal(silence_look(&silence, 105 * SECOND, 100 * SECOND, 0), SILENCE_IDLE);
}

static void a_sign_of_life_begins_the_time_anew(void **state)
{
	struct silence silence;

	(void)state;
	silence_heard(&silence, 0);
	for (uint64_t t = 0; t < 10000 * SECOND; t += SECOND) {
		enum silence_verdict verdict = silence_look(&silence, t, 100 * SECOND, 0);

		assert_true(verdict == SILENCE_FINE || verdict == SILENCE_PING);
		if (verdict == SILENCE_PING)
			silence_heard(&silence, t + SECOND / 2); /* PONG */
	}
}

static void who_waits_for_answers_has_longer_but_not_for_ever(void **state)
{
	struct silence silence;

	(void)state;
	silence_heard(&silence, 0);
	assert_int_equal(silence_look(&silence, 50 * SECOND, 100 * SECOND, 1), SILENCE_PING);
	assert_int_equal(silence_look(&silence, 149 * SECOND, 100 * SECOND, 1), SILENCE_FINE);
	assert_int_equal(silence_look(&silence, 150 * SECOND, 100 * SECOND, 1), SILENCE_DEAD);
}

static void who_was_asked_late_has_time_to_answer(void **state)
{
	struct silence silence;

	(void)state;
	silence_heard(&silence, 0);
	assert_int_equal(silence_look(&silence, 200 * SECOND, 100 * SECOND, 0), SILENCE_PING);
	assert_int_equal(silence_look(&silence, 249 * SECOND, 100 * SECOND, 0), SILENCE_FINE);
	assert_int_equal(silence_look(&silence, 250 * SECOND, 100 * SECOND, 0), SILENCE_IDLE);
}

static void without_a_limit_silence_is_never_asked(void **state)
{
	struct silence silence;

	(void)state;
	silence_heard(&silence, 0);
	assert_int_equal(silence_look(&silence, UINT64_MAX / 2, 0, 0), SILENCE_FINE);
	assert_int_equal(silence_look(&silence, UINT64_MAX / 2, 0, 1), SILENCE_FINE);
}

/* ---- the daemon ---- */

static int connect_silent(void)
{
	peer_connect(&q, &psrd);
	return q.fd;
}

static void draw(struct peer *peer)
{
	struct psr_msg_frame frame = frame_default(64, 64);
	struct psr_msg_frame_end end;

	assert_true(peer_expect_frame(peer, peer_ask_frame(peer, &frame), &end) > 0);
}

static void silent_connections_keep_nobody_out(void **state)
{
	enum { N = 300 };
	const char *const more[] = { "--max-clients", "4", "--max-pending", "80", NULL };
	int fd[N], n_closed = 0;
	char byte;

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_begin(&p, &psrd, "plate");
	for (int i = 0; i < N; i++) {
		fd[i] = connect_silent();
		if (i % 50 == 0)
			draw(&p);
	}
	for (int i = 0; i < 3; i++)
		expect_serves(&psrd, "plate");
	draw(&p);
	for (int i = 0; i < N; i++) {
		n_closed += recv(fd[i], &byte, 1, MSG_DONTWAIT) >= 0 || errno == ECONNRESET;
		close(fd[i]);
	}
	assert_in_range(n_closed, N - 80, N - 80 + 4); /* a HELLO that came after its connection took a place */
	peer_close(&p);
	daemon_stop(&psrd);
}

static void a_limit_for_an_address_is_kept(void **state)
{
	const char *const more[] = { "--max-pending-per-address", "2", NULL };
	int fd[5];
	char byte;

	(void)state;
	daemon_start(&psrd, folder, more);
	for (int i = 0; i < 5; i++)
		fd[i] = connect_silent();
	for (int i = 0; i < 3; i++)
		assert_true(recv(fd[i], &byte, 1, 0) <= 0);
	for (int i = 3; i < 5; i++)
		assert_true(recv(fd[i], &byte, 1, MSG_DONTWAIT) < 0 && errno == EAGAIN);
	expect_serves(&psrd, "plate");
	for (int i = 0; i < 5; i++)
		close(fd[i]);
	daemon_stop(&psrd);
}

/* Behind a Unix socket a process is an origin: what one does costs another's connections nothing. */
static void a_process_that_crowds_a_unix_socket_replaces_its_own(void **state)
{
	enum { N = 40 };
	char path[PATH_MAX], address[PATH_MAX];
	/* Only the crowd may cost a place: what is silent on a slow machine for longer than the default stays. */
	const char *const argv[] = { path, "--models", folder, "--listen", address, "--max-pending", "8",
		                         "--handshake-timeout", "600", "--frame-timeout", "3600", NULL };
	char byte;
	pid_t crowd;
	int fd;

	(void)state;
	daemon_path(path, "psrd");
	snprintf(address, sizeof address, "unix:%.200s/socket", folder);
	daemon_spawn(&psrd, argv);
	daemon_wait_ready(&psrd);
	fd = connect_silent();
	crowd = fork();
	assert_true(crowd >= 0);
	if (crowd == 0) {
		for (int i = 0; i < N; i++)
			connect_silent();
		while (recv(q.fd, &byte, 1, 0) < 0) /* until the parent ends it */
			;
		_exit(0);
	}
	usleep(200000);
	expect_serves(&psrd, "plate");
	assert_true(recv(fd, &byte, 1, MSG_DONTWAIT) < 0 && errno == EAGAIN);
	kill(crowd, SIGKILL);
	waitpid(crowd, NULL, 0);
	close(fd);
	daemon_stop(&psrd);
}

/* HELLO a byte at a time is no sign of life: the time before HELLO does not begin anew. */
static void a_hello_that_drips_is_closed_in_time(void **state)
{
	struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .client = "test" };
	const char *const more[] = { "--handshake-timeout", "1", NULL };
	int64_t began;
	size_t n = 0;

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_connect(&p, &psrd);
	assert_int_equal(psr_msg_hello_encode(&p.buf, &hello, NULL), PSR_OK);
	began = clock_ms();
	while (n + 1 < p.buf.size && send(p.fd, p.bytes + n, 1, MSG_NOSIGNAL) == 1) {
		n++;
		usleep(100000); /* all of it takes several times as long as psrd waits */
	}
	assert_true(n + 1 < p.buf.size);
	assert_in_range(clock_ms() - began, 980, PATIENCE_MS);
	peer_close(&p);
	expect_serves(&psrd, "plate");
	daemon_stop(&psrd);
}

static void a_full_server_tells_how_many_it_serves_and_has_room_when_one_leaves(void **state)
{
	struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .client = "test" };
	const char *const more[] = { "--max-clients", "1", NULL };
	char text[PSR_ERROR_TEXT];
	int silent[10];

	(void)state;
	daemon_start(&psrd, folder, more);
	for (int i = 0; i < 10; i++)
		silent[i] = connect_silent();
	peer_hello(&p, &psrd, NULL);
	for (int i = 0; i < 100; i++) { /* more than were ever told at a time */
		peer_connect(&q, &psrd);
		psr_msg_hello_encode(&q.buf, &hello, NULL);
		peer_send(&q);
		peer_expect_error(&q, 0, PSR_WIRE_BUSY, text);
		assert_non_null(strstr(text, "serves 1 client"));
		peer_expect_end(&q);
		peer_close(&q);
	}
	peer_close(&p);
	expect_serves(&psrd, "plate");
	for (int i = 0; i < 10; i++)
		close(silent[i]);
	daemon_stop(&psrd);
}

static void answer_ping(struct peer *peer, const struct psr_message *message)
{
	struct psr_msg_ping ping;

	assert_int_equal(psr_msg_ping_decode(&ping, message->payload, message->n, NULL), PSR_OK);
	assert_int_equal(psr_msg_pong_encode(&peer->buf, &ping, NULL), PSR_OK);
	peer_send(peer);
}

/* Reads on to a message of this type, however long psrd takes to draw. */
static void read_to(struct peer *peer, unsigned type)
{
	struct psr_message message;
	struct psr_msg_error error;

	do {
		assert_true(peer_next(peer, &message));
		if (message.type == PSR_MSG_ERROR && psr_msg_error_decode(&error, message.payload, message.n, NULL) == PSR_OK)
			fail_msg("ERROR %u: %s", error.code, error.text);
		if (message.type == PSR_MSG_PING)
			answer_ping(peer, &message);
	} while (message.type != type);
}

/* It asked for what takes long, and vanished behind something that keeps its connection. */
static void a_busy_peer_that_does_not_answer_ping_is_dropped(void **state)
{
	struct psr_msg_frame frame = frame_default(16, 16);
	const char *const more[] = { "--idle-timeout", "4", "--threads", "1", NULL };
	struct psr_message message;

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_begin(&p, &psrd, "plate");
	peer_ask_frame(&p, &frame);
	read_to(&p, PSR_MSG_FRAME_END);
	frame = frame_default(1500, 1500);
	frame.pass_limit = 4;
	frame.camera.fov_y = 0.1;
	frame.color_codec = PSR_CODEC_JPEG;
	frame.color_quality = 10;
	for (int i = 0; i < 60; i++) /* many seconds of work */
		peer_ask_frame(&p, &frame);
	while (peer_next(&p, &message)) /* reads, and answers nothing */
		assert_int_not_equal(message.type, PSR_MSG_GOODBYE);
	peer_close(&p);
	expect_serves(&psrd, "plate");
	daemon_stop(&psrd);
}

static void answers_to_ping_keep_a_connection(void **state)
{
	const char *const more[] = { "--idle-timeout", "4", NULL };
	struct psr_message message;

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_begin(&p, &psrd, "plate");
	for (int i = 0; i < 3; i++) { /* two seconds apart, from which two are the timeout */
		peer_expect(&p, &message, PSR_MSG_PING, 0);
		answer_ping(&p, &message);
	}
	draw(&p);
	peer_close(&p);
	daemon_stop(&psrd);
}

/* A stopped process, a machine that was suspended: peers that were there before are there after it. */
static void time_in_which_psrd_stood_still_does_not_count(void **state)
{
	const char *const more[] = { "--idle-timeout", "6", "--slow-timeout", "5", "--handshake-timeout", "5",
		                         "--frame-timeout", "3600", NULL };
	struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .client = "test" };
	struct psr_msg_frame frame = frame_default(2200, 2200); /* more than sockets hold */
	struct psr_message message;

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_begin(&p, &psrd, "plate");
	frame.color_codec = PSR_CODEC_RAW;
	peer_ask_frame(&p, &frame);
	read_to(&p, PSR_MSG_FRAME_BEGIN);
	peer_connect(&q, &psrd);
	usleep(200000);
	kill(psrd.pid, SIGSTOP);
	usleep(6500000);
	kill(psrd.pid, SIGCONT);
	assert_int_equal(psr_msg_hello_encode(&q.buf, &hello, NULL), PSR_OK);
	peer_send(&q);
	peer_expect(&q, &message, PSR_MSG_WELCOME, 0);
	read_to(&p, PSR_MSG_FRAME_END);
	peer_close(&q);
	peer_close(&p);
	daemon_stop(&psrd);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_longest_waiting_guest_makes_room),
		cmocka_unit_test(a_crowd_from_one_origin_replaces_its_own),
		cmocka_unit_test(an_origin_has_its_limit_while_there_is_room_for_others),
		cmocka_unit_test(who_has_been_refused_goes_first),
		cmocka_unit_test(a_guest_stays_as_long_as_places_last),
		cmocka_unit_test(this_machine_is_one_origin_and_so_is_a_network),
		cmocka_unit_test(silence_is_asked_at_half_time_and_ends_at_full),
		cmocka_unit_test(a_sign_of_life_begins_the_time_anew),
		cmocka_unit_test(who_waits_for_answers_has_longer_but_not_for_ever),
		cmocka_unit_test(who_was_asked_late_has_time_to_answer),
		cmocka_unit_test(without_a_limit_silence_is_never_asked),
		cmocka_unit_test_setup_teardown(silent_connections_keep_nobody_out, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_limit_for_an_address_is_kept, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_process_that_crowds_a_unix_socket_replaces_its_own, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_hello_that_drips_is_closed_in_time, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_full_server_tells_how_many_it_serves_and_has_room_when_one_leaves, set_up,
		                                tear_down),
		cmocka_unit_test_setup_teardown(a_busy_peer_that_does_not_answer_ping_is_dropped, set_up, tear_down),
		cmocka_unit_test_setup_teardown(answers_to_ping_keep_a_connection, set_up, tear_down),
		cmocka_unit_test_setup_teardown(time_in_which_psrd_stood_still_does_not_count, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

/* The daemon's life and limits: starting, refusing to start, ending, reloading, and each limit that an option sets. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "plate.h"

static struct daemon psrd;
static struct peer p, q;

/* Exit status of psrd with these arguments, when it does not start; its words stay in psrd.log. */
static int refused(const char *const *arguments)
{
	char path[PATH_MAX];
	const char *argv[16] = { path };

	daemon_path(path, "psrd");
	for (int i = 0; arguments[i] != NULL; i++)
		argv[1 + i] = arguments[i];
	daemon_spawn(&psrd, argv);
	return daemon_wait(&psrd);
}

static void start(const char *a, const char *b, const char *c, const char *d)
{
	const char *const more[] = { a, b, c, d, NULL };

	daemon_start(&psrd, folder, more);
}

static void sigterm_and_sigint_end_with_0_and_goodbye(void **state)
{
	static const int signals[] = { SIGTERM, SIGINT };
	struct psr_message message;
	struct psr_msg_goodbye goodbye;

	(void)state;
	for (int i = 0; i < 2; i++) {
		start(NULL, NULL, NULL, NULL);
		peer_hello(&p, &psrd, NULL);
		kill(psrd.pid, signals[i]);
		peer_expect(&p, &message, PSR_MSG_GOODBYE, 0);
		assert_int_equal(psr_msg_goodbye_decode(&goodbye, message.payload, message.n, NULL), PSR_OK);
		assert_int_equal(goodbye.reason, PSR_GOODBYE_SHUTDOWN);
		peer_expect_end(&p);
		peer_close(&p);
		assert_int_equal(daemon_wait(&psrd), 0);
	}
}

/* Each of the open ids ends, by its frame or by ERROR, before GOODBYE. */
static void frames_under_way_are_finished_at_the_end(void **state)
{
	struct psr_msg_frame frame = frame_default(800, 800);
	struct psr_message message;
	int n_frames = 0, n_errors = 0;

	(void)state;
	start("--threads", "1", NULL, NULL);
	peer_begin(&p, &psrd, "plate");
	for (int i = 0; i < 8; i++)
		peer_ask_frame(&p, &frame);
	do
		assert_true(peer_next(&p, &message));
	while (message.type != PSR_MSG_FRAME_END);
	kill(psrd.pid, SIGTERM);
	n_frames = 1;
	while (peer_next(&p, &message) && message.type != PSR_MSG_GOODBYE) {
		n_frames += message.type == PSR_MSG_FRAME_END;
		n_errors += message.type == PSR_MSG_ERROR;
	}
	assert_int_equal(message.type, PSR_MSG_GOODBYE);
	assert_int_equal(n_frames + n_errors, 8);
	peer_close(&p);
	assert_int_equal(daemon_wait(&psrd), 0);
}

static void sighup_finds_new_models(void **state)
{
	struct psr_msg_opened opened;
	struct psr_message message;
	int64_t end = clock_ms() + PATIENCE_MS;
	uint32_t id;

	(void)state;
	start(NULL, NULL, NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "late"), PSR_WIRE_NOT_FOUND, NULL);
	plate_write(folder, "late.psr", 0x112233);
	kill(psrd.pid, SIGHUP);
	do { /* reading the folder takes its time */
		assert_true(clock_ms() < end);
		id = peer_ask_open(&p, "late");
		do
			assert_true(peer_next(&p, &message));
		while (message.type == PSR_MSG_PROGRESS);
	} while (message.type == PSR_MSG_ERROR);
	assert_int_equal(message.id, id);
	assert_int_equal(psr_msg_opened_decode(&opened, message.payload, message.n, NULL), PSR_OK);
	assert_int_equal(opened.n_samples, PLATE_SAMPLES);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void damaged_models_are_refused_and_listed_as_failed(void **state)
{
	char path[2 * PATH_MAX], text[PSR_ERROR_TEXT];
	struct psr_message message;
	struct psr_msg_list_entry entry;
	struct stat status;

	(void)state;
	plate_write(folder, "cut.psr", 0x112233);
	snprintf(path, sizeof path, "%s/cut.psr", folder);
	assert_int_equal(stat(path, &status), 0);
	assert_int_equal(truncate(path, status.st_size / 2), 0);
	file_write(folder, "text.psr", "this is no model\n", 17);
	file_write(folder, "empty.psr", "", 0);
	start(NULL, NULL, NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "cut"), PSR_WIRE_FORMAT, text);
	assert_non_null(strstr(text, "cut"));
	assert_null(strstr(text, folder));
	peer_expect_open_error(&p, peer_ask_open(&p, "text"), PSR_WIRE_FORMAT, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "empty"), PSR_WIRE_FORMAT, NULL);
	psr_msg_list_encode(&p.buf, ++p.id, NULL);
	peer_send(&p);
	peer_expect(&p, &message, PSR_MSG_LIST_ENTRY, p.id);
	assert_int_equal(psr_msg_list_entry_decode(&entry, message.payload, message.n, NULL), PSR_OK);
	assert_string_equal(entry.name, "cut");
	assert_int_equal(entry.state, PSR_ENTRY_FAILED);
	peer_close(&p);
	expect_serves(&psrd, "plate");
	daemon_stop(&psrd);
}

/* ---- limits ---- */

static void silence_before_hello_is_closed_in_time(void **state)
{
	int64_t began;
	uint8_t byte;

	(void)state;
	start("--handshake-timeout", "1", NULL, NULL);
	began = clock_ms();
	peer_connect(&p, &psrd);
	assert_true(recv(p.fd, &byte, 1, 0) <= 0);
	assert_true(clock_ms() - began >= 990);
	peer_close(&p);
	expect_serves(&psrd, "plate");
	daemon_stop(&psrd);
}

static void idle_clients_hear_ping_then_goodbye(void **state)
{
	struct psr_msg_welcome welcome;
	struct psr_message message;
	struct psr_msg_goodbye goodbye;

	(void)state;
	start("--idle-timeout", "0.2", NULL, NULL);
	peer_hello(&p, &psrd, &welcome);
	assert_int_equal(welcome.idle_timeout_ms, 200);
	peer_expect(&p, &message, PSR_MSG_PING, 0);
	peer_expect(&p, &message, PSR_MSG_GOODBYE, 0);
	assert_int_equal(psr_msg_goodbye_decode(&goodbye, message.payload, message.n, NULL), PSR_OK);
	assert_int_equal(goodbye.reason, PSR_GOODBYE_IDLE);
	peer_expect_end(&p);
	peer_close(&p);
	daemon_stop(&psrd);
}

/* 64 raw frames of 3 MB for a peer that reads none: only what fits the queue is drawn, others are served, and in the
 * end the peer is dropped. */
static void a_reader_that_stops_is_dropped_and_costs_others_nothing(void **state)
{
	struct psr_msg_frame frame = frame_default(1000, 1000);
	const char *const more[] = { "--threads", "1", "--slow-timeout", "1", "--max-queue", "4m", NULL };
	int64_t end = clock_ms() + PATIENCE_MS;

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_begin(&p, &psrd, "plate");
	frame.color_codec = PSR_CODEC_RAW;
	frame.camera.fov_y = 0.1; /* all plate: nothing is left out as background */
	for (int i = 0; i < 64; i++)
		peer_ask_frame(&p, &frame);
	expect_serves(&psrd, "plate");
	while (stat_of(&psrd, PSR_STAT_DROPPED_PEERS) == 0) {
		assert_true(clock_ms() < end);
		usleep(50000);
	}
	/* Two frames of the queue's 4 MiB, and what the sockets' own buffers took: far from 64. */
	assert_true(stat_of(&psrd, PSR_STAT_FRAMES) < 20);
	assert_int_equal(stat_of(&psrd, PSR_STAT_FRAMES_WAITING), 0);
	peer_close(&p);
	expect_serves(&psrd, "plate");
	daemon_stop(&psrd);
}

/* A reader that waits for a while gets everything, however much it asked for: requests rest, none is lost. */
static void a_late_reader_gets_all_its_frames(void **state)
{
	struct psr_msg_frame frame = frame_default(400, 400);
	const char *const more[] = { "--max-queue", "64k", "--threads", "2", NULL };
	struct psr_message message;
	int n = 0;

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_begin(&p, &psrd, "plate");
	frame.color_codec = PSR_CODEC_RAW;
	for (int i = 0; i < 40; i++)
		peer_ask_frame(&p, &frame);
	usleep(300000);
	while (n < 40) {
		assert_true(peer_next(&p, &message));
		n += message.type == PSR_MSG_FRAME_END;
	}
	peer_close(&p);
	daemon_stop(&psrd);
}

/* 40,000 STATS without a look at the answers, of which 64 KiB may wait: the rest stays in the sockets. */
static void requests_wait_when_answers_are_not_read(void **state)
{
	enum { N = 40000 };
	const char *const more[] = { "--max-queue", "64k", "--slow-timeout", "60", NULL };
	struct psr_message message;
	uint32_t asked = 0, answered = 0;
	pid_t writer;

	(void)state;
	daemon_start(&psrd, folder, more);
	peer_hello(&p, &psrd, NULL);
	writer = fork();
	assert_true(writer >= 0);
	if (writer == 0) {
		while (asked < N) {
			p.buf.size = 0;
			while (asked < N && psr_msg_stats_encode(&p.buf, asked + 1, NULL) == PSR_OK)
				asked++;
			for (size_t at = 0; at < p.buf.size;) {
				ssize_t n = send(p.fd, p.bytes + at, p.buf.size - at, MSG_NOSIGNAL);

				if (n <= 0)
					_exit(1);
				at += (size_t)n;
			}
		}
		_exit(0);
	}
	usleep(200000);
	while (answered < N) {
		peer_expect(&p, &message, PSR_MSG_STATS_REPLY, answered + 1);
		answered++;
	}
	waitpid(writer, NULL, 0);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void a_full_server_says_so(void **state)
{
	struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .client = "test" };
	struct psr_msg_welcome welcome;

	(void)state;
	start("--max-clients", "1", NULL, NULL);
	peer_hello(&p, &psrd, &welcome);
	peer_connect(&q, &psrd);
	psr_msg_hello_encode(&q.buf, &hello, NULL);
	peer_send(&q);
	peer_expect_error(&q, 0, PSR_WIRE_BUSY, NULL);
	peer_expect_end(&q);
	peer_close(&q);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void requests_beyond_max_open_are_busy(void **state)
{
	struct psr_msg_frame frame = frame_default(700, 700);
	struct psr_message message;
	struct psr_msg_error error;
	int n_frames = 0, n_busy = 0;

	(void)state;
	start("--max-open", "2", "--threads", "1");
	peer_begin(&p, &psrd, "plate");
	for (int i = 0; i < 12; i++)
		assert_int_equal(psr_msg_frame_encode(&p.buf, ++p.id, 0, &frame, NULL), PSR_OK);
	peer_send(&p);
	while (n_frames + n_busy < 12) {
		assert_true(peer_next(&p, &message));
		n_frames += message.type == PSR_MSG_FRAME_END;
		if (message.type == PSR_MSG_ERROR) {
			assert_int_equal(psr_msg_error_decode(&error, message.payload, message.n, NULL), PSR_OK);
			assert_int_equal(error.code, PSR_WIRE_BUSY);
			n_busy++;
		}
	}
	assert_true(n_frames >= 2 && n_busy > 0);
	peer_close(&p);
	expect_serves(&psrd, "plate");
	daemon_stop(&psrd);
}

static void frames_beyond_max_pixels_are_refused(void **state)
{
	struct psr_msg_welcome welcome;
	struct psr_msg_frame frame = frame_default(100, 101);
	struct psr_msg_frame_end end;

	(void)state;
	start("--max-pixels", "10000", NULL, NULL);
	peer_hello(&p, &psrd, &welcome);
	assert_int_equal(welcome.max_pixels, 10000);
	peer_close(&p);
	peer_begin(&p, &psrd, "plate");
	peer_expect_error(&p, peer_ask_frame(&p, &frame), PSR_WIRE_LIMIT, NULL);
	frame.height = 100;
	peer_expect_frame(&p, peer_ask_frame(&p, &frame), &end);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void models_beyond_max_handles_are_refused(void **state)
{
	struct psr_msg_close close_handle = { .handle = 1 };
	struct psr_msg_opened opened;

	(void)state;
	start("--max-handles", "2", NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_expect_opened(&p, peer_ask_open(&p, "plate"), &opened);
	peer_expect_opened(&p, peer_ask_open(&p, "plate"), &opened);
	peer_expect_open_error(&p, peer_ask_open(&p, "plate"), PSR_WIRE_LIMIT, NULL);
	psr_msg_close_encode(&p.buf, ++p.id, &close_handle, NULL);
	peer_send(&p);
	peer_expect_opened(&p, peer_ask_open(&p, "plate"), &opened);
	assert_int_equal(opened.handle, 3);
	peer_close(&p);
	daemon_stop(&psrd);
}

/* With one thread, a client with 40 requests and then one with a single request: taking turns, the second is answered
 * after the frame under way and at most one more of the first's. */
static void clients_take_turns(void **state)
{
	struct psr_msg_frame large = frame_default(1000, 1000), small = frame_default(32, 32);
	struct psr_msg_frame_end end;
	struct psr_message message;

	(void)state;
	start("--threads", "1", NULL, NULL);
	peer_begin(&q, &psrd, "plate");
	peer_begin(&p, &psrd, "plate");
	for (int i = 0; i < 40; i++)
		assert_int_equal(psr_msg_frame_encode(&p.buf, ++p.id, 0, &large, NULL), PSR_OK);
	peer_send(&p);
	peer_expect(&p, &message, PSR_MSG_FRAME_BEGIN, p.id - 39); /* all 40 are there, one is drawn */
	peer_expect_frame(&q, peer_ask_frame(&q, &small), &end);
	assert_int_equal(end.entry[8].id, PSR_WIRE_REPORT_QUEUE);
	assert_true(end.entry[8].count > 20); /* so many were waiting before it */
	assert_true(stat_of(&psrd, PSR_STAT_FRAMES) < 20);
	peer_close(&p);
	peer_close(&q);
	daemon_stop(&psrd);
}

/* What counts is the memory that a packed model takes, which its header tells. */
static void packed_models_beyond_max_memory_are_refused(void **state)
{
	static const uint8_t size[8] = { 0, 4, 16 }; /* 1 MiB and 1 KiB, little-endian */
	struct psr_model *plate = plate_create(0x112233);
	struct psr_msg_opened opened;
	char text[PSR_ERROR_TEXT], limit[32], path[2 * PATH_MAX];
	FILE *file;

	(void)state;
	snprintf(path, sizeof path, "%s/small.psr", folder);
	assert_int_equal(psr_model_write_packed(plate, path, NULL), PSR_OK);
	snprintf(path, sizeof path, "%s/large.psr", folder);
	assert_int_equal(psr_model_write_packed(plate, path, NULL), PSR_OK);
	psr_model_unref(plate);
	file = fopen(path, "r+b");
	assert_non_null(file);
	assert_int_equal(fseek(file, 16, SEEK_SET), 0);
	assert_int_equal(fwrite(size, 1, 8, file), 8);
	fclose(file);
	snprintf(limit, sizeof limit, "%d", 1 << 20);
	start("--max-memory", limit, NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "large"), PSR_WIRE_LIMIT, text);
	assert_non_null(strstr(text, "--max-memory"));
	peer_expect_opened(&p, peer_ask_open(&p, "small"), &opened);
	assert_int_equal(opened.n_samples, PLATE_SAMPLES);
	peer_close(&p);
	daemon_stop(&psrd);
}

static void models_beyond_max_memory_are_refused(void **state)
{
	struct psr_msg_opened opened;
	struct psr_msg_close close_handle = { .handle = 1 };
	char text[PSR_ERROR_TEXT], limit[32], path[2 * PATH_MAX];
	static const char zeros[1 << 20];
	FILE *file;

	(void)state;
	plate_write(folder, "other.psr", 0x112233);
	snprintf(path, sizeof path, "%s/huge.psr", folder);
	file = fopen(path, "wb");
	assert_non_null(file);
	for (int i = 0; i < 2; i++)
		assert_int_equal(fwrite(zeros, 1, sizeof zeros, file), sizeof zeros);
	fclose(file);
	snprintf(limit, sizeof limit, "%d", 1 << 20);
	start("--max-memory", limit, NULL, NULL);
	peer_hello(&p, &psrd, NULL);
	peer_expect_open_error(&p, peer_ask_open(&p, "huge"), PSR_WIRE_LIMIT, text);
	assert_non_null(strstr(text, "--max-memory"));
	peer_expect_opened(&p, peer_ask_open(&p, "plate"), &opened);
	assert_true(opened.bytes < 1 << 20);
	psr_msg_close_encode(&p.buf, ++p.id, &close_handle, NULL);
	peer_send(&p);
	peer_expect_opened(&p, peer_ask_open(&p, "other"), &opened);
	peer_close(&p);
	daemon_stop(&psrd);
}

/* A peer that reads nothing cannot hold up the end. */
static void the_end_does_not_wait_for_readers_that_stopped(void **state)
{
	struct psr_msg_frame frame = frame_default(2000, 2000);
	int64_t began;

	(void)state;
	start("--drain-timeout", "0.5", "--frame-timeout", "3600");
	peer_begin(&p, &psrd, "plate");
	frame.color_codec = PSR_CODEC_RAW;
	frame.camera.fov_y = 0.1;
	peer_ask_frame(&p, &frame);
	while (stat_of(&psrd, PSR_STAT_FRAMES) == 0)
		usleep(5000);
	began = clock_ms();
	kill(psrd.pid, SIGTERM);
	assert_int_equal(daemon_wait(&psrd), 0);
	assert_true(clock_ms() - began >= 490);
	assert_true(clock_ms() - began < PATIENCE_MS / 2);
	peer_close(&p);
}

/* ---- starting ---- */

static void addresses_that_are_not_loopback_are_refused_with_advice(void **state)
{
	static const char *const addresses[] = { "0.0.0.0:0", "[::]:0", "192.0.2.1:7447", "tcp://10.0.0.1:0",
		                                       "tls://127.0.0.1:0" };

	(void)state;
	for (size_t i = 0; i < sizeof addresses / sizeof addresses[0]; i++) {
		const char *const arguments[] = { "--models", folder, "--listen", addresses[i], NULL };

		assert_int_equal(refused(arguments), 2);
		assert_non_null(strstr(psrd.log, "ssh -L"));
		assert_non_null(strstr(psrd.log, addresses[i]));
	}
}

static void bad_command_lines_exit_with_2_and_missing_folders_with_3(void **state)
{
	static const char *const none[] = { NULL };
	static const char *const missing[] = { "--models", "/nonexistent-folder", "--listen", "127.0.0.1:0", NULL };
	const char *const unknown[] = { "--models", folder, "--no-such-option", "1", NULL };
	const char *const threads[] = { "--models", folder, "--threads", "0", NULL };
	const char *const port[] = { "--models", folder, "--listen", "127.0.0.1:99999", NULL };
	const char *const config[] = { "--models", folder, "--config", "/nonexistent-file", NULL };

	(void)state;
	assert_int_equal(refused(none), 2);
	assert_int_equal(refused(unknown), 2);
	assert_int_equal(refused(threads), 2);
	assert_int_equal(refused(port), 2);
	assert_int_equal(refused(missing), 3);
	assert_int_equal(refused(config), 3);
}

static void a_port_in_use_is_named(void **state)
{
	char address[64];
	struct daemon other;
	const char *const arguments[] = { "--models", folder, "--listen", address, NULL };

	(void)state;
	start(NULL, NULL, NULL, NULL);
	other = psrd;
	snprintf(address, sizeof address, "127.0.0.1:%u", psrd.port);
	assert_int_not_equal(refused(arguments), 0);
	assert_non_null(strstr(psrd.log, address));
	psrd = other;
	daemon_stop(&psrd);
}

static void unix_sockets_are_private_replaced_when_stale_and_removed(void **state)
{
	char path[PATH_MAX], address[PATH_MAX], program[PATH_MAX];
	const char *const arguments[] = { "--models", folder, "--listen", address, NULL };
	const char *const argv[] = { program, "--models", folder, "--listen", address, NULL };
	struct stat status;
	struct daemon first;

	(void)state;
	daemon_path(program, "psrd");
	snprintf(path, sizeof path, "%.200s/socket", folder);
	snprintf(address, sizeof address, "unix:%.210s", path);
	daemon_spawn(&psrd, argv);
	daemon_wait_ready(&psrd);
	assert_string_equal(psrd.ready, address);
	assert_int_equal(stat(path, &status), 0);
	assert_true(S_ISSOCK(status.st_mode));
	assert_int_equal(status.st_mode & 0777, 0600);
	expect_serves(&psrd, "plate");
	first = psrd;
	assert_int_not_equal(refused(arguments), 0); /* a live one stays */
	assert_non_null(strstr(psrd.log, "already serves"));
	psrd = first;
	kill(psrd.pid, SIGKILL);
	assert_int_equal(daemon_wait(&psrd), -SIGKILL);
	assert_int_equal(stat(path, &status), 0);
	daemon_spawn(&psrd, argv); /* a stale one is replaced */
	daemon_wait_ready(&psrd);
	expect_serves(&psrd, "plate");
	daemon_stop(&psrd);
	assert_int_equal(stat(path, &status), -1);
	file_write(folder, "socket", "text", 4); /* what is no socket is not touched */
	assert_int_equal(refused(arguments), 2);
	assert_int_equal(stat(path, &status), 0);
}

static void every_listener_is_announced_and_served(void **state)
{
	char socket_address[PATH_MAX];
	struct daemon second;

	(void)state;
	snprintf(socket_address, sizeof socket_address, "unix:%.200s/second", folder);
	start("--listen", socket_address, NULL, NULL);
	expect_serves(&psrd, "plate");
	second = psrd;
	daemon_wait_ready(&second);
	second.port = 0;
	assert_string_equal(second.ready, socket_address);
	expect_serves(&second, "plate");
	daemon_stop(&psrd);
}

static void the_command_line_wins_over_the_configuration(void **state)
{
	static const char config[] = "# limits\nmax-pixels = 5000\n\nmax-open=3\n  verbose = yes\n";
	char path[PATH_MAX];
	struct psr_msg_welcome welcome;
	const char *const bad[] = { "--models", folder, "--config", path, NULL };

	(void)state;
	file_write(folder, "psrd.conf", config, sizeof config - 1);
	snprintf(path, sizeof path, "%.200s/psrd.conf", folder);
	start("--config", path, "--max-open", "4");
	peer_hello(&p, &psrd, &welcome);
	assert_int_equal(welcome.max_pixels, 5000);
	assert_int_equal(welcome.max_open, 4);
	peer_close(&p);
	daemon_stop(&psrd);
	file_write(folder, "psrd.conf", "threads = 1\nmax-pixel = 1\n", 26);
	assert_int_equal(refused(bad), 2);
	assert_non_null(strstr(psrd.log, "line 2"));
	assert_non_null(strstr(psrd.log, "max-pixels"));
}

static void running_out_of_descriptors_does_not_stop_the_daemon(void **state)
{
	enum { N = 40 };
	static struct peer peers[N];
	char path[PATH_MAX], command[2 * PATH_MAX + 200];
	const char *const argv[] = { "/bin/sh", "-c", command, NULL };

	(void)state;
	daemon_path(path, "psrd");
	/* Too few for the default of 64 clients; --max-clients shrinks to 1, and connections beyond it come and go. */
	snprintf(command, sizeof command, "ulimit -n 40; exec '%s' --listen 127.0.0.1:0 --models '%s'", path, folder);
	daemon_spawn(&psrd, argv);
	daemon_wait_ready(&psrd);
	for (int i = 0; i < N; i++)
		peer_connect(&peers[i], &psrd);
	usleep(300000);
	for (int i = 0; i < N; i++)
		peer_close(&peers[i]);
	expect_serves(&psrd, "plate");
	daemon_stop(&psrd);
	assert_non_null(strstr(psrd.log, "ulimit -n"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(sigterm_and_sigint_end_with_0_and_goodbye, set_up, tear_down),
		cmocka_unit_test_setup_teardown(frames_under_way_are_finished_at_the_end, set_up, tear_down),
		cmocka_unit_test_setup_teardown(sighup_finds_new_models, set_up, tear_down),
		cmocka_unit_test_setup_teardown(damaged_models_are_refused_and_listed_as_failed, set_up, tear_down),
		cmocka_unit_test_setup_teardown(silence_before_hello_is_closed_in_time, set_up, tear_down),
		cmocka_unit_test_setup_teardown(idle_clients_hear_ping_then_goodbye, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_reader_that_stops_is_dropped_and_costs_others_nothing, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_late_reader_gets_all_its_frames, set_up, tear_down),
		cmocka_unit_test_setup_teardown(requests_wait_when_answers_are_not_read, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_full_server_says_so, set_up, tear_down),
		cmocka_unit_test_setup_teardown(requests_beyond_max_open_are_busy, set_up, tear_down),
		cmocka_unit_test_setup_teardown(frames_beyond_max_pixels_are_refused, set_up, tear_down),
		cmocka_unit_test_setup_teardown(packed_models_beyond_max_memory_are_refused, set_up, tear_down),
		cmocka_unit_test_setup_teardown(models_beyond_max_handles_are_refused, set_up, tear_down),
		cmocka_unit_test_setup_teardown(clients_take_turns, set_up, tear_down),
		cmocka_unit_test_setup_teardown(models_beyond_max_memory_are_refused, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_end_does_not_wait_for_readers_that_stopped, set_up, tear_down),
		cmocka_unit_test_setup_teardown(addresses_that_are_not_loopback_are_refused_with_advice, set_up, tear_down),
		cmocka_unit_test_setup_teardown(bad_command_lines_exit_with_2_and_missing_folders_with_3, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_port_in_use_is_named, set_up, tear_down),
		cmocka_unit_test_setup_teardown(unix_sockets_are_private_replaced_when_stale_and_removed, set_up, tear_down),
		cmocka_unit_test_setup_teardown(every_listener_is_announced_and_served, set_up, tear_down),
		cmocka_unit_test_setup_teardown(the_command_line_wins_over_the_configuration, set_up, tear_down),
		cmocka_unit_test_setup_teardown(running_out_of_descriptors_does_not_stop_the_daemon, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

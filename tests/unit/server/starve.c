/* A psrd within this program, whose allocations fail one after the other: the n-th of its life, for every n. Each
 * request ends in an answer or with the connection, and the next client is served. Calls of our own code are counted,
 * threads and contexts of codecs among them; what libraries ask for within is theirs. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <pthread.h>
#include <stdatomic.h>
#include <sys/mman.h>
#include <turbojpeg.h>
#include <zstd.h>
#include "fixture.h"
#include "server/server.h"

/* ---- allocations ---- */

static atomic_int n_calls, fail_at, n_fails; /* fail_at 0: none fails */
static __thread int is_tester;               /* this thread's succeed, and do not count */

static int fails(void)
{
	const int at = fail_at;
	int n;

	if (is_tester || at == 0)
		return 0;
	n = ++n_calls;
	if (n < at || n >= at + n_fails)
		return 0;
	errno = ENOMEM;
	return 1;
}

#define WRAP(type, failure, name, parameters, arguments) \
	type __real_##name parameters; \
	type __wrap_##name parameters; \
	type __wrap_##name parameters \
	{ \
		return fails() ? failure : __real_##name arguments; \
	}
WRAP(void *, NULL, malloc, (size_t n), (n))
WRAP(void *, NULL, calloc, (size_t n, size_t size), (n, size))
WRAP(void *, NULL, realloc, (void *old, size_t n), (old, n))
WRAP(void *, NULL, aligned_alloc, (size_t to, size_t n), (to, n))
WRAP(char *, NULL, strdup, (const char *text), (text))
WRAP(char *, NULL, strndup, (const char *text, size_t n), (text, n))
WRAP(void *, MAP_FAILED, mmap, (void *at, size_t n, int may, int flags, int fd, off_t from),
     (at, n, may, flags, fd, from))
WRAP(int, EAGAIN, pthread_create, (pthread_t *thread, const pthread_attr_t *how, void *(*fn)(void *), void *userdata),
     (thread, how, fn, userdata))
WRAP(ZSTD_CCtx *, NULL, ZSTD_createCCtx, (void), ())
WRAP(ZSTD_DCtx *, NULL, ZSTD_createDCtx, (void), ())
WRAP(tjhandle, NULL, tjInitCompress, (void), ())

/* ---- the server ---- */

static char folder[PATH_MAX], place[PATH_MAX + 16];
static struct daemon here; /* its address alone */
static pthread_t thread;
static atomic_int start_code; /* 1: not yet */

static void *serve(void *userdata)
{
	char *argv[] = { "psrd", "--models", folder, "--listen", place, "--threads", "2", NULL };
	struct options options;
	struct server *server;
	struct psr_error err;
	int code = options_parse(&options, 7, argv, &err);

	(void)userdata;
	if (code == PSR_OK)
		code = server_start(&server, &options, &err);
	start_code = code;
	if (code == PSR_OK)
		server_run(server, &err);
	options_fini(&options);
	return NULL;
}

static int start(void)
{
	int64_t end = clock_ms() + PATIENCE_MS;

	start_code = 1;
	assert_int_equal(pthread_create(&thread, NULL, serve, NULL), 0);
	while (start_code == 1) {
		assert_true(clock_ms() < end);
		usleep(500);
	}
	return start_code;
}

static void stop(void)
{
	struct timespec patience;

	if (start_code == PSR_OK)
		kill(getpid(), SIGTERM);
	clock_gettime(CLOCK_REALTIME, &patience);
	patience.tv_sec += PATIENCE_MS / 1000;
	if (pthread_timedjoin_np(thread, NULL, &patience) != 0)
		fail_msg("allocation %d: the server does not end", fail_at);
}

static int set_up(void **state)
{
	sigset_t signals;

	(void)state;
	is_tester = 1;
	sigemptyset(&signals);
	sigaddset(&signals, SIGTERM);
	pthread_sigmask(SIG_BLOCK, &signals, NULL);
	folder_make(folder);
	plate_write(folder, "plate.psr", 0x2040c0);
	snprintf(place, sizeof place, "unix:%s/socket", folder);
	snprintf(here.ready, sizeof here.ready, "%.500s", place);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	folder_remove(folder);
	return 0;
}

/* ---- a client that takes what comes ---- */

static struct peer p;
static int is_closed;  /* the server has closed, or said that it will */
static int n_errors;

static int is_terminal(const struct psr_message *message)
{
	struct psr_msg_frame_end end;

	switch (message->type) {
	case PSR_MSG_FRAME_END:
		return psr_msg_frame_end_decode(&end, message->payload, message->n, NULL) == PSR_OK && end.is_final;
	case PSR_MSG_ERROR:
	case PSR_MSG_LIST_END:
	case PSR_MSG_OPENED:
	case PSR_MSG_PRESETS_END:
	case PSR_MSG_STATS_REPLY:
	case PSR_MSG_SUPERSEDED:
	case PSR_MSG_CANCELLED:
	case PSR_MSG_WELCOME:
		return 1;
	}
	return 0;
}

/* The first thing that fails, fails for memory; what builds on it may fail for the lack of it. */
static void take_error(const struct psr_message *message)
{
	struct psr_msg_error error;

	assert_int_equal(psr_msg_error_decode(&error, message->payload, message->n, NULL), PSR_OK);
	if (n_errors++ == 0 && error.code != PSR_WIRE_MEMORY)
		fail_msg("allocation %d: ERROR %u: %s", fail_at, error.code, error.text);
	is_closed |= message->id == 0;
}

/* Sends what is encoded, and waits for the end of its id, if it has one. Returns whether that was not an error. */
static int go(uint32_t id, uint16_t view)
{
	struct psr_message message;

	for (size_t at = 0; at < p.buf.size && !is_closed;) {
		ssize_t n = send(p.fd, p.buf.data + at, p.buf.size - at, MSG_NOSIGNAL);

		is_closed |= n <= 0;
		at += n > 0 ? (size_t)n : 0;
	}
	p.buf.size = 0;
	while (!is_closed) {
		if (!peer_next(&p, &message)) {
			is_closed = 1;
			return 0;
		}
		if (message.type == PSR_MSG_ERROR)
			take_error(&message);
		if (message.id != id)
			continue;
		if (message.type == PSR_MSG_FRAME_END && view > 0) {
			struct psr_msg_frame_end end;

			psr_msg_frame_end_decode(&end, message.payload, message.n, NULL);
			psr_msg_ack_encode(&p.buf, id, view, &(struct psr_msg_ack){ end.pass }, NULL);
			if (!end.is_final) /* goes at once: the next frame waits for it */
				return go(id, view);
		}
		if (is_terminal(&message))
			return message.type != PSR_MSG_ERROR;
	}
	return 0;
}

static int ask(uint16_t view, struct psr_msg_frame *frame)
{
	psr_msg_frame_encode(&p.buf, ++p.id, view, frame, NULL);
	return go(p.id, view);
}

/* Returns whether every request was granted. */
static int live(int is_sharp)
{
	struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .client = "test" };
	struct psr_msg_open open = { .name = "plate" };
	struct psr_msg_frame frame = frame_default(48, 48);
	struct psr_msg_scene *scene = malloc(sizeof *scene);
	int is_granted;

	assert_non_null(scene);
	n_errors = is_closed = 0;
	peer_connect(&p, &here);
	psr_msg_hello_encode(&p.buf, &hello, NULL);
	is_granted = go(0, 0);
	psr_msg_list_encode(&p.buf, ++p.id, NULL);
	is_granted &= go(p.id, 0);
	psr_msg_open_encode(&p.buf, ++p.id, &open, NULL);
	is_granted &= go(p.id, 0);
	psr_msg_presets_encode(&p.buf, ++p.id, &(struct psr_msg_presets){ 1 }, NULL);
	is_granted &= go(p.id, 0);
	scene_default(scene, 1);
	scene->n_lights = 1;
	scene->light[0] = (struct psr_msg_light){ .kind = PSR_WIRE_LIGHT_DIRECTIONAL, .flags = PSR_WIRE_LIGHT_SHADOW,
		                                      .color = { 255, 255, 255 }, .intensity = 1, .direction = { 0, 0, -1 } };
	psr_msg_scene_encode(&p.buf, ++p.id, scene, NULL);
	free(scene);
	frame.color_codec = PSR_CODEC_JPEG;
	frame.color_quality = 50;
	is_granted &= ask(0, &frame);
	frame = frame_default(48, 48);
	frame.planes |= 2;
	frame.depth_format = PSR_WIRE_DEPTH_F32;
	frame.depth_codec = PSR_CODEC_ZSTD;
	is_granted &= ask(1, &frame);
	frame.base = p.id;
	is_granted &= ask(1, &frame);
	if (is_sharp) {
		frame.base = 0;
		frame.planes = 1;
		frame.depth_format = frame.depth_codec = 0;
		frame.flags = PSR_WIRE_FRAME_SHARP;
		frame.pass_limit = 1;
		is_granted &= ask(1, &frame);
	}
	psr_msg_stats_encode(&p.buf, ++p.id, NULL);
	is_granted &= go(p.id, 0);
	psr_msg_goodbye_encode(&p.buf, &(struct psr_msg_goodbye){ .reason = PSR_GOODBYE_DONE }, NULL);
	is_granted &= !is_closed && send(p.fd, p.buf.data, p.buf.size, MSG_NOSIGNAL) == (ssize_t)p.buf.size;
	peer_close(&p);
	return is_granted;
}

/* ---- the tests ---- */

/* A server's whole life with the failures, and a sound client behind it. Returns the calls that there were. */
static int starve(int at, int n, int is_from_start, int is_sharp)
{
	n_calls = 0;
	n_fails = n;
	fail_at = is_from_start ? at : 0;
	if (start() == PSR_OK) {
		fail_at = at;
		if (!is_from_start)
			n_calls = 0;
		live(is_sharp);
		n = n_calls;
		fail_at = 0;
		if (!live(0))
			fail_msg("allocation %d: the next client is not served", at);
		fail_at = at;
		n_calls = 1 << 30; /* none fails any more */
	} else {
		assert_true(is_from_start);
		assert_int_equal(start_code, PSR_ERR_MEMORY);
		n = n_calls;
	}
	stop();
	fail_at = 0;
	return n;
}

/* Returns the number of calls of a life in which none failed. */
static int starve_all(int first, int n, int is_from_start, int is_sharp)
{
	int at = first, n_last;

	while ((n_last = starve(at, n, is_from_start, is_sharp)) >= at)
		at++;
	print_message("# %d lives, the last one with %d allocations\n", at - first + 1, n_last);
	return n_last;
}

static void every_allocation_of_a_connection_may_fail(void **state)
{
	(void)state;
	assert_true(starve_all(1, 1, 0, 0) > 50);
}

static void so_may_several_in_a_row(void **state)
{
	(void)state;
	for (int n = 2; n <= 32; n *= 4)
		starve_all(1, n, 0, 0);
}

/* Those from the first quick frame at rest on: a sharp and a refined one follow it. */
static void so_may_those_of_frames_at_rest(void **state)
{
	const int first = starve(1 << 30, 1, 0, 0);

	(void)state;
	starve_all(first - 10, 1, 0, 1);
}

static void every_allocation_of_a_start_may_fail(void **state)
{
	(void)state;
	assert_true(starve_all(1, 1, 1, 0) > 80);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_allocation_of_a_connection_may_fail),
		cmocka_unit_test(so_may_several_in_a_row),
		cmocka_unit_test(so_may_those_of_frames_at_rest),
		cmocka_unit_test(every_allocation_of_a_start_may_fail),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}

/* A client against a server of the test's own, which says whatever a script has it say. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>
#include "client/lib/camera.h"
#include "proto/proto.h"
#include "psr/client.h"

#define SIDE 24
#define TIMEOUT 10000

/* ---- the server ---- */

struct peer {
	int listener, fd;
	size_t most; /* bytes a write */
	void (*script)(struct peer *peer);
	pthread_t thread;
	struct psr_framer framer;
	uint8_t in[2 * PSR_WIRE_MAX_MESSAGE], out[4 * PSR_WIRE_MAX_MESSAGE];
	struct psr_buf buf;
};

static char folder[96], address[128];
static struct peer peer;

static void put(struct peer *p, const void *data, size_t n)
{
	const uint8_t *at = data;

	while (n > 0) {
		size_t part = n < p->most ? n : p->most;
		ssize_t sent = send(p->fd, at, part, MSG_NOSIGNAL);

		if (sent <= 0)
			return;
		at += sent;
		n -= (size_t)sent;
	}
}

static void flush(struct peer *p)
{
	put(p, p->buf.data, p->buf.size);
	p->buf.size = 0;
}

/* The next message of this type; others are dropped. Its id, or 0 if the client went away. */
static uint32_t expect(struct peer *p, unsigned type, struct psr_message *message)
{
	for (;;) {
		int got = psr_framer_next(&p->framer, message, NULL);
		uint8_t *space;
		size_t room;
		ssize_t n;

		if (got > 0 && message->type == type)
			return message->id != 0 ? message->id : 1;
		if (got > 0)
			continue;
		if (got < 0)
			return 0;
		space = psr_framer_space(&p->framer, &room);
		n = recv(p->fd, space, room, 0);
		if (n <= 0)
			return 0;
		psr_framer_filled(&p->framer, (size_t)n);
	}
}

static void *serve(void *userdata)
{
	struct peer *p = userdata;

	p->fd = accept(p->listener, NULL, NULL);
	p->buf = (struct psr_buf){ p->out, 0, sizeof p->out };
	psr_framer_init(&p->framer, PSR_CLIENT, p->in, sizeof p->in);
	p->script(p);
	flush(p);
	close(p->fd);
	return NULL;
}

static void start(void (*script)(struct peer *), size_t most)
{
	struct sockaddr_un to = { .sun_family = AF_UNIX };

	snprintf(to.sun_path, sizeof to.sun_path, "%s/s", folder);
	snprintf(address, sizeof address, "unix:%s/s", folder);
	unlink(to.sun_path);
	peer.most = most;
	peer.script = script;
	peer.listener = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
	assert_int_equal(bind(peer.listener, (struct sockaddr *)&to, sizeof to), 0);
	assert_int_equal(listen(peer.listener, 4), 0);
	assert_int_equal(pthread_create(&peer.thread, NULL, serve, &peer), 0);
}

static void stop(struct psr_client *client)
{
	psr_client_close(client);
	pthread_join(peer.thread, NULL);
	close(peer.listener);
}

static uint64_t capabilities = PSR_CAP_PRESETS | PSR_CAP_FETCH;

static void welcome(struct peer *p)
{
	const struct psr_msg_welcome msg = { .minor = PSR_PROTO_MINOR,
		                                 .capabilities = capabilities,
		                                 .max_message = 65536,
		                                 .max_side = 16384,
		                                 .max_pixels = 1 << 20,
		                                 .max_instances = 1,
		                                 .max_lights = 4,
		                                 .max_scenes = 1,
		                                 .max_open = 4,
		                                 .max_models = 4,
		                                 .server = "test" };
	struct psr_message message;

	if (expect(p, PSR_MSG_HELLO, &message) == 0)
		return;
	psr_framer_accept(&p->framer, p->in, sizeof p->in);
	psr_msg_welcome_encode(&p->buf, &msg, NULL);
	flush(p);
}

static struct psr_client *connected(void)
{
	struct psr_client *client = NULL;
	struct psr_error err;

	if (psr_client_connect(&client, address, "test", "model", TIMEOUT, &err) != PSR_OK)
		fail_msg("%s", err.text);
	return client;
}

static struct psr_msg_frame request(void)
{
	struct psr_msg_frame frame = { .width = SIDE, .height = SIDE, .planes = 1, .color_codec = PSR_CODEC_RAW };

	frame.camera = (struct psr_camera){
		.kind = PSR_CAMERA_PERSPECTIVE, .eye = { 0, 0, 5 }, .up = { 0, 1, 0 }, .fov_y = 0.5, .near_z = 0.1
	};
	return frame;
}

/* BEGIN, two rectangles (the first in two pieces, with `between` in the middle), END. */
static void put_frame(struct peer *p, uint32_t id, uint64_t hash_error, void (*between)(struct peer *))
{
	struct psr_msg_frame asked = request();
	struct psr_msg_frame_begin begin = {
		.width = SIDE, .height = SIDE, .planes = 1, .settings = { .scale = 1, .spacing_px = 1 }, .camera = asked.camera
	};
	static uint8_t rgb[3 * SIDE * SIDE];
	const struct psr_frame frame = { .width = SIDE, .height = SIDE, .rgb = rgb };
	const uint32_t half = 3 * SIDE * SIDE / 2;
	struct psr_msg_rect rect = { 0, PSR_CODEC_RAW, 1, 0, 0, SIDE, SIDE / 2, half, 0, 100, rgb };
	struct psr_msg_frame_end end = { .is_final = 1, .planes = 1, .has_hashes = 1 };

	for (size_t i = 0; i < sizeof rgb; i++)
		rgb[i] = (uint8_t)(i * id);
	psr_msg_frame_begin_encode(&p->buf, id, 0, &begin, NULL);
	psr_msg_rect_encode(&p->buf, id, 0, &rect, NULL);
	if (between != NULL)
		between(p);
	rect.offset = 100;
	rect.bytes = half - 100;
	rect.data = rgb + 100;
	psr_msg_rect_encode(&p->buf, id, 0, &rect, NULL);
	rect = (struct psr_msg_rect){ 0, PSR_CODEC_RAW, 1, 0, SIDE / 2, SIDE, SIDE / 2, half, 0, half, rgb + half };
	psr_msg_rect_encode(&p->buf, id, 0, &rect, NULL);
	end.hash[0] = psr_frame_hash(&frame, PSR_PLANE_COLOR) ^ hash_error;
	psr_msg_frame_end_encode(&p->buf, id, 0, &end, NULL);
	flush(p);
}

static int set_up(void **state)
{
	const char *root = getenv("TMPDIR");

	(void)state;
	snprintf(folder, sizeof folder, "%s/psr-client-XXXXXX", root != NULL && strlen(root) < 60 ? root : "/tmp");
	return mkdtemp(folder) == NULL;
}

static int tear_down(void **state)
{
	char path[300];

	(void)state;
	snprintf(path, sizeof path, "%s/s", folder);
	unlink(path);
	return rmdir(folder);
}

/* ---- sound servers ---- */

static void serve_all(struct peer *p)
{
	const struct psr_msg_list_entry entry[2] = { { PSR_ENTRY_READY, 1000, { 1 }, "bunny" },
		                                         { PSR_ENTRY_SOURCE, 2000, { 0 }, "dragon" } };
	struct psr_msg_progress progress = { PSR_PROGRESS_SAMPLE, 1, 2 };
	struct psr_msg_opened opened = {
		.handle = 7, .representations = 2, .scale = 1, .spacing = 0.1, .resolution = 1, .n_levels = 1,
		.up = { 0, 1, 0 }
	};
	struct psr_msg_stats_reply stats = { 1, { { PSR_STAT_FRAMES, 42 } } };
	struct psr_msg_preset light = { .kind = PSR_WIRE_PRESET_LIGHT, .light = { .kind = PSR_WIRE_LIGHT_POINT } };
	struct psr_msg_ping ping = { 99 };
	struct psr_message message;
	uint32_t id;

	welcome(p);
	id = expect(p, PSR_MSG_LIST, &message);
	for (int i = 0; i < 2; i++)
		psr_msg_list_entry_encode(&p->buf, id, &entry[i], NULL);
	psr_msg_list_end_encode(&p->buf, id, &(struct psr_msg_list_end){ 2 }, NULL);
	flush(p);
	id = expect(p, PSR_MSG_OPEN, &message);
	psr_msg_progress_encode(&p->buf, id, &progress, NULL);
	psr_msg_ping_encode(&p->buf, &ping, NULL);
	flush(p);
	expect(p, PSR_MSG_PONG, &message);
	psr_msg_opened_encode(&p->buf, id, &opened, NULL);
	flush(p);
	id = expect(p, PSR_MSG_PRESETS, &message);
	for (int i = 0; i < PSR_WIRE_MAX_PRESETS; i++) {
		snprintf(light.name, sizeof light.name, "light %d", i);
		psr_msg_preset_encode(&p->buf, id, &light, NULL);
	}
	psr_msg_presets_end_encode(&p->buf, id, &(struct psr_msg_presets_end){ 0, PSR_WIRE_MAX_PRESETS }, NULL);
	flush(p);
	id = expect(p, PSR_MSG_PRESETS, &message);
	psr_msg_presets_end_encode(&p->buf, id, &(struct psr_msg_presets_end){ 0, 0 }, NULL);
	flush(p);
	id = expect(p, PSR_MSG_STATS, &message);
	psr_msg_stats_reply_encode(&p->buf, id, &stats, NULL);
	flush(p);
	expect(p, PSR_MSG_GOODBYE, &message);
}

static void count_progress(const struct psr_msg_progress *progress, void *userdata)
{
	assert_int_equal(progress->stage, PSR_PROGRESS_SAMPLE);
	++*(int *)userdata;
}

static void session_works_for_any_split_of_the_bytes(void **state)
{
	static const size_t splits[] = { 1, 7, 65536 };

	(void)state;
	for (size_t i = 0; i < 3; i++) {
		struct psr_msg_list_entry *entries;
		struct psr_msg_stats_reply stats;
		struct psr_msg_opened opened;
		struct psr_msg_preset *presets;
		struct psr_client *client;
		struct psr_error err;
		uint32_t n;
		int n_progress = 0;

		start(serve_all, splits[i]);
		client = connected();
		assert_string_equal(psr_client_welcome(client)->server, "test");
		assert_int_equal(psr_client_list(client, &entries, &n, TIMEOUT, &err), PSR_OK);
		assert_int_equal(n, 2);
		assert_string_equal(entries[1].name, "dragon");
		free(entries);
		psr_client_on_progress(client, count_progress, &n_progress);
		assert_int_equal(psr_client_open(client, "bunny", TIMEOUT, &opened, &err), PSR_OK);
		assert_int_equal(opened.handle, 7);
		assert_int_equal(n_progress, 1);
		assert_int_equal(psr_client_presets(client, 7, &presets, &n, TIMEOUT, &err), PSR_OK);
		assert_int_equal(n, PSR_WIRE_MAX_PRESETS);
		assert_string_equal(presets[n - 1].name, "light 255");
		free(presets);
		assert_int_equal(psr_client_presets(client, 7, &presets, &n, TIMEOUT, &err), PSR_OK);
		assert_int_equal(n, 0);
		assert_null(presets);
		assert_int_equal(psr_client_stats(client, &stats, TIMEOUT, &err), PSR_OK);
		assert_int_equal(stats.stat[0].value, 42);
		stop(client);
	}
}

static void serve_frames_backwards(struct peer *p)
{
	const struct psr_msg_stats_reply stats = { .n_stats = 1, .stat = { { PSR_STAT_FRAMES, 42 } } };
	struct psr_message message;
	uint32_t id[3];

	welcome(p);
	for (int i = 0; i < 3; i++)
		id[i] = expect(p, PSR_MSG_FRAME, &message);
	put_frame(p, id[2], 0, NULL);
	psr_msg_stats_reply_encode(&p->buf, expect(p, PSR_MSG_STATS, &message), &stats, NULL);
	psr_msg_error_encode(&p->buf, id[1], 0, &(struct psr_msg_error){ PSR_WIRE_LIMIT, "too large" }, NULL);
	put_frame(p, id[0], 0, NULL);
	expect(p, PSR_MSG_GOODBYE, &message);
}

static void frames_come_in_any_order_and_one_may_fail(void **state)
{
	struct psr_msg_frame frame = request();
	struct psr_client *client;
	struct psr_event event;
	struct psr_error err;
	struct psr_msg_stats_reply stats;
	uint32_t id[5];

	(void)state;
	start(serve_frames_backwards, 50);
	client = connected();
	for (int i = 0; i < 3; i++)
		assert_int_equal(psr_client_frame(client, &frame, &id[i], &err), PSR_OK);
	assert_int_equal(psr_client_stats(client, &stats, TIMEOUT, &err), PSR_OK); /* while the first one comes */
	assert_int_equal(stats.stat[0].value, 42);
	assert_int_equal(psr_client_wait(client, TIMEOUT, &event, &err), 1);
	assert_int_equal(event.type, PSR_EVENT_FRAME);
	assert_int_equal(event.id, id[2]);
	assert_int_equal(event.checked, 1);
	for (size_t i = 0; i < 3 * SIDE * SIDE; i++)
		assert_int_equal(event.picture->rgb[i], (uint8_t)(i * id[2]));
	assert_int_equal(psr_client_wait(client, TIMEOUT, &event, &err), 1);
	assert_int_equal(event.type, PSR_EVENT_FAILED);
	assert_int_equal(event.id, id[1]);
	assert_int_equal(event.error.code, PSR_ERR_LIMIT);
	assert_string_equal(event.error.text, "too large");
	assert_int_equal(psr_client_wait(client, TIMEOUT, &event, &err), 1);
	assert_int_equal(event.id, id[0]);
	assert_int_equal(psr_client_wait(client, 30, &event, &err), 0);
	stop(client);
}

static void serve_nothing_more(struct peer *p)
{
	struct psr_message message;

	welcome(p);
	expect(p, PSR_MSG_GOODBYE, &message);
}

static void no_more_requests_are_open_than_the_server_takes(void **state)
{
	struct psr_msg_frame frame = request();
	struct psr_client *client;
	struct psr_error err;
	uint32_t id;

	(void)state;
	start(serve_nothing_more, 65536);
	client = connected();
	for (int i = 0; i < 4; i++)
		assert_int_equal(psr_client_frame(client, &frame, &id, &err), PSR_OK);
	assert_int_equal(psr_client_frame(client, &frame, &id, &err), PSR_ERR_BUSY);
	stop(client);
}

static void what_the_server_does_not_offer_is_refused_here(void **state)
{
	static struct psr_msg_scene scene;
	struct psr_msg_frame frame;
	struct psr_client *client;
	struct psr_error err;
	uint32_t id;

	(void)state;
	start(serve_nothing_more, 65536);
	client = connected();
	scene.n_lights = 1;
	assert_int_equal(psr_light_parse(&scene.light[0], "dir:0,-1,0,shadow", &err), PSR_OK);
	assert_int_equal(psr_client_scene(client, &scene, NULL, &err), PSR_ERR_UNSUPPORTED);
	assert_non_null(strstr(err.text, "shadow"));
	for (int i = 0; i < 4; i++) {
		frame = request();
		if (i == 0)
			frame.planes = 4;
		else if (i == 1)
			frame.pass_limit = 1;
		else if (i == 2)
			frame.color_codec = PSR_CODEC_PNG;
		else
			frame.budget = PSR_WIRE_BUDGET_TIME;
		assert_int_equal(psr_client_frame(client, &frame, &id, &err), PSR_ERR_UNSUPPORTED);
	}
	frame = request();
	frame.camera.eye[0] = NAN;
	assert_int_equal(psr_client_frame(client, &frame, &id, &err), PSR_ERR_ARG);
	frame = request();
	frame.width = 0;
	assert_int_equal(psr_client_frame(client, &frame, &id, &err), PSR_ERR_ARG);
	frame.width = frame.height = 100000;
	assert_true(psr_client_frame(client, &frame, &id, &err) < 0);
	stop(client);
}

/* ---- broken servers ---- */

static void say_http(struct peer *p)
{
	put(p, "HTTP/1.1 400 Bad Request\r\n\r\n", 28);
}

static void say_nothing_and_close(struct peer *p)
{
	(void)p;
}

static void refuse(struct peer *p)
{
	const struct psr_msg_error msg = { PSR_WIRE_BUSY, "64 clients are connected already" };
	struct psr_message message;

	expect(p, PSR_MSG_HELLO, &message);
	psr_msg_error_encode(&p->buf, 0, 0, &msg, NULL);
}

static void stay_silent(struct peer *p)
{
	uint8_t byte;

	while (recv(p->fd, &byte, 1, 0) > 0)
		;
}

static int connect_to(void (*script)(struct peer *), int timeout_ms, struct psr_error *err)
{
	struct psr_client *client = NULL;
	int code;

	start(script, 65536);
	code = psr_client_connect(&client, address, "test", NULL, timeout_ms, err);
	stop(client);
	return code;
}

static void what_is_no_psrd_is_told_apart(void **state)
{
	struct psr_error err;

	(void)state;
	assert_int_equal(connect_to(say_http, TIMEOUT, &err), PSR_ERR_PROTOCOL);
	assert_int_equal(connect_to(say_nothing_and_close, TIMEOUT, &err), PSR_ERR_CONNECTION);
	assert_int_equal(connect_to(refuse, TIMEOUT, &err), PSR_ERR_BUSY);
	assert_non_null(strstr(err.text, "64 clients"));
	assert_int_equal(connect_to(stay_silent, 50, &err), PSR_ERR_CONNECTION);
	assert_non_null(strstr(err.text, "50 ms"));
}

static void nobody_there_is_a_connection_error(void **state)
{
	struct psr_client *client;
	struct psr_error err;
	char nowhere[128];

	(void)state;
	snprintf(nowhere, sizeof nowhere, "unix:%s/nobody", folder);
	assert_int_equal(psr_client_connect(&client, nowhere, "test", NULL, TIMEOUT, &err), PSR_ERR_CONNECTION);
	assert_non_null(strstr(err.text, "nobody"));
	/* port 1 of this machine: tcpmux, which nobody has run for decades */
	assert_int_equal(psr_client_connect(&client, "127.0.0.1:1", "test", NULL, TIMEOUT, &err), PSR_ERR_CONNECTION);
}

static void hold_open(struct peer *p)
{
	struct psr_message message;

	welcome(p);
	expect(p, PSR_MSG_OPEN, &message);
	stay_silent(p);
}

static void answer_pings_for_a_while(struct peer *p)
{
	struct psr_msg_opened opened = {
		.handle = 1, .representations = 2, .scale = 1, .spacing = 1, .resolution = 1, .n_levels = 1,
		.up = { 0, 1, 0 }
	};
	struct psr_message message;
	struct psr_msg_ping ping;
	uint32_t id;

	welcome(p);
	id = expect(p, PSR_MSG_OPEN, &message);
	for (int i = 0; i < 3; i++) {
		if (expect(p, PSR_MSG_PING, &message) == 0)
			return;
		psr_msg_ping_decode(&ping, message.payload, message.n, NULL);
		psr_msg_pong_encode(&p->buf, &ping, NULL);
		flush(p);
	}
	psr_msg_opened_encode(&p->buf, id, &opened, NULL);
	flush(p);
	stay_silent(p);
}

static void silent_server_is_given_up_and_a_busy_one_is_not(void **state)
{
	struct psr_msg_opened opened;
	struct psr_client *client;
	struct psr_error err;

	(void)state;
	start(hold_open, 65536);
	client = connected();
	assert_int_equal(psr_client_open(client, "m", 60, &opened, &err), PSR_ERR_CONNECTION);
	assert_int_equal(psr_client_open(client, "m", 60, &opened, &err), PSR_ERR_CONNECTION);
	stop(client);
	start(answer_pings_for_a_while, 65536);
	client = connected();
	/* three PINGs at half of the time each: it lasts 1.5 times as long as a silence may */
	assert_int_equal(psr_client_open(client, "m", 1200, &opened, &err), PSR_OK);
	stop(client);
}

static uint32_t resolution[3]; /* that OPENs asked for */

static void note_resolutions(struct peer *p)
{
	struct psr_msg_error refusal = { .code = PSR_WIRE_NOT_FOUND, .text = "there is no such model" };
	struct psr_message message;
	struct psr_msg_open open;

	welcome(p);
	for (int i = 0; i < 3; i++) {
		uint32_t id = expect(p, PSR_MSG_OPEN, &message);

		if (id == 0 || psr_msg_open_decode(&open, message.payload, message.n, NULL) != PSR_OK)
			return;
		resolution[i] = open.resolution;
		psr_msg_error_encode(&p->buf, id, 0, &refusal, NULL);
		flush(p);
	}
}

static void resolutions_go_to_servers_that_take_them(void **state)
{
	static const uint32_t wanted[3] = { 0, 1920, 1000000 }, sent[3] = { 0, 1920, PSR_WIRE_MAX_SIDE };
	struct psr_msg_opened opened;
	struct psr_client *client;
	struct psr_error err;

	(void)state;
	for (int takes = 0; takes <= 1; takes++) {
		capabilities = PSR_CAP_PRESETS | PSR_CAP_FETCH | (takes ? PSR_CAP_RESOLUTION : 0);
		start(note_resolutions, 65536);
		client = connected();
		for (int i = 0; i < 3; i++) {
			if (i > 0)
				psr_client_set_resolution(client, wanted[i]);
			assert_int_equal(psr_client_open(client, "m", TIMEOUT, &opened, &err), PSR_ERR_NOT_FOUND);
		}
		stop(client);
		for (int i = 0; i < 3; i++)
			assert_int_equal(resolution[i], takes ? sent[i] : 0);
	}
	capabilities = PSR_CAP_PRESETS | PSR_CAP_FETCH;
}

static void (*between_pieces)(struct peer *);
static uint64_t hash_error;

static void serve_one_frame(struct peer *p)
{
	struct psr_message message;
	uint32_t id;

	welcome(p);
	id = expect(p, PSR_MSG_FRAME, &message);
	put_frame(p, id, hash_error, between_pieces);
	stay_silent(p);
}

static int wait_for_frame(void (*script)(struct peer *), struct psr_event *event, struct psr_error *err)
{
	struct psr_msg_frame frame = request();
	struct psr_client *client;
	uint32_t id;
	int got;

	start(script, 1000);
	client = connected();
	assert_int_equal(psr_client_frame(client, &frame, &id, err), PSR_OK);
	got = psr_client_wait(client, TIMEOUT, event, err);
	if (got < 0) { /* the error stays */
		struct psr_error again;

		assert_int_equal(psr_client_frame(client, &frame, &id, &again), err->code);
		assert_string_equal(again.text, err->text);
		assert_int_equal(psr_client_wait(client, TIMEOUT, event, &again), err->code);
	}
	stop(client);
	return got;
}

static void other_messages_may_stand_between_rectangles(struct peer *p)
{
	psr_msg_ping_encode(&p->buf, &(struct psr_msg_ping){ 5 }, NULL);
	psr_msg_pong_encode(&p->buf, &(struct psr_msg_ping){ 5 }, NULL);
}

static void another_rectangle(struct peer *p)
{
	static const uint8_t data[3];
	const struct psr_msg_rect rect = { 0, PSR_CODEC_RAW, 1, 0, 0, 1, 1, 3, 0, 3, data };

	psr_msg_rect_encode(&p->buf, 1, 0, &rect, NULL);
}

static void rectangle_of_no_request(struct peer *p)
{
	static const uint8_t data[3];
	const struct psr_msg_rect rect = { 0, PSR_CODEC_RAW, 1, 0, 0, 1, 1, 3, 0, 3, data };

	psr_msg_rect_encode(&p->buf, 77, 0, &rect, NULL);
}

static void error_of_the_future(struct peer *p)
{
	psr_msg_error_encode(&p->buf, 77, 0, &(struct psr_msg_error){ PSR_WIRE_ARG, "x" }, NULL);
}

static void unasked_opened(struct peer *p)
{
	const struct psr_msg_opened opened = {
		.handle = 1, .representations = 2, .scale = 1, .spacing = 1, .resolution = 1, .n_levels = 1,
		.up = { 0, 1, 0 }
	};

	psr_msg_opened_encode(&p->buf, 1, &opened, NULL);
}

static void second_welcome(struct peer *p)
{
	const struct psr_msg_welcome msg = { .minor = PSR_PROTO_MINOR,
		                                 .max_message = 65536,
		                                 .max_side = 1,
		                                 .max_pixels = 1,
		                                 .max_instances = 1,
		                                 .max_lights = 1,
		                                 .max_scenes = 1,
		                                 .max_open = 1,
		                                 .max_models = 1 };

	psr_msg_welcome_encode(&p->buf, &msg, NULL);
}

static void random_bytes(struct peer *p)
{
	for (int i = 0; i < 1000; i++)
		p->buf.data[p->buf.size++] = (uint8_t)(i * i * 97 >> 3);
}

static void huge_length(struct peer *p)
{
	static const uint8_t header[16] = { 255, 255, 255, 255, PSR_MSG_RECT };

	memcpy(p->buf.data + p->buf.size, header, 16);
	p->buf.size += 16;
}

/* ---- presets ---- */

/* 0: one light more than there can be; 1: END counts another number; 2: they are of no request. */
static int presets_lie;

static void serve_wrong_presets(struct peer *p)
{
	const struct psr_msg_preset light = { .kind = PSR_WIRE_PRESET_LIGHT, .light = { .kind = PSR_WIRE_LIGHT_POINT },
		                                  .name = "x" };
	struct psr_message message;
	uint32_t id;

	welcome(p);
	id = expect(p, PSR_MSG_PRESETS, &message);
	for (int i = 0; i < (presets_lie == 0 ? PSR_WIRE_MAX_PRESETS + 1 : 1); i++)
		psr_msg_preset_encode(&p->buf, presets_lie == 2 ? id + 1 : id, &light, NULL);
	psr_msg_presets_end_encode(&p->buf, id, &(struct psr_msg_presets_end){ 1, 1 }, NULL);
	flush(p);
	expect(p, PSR_MSG_GOODBYE, &message);
}

static void wrong_presets_end_the_connection(void **state)
{
	(void)state;
	for (presets_lie = 0; presets_lie < 3; presets_lie++) {
		struct psr_msg_preset *presets = NULL;
		struct psr_client *client;
		uint32_t n;

		start(serve_wrong_presets, 65536);
		client = connected();
		assert_int_equal(psr_client_presets(client, 1, &presets, &n, TIMEOUT, NULL), PSR_ERR_PROTOCOL);
		assert_null(presets);
		stop(client);
	}
}

/* Of a fetch of bytes 10 to 14: a gap, a byte that was not asked for, another id, an end too early, none at all. */
static int parts_lie;

static void serve_wrong_parts(struct peer *p)
{
	const struct psr_msg_fetch_part part = { .offset = parts_lie == 0 ? 11 : 10, .bytes = parts_lie == 1 ? 6 : 3,
		                                     .data = (const uint8_t *)"abcdef" };
	const struct psr_msg_fetch_end end = { .file_bytes = parts_lie == 4 ? 13 : 100, .file_hash = 7 };
	struct psr_message message;
	uint32_t id;

	welcome(p);
	id = expect(p, PSR_MSG_FETCH, &message);
	psr_msg_fetch_part_encode(&p->buf, parts_lie == 2 ? id + 1 : id, &part, NULL);
	psr_msg_fetch_end_encode(&p->buf, id, &end, NULL);
	flush(p);
	expect(p, PSR_MSG_GOODBYE, &message);
}

struct taken {
	char bytes[16];
	size_t n;
};

static int take_part(const uint8_t *bytes, size_t n, void *userdata, struct psr_error *err)
{
	struct taken *taken = userdata;

	assert_true(n <= sizeof taken->bytes - taken->n);
	memcpy(taken->bytes + taken->n, bytes, n);
	taken->n += n;
	return parts_lie == 5 ? psr_fail(err, PSR_ERR_IO, "no room") : PSR_OK;
}

static void wrong_parts_of_a_file_end_the_connection(void **state)
{
	(void)state;
	for (parts_lie = 0; parts_lie < 6; parts_lie++) {
		const struct psr_msg_fetch fetch = { .handle = 1, .offset = 10, .length = 5 };
		struct taken taken = { "", 0 };
		struct psr_msg_fetch_end end;
		struct psr_client *client;
		int code;

		start(serve_wrong_parts, 65536);
		client = connected();
		code = psr_client_fetch(client, &fetch, &(struct psr_fetch_user){ take_part, &taken }, &end, TIMEOUT, NULL);
		/* 4: the file ends there. */
		assert_int_equal(code, parts_lie == 4 ? PSR_OK : parts_lie == 5 ? PSR_ERR_IO : PSR_ERR_PROTOCOL);
		if (parts_lie == 4)
			assert_true(end.file_bytes == 13 && end.file_hash == 7);
		assert_int_equal(taken.n, parts_lie >= 3 ? 3 : 0);
		assert_memory_equal(taken.bytes, "abc", taken.n);
		stop(client);
	}
}

static void violations_end_the_connection(void **state)
{
	static void (*const scripts[])(struct peer *) = {
		another_rectangle, rectangle_of_no_request, error_of_the_future, unasked_opened, second_welcome, random_bytes,
		huge_length,
	};
	struct psr_event event;
	struct psr_error err;

	(void)state;
	hash_error = 0;
	between_pieces = other_messages_may_stand_between_rectangles;
	assert_int_equal(wait_for_frame(serve_one_frame, &event, &err), 1);
	for (size_t i = 0; i < sizeof scripts / sizeof scripts[0]; i++) {
		between_pieces = scripts[i];
		if (wait_for_frame(serve_one_frame, &event, &err) != PSR_ERR_PROTOCOL)
			fail_msg("violation %zu was taken", i);
	}
	between_pieces = NULL;
}

static void wrong_hash_fails_the_frame_only(void **state)
{
	struct psr_event event;
	struct psr_error err;

	(void)state;
	hash_error = 1;
	assert_int_equal(wait_for_frame(serve_one_frame, &event, &err), 1);
	assert_int_equal(event.type, PSR_EVENT_FAILED);
	assert_int_equal(event.error.code, PSR_ERR_FORMAT);
	hash_error = 0;
}

static size_t cut;

static void close_in_the_middle(struct peer *p)
{
	struct psr_message message;
	uint32_t id;
	int real = p->fd;
	size_t n;

	welcome(p);
	id = expect(p, PSR_MSG_FRAME, &message);
	p->fd = -1; /* into the buffer only */
	p->most = 0;
	p->buf.size = 0;
	put_frame(p, id, 0, NULL);
	p->fd = real;
	n = cut;
	p->most = 65536;
	put(p, p->buf.data, n);
}

static void closing_at_any_byte_is_an_error_and_no_hang(void **state)
{
	struct psr_event event;
	struct psr_error err;

	(void)state;
	for (cut = 0; cut < 2000; cut += cut < 200 ? 1 : 97)
		assert_int_equal(wait_for_frame(close_in_the_middle, &event, &err), PSR_ERR_CONNECTION);
}

static void send_rectangles_for_ever(struct peer *p)
{
	struct psr_msg_frame asked = request();
	struct psr_msg_frame_begin begin = {
		.width = SIDE, .height = SIDE, .planes = 1, .settings = { .scale = 1, .spacing_px = 1 }, .camera = asked.camera
	};
	static const uint8_t data[3];
	const struct psr_msg_rect rect = { 0, PSR_CODEC_RAW, 1, 0, 0, 1, 1, 3, 0, 3, data };
	struct psr_message message;
	uint32_t id;

	welcome(p);
	id = expect(p, PSR_MSG_FRAME, &message);
	psr_msg_frame_begin_encode(&p->buf, id, 0, &begin, NULL);
	flush(p);
	while (p->buf.size < 60000)
		psr_msg_rect_encode(&p->buf, id, 0, &rect, NULL);
	while (send(p->fd, p->buf.data, p->buf.size, MSG_NOSIGNAL) == (ssize_t)p->buf.size)
		;
	p->buf.size = 0;
}

static void endless_frame_ends_by_the_timeout(void **state)
{
	struct psr_msg_frame frame = request();
	struct psr_client *client;
	struct psr_event event;
	struct psr_error err;
	uint32_t id;

	(void)state;
	start(send_rectangles_for_ever, 65536);
	client = connected();
	assert_int_equal(psr_client_frame(client, &frame, &id, &err), PSR_OK);
	assert_int_equal(psr_client_wait(client, 100, &event, &err), 0);
	stop(client);
}

static void say_goodbye(struct peer *p)
{
	const struct psr_msg_goodbye msg = { PSR_GOODBYE_SHUTDOWN, "see you" };
	struct psr_message message;

	welcome(p);
	expect(p, PSR_MSG_FRAME, &message);
	psr_msg_goodbye_encode(&p->buf, &msg, NULL);
}

static void goodbye_says_why(void **state)
{
	struct psr_event event;
	struct psr_error err;

	(void)state;
	assert_int_equal(wait_for_frame(say_goodbye, &event, &err), PSR_ERR_CONNECTION);
	assert_non_null(strstr(err.text, "shuts down"));
	assert_non_null(strstr(err.text, "see you"));
}

static void list_without_end(struct peer *p)
{
	struct psr_msg_list_entry entry = { PSR_ENTRY_READY, 1, { 0 }, "m" };
	struct psr_message message;
	uint32_t id;

	welcome(p);
	id = expect(p, PSR_MSG_LIST, &message);
	for (int i = 0; i < PSR_CLIENT_MAX_ENTRIES + 1; i++) {
		snprintf(entry.name, sizeof entry.name, "m%06d", i);
		psr_msg_list_entry_encode(&p->buf, id, &entry, NULL);
		if (p->buf.size > 60000)
			flush(p);
	}
	flush(p);
	stay_silent(p);
}

static void miscount_list(struct peer *p)
{
	struct psr_message message;
	uint32_t id;

	welcome(p);
	id = expect(p, PSR_MSG_LIST, &message);
	psr_msg_list_end_encode(&p->buf, id, &(struct psr_msg_list_end){ 3 }, NULL);
}

static void lists_are_bounded_and_counted(void **state)
{
	struct psr_msg_list_entry *entries;
	struct psr_client *client;
	struct psr_error err;
	uint32_t n;

	(void)state;
	start(list_without_end, 65536);
	client = connected();
	assert_int_equal(psr_client_list(client, &entries, &n, TIMEOUT, &err), PSR_ERR_LIMIT);
	stop(client);
	start(miscount_list, 65536);
	client = connected();
	assert_int_equal(psr_client_list(client, &entries, &n, TIMEOUT, &err), PSR_ERR_PROTOCOL);
	stop(client);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(session_works_for_any_split_of_the_bytes),
		cmocka_unit_test(frames_come_in_any_order_and_one_may_fail),
		cmocka_unit_test(no_more_requests_are_open_than_the_server_takes),
		cmocka_unit_test(what_the_server_does_not_offer_is_refused_here),
		cmocka_unit_test(resolutions_go_to_servers_that_take_them),
		cmocka_unit_test(what_is_no_psrd_is_told_apart),
		cmocka_unit_test(nobody_there_is_a_connection_error),
		cmocka_unit_test(silent_server_is_given_up_and_a_busy_one_is_not),
		cmocka_unit_test(wrong_presets_end_the_connection),
		cmocka_unit_test(wrong_parts_of_a_file_end_the_connection),
		cmocka_unit_test(violations_end_the_connection),
		cmocka_unit_test(wrong_hash_fails_the_frame_only),
		cmocka_unit_test(closing_at_any_byte_is_an_error_and_no_hang),
		cmocka_unit_test(endless_frame_ends_by_the_timeout),
		cmocka_unit_test(goodbye_says_why),
		cmocka_unit_test(lists_are_bounded_and_counted),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}

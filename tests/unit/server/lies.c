/* Each message of a client behind a good HELLO, cut at every length, and with a lie at every place: psrd ends the
 * connection as the client does, says only messages before, and serves the next one. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "fixture.h"

static char folder[PATH_MAX];
static struct daemon psrd;
static struct peer p;
static unsigned n_connections;

static int set_up(void **state)
{
	static const char *const more[] = { "--max-pixels", "20000", NULL };

	(void)state;
	folder_make(folder);
	plate_write(folder, "plate.psr", 0x2040c0);
	daemon_start(&psrd, folder, more);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	print_message("# %u connections\n", n_connections);
	daemon_stop(&psrd);
	folder_remove(folder);
	return 0;
}

/* ---- messages ---- */

enum { HELLO, PING, PONG, GOODBYE, LIST, OPEN, CLOSE, PRESETS, SCENE, FRAME, ACK, CANCEL, PAUSE, RESUME, STATS, N_KINDS };

static void encode_scene(struct psr_buf *out, uint32_t id)
{
	struct psr_msg_scene *scene = malloc(sizeof *scene);

	assert_non_null(scene);
	scene_default(scene, 1);
	scene->n_lights = 1;
	scene->light[0] = (struct psr_msg_light){ .kind = PSR_WIRE_LIGHT_POINT, .color = { 255, 255, 255 }, .intensity = 1,
		                                      .position = { 0, 0, 2 }, .reference = 1 };
	psr_msg_scene_encode(out, id, scene, NULL);
	free(scene);
}

static void encode_hello(struct psr_buf *out)
{
	const struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .client = "test",
		                                 .token = "abc" };

	psr_msg_hello_encode(out, &hello, NULL);
}

static void encode(struct psr_buf *out, int kind, uint32_t id)
{
	const struct psr_msg_open open = { .name = "plate" };
	const struct psr_msg_goodbye goodbye = { .text = "done" };
	struct psr_msg_frame frame = frame_default(32, 32);

	frame.base = 1;
	switch (kind) {
	case HELLO: encode_hello(out); break;
	case PING: psr_msg_ping_encode(out, &(struct psr_msg_ping){ 7 }, NULL); break;
	case PONG: psr_msg_pong_encode(out, &(struct psr_msg_ping){ 7 }, NULL); break;
	case GOODBYE: psr_msg_goodbye_encode(out, &goodbye, NULL); break;
	case LIST: psr_msg_list_encode(out, id, NULL); break;
	case OPEN: psr_msg_open_encode(out, id, &open, NULL); break;
	case CLOSE: psr_msg_close_encode(out, id, &(struct psr_msg_close){ 1 }, NULL); break;
	case PRESETS: psr_msg_presets_encode(out, id, &(struct psr_msg_presets){ 1 }, NULL); break;
	case SCENE: encode_scene(out, id); break;
	case FRAME: psr_msg_frame_encode(out, id, 1, &frame, NULL); break;
	case ACK: psr_msg_ack_encode(out, id, 1, &(struct psr_msg_ack){ 0 }, NULL); break;
	case CANCEL: psr_msg_cancel_encode(out, id, 1, NULL); break;
	case PAUSE: psr_msg_pause_encode(out, id, 1, NULL); break;
	case RESUME: psr_msg_resume_encode(out, id, 1, NULL); break;
	case STATS: psr_msg_stats_encode(out, id, NULL); break;
	}
	assert_true(out->size >= PSR_HEADER_SIZE);
}

/* ---- connections ---- */

/* HELLO, a model, a scene and a frame, not waiting for any; then these bytes, and the end. */
static void send_and_end(int kind, const uint8_t *bytes, size_t n)
{
	const struct psr_msg_open open = { .name = "plate" };
	struct psr_msg_frame frame = frame_default(32, 32);
	struct psr_message message;
	uint8_t head[4096];
	struct psr_buf out = { head, 0, sizeof head };

	n_connections++;
	peer_connect(&p, &psrd);
	if (kind != HELLO || n_connections % 2) { /* a second HELLO, and a first one */
		encode_hello(&out);
		psr_msg_open_encode(&out, 1, &open, NULL);
		encode_scene(&out, 2);
		psr_msg_frame_encode(&out, 3, 1, &frame, NULL);
	}
	if (send(p.fd, head, out.size, MSG_NOSIGNAL) == (ssize_t)out.size && n > 0) /* it may refuse before all is sent */
		(void)!send(p.fd, bytes, n, MSG_NOSIGNAL);
	shutdown(p.fd, SHUT_WR);
	while (peer_next(&p, &message)) /* fails if it is silent and keeps the connection */
		;
	peer_close(&p);
}

static void messages_are_cut_at_every_length(void **state)
{
	uint8_t bytes[1024];

	(void)state;
	for (int kind = 0; kind < N_KINDS; kind++) {
		struct psr_buf out = { bytes, 0, sizeof bytes };

		encode(&out, kind, 4);
		for (size_t n = 0; n <= out.size; n++)
			send_and_end(kind, bytes, n);
		expect_serves(&psrd, "plate");
	}
}

static void put_lie(uint8_t *bytes, size_t at, size_t size, uint64_t lie)
{
	for (size_t i = 0; i < size; i++)
		bytes[at + i] = (uint8_t)(lie >> 8 * i);
}

/* The length of each message, behind which stands another one. */
static void lengths_of_messages_are_lies(void **state)
{
	static const uint32_t lie[] = { 0, 1, 15, 16, 17, 20, 100, 1024, 1025, 65535, 65536, 65537, 0x7fffffff, 0xffffffff };
	uint8_t bytes[1024];

	(void)state;
	for (int kind = 0; kind < N_KINDS; kind++) {
		for (size_t i = 0; i < sizeof lie / sizeof lie[0]; i++) {
			struct psr_buf out = { bytes, 0, sizeof bytes };

			encode(&out, kind, 4);
			put_lie(bytes, 0, 4, lie[i]);
			encode(&out, STATS, 5);
			send_and_end(kind, bytes, out.size);
		}
		expect_serves(&psrd, "plate");
	}
}

/* Every two bytes behind the length, those of strings and of arrays among them. */
static void everything_else_is_a_lie(void **state)
{
	static const uint32_t lie[] = { 0, 1, 0x7fff, 0xffff };
	uint8_t bytes[1024];

	(void)state;
	for (int kind = 0; kind < N_KINDS; kind++) {
		struct psr_buf sound = { bytes, 0, sizeof bytes };
		size_t size;

		encode(&sound, kind, 4);
		size = sound.size;
		for (size_t at = 4; at + 2 <= size; at += 2) {
			for (size_t i = 0; i < sizeof lie / sizeof lie[0]; i++) {
				struct psr_buf out = { bytes, 0, sizeof bytes };

				encode(&out, kind, 4);
				put_lie(bytes, at, 2, lie[i]);
				encode(&out, STATS, 5);
				send_and_end(kind, bytes, out.size);
			}
		}
		expect_serves(&psrd, "plate");
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(messages_are_cut_at_every_length),
		cmocka_unit_test(lengths_of_messages_are_lies),
		cmocka_unit_test(everything_else_is_a_lie),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}

/* Clients that break rules, stop reading or go without a word. Nothing is expected of psrd but that others do not
 * notice: whatever it answers is read and thrown away, or not read at all. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <netinet/in.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>
#include "proto/proto.h"
#include "soak.h"

struct rude {
	uint64_t *random;
	int fd;
	uint32_t id;
	struct psr_buf out;
	uint8_t bytes[PSR_WIRE_MAX_MESSAGE];
};

static unsigned below(struct rude *r, unsigned n)
{
	return random_below(r->random, n);
}

/* ---- bytes ---- */

static int open_socket(void)
{
	const struct timeval patience = { .tv_usec = 300000 };
	struct sockaddr_in in = { .sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK),
		                      .sin_port = htons((uint16_t)atoi(strrchr(soak.address, ':') + 1)) };
	int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);

	setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
	setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
	if (connect(fd, (struct sockaddr *)&in, sizeof in) == 0)
		return fd;
	close(fd);
	return -1;
}

static int put(struct rude *r, const void *bytes, size_t n)
{
	return send(r->fd, bytes, n, MSG_NOSIGNAL) == (ssize_t)n;
}

/* What was encoded; 0: psrd takes nothing any more. */
static int flush(struct rude *r)
{
	const int is_sent = put(r, r->out.data, r->out.size);

	r->out.size = 0;
	return is_sent;
}

static void read_some(struct rude *r, size_t most)
{
	uint8_t bytes[4096];
	ssize_t n = 1;

	while (most > 0 && n > 0) {
		n = recv(r->fd, bytes, most < sizeof bytes ? most : sizeof bytes, 0);
		most -= n > 0 ? (size_t)n : 0;
	}
}

static void reset(struct rude *r)
{
	static const struct linger now = { .l_onoff = 1 };

	setsockopt(r->fd, SOL_SOCKET, SO_LINGER, &now, sizeof now);
}

/* ---- messages ---- */

static int introduce(struct rude *r)
{
	const struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .client = "rude" };
	struct psr_msg_open open = { .resolution = 0 };
	struct psr_msg_scene *scene = calloc(1, sizeof *scene);
	int is_sent;

	if (scene == NULL)
		return 0;
	strcpy(open.name, soak_model[below(r, SOAK_MODELS)]);
	scene->ambient = 1;
	scene->n_instances = 1;
	scene->instance[0] = (struct psr_msg_instance){ .handle = 1, .rotation = { 0, 0, 0, 1 }, .scale = 1 };
	psr_msg_hello_encode(&r->out, &hello, NULL);
	psr_msg_open_encode(&r->out, ++r->id, &open, NULL);
	is_sent = flush(r);
	read_some(r, 100 + below(r, 300)); /* WELCOME, and perhaps OPENED, before which there is no scene */
	soak_sleep_ms(below(r, 20));
	psr_msg_scene_encode(&r->out, ++r->id, scene, NULL);
	free(scene);
	return is_sent && flush(r);
}

static void ask(struct rude *r, uint16_t view, unsigned side)
{
	struct psr_msg_frame frame = { .width = side, .height = side, .planes = 1u << PSR_PLANE_COLOR,
		.pass_limit = below(r, 4) == 0 ? 4 : 0,
		.camera = { .kind = PSR_CAMERA_PERSPECTIVE, .eye = { 0, 0, 4 }, .up = { 0, 1, 0 }, .fov_y = 0.6, .near_z = 0.01 } };

	if (view > 0 && below(r, 2))
		frame.base = r->id;
	psr_msg_frame_encode(&r->out, ++r->id, view, &frame, NULL);
}

static void send_nonsense(struct rude *r)
{
	uint8_t bytes[600];

	for (size_t i = 0; i < sizeof bytes; i++)
		bytes[i] = (uint8_t)random_next(r->random);
	if (below(r, 2)) { /* a header that may pass */
		memset(bytes, 0, 16);
		bytes[0] = (uint8_t)(16 + below(r, 200));
		bytes[4] = (uint8_t)below(r, 52);
		bytes[9] = 1;
		bytes[12] = (uint8_t)below(r, 3);
	}
	put(r, bytes, sizeof bytes);
}

static void go_in_the_middle(struct rude *r)
{
	ask(r, (uint16_t)below(r, 4), 200 + below(r, 400));
	flush(r);
	read_some(r, below(r, 60000));
	if (below(r, 2))
		reset(r);
}

static void stop_in_a_message(struct rude *r)
{
	ask(r, 0, 64);
	r->out.size = 1 + below(r, (unsigned)r->out.size - 1);
	flush(r);
	soak_sleep_ms(below(r, 1500));
}

static void cancel_at_random(struct rude *r)
{
	const uint32_t first = r->id + 1;

	for (int i = 0; i < 64; i++) {
		ask(r, (uint16_t)(below(r, 2) ? 0 : below(r, 16)), 32 + below(r, 200));
		if (below(r, 2))
			psr_msg_cancel_encode(&r->out, first + below(r, 70), (uint16_t)(below(r, 6) ? 0 : below(r, 3)), NULL);
		if (r->out.size > sizeof r->bytes / 2 || below(r, 8) == 0)
			flush(r);
	}
	flush(r);
	read_some(r, below(r, 200000));
}

static void ping_without_end(struct rude *r)
{
	const struct psr_msg_ping ping = { .token = 1 };

	for (int i = 0; i < 1000; i++)
		psr_msg_ping_encode(&r->out, &ping, NULL);
	for (int i = 0; i < 200 && put(r, r->out.data, r->out.size); i++)
		;
}

static void pause_for_ever(struct rude *r)
{
	for (uint16_t view = 0; view < 16; view++) {
		ask(r, view, 128);
		psr_msg_pause_encode(&r->out, ++r->id, view, NULL);
		ask(r, view, 128);
		flush(r);
	}
	soak_sleep_ms(below(r, 1500));
}

static void read_nothing(struct rude *r)
{
	for (int i = 0; i < 64; i++)
		ask(r, (uint16_t)(i % 2 * (i % 16)), 700);
	flush(r);
	soak_sleep_ms(below(r, 4000));
}

static void acknowledge_at_random(struct rude *r)
{
	for (int i = 0; i < 200; i++) {
		const struct psr_msg_ack ack = { .pass = (uint16_t)below(r, 3) };

		if (i % 4 == 0)
			ask(r, (uint16_t)(1 + below(r, 3)), 100);
		psr_msg_ack_encode(&r->out, r->id - below(r, 3) % r->id, (uint16_t)(1 + below(r, 3)), &ack, NULL);
		if (!flush(r))
			return;
	}
	read_some(r, 100000);
}

/* Sound messages, but for a byte or two. */
static void spoil_a_byte(struct rude *r)
{
	for (int i = 0; i < 20; i++) {
		ask(r, (uint16_t)below(r, 3), 64);
		psr_msg_list_encode(&r->out, ++r->id, NULL);
		psr_msg_stats_encode(&r->out, ++r->id, NULL);
		if (i > 3)
			r->out.data[below(r, (unsigned)r->out.size)] ^= (uint8_t)(1u << below(r, 8));
		if (!flush(r))
			return;
	}
	read_some(r, 50000);
}

static void say_nothing(struct rude *r)
{
	soak_sleep_ms(below(r, 1500));
	if (below(r, 2))
		put(r, "GET / HTTP/1.0\r\n\r\n", 18);
}

void rude_client(struct client *client)
{
	static void (*const way[])(struct rude *r) = { say_nothing, send_nonsense, go_in_the_middle, stop_in_a_message,
		cancel_at_random, ping_without_end, pause_for_ever, read_nothing, acknowledge_at_random, spoil_a_byte };
	struct rude *r = malloc(sizeof *r);

	while (r != NULL && !soak.is_over) {
		const unsigned which = random_below(&client->random, sizeof way / sizeof way[0]);

		*r = (struct rude){ .random = &client->random, .fd = open_socket() };
		r->out = (struct psr_buf){ .data = r->bytes, .capacity = sizeof r->bytes };
		client->n_runs++;
		if (r->fd < 0)
			continue;
		if (which == 0 || introduce(r))
			way[which](r);
		if (random_below(&client->random, 4) == 0)
			reset(r);
		close(r->fd);
	}
	free(r);
}

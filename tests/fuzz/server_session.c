/* The server's side of whole connections: a psrd within this process, with its loop, sessions, frames and threads. The
 * input is what one or two clients do, a byte an act with arguments behind it: sound messages in any order, cut ones,
 * ones with changed bytes or lengths, plain bytes, reading and not reading, acknowledgements, ends.
 *
 * Properties, whatever it is: what comes are messages; no id has two terminals, and nothing follows one, nor what ends
 * the connection; frames come whole. A client that kept to the protocol gets a terminal for each id, has two
 * unacknowledged frames of a view at most, and is not dropped. Nothing of those that have gone is left. */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include "base/clock.h"
#include "proto/proto.h"
#include "server/server.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

#define REQUIRE(x) ((x) ? (void)0 : (fprintf(stderr, "server_session: line %d: not %s\n", __LINE__, #x), abort()))
#define PATIENCE_MS 8000
#define N_IDS 256
#define N_VIEWS 16
#define MOST_ACTS 200

enum act { HELLO, OPEN, SCENE, FRAME, ACK, CANCEL, PAUSE, RESUME, LIST, PRESETS, STATS, CLOSE, PING, GOODBYE, READ,
	       WAIT, HALF_CLOSE, END, RESET, BYTES, CUT, CHANGE, LENGTH, OTHER, FETCH, N_ACTS };
enum spoil { SOUND, SPOIL_CUT, SPOIL_CHANGE, SPOIL_LENGTH };

struct id {
	uint8_t type;     /* of our request; 0: none */
	uint8_t is_ended, has_begun, is_final_wanted;
	uint16_t view, pass;
	uint64_t next;    /* byte of a file that a FETCH waits for */
};

struct peer {
	int fd;           /* -1: not connected */
	int is_unsound;   /* broke a rule: it may be dropped */
	int is_leaving;   /* said GOODBYE, or closed its half: open ids end without a word */
	int has_ended;    /* the server's last message came, or its end */
	enum spoil spoil; /* of the next message */
	uint32_t last, handle;
	struct id id[N_IDS];
	uint32_t unacknowledged[N_VIEWS][2]; /* id << 8 | pass, of frames whose end has come; */
	unsigned n_unacknowledged[N_VIEWS];  /* and of all that have begun */
	unsigned n_ended[N_VIEWS];
	struct psr_framer framer;
	uint8_t storage[2 * PSR_WIRE_MAX_MESSAGE];
};

struct input {
	const uint8_t *data;
	size_t n;
};

static struct server *server;
static struct sockaddr_un place = { .sun_family = AF_UNIX };

static unsigned next_byte(struct input *in)
{
	if (in->n == 0)
		return 0;
	in->n--;
	return *in->data++;
}

/* ---- the server ---- */

static void *serve(void *userdata)
{
	static struct options options;
	static char listen[160];
	char *argv[] = { "psrd", "--models", "tests/golden", "--listen", listen, "--threads", "2", "--max-memory", "24000000",
		"--max-queue", "200000", "--max-open", "8", "--max-handles", "3", "--max-pixels", "20000", NULL };
	struct psr_error err;
	int is_ready = *(int *)userdata;

	snprintf(listen, sizeof listen, "unix:%s", place.sun_path);
	REQUIRE(options_parse(&options, sizeof argv / sizeof argv[0] - 1, argv, &err) == PSR_OK);
	if (server_start(&server, &options, &err) != PSR_OK) {
		fprintf(stderr, "server_session: %s\n", err.text);
		exit(2);
	}
	REQUIRE(write(is_ready, "", 1) == 1);
	server_run(server, &err);
	return NULL;
}

static void remove_place(void)
{
	unlink(place.sun_path);
}

static void start_server(void)
{
	const char *folder = getenv("TMPDIR");
	pthread_t thread;
	int ready[2];
	char byte;

	snprintf(place.sun_path, sizeof place.sun_path, "%.80s/psr-fuzz-%d", folder != NULL ? folder : "/tmp", (int)getpid());
	REQUIRE(pipe(ready) == 0 && pthread_create(&thread, NULL, serve, &ready[1]) == 0 && read(ready[0], &byte, 1) == 1);
	pthread_detach(thread);
	atexit(remove_place);
}

/* ---- what comes ---- */

static void end_id(struct peer *p, struct id *id)
{
	REQUIRE(!id->is_ended);
	id->is_ended = 1;
	if (id->has_begun && id->view < N_VIEWS)
		p->n_unacknowledged[id->view]--;
	id->has_begun = 0;
}

static void take_frame_begin(struct peer *p, struct id *id, const struct psr_message *message)
{
	struct psr_msg_frame_begin begin;

	REQUIRE(psr_msg_frame_begin_decode(&begin, message->payload, message->n, NULL) == PSR_OK);
	REQUIRE(!id->has_begun && begin.pass == id->pass);
	id->has_begun = 1;
	id->view = message->view;
	if (message->view > 0)
		REQUIRE(++p->n_unacknowledged[message->view] <= 2 || p->is_unsound);
	else
		p->n_unacknowledged[0]++;
}

static void take_frame_end(struct peer *p, struct id *id, const struct psr_message *message)
{
	struct psr_msg_frame_end end;

	REQUIRE(psr_msg_frame_end_decode(&end, message->payload, message->n, NULL) == PSR_OK);
	REQUIRE(id->has_begun && end.pass == id->pass);
	id->pass++;
	id->has_begun = 0;
	if (message->view == 0)
		p->n_unacknowledged[0]--;
	else if (p->n_ended[message->view] < 2)
		p->unacknowledged[message->view][p->n_ended[message->view]++] = message->id << 8 | end.pass;
	else
		REQUIRE(p->is_unsound);
	if (end.is_final)
		end_id(p, id);
}

static void take_last(struct peer *p, const struct psr_message *message)
{
	p->has_ended = 1;
	if (message->type == PSR_MSG_ERROR)
		REQUIRE(p->is_unsound || p->last == 0);
}

static void take(struct peer *p, const struct psr_message *message)
{
	struct id *id = &p->id[message->id % N_IDS];
	struct psr_msg_rect rect;
	struct psr_msg_error error;
	struct psr_msg_opened opened;
	struct psr_msg_fetch_part part;

	REQUIRE(!p->has_ended);
	if (message->type == PSR_MSG_GOODBYE || (message->type == PSR_MSG_ERROR && message->id == 0)) {
		take_last(p, message);
		return;
	}
	if (message->id == 0)
		return;
	if (message->id >= N_IDS) { /* of plain bytes */
		REQUIRE(p->is_unsound);
		return;
	}
	REQUIRE(!id->is_ended && (id->type != 0 || p->is_unsound));
	switch (message->type) {
	case PSR_MSG_FRAME_BEGIN:
		take_frame_begin(p, id, message);
		break;
	case PSR_MSG_RECT:
		REQUIRE(id->has_begun && psr_msg_rect_decode(&rect, message->payload, message->n, NULL) == PSR_OK);
		break;
	case PSR_MSG_FRAME_END:
		take_frame_end(p, id, message);
		break;
	case PSR_MSG_OPENED:
		REQUIRE(psr_msg_opened_decode(&opened, message->payload, message->n, NULL) == PSR_OK);
		p->handle = opened.handle;
		end_id(p, id);
		break;
	case PSR_MSG_ERROR:
		REQUIRE(psr_msg_error_decode(&error, message->payload, message->n, NULL) == PSR_OK);
		end_id(p, id);
		break;
	case PSR_MSG_FETCH_PART:
		REQUIRE(psr_msg_fetch_part_decode(&part, message->payload, message->n, NULL) == PSR_OK);
		REQUIRE(p->is_unsound || (id->type == PSR_MSG_FETCH && part.offset == id->next));
		id->next = part.offset + part.bytes;
		break;
	case PSR_MSG_FETCH_END:
	case PSR_MSG_LIST_END:
	case PSR_MSG_PRESETS_END:
	case PSR_MSG_STATS_REPLY:
	case PSR_MSG_SUPERSEDED:
	case PSR_MSG_CANCELLED:
		end_id(p, id);
	}
}

static void close_peer(struct peer *p)
{
	if (p->fd >= 0)
		close(p->fd);
	p->fd = -1;
}

/* Reads for so long at most, or what is there. 0: nothing came. */
static int receive(struct peer *p, int ms)
{
	struct pollfd waits = { .fd = p->fd, .events = POLLIN };
	struct psr_message message;
	size_t room;
	uint8_t *space;
	ssize_t n;
	int code;

	if (p->fd < 0 || poll(&waits, 1, ms) <= 0)
		return 0;
	space = psr_framer_space(&p->framer, &room);
	n = recv(p->fd, space, room, MSG_DONTWAIT);
	if (n <= 0) {
		REQUIRE(p->has_ended || p->is_unsound || p->is_leaving || p->last == 0);
		close_peer(p);
		return 0;
	}
	psr_framer_filled(&p->framer, (size_t)n);
	while ((code = psr_framer_next(&p->framer, &message, NULL)) > 0)
		take(p, &message);
	REQUIRE(code == 0);
	return 1;
}

/* ---- what is sent ---- */

static void put(struct peer *p, const uint8_t *bytes, size_t n)
{
	const uint64_t end_ns = clock_ns() + PATIENCE_MS * UINT64_C(1000000);

	while (n > 0 && p->fd >= 0) {
		const ssize_t sent = send(p->fd, bytes, n, MSG_DONTWAIT | MSG_NOSIGNAL);

		if (sent > 0) {
			bytes += sent;
			n -= (size_t)sent;
		} else if (sent < 0 && errno != EAGAIN) {
			while (receive(p, 0)) /* what it said before it closed */
				;
			close_peer(p);
		} else {
			receive(p, 10); /* a server that holds much for us reads nothing */
			REQUIRE(clock_ns() < end_ns);
		}
	}
}

static void send_spoilt(struct peer *p, struct psr_buf *out, struct input *in)
{
	size_t n = out->size;

	switch (p->spoil) {
	case SOUND:
		break;
	case SPOIL_CUT:
		n = n * next_byte(in) / 256;
		break;
	case SPOIL_CHANGE:
		out->data[(next_byte(in) | next_byte(in) << 8) % n] = (uint8_t)next_byte(in);
		break;
	case SPOIL_LENGTH:
		out->data[0] = (uint8_t)next_byte(in);
		out->data[1] = (uint8_t)next_byte(in);
	}
	p->is_unsound |= p->spoil != SOUND;
	p->spoil = SOUND;
	put(p, out->data, n);
}

static struct psr_msg_frame make_frame(const struct peer *p, struct input *in)
{
	const unsigned kind = next_byte(in), size = next_byte(in);
	struct psr_msg_frame frame = { .slot = (uint16_t)(kind & 1), .width = 1 + size % 160, .height = 1 + size / 2,
		.planes = 1, .color_codec = kind & 2 ? PSR_CODEC_ZSTD : PSR_CODEC_RAW, .pass_limit = kind >> 6 == 3 ? 1 : 0,
		.camera = { .eye = { 0, 0, 6 }, .up = { 0, 1, 0 }, .fov_y = 0.8, .near_z = 0.1,
		            .kind = PSR_CAMERA_PERSPECTIVE } };

	frame.camera.eye[0] = kind & 4;
	if (kind & 8) {
		frame.color_codec = PSR_CODEC_JPEG;
		frame.color_quality = 50;
		frame.flags = PSR_WIRE_FRAME_NO_HASHES;
	}
	if (kind & 16) {
		frame.planes |= 2;
		frame.depth_format = PSR_WIRE_DEPTH_U16_HALF;
		frame.depth_min = 1;
		frame.depth_max = 9;
		frame.pass_limit = 0;
	}
	if (kind & 32)
		frame.base = p->last;
	return frame;
}

static void encode_frame(struct peer *p, struct psr_buf *out, struct input *in)
{
	struct psr_msg_frame frame = make_frame(p, in);
	const uint16_t view = (uint16_t)(next_byte(in) % 18); /* 16 and 17 are refused */

	if (view == 0)
		frame.base = 0;
	else if (frame.base != 0)
		frame.flags |= PSR_WIRE_FRAME_SHARP;
	p->id[++p->last] = (struct id){ .type = PSR_MSG_FRAME, .view = view };
	psr_msg_frame_encode(out, p->last, view, &frame, NULL);
}

static void encode_scene(struct peer *p, struct psr_buf *out, struct input *in)
{
	static struct psr_msg_scene scene;
	const unsigned kind = next_byte(in);

	memset(&scene, 0, sizeof scene);
	scene.slot = kind & 1;
	scene.ambient = 1;
	scene.n_instances = (uint16_t)(kind >> 1 & 3);
	for (unsigned i = 0; i < scene.n_instances; i++)
		scene.instance[i] = (struct psr_msg_instance){ .handle = kind & 32 ? 1 + i : p->handle != 0 ? p->handle : 1,
			.rotation = { 0, 0, 0, 1 }, .scale = 1, .translation = { i, 0, 0 } };
	scene.n_lights = kind >> 6 & 1;
	scene.light[0] = (struct psr_msg_light){ .kind = PSR_WIRE_LIGHT_DIRECTIONAL, .flags = kind >> 7 & 1,
		.color = { 255, 255, 255 }, .intensity = 1, .direction = { 0, -1, -1 } };
	p->id[++p->last].type = PSR_MSG_SCENE;
	psr_msg_scene_encode(out, p->last, &scene, NULL);
}

/* The oldest frame of a view whose end has come. */
static void encode_ack(struct peer *p, struct psr_buf *out, unsigned view)
{
	struct psr_msg_ack ack;
	uint32_t frame;

	if (view == 0 || p->n_ended[view] == 0)
		return;
	frame = p->unacknowledged[view][0];
	p->unacknowledged[view][0] = p->unacknowledged[view][1];
	p->n_ended[view]--;
	p->n_unacknowledged[view]--;
	ack.pass = frame & 0xff;
	psr_msg_ack_encode(out, frame >> 8, (uint16_t)view, &ack, NULL);
}

static void encode_open(struct peer *p, struct psr_buf *out, unsigned which)
{
	static const char *const name[] = { "teapot", "dice", "wheel", "nothing" };
	struct psr_msg_open open = { .resolution = 0 };

	strcpy(open.name, name[which % 4]);
	p->id[++p->last].type = PSR_MSG_OPEN;
	psr_msg_open_encode(out, p->last, &open, NULL);
}

static void encode_fetch(struct peer *p, struct psr_buf *out, unsigned which)
{
	struct psr_msg_fetch fetch = { .handle = which & 64 ? which & 3 : p->handle,
		                                 .offset = (uint64_t)(which >> 2 & 7) * 30000,
		                                 .length = which & 32 ? 70000 : 0, .file_hash = which & 128 ? which : 0 };

	strcpy(fetch.name, fetch.handle != 0 ? "" : which & 1 ? "wheel" : "dice");
	p->id[++p->last] = (struct id){ .type = PSR_MSG_FETCH, .next = fetch.offset };
	psr_msg_fetch_encode(out, p->last, &fetch, NULL);
}

/* The message of an act; none for acts without one. */
static void encode(struct peer *p, struct psr_buf *out, enum act act, struct input *in)
{
	const struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .client = "fuzz" };
	const unsigned k = act <= PING && act != FRAME && act != SCENE ? next_byte(in) : 0, view = k % N_VIEWS;
	const uint32_t target = p->last > k / N_VIEWS ? p->last - k / N_VIEWS : 1;

	switch (act) {
	case HELLO:
		p->is_unsound |= p->last > 0;
		psr_msg_hello_encode(out, &hello, NULL);
		p->last += p->last == 0;
		break;
	case OPEN:
		encode_open(p, out, k);
		break;
	case SCENE:
		encode_scene(p, out, in);
		break;
	case FRAME:
		encode_frame(p, out, in);
		break;
	case ACK:
		encode_ack(p, out, view);
		break;
	case CANCEL: /* with the view of its id, if there is one */
		psr_msg_cancel_encode(out, target, p->id[target].view, NULL);
		break;
	case PAUSE:
	case RESUME:
		p->id[++p->last].type = PSR_MSG_PAUSE;
		(act == PAUSE ? psr_msg_pause_encode : psr_msg_resume_encode)(out, p->last, (uint16_t)view, NULL);
		break;
	case LIST:
		p->id[++p->last].type = PSR_MSG_LIST;
		psr_msg_list_encode(out, p->last, NULL);
		break;
	case PRESETS:
		p->id[++p->last].type = PSR_MSG_PRESETS;
		psr_msg_presets_encode(out, p->last, &(struct psr_msg_presets){ 1 + k % 4 }, NULL);
		break;
	case STATS:
		p->id[++p->last].type = PSR_MSG_STATS;
		psr_msg_stats_encode(out, p->last, NULL);
		break;
	case CLOSE:
		p->id[++p->last].type = PSR_MSG_CLOSE;
		psr_msg_close_encode(out, p->last, &(struct psr_msg_close){ 1 + k % 4 }, NULL);
		break;
	case FETCH:
		encode_fetch(p, out, next_byte(in));
		break;
	case PING:
		psr_msg_ping_encode(out, &(struct psr_msg_ping){ k }, NULL);
		break;
	case GOODBYE:
		p->is_leaving = 1;
		psr_msg_goodbye_encode(out, &(struct psr_msg_goodbye){ .reason = PSR_GOODBYE_DONE }, NULL);
		break;
	default:
		break;
	}
}

/* ---- lives ---- */

static void connect_peer(struct peer *p)
{
	*p = (struct peer){ .fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0) };
	psr_framer_init(&p->framer, PSR_SERVER, p->storage, sizeof p->storage);
	REQUIRE(p->fd >= 0 && connect(p->fd, (struct sockaddr *)&place, sizeof place) == 0);
}

static void send_act(struct peer *p, enum act act, struct input *in)
{
	static uint8_t bytes[PSR_WIRE_MAX_MESSAGE];
	struct psr_buf out = { bytes, 0, sizeof bytes };
	const int was_new = p->last == 0;

	if (p->last + 1 >= N_IDS)
		return;
	if (p->is_leaving || (was_new && act != HELLO)) /* nothing may follow a GOODBYE, or come before HELLO */
		p->is_unsound = 1;
	encode(p, &out, act, in);
	if (out.size > 0)
		send_spoilt(p, &out, in);
}

static void act(struct peer *p, enum act act_, struct input *in)
{
	static const struct linger now = { .l_onoff = 1 };
	uint8_t bytes[64];
	size_t n = 0;

	switch (act_) {
	case READ:
		receive(p, (int)(next_byte(in) & 1));
		break;
	case WAIT:
		receive(p, 5);
		break;
	case HALF_CLOSE:
		p->is_leaving = 1;
		shutdown(p->fd, SHUT_WR);
		break;
	case END:
		close_peer(p);
		break;
	case RESET:
		setsockopt(p->fd, SOL_SOCKET, SO_LINGER, &now, sizeof now);
		close_peer(p);
		break;
	case BYTES:
		p->is_unsound = 1;
		for (size_t most = next_byte(in) % sizeof bytes; n < most && in->n > 0;)
			bytes[n++] = (uint8_t)next_byte(in);
		put(p, bytes, n);
		break;
	case CUT:
	case CHANGE:
	case LENGTH:
		p->spoil = (enum spoil)(act_ - CUT + SPOIL_CUT);
		break;
	default:
		send_act(p, act_, in);
	}
}

static int count_open(struct peer *p, uint32_t *refining)
{
	int n = 0;

	*refining = 0;
	for (uint32_t i = 2; i <= p->last; i++) {
		const struct id *id = &p->id[i];

		if (id->is_ended || id->type == PSR_MSG_SCENE || id->type == PSR_MSG_PAUSE || id->type == PSR_MSG_CLOSE)
			continue;
		n++;
		if (id->pass > 0)
			*refining = i;
	}
	return n;
}

/* A client that kept to the rules gets an end of each request; it gives up what is refined after the first picture. */
static void finish(struct peer *p)
{
	const uint64_t end_ns = clock_ns() + PATIENCE_MS * UINT64_C(1000000);
	struct input none = { NULL, 0 };
	static uint8_t bytes[4096];
	struct psr_buf out = { bytes, 0, sizeof bytes };
	uint32_t refining;

	if (p->fd < 0 || p->is_unsound || p->is_leaving || p->last == 0 || p->last + N_VIEWS >= N_IDS)
		return;
	p->spoil = SOUND;
	for (unsigned view = 0; view < N_VIEWS; view++) {
		p->id[++p->last].type = PSR_MSG_PAUSE;
		psr_msg_resume_encode(&out, p->last, (uint16_t)view, NULL);
	}
	send_spoilt(p, &out, &none);
	while (p->fd >= 0 && count_open(p, &refining) > 0) {
		out.size = 0;
		for (unsigned view = 1; view < N_VIEWS; view++)
			while (p->n_ended[view] > 0)
				encode_ack(p, &out, view);
		if (refining != 0)
			psr_msg_cancel_encode(&out, refining, p->id[refining].view, NULL);
		if (out.size > 0)
			send_spoilt(p, &out, &none);
		receive(p, 20);
		REQUIRE(clock_ns() < end_ns);
	}
	REQUIRE(p->fd >= 0);
}

/* Whoever has gone has left nothing: asked by a client of its own. */
static void expect_nothing_left(void)
{
	static struct peer asker;
	const uint64_t end_ns = clock_ns() + PATIENCE_MS * UINT64_C(1000000);
	struct input none = { NULL, 0 };

	connect_peer(&asker);
	act(&asker, HELLO, &none);
	for (;;) {
		uint64_t connections = 0, waiting = 0;
		struct psr_msg_stats_reply stats;
		uint8_t bytes[1024];
		size_t n = 0;

		act(&asker, STATS, &none);
		while (!asker.id[asker.last].is_ended) {
			struct pollfd waits = { .fd = asker.fd, .events = POLLIN };

			REQUIRE(poll(&waits, 1, PATIENCE_MS) == 1);
			n = (size_t)recv(asker.fd, bytes, sizeof bytes, MSG_PEEK);
			receive(&asker, 0);
		}
		REQUIRE(n <= sizeof bytes);
		for (size_t at = 0; at + PSR_HEADER_SIZE < n; at += bytes[at] | (size_t)bytes[at + 1] << 8)
			if (bytes[at + 4] == PSR_MSG_STATS_REPLY
			    && psr_msg_stats_reply_decode(&stats, bytes + at + PSR_HEADER_SIZE,
			                                  (bytes[at] | (size_t)bytes[at + 1] << 8) - PSR_HEADER_SIZE, NULL) == PSR_OK)
				for (unsigned i = 0; i < stats.n_stats; i++) {
					connections = stats.stat[i].id == PSR_STAT_CONNECTIONS ? stats.stat[i].value : connections;
					waiting = stats.stat[i].id == PSR_STAT_FRAMES_WAITING ? stats.stat[i].value : waiting;
				}
		if (connections == 1 && waiting == 0)
			break;
		REQUIRE(clock_ns() < end_ns);
		usleep(1000);
	}
	close_peer(&asker);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	static struct peer peers[2];
	static unsigned n_runs;
	struct input in = { data, n };
	struct peer *p = &peers[0];

	if (server == NULL)
		start_server();
	connect_peer(&peers[0]);
	peers[1].fd = -1;
	for (unsigned i = 0; i < MOST_ACTS && in.n > 0; i++) {
		const enum act next = next_byte(&in) % N_ACTS;

		if (next == OTHER)
			p = p == &peers[0] ? &peers[1] : &peers[0];
		else if (p->fd >= 0)
			act(p, next, &in);
		if (p->fd < 0)
			connect_peer(p);
	}
	for (int i = 0; i < 2; i++)
		finish(&peers[i]);
	for (int i = 0; i < 2; i++)
		close_peer(&peers[i]);
	if (++n_runs % 64 == 0)
		expect_nothing_left();
	return 0;
}

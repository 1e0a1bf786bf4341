/* A client's whole connection: the input is what a server sends behind its WELCOME, of which the first byte says what
 * the client asks for. Properties, whatever the bytes are: no frame comes of an id that has ended, frames come whole and
 * as asked, and a broken connection stays broken. */
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include "client/lib/internal.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

#define REQUIRE(x) ((x) ? (void)0 : abort())

enum { ASK_LIST = 1, ASK_OPEN = 2, ASK_PRESETS = 4, ASK_STATS = 8, ASK_FRAMES = 16 };
enum { MOST_FRAMES = 12 };

struct run {
	struct psr_client *client;
	uint32_t id[MOST_FRAMES]; /* of frames; 0: it has ended */
	struct psr_msg_frame asked[MOST_FRAMES];
	unsigned n;
};

static int put(int fd, const void *bytes, size_t n)
{
	return send(fd, bytes, n, MSG_DONTWAIT | MSG_NOSIGNAL) == (ssize_t)n;
}

/* A client whose server has sent the bytes and is gone. */
static struct psr_client *connect_to(const uint8_t *data, size_t n)
{
	const struct psr_msg_welcome welcome = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR,
		.capabilities = UINT64_MAX, .max_message = PSR_WIRE_MAX_MESSAGE, .max_side = PSR_WIRE_MAX_SIDE,
		.max_pixels = PSR_WIRE_MAX_PIXELS, .max_instances = 1, .max_lights = 1, .max_scenes = 1,
		.max_open = PSR_WIRE_MAX_OPEN, .max_models = 1, .server = "fuzz" };
	uint8_t bytes[512];
	struct psr_buf out = { bytes, 0, sizeof bytes };
	struct psr_client *client = NULL;
	int fd[2];

	REQUIRE(psr_msg_welcome_encode(&out, &welcome, NULL) == PSR_OK);
	if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, fd) != 0)
		return NULL;
	if (put(fd[1], bytes, out.size) && put(fd[1], data, n) && shutdown(fd[1], SHUT_WR) == 0
	    && client_create(&client, fd[0], "fuzz", NULL) != PSR_OK)
		client = NULL;
	close(fd[1]);
	if (client == NULL)
		close(fd[0]);
	return client;
}

static void ask_frame(struct run *run, uint16_t view, int kind)
{
	struct psr_msg_frame *frame = &run->asked[run->n];

	if (run->n == MOST_FRAMES)
		return;
	*frame = (struct psr_msg_frame){ .width = 24, .height = 16, .planes = 3, .color_codec = PSR_CODEC_ZSTD,
		.depth_format = PSR_WIRE_DEPTH_F32, .depth_codec = PSR_CODEC_ZSTD,
		.camera = { { 0, 0, 5 }, { 0, 0, 0 }, { 0, 1, 0 }, PSR_CAMERA_PERSPECTIVE, 1, 0, 0.1 } };
	if (kind == 1) {
		frame->color_codec = PSR_CODEC_JPEG;
		frame->color_quality = 50;
		frame->depth_format = PSR_WIRE_DEPTH_U16_HALF;
		frame->depth_min = 1;
		frame->depth_max = 10;
		frame->pass_limit = 2;
		frame->flags = view > 0 ? PSR_WIRE_FRAME_SHARP | PSR_WIRE_FRAME_NO_HASHES : 0;
	}
	frame->base = view > 0 ? psr_client_base(run->client, view) : 0;
	if (psr_client_frame_in(run->client, view, frame, &run->id[run->n], NULL) == PSR_OK)
		run->n++;
}

static void take_event(struct run *run, const struct psr_event *event)
{
	unsigned i = 0;

	while (i < run->n && run->id[i] != event->id)
		i++;
	if (i == run->n) { /* no frame of an id that has ended; an ERROR may be of a SCENE or CLOSE, as far as a client knows */
		REQUIRE(event->type == PSR_EVENT_FAILED);
		return;
	}
	if (event->type == PSR_EVENT_FRAME) {
		const struct psr_msg_frame *asked = &run->asked[i];

		REQUIRE(event->picture->width == asked->width && event->picture->height == asked->height);
		REQUIRE(psr_frame_plane(event->picture, PSR_PLANE_COLOR) != NULL && event->end->planes == asked->planes);
		REQUIRE((event->checked & ~asked->planes) == 0);
	}
	if (event->type != PSR_EVENT_BEGIN && (event->type != PSR_EVENT_FRAME || event->end->is_final))
		run->id[i] = 0;
}

static void draw(struct run *run)
{
	struct psr_event event;
	struct psr_error err;

	ask_frame(run, 0, 0);
	ask_frame(run, 1, 1);
	ask_frame(run, 1, 0);
	while (psr_client_wait(run->client, 0, &event, &err) > 0) {
		const uint32_t id = event.id;
		const int is_frame = event.type == PSR_EVENT_FRAME, pass = is_frame ? event.begin->pass : 0;

		take_event(run, &event);
		if (is_frame && psr_client_ack(run->client, id, (uint16_t)pass, NULL) == PSR_OK)
			ask_frame(run, 1, pass & 1);
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	struct run run = { .client = n > 0 ? connect_to(data + 1, n - 1) : NULL };
	const unsigned asks = n > 0 ? data[0] : 0;
	struct psr_msg_list_entry *entries = NULL;
	struct psr_msg_preset *presets = NULL;
	struct psr_msg_stats_reply stats;
	struct psr_msg_opened opened;
	struct psr_event event;
	struct psr_error err;
	uint32_t n_got;

	if (run.client == NULL)
		return 0;
	REQUIRE(client_run(run.client, 0, &event, &err) == 1);
	if (asks & ASK_LIST && psr_client_list(run.client, &entries, &n_got, 0, &err) == PSR_OK)
		free(entries);
	if (asks & ASK_OPEN && psr_client_open(run.client, "teapot", 0, &opened, &err) == PSR_OK)
		REQUIRE(opened.handle != 0);
	if (asks & ASK_PRESETS && psr_client_presets(run.client, 1, &presets, &n_got, 0, &err) == PSR_OK)
		free(presets);
	if (asks & ASK_STATS && psr_client_stats(run.client, &stats, 0, &err) == PSR_OK)
		REQUIRE(stats.n_stats <= PSR_WIRE_MAX_STATS);
	if (asks & ASK_FRAMES)
		draw(&run);
	if (run.client->broken.code != PSR_OK) {
		REQUIRE(psr_client_wait(run.client, 0, &event, &err) == run.client->broken.code);
		REQUIRE(psr_client_stats(run.client, &stats, 0, &err) == run.client->broken.code);
	}
	psr_client_close(run.client);
	return 0;
}

/* A connection of psr bench: the input is what a server sends behind its WELCOME; the first byte says what the load asks
 * for. Properties, whatever the bytes are: each request ends exactly once, none are open when the connection is over, and
 * no picture is kept of one that has ended. */
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include "client/bench/conn.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

#define REQUIRE(x) ((x) ? (void)0 : abort())

enum { IN_VIEW = 1, DECODED = 2 };
enum { MOST_REQUESTS = 200, INFLIGHT = 3 };

struct load {
	uint64_t n_asked, n_answered;
};

static void ask(struct conn *conn)
{
	struct load *load = conn->shared->userdata;

	while (conn->state == CONN_READY && conn->n_open < INFLIGHT && load->n_asked < MOST_REQUESTS)
		load->n_asked += (uint64_t)conn_ask(conn, 0, load->n_asked + 1, 1);
}

static void on_answer(struct conn *conn, const struct conn_request *request, const struct conn_answer *answer)
{
	struct load *load = conn->shared->userdata;

	REQUIRE(request->id != 0 && request->assembly == NULL);
	REQUIRE((answer->outcome == CONN_DRAWN) == (answer->end != NULL));
	REQUIRE((answer->outcome == CONN_FAILED) == (answer->code < 0));
	load->n_answered++;
	ask(conn);
}

static int put(int fd, const void *bytes, size_t n)
{
	return send(fd, bytes, n, MSG_DONTWAIT | MSG_NOSIGNAL) == (ssize_t)n;
}

/* Returns the end of a connection whose server has sent the bytes and is gone; -1 if they do not fit. */
static int serve(const uint8_t *data, size_t n)
{
	const struct psr_msg_welcome welcome = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR,
		.capabilities = UINT64_MAX, .max_message = PSR_WIRE_MAX_MESSAGE, .max_side = PSR_WIRE_MAX_SIDE,
		.max_pixels = PSR_WIRE_MAX_PIXELS, .max_instances = 1, .max_lights = 1, .max_scenes = 1,
		.max_open = INFLIGHT + 1, .max_models = 1, .server = "fuzz" };
	uint8_t bytes[512];
	struct psr_buf out = { bytes, 0, sizeof bytes };
	int fd[2];

	REQUIRE(psr_msg_welcome_encode(&out, &welcome, NULL) == PSR_OK);
	if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, fd) != 0)
		return -1;
	if (put(fd[1], bytes, out.size) && put(fd[1], data, n) && shutdown(fd[1], SHUT_WR) == 0)
		return close(fd[1]) == 0 ? fd[0] : -1;
	close(fd[0]);
	close(fd[1]);
	return -1;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	static struct scene scene = { .msg = { .ambient = 1, .n_instances = 1,
		.instance = { { .rotation = { 0, 0, 0, 1 }, .scale = 1 } } } };
	static uint32_t model_of[1];
	static struct bench_model model = { .name = "teapot", .pixels = 24 };
	static struct bench_request request = { .camera = { { 0, 0, 5 }, { 0, 0, 0 }, { 0, 1, 0 },
		PSR_CAMERA_ORTHOGRAPHIC, 0, 4, 0 } };
	static struct bench_plan plan = { .n_kinds = 1, .model = &model, .n_models = 1, .request = &request, .n_requests = 1,
		.n_clients = 1, .kind = { { .scene = &scene, .model = model_of, .up_to = 1, .frame = { .width = 24, .height = 16,
		.planes = 1, .color_codec = PSR_CODEC_ZSTD } } } };
	struct load load = { 0, 0 };
	struct conn_shared shared = { .plan = &plan, .server = "fuzz", .userdata = &load, .on_ready = ask,
		                          .on_answer = on_answer };
	struct psr_error err;
	struct conn conn;
	int fd;

	if (n == 0 || (fd = serve(data + 1, n - 1)) < 0)
		return 0;
	shared.is_view = data[0] & IN_VIEW;
	shared.is_decoded = (data[0] & DECODED) != 0;
	REQUIRE(!shared.is_decoded || client_decoder_create(&shared.decoder) == PSR_OK);
	if (conn_begin(&conn, &shared, 0, fd, &err) == PSR_OK) {
		while (conn.state != CONN_OVER)
			conn_read(&conn);
		REQUIRE(conn.why.code < 0 && conn.why.text[0] != '\0');
	}
	REQUIRE(conn.n_open == 0 && load.n_answered == load.n_asked);
	conn_close(&conn);
	client_decoder_destroy(shared.decoder);
	return 0;
}

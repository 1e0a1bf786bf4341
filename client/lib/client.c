#include <errno.h>
#include <inttypes.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include "base/clock.h"
#include "internal.h"

int client_create(struct psr_client **out, int fd, const char *address, struct psr_error *err)
{
	struct psr_client *client = calloc(1, sizeof *client);

	if (client == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a connection");
	client->fd = -1; /* still the caller's until this function succeeds */
	client->next_id = 1;
	snprintf(client->address, sizeof client->address, "%s", address);
	client->in_storage = malloc(CLIENT_IN_BYTES);
	client->out.data = malloc(CLIENT_OUT_BYTES);
	client->out.capacity = CLIENT_OUT_BYTES;
	if (client->in_storage == NULL || client->out.data == NULL || client_decoder_create(&client->decoder) != PSR_OK) {
		psr_client_close(client);
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a connection");
	}
	psr_framer_init(&client->framer, PSR_SERVER, client->in_storage, CLIENT_IN_BYTES);
	client->fd = fd;
	*out = client;
	return PSR_OK;
}

void psr_client_close(struct psr_client *client)
{
	struct psr_msg_goodbye goodbye = { .reason = PSR_GOODBYE_DONE };

	if (client == NULL)
		return;
	if (client->fd >= 0 && client->is_open && client->broken.code == PSR_OK && !client->write_failed) {
		if (psr_msg_goodbye_encode(&client->out, &goodbye, NULL) == PSR_OK
		    && send(client->fd, client->out.data + client->out_sent, client->out.size - client->out_sent,
		            MSG_NOSIGNAL | MSG_DONTWAIT)
		           > 0)
			shutdown(client->fd, SHUT_WR);
	}
	if (client->fd >= 0)
		close(client->fd);
	for (size_t i = 0; i < PSR_WIRE_MAX_OPEN; i++)
		client_assembly_fini(&client->frame[i].assembly);
	client_assembly_fini(&client->done);
	client_free_queued(client);
	client_free_held(client);
	client_decoder_destroy(client->decoder);
	client_crew_destroy(client->crew);
	free(client->list.entry);
	free(client->presets.preset);
	free(client->in_storage);
	free(client->out.data);
	free(client);
}

int client_break(struct psr_client *client, int code, const char *format, ...)
{
	char text[PSR_ERROR_TEXT];
	va_list args;

	va_start(args, format);
	vsnprintf(text, sizeof text, format, args);
	va_end(args);
	return psr_fail(&client->broken, code, "%.200s: %s", client->address, text);
}

int client_check(const struct psr_client *client, struct psr_error *err)
{
	return client->broken.code == PSR_OK ? PSR_OK : psr_fail(err, client->broken.code, "%s", client->broken.text);
}

int psr_client_use_threads(struct psr_client *client, int n_threads, struct psr_error *err)
{
	if (n_threads < 1 || n_threads > PSR_CLIENT_MAX_THREADS || client->crew != NULL)
		return psr_fail(err, PSR_ERR_ARG, "%d threads are to decode: 1 to %d can, and it is said once", n_threads,
		                PSR_CLIENT_MAX_THREADS);
	if (client_crew_create(&client->crew, n_threads) != PSR_OK)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %d threads", n_threads);
	return PSR_OK;
}

const struct psr_msg_welcome *psr_client_welcome(const struct psr_client *client)
{
	return &client->welcome;
}

int psr_client_fd(const struct psr_client *client, short *events)
{
	if (events != NULL)
		*events = (short)(POLLIN | (client->out.size > 0 ? POLLOUT : 0));
	return client->fd;
}

uint64_t psr_client_bytes_received(const struct psr_client *client)
{
	return client->n_received;
}

/* A peer that has closed may have sent the reason before. So a failed write is no error yet: reading goes on. */
void client_flush(struct psr_client *client)
{
	struct psr_buf *out = &client->out;

	while (!client->write_failed && client->out_sent < out->size) {
		ssize_t n = send(client->fd, out->data + client->out_sent, out->size - client->out_sent, MSG_NOSIGNAL);

		if (n >= 0)
			client->out_sent += (size_t)n;
		else if (errno == EAGAIN || errno == EWOULDBLOCK)
			break;
		else if (errno != EINTR)
			client->write_failed = 1;
	}
	if (client->write_failed || client->out_sent == out->size) {
		out->size = 0;
		client->out_sent = 0;
	} else if (client->out_sent > 0) {
		memmove(out->data, out->data + client->out_sent, out->size - client->out_sent);
		out->size -= client->out_sent;
		client->out_sent = 0;
	}
}

/* Returns 1: bytes came; 0: there are none now; negative: the connection is broken. */
static int fill_input(struct psr_client *client)
{
	size_t room;
	uint8_t *to = psr_framer_space(&client->framer, &room);
	ssize_t n;

	do
		n = recv(client->fd, to, room, 0);
	while (n < 0 && errno == EINTR);
	if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
		return 0;
	if (n < 0)
		return client_break(client, PSR_ERR_CONNECTION, "the connection is lost: %s", strerror(errno));
	if (n == 0)
		return client_break(client, PSR_ERR_CONNECTION,
		                    client->is_open ? "the server closed the connection"
		                                    : "the peer closed the connection unanswered; is it a psrd of this "
		                                      "version?");
	psr_framer_filled(&client->framer, (size_t)n);
	client->n_received += (uint64_t)n;
	return 1;
}

static int take_messages(struct psr_client *client, struct psr_event *event)
{
	struct psr_message message;
	struct psr_error why;

	for (;;) {
		int got = psr_framer_next(&client->framer, &message, &why);

		if (got == 0)
			return 0;
		if (got < 0)
			return client_break(
				client, PSR_ERR_PROTOCOL,
				client->is_open ? "the server broke the protocol: %.300s" : "no psrd answers there: %.300s", why.text);
		got = client_dispatch(client, &message, event);
		if (got != 0)
			return got;
	}
}

int client_run(struct psr_client *client, uint64_t deadline_ns, struct psr_event *event, struct psr_error *err)
{
	client_assembly_fini(&client->done);
	client_free_given(client);
	memset(event, 0, sizeof *event);
	client->answer = CLIENT_ANSWER_NONE;
	for (int has_read = 0; client->broken.code == PSR_OK; has_read = 1) {
		int got = take_messages(client, event);

		if (got > 0)
			return 1;
		if (got < 0)
			break;
		if (has_read && clock_ns() >= deadline_ns) /* for a server that never stops sending */
			return 0;
		client_flush(client);
		got = fill_input(client);
		if (got != 0)
			continue;
		got = client_poll(client->fd, POLLIN | (client->out.size > 0 ? POLLOUT : 0), deadline_ns, err);
		if (got <= 0)
			return got;
	}
	return client_check(client, err);
}

int psr_client_wait(struct psr_client *client, int timeout_ms, struct psr_event *event, struct psr_error *err)
{
	uint64_t deadline_ns = client_deadline_ns(timeout_ms);
	int got;

	if (client->broken.code == PSR_OK && client_take_queued(client, event))
		return 1;
	do
		got = client_run(client, deadline_ns, event, err);
	while (got > 0 && event->type == 0); /* a late PONG makes no event */
	return got;
}

/* Completes a request that was encoded behind `start`. */
static int finish_request(struct psr_client *client, size_t start, int code, const char *what, struct psr_error *err)
{
	if (code == PSR_ERR_MEMORY)
		return psr_fail(err, PSR_ERR_BUSY, "%s waits until the server has taken earlier requests", client->address);
	if (code != PSR_OK)
		return code;
	if (client->out.size - start > client->welcome.max_message) {
		size_t n = client->out.size - start;

		client->out.size = start;
		return psr_fail(err, PSR_ERR_LIMIT, "the %s takes %zu bytes, the server takes messages of at most %u", what, n,
		                client->welcome.max_message);
	}
	client->next_id++;
	client_flush(client);
	return PSR_OK;
}

static int start_request(struct psr_client *client, struct psr_error *err)
{
	if (client->broken.code != PSR_OK)
		return client_check(client, err);
	if (client->next_id == UINT32_MAX)
		return psr_fail(err, PSR_ERR_LIMIT, "%s: the ids of this connection are used up; connect again",
		                client->address);
	return PSR_OK;
}

int psr_client_scene(struct psr_client *client, const struct psr_msg_scene *scene, uint32_t *id, struct psr_error *err)
{
	size_t start = client->out.size;
	int code = start_request(client, err);

	for (unsigned i = 0; code == PSR_OK && i < scene->n_lights && i < PSR_WIRE_MAX_LIGHTS; i++)
		if (scene->light[i].flags & PSR_WIRE_LIGHT_SHADOW && !(client->welcome.capabilities & PSR_CAP_SHADOWS))
			code = psr_fail(err, PSR_ERR_UNSUPPORTED, "%s draws no shadows (%s); leave `shadow` out", client->address,
			                client->welcome.server);
	for (unsigned i = 0; code == PSR_OK && i < scene->n_instances && i < PSR_WIRE_MAX_INSTANCES; i++) {
		const unsigned kind = scene->instance[i].representation;
		const uint32_t needs = kind == PSR_WIRE_REP_OCTREE ? PSR_CAP_OCTREE : kind == PSR_WIRE_REP_DPOINT ? PSR_CAP_DPOINT : 0;

		if ((client->welcome.capabilities & needs) != needs)
			code = psr_fail(err, PSR_ERR_UNSUPPORTED, "%s draws no %s (%s)", client->address,
			                kind == PSR_WIRE_REP_OCTREE ? "octrees" : "differential points", client->welcome.server);
	}
	if (code != PSR_OK)
		return code;
	if (id != NULL)
		*id = client->next_id;
	code = psr_msg_scene_encode(&client->out, client->next_id, scene, err);
	return finish_request(client, start, code, "scene", err);
}

static struct client_frame *free_frame(struct psr_client *client, uint16_t view)
{
	struct client_frame *frame = NULL;
	unsigned n_open = 0;

	for (size_t i = 0; i < PSR_WIRE_MAX_OPEN; i++) {
		if (client->frame[i].id == 0)
			frame = frame == NULL ? &client->frame[i] : frame;
		else if (client->frame[i].view == 0)
			n_open++;
	}
	return view > 0 || n_open < client->welcome.max_open ? frame : NULL;
}

static int check_offered(const struct psr_client *client, uint16_t view, const struct psr_msg_frame *asked,
                         struct psr_error *err)
{
	const struct {
		int is_asked;
		uint64_t capability;
		const char *what;
	} needs[] = {
		{ view > 0, PSR_CAP_VIEWS, "keep views" },
		{ asked->base != 0, PSR_CAP_BASE, "send changes to a base" },
		{ asked->pass_limit > 0, PSR_CAP_REFINE, "refine frames" },
		{ asked->budget == PSR_WIRE_BUDGET_SETTINGS && asked->settings.scale != 1, PSR_CAP_SETTINGS,
		  "draw at other scales" },
		{ asked->budget == PSR_WIRE_BUDGET_TIME, PSR_CAP_TIME_BUDGET, "keep budgets of time" },
		{ asked->budget == PSR_WIRE_BUDGET_ERROR, PSR_CAP_ERROR_BOUND, "keep bounds on the error" },
		{ asked->budget == PSR_WIRE_BUDGET_RMSE, PSR_CAP_RMSE_BOUND, "keep bounds on the RMSE" },
		{ asked->settings.pass > 0, PSR_CAP_TIME_BUDGET | PSR_CAP_ERROR_BOUND, "draw a pass at once" },
		{ asked->depth_format > PSR_WIRE_DEPTH_F32, PSR_CAP_DEPTH_U16, "send depth as u16" },
		{ asked->flags & PSR_WIRE_FRAME_SHARP, PSR_CAP_SHARP, "send sharp frames" },
	};

	for (size_t i = 0; i < sizeof needs / sizeof needs[0]; i++)
		if (needs[i].is_asked && !(client->welcome.capabilities & needs[i].capability))
			return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s does not %s (%s)", client->address, needs[i].what,
			                client->welcome.server);
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (asked->planes >> plane & 1 && psr_plane_capability(plane) & ~client->welcome.capabilities)
			return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s: this server does not send the %s plane", client->address,
			                psr_plane_name(plane));
	return PSR_OK;
}

int psr_client_frame_in(struct psr_client *client, uint16_t view, const struct psr_msg_frame *asked, uint32_t *id,
                        struct psr_error *err)
{
	struct client_frame *frame = free_frame(client, view);
	size_t start = client->out.size;
	int code = start_request(client, err);

	if (code != PSR_OK)
		return code;
	if (frame == NULL)
		return psr_fail(err, PSR_ERR_BUSY, "%s takes %u requests at a time", client->address,
		                view > 0 ? PSR_WIRE_MAX_OPEN : client->welcome.max_open);
	if (asked->color_codec > PSR_CODEC_ZSTD)
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "this client asks for frames without PNG");
	if (asked->base != 0 && asked->base != psr_client_base(client, view))
		return psr_fail(err, PSR_ERR_ARG, "frame %" PRIu32 " is no base: the last one acknowledged in view %u is %" PRIu32,
		                asked->base, view, psr_client_base(client, view));
	code = check_offered(client, view, asked, err);
	if (code != PSR_OK)
		return code;
	code = psr_msg_frame_encode(&client->out, client->next_id, view, asked, err);
	*id = client->next_id;
	code = finish_request(client, start, code, "request", err);
	if (code != PSR_OK)
		return code;
	client_assembly_init(&frame->assembly, asked, 0);
	frame->id = *id;
	frame->view = view;
	frame->bytes = frame->decode_ns = 0;
	frame->sent_ns = clock_ns();
	return PSR_OK;
}

int psr_client_frame(struct psr_client *client, const struct psr_msg_frame *asked, uint32_t *id, struct psr_error *err)
{
	return psr_client_frame_in(client, 0, asked, id, err);
}

int psr_client_cancel(struct psr_client *client, uint32_t id, struct psr_error *err)
{
	size_t i = 0;
	int code = client_check(client, err);

	if (code != PSR_OK)
		return code;
	while (i < PSR_WIRE_MAX_OPEN && (id == 0 || client->frame[i].id != id))
		i++;
	if (i == PSR_WIRE_MAX_OPEN)
		return psr_fail(err, PSR_ERR_NOT_FOUND, "no frame %" PRIu32 " is under way", id);
	code = psr_msg_cancel_encode(&client->out, id, client->frame[i].view, err);
	if (code == PSR_ERR_MEMORY)
		return psr_fail(err, PSR_ERR_BUSY, "%s waits until the server has taken earlier requests", client->address);
	client_flush(client);
	return code;
}

int psr_client_pause(struct psr_client *client, uint16_t view, int is_paused, struct psr_error *err)
{
	size_t start = client->out.size;
	int code = start_request(client, err);

	if (code != PSR_OK)
		return code;
	if (!(client->welcome.capabilities & PSR_CAP_PAUSE))
		return psr_fail(err, PSR_ERR_UNSUPPORTED, "%s does not pause views (%s)", client->address,
		                client->welcome.server);
	code = (is_paused ? psr_msg_pause_encode : psr_msg_resume_encode)(&client->out, client->next_id, view, err);
	return finish_request(client, start, code, "request", err);
}

int psr_client_close_model(struct psr_client *client, uint32_t handle, struct psr_error *err)
{
	const struct psr_msg_close msg = { .handle = handle };
	size_t start = client->out.size;
	int code = start_request(client, err);

	if (code != PSR_OK)
		return code;
	code = psr_msg_close_encode(&client->out, client->next_id, &msg, err);
	return finish_request(client, start, code, "request", err);
}

int psr_client_ping(struct psr_client *client, struct psr_error *err)
{
	const struct psr_msg_ping ping = { 0 };
	const int code = client_check(client, err);

	if (code != PSR_OK)
		return code;
	if (psr_msg_ping_encode(&client->out, &ping, NULL) != PSR_OK)
		return psr_fail(err, PSR_ERR_BUSY, "%s waits for the server to take what was sent before", client->address);
	client_flush(client);
	return PSR_OK;
}

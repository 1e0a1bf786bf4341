/* What a server says on a connection of a load. Rectangles are looked at only if pictures are decoded. */
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "conn_inside.h"

static void unexpected(struct conn *conn, const struct psr_message *message)
{
	conn_fail(conn, PSR_ERR_PROTOCOL, "the server sent %s for id %" PRIu32 " where it has no place",
	          psr_msg_name(message->type), message->id);
}

/* ---- until it is ready ---- */

static void open_next(struct conn *conn)
{
	const struct bench_model *model = &conn->shared->plan->model[conn->n_opened];
	struct psr_msg_open msg = {
		.resolution = conn->capabilities & PSR_CAP_RESOLUTION ? (uint16_t)model->pixels : 0,
		.levels = conn->capabilities & PSR_CAP_LEVELS ? model->levels : 0,
	};
	struct psr_error err;
	int code;

	strcpy(msg.name, model->name);
	conn->control_id = conn->next_id++;
	while ((code = psr_msg_open_encode(&conn->out, conn->control_id, &msg, &err)) == PSR_ERR_MEMORY)
		if (!conn_grow(conn))
			return;
	if (code != PSR_OK)
		conn_fail(conn, code, "%s", err.text);
	conn_flush(conn);
}

static void send_scenes(struct conn *conn)
{
	const struct bench_plan *plan = conn->shared->plan;
	struct psr_msg_scene *msg = &conn->shared->scene;
	struct psr_error err;

	for (uint32_t i = 0; i < plan->n_kinds && conn->state != CONN_OVER; i++) {
		int code;

		*msg = plan->kind[i].scene->msg;
		for (uint32_t k = 0; k < msg->n_instances; k++)
			msg->instance[k].handle = conn->handle[plan->kind[i].model[k]];
		conn->scene_id = conn->next_id++;
		while ((code = psr_msg_scene_encode(&conn->out, conn->scene_id, msg, &err)) == PSR_ERR_MEMORY)
			if (!conn_grow(conn))
				return;
		if (code != PSR_OK)
			conn_fail(conn, code, "%s", err.text);
	}
	conn_flush(conn);
}

static void on_welcome(struct conn *conn, const struct psr_message *message)
{
	const struct conn_shared *shared = conn->shared;
	struct psr_msg_welcome welcome;
	struct psr_error err;

	if (conn->state != CONN_HELLO) {
		unexpected(conn, message);
		return;
	}
	if (psr_msg_welcome_decode(&welcome, message->payload, message->n, &err) != PSR_OK) {
		conn_fail(conn, PSR_ERR_PROTOCOL, "%.300s", err.text);
		return;
	}
	if (welcome.major != PSR_PROTO_MAJOR || welcome.minor != PSR_PROTO_MINOR) {
		conn_fail(conn, PSR_ERR_VERSION, "the server speaks version %u.%u of the protocol", welcome.major, welcome.minor);
		return;
	}
	if (conn->view > 0 && !(welcome.capabilities & PSR_CAP_VIEWS)) {
		conn_fail(conn, PSR_ERR_UNSUPPORTED, "this server keeps no views; leave --views out");
		return;
	}
	if (shared->plan->n_models > welcome.max_models) {
		conn_fail(conn, PSR_ERR_LIMIT, "the load has %u models, the server lets a client open %u",
		          shared->plan->n_models, welcome.max_models);
		return;
	}
	conn->capabilities = welcome.capabilities;
	conn->most_open = conn->view > 0 ? PSR_WIRE_MAX_OPEN : welcome.max_open;
	conn->request = calloc(conn->most_open, sizeof *conn->request);
	if (conn->request == NULL) {
		conn_fail(conn, PSR_ERR_MEMORY, "no memory for requests");
		return;
	}
	conn->state = CONN_OPENING;
	open_next(conn);
}

static void on_opened(struct conn *conn, const struct psr_message *message)
{
	struct psr_msg_opened opened;
	struct psr_error err;

	if (conn->state != CONN_OPENING || message->id != conn->control_id) {
		unexpected(conn, message);
		return;
	}
	if (psr_msg_opened_decode(&opened, message->payload, message->n, &err) != PSR_OK) {
		conn_fail(conn, PSR_ERR_PROTOCOL, "%.300s", err.text);
		return;
	}
	conn->control_id = 0;
	conn->handle[conn->n_opened++] = opened.handle;
	if (conn->n_opened < conn->shared->plan->n_models) {
		open_next(conn);
		return;
	}
	send_scenes(conn);
	if (conn->state == CONN_OVER)
		return;
	conn->state = CONN_READY;
	conn->shared->on_ready(conn);
}

/* ---- frames ---- */

static struct conn_request *find(struct conn *conn, uint32_t id)
{
	for (uint32_t i = 0; conn->request != NULL && id != 0 && i < conn->most_open; i++)
		if (conn->request[i].id == id)
			return &conn->request[i];
	return NULL;
}

/* Decodes with the client library's assembly. Returns 0 if the connection is over by it. */
static int decode(struct conn *conn, struct conn_request *request, const struct psr_message *message, int *is_spoilt)
{
	struct conn_shared *shared = conn->shared;
	const uint64_t start_ns = clock_ns();
	struct psr_msg_rect rect;
	struct psr_error err;
	unsigned checked;
	int code;

	switch (message->type) {
	case PSR_MSG_FRAME_BEGIN:
		code = client_assembly_begin(request->assembly, &shared->begin, NULL, &err);
		break;
	case PSR_MSG_RECT:
		code = psr_msg_rect_decode(&rect, message->payload, message->n, &err);
		if (code == PSR_OK)
			code = client_assembly_rect(request->assembly, shared->decoder, &rect, &err);
		break;
	default:
		code = client_assembly_end(request->assembly, &shared->end, &checked, &err);
		break;
	}
	request->decode_ns += clock_ns() - start_ns;
	*is_spoilt = code == PSR_ERR_FORMAT;
	if (code == PSR_OK || *is_spoilt)
		return 1;
	conn_fail(conn, code == PSR_ERR_MEMORY ? code : PSR_ERR_PROTOCOL, "%.300s", err.text);
	return 0;
}

static void acknowledge(struct conn *conn, uint32_t id, uint16_t pass)
{
	const struct psr_msg_ack ack = { .pass = pass };

	while (psr_msg_ack_encode(&conn->out, id, conn->view, &ack, NULL) == PSR_ERR_MEMORY)
		if (!conn_grow(conn))
			return;
	conn->base = id;
	conn_flush(conn);
}

static void on_end(struct conn *conn, struct conn_request *request, const struct psr_message *message)
{
	struct psr_msg_frame_end *end = &conn->shared->end;
	struct conn_answer answer = { .outcome = CONN_DRAWN, .end = end };
	struct psr_error err;
	int is_spoilt = 0;

	if (psr_msg_frame_end_decode(end, message->payload, message->n, &err) != PSR_OK) {
		conn_fail(conn, PSR_ERR_PROTOCOL, "%.300s", err.text);
		return;
	}
	if (request->assembly != NULL && !decode(conn, request, message, &is_spoilt))
		return;
	if (conn->view > 0)
		acknowledge(conn, request->id, end->pass);
	if (conn->state == CONN_OVER)
		return;
	if (is_spoilt)
		answer = (struct conn_answer){ .outcome = CONN_FAILED, .code = PSR_ERR_FORMAT };
	if (end->is_final) {
		conn_end(conn, request, &answer);
	} else if (request->assembly != NULL) {
		const struct psr_msg_frame asked = request->assembly->asked;

		client_assembly_fini(request->assembly);
		client_assembly_init(request->assembly, &asked, (uint16_t)(end->pass + 1));
	}
}

static void on_frame(struct conn *conn, struct conn_request *request, const struct psr_message *message)
{
	struct psr_error err;
	int is_spoilt;

	if (request == NULL || message->view != conn->view) {
		unexpected(conn, message);
		return;
	}
	request->bytes += PSR_HEADER_SIZE + message->n;
	if (request->first_ns == 0)
		request->first_ns = conn->shared->now_ns;
	switch (message->type) {
	case PSR_MSG_FRAME_BEGIN:
		if (psr_msg_frame_begin_decode(&conn->shared->begin, message->payload, message->n, &err) != PSR_OK)
			conn_fail(conn, PSR_ERR_PROTOCOL, "%.300s", err.text);
		else
			request->settings = conn->shared->begin.settings;
		if (conn->state != CONN_OVER && request->assembly != NULL)
			decode(conn, request, message, &is_spoilt);
		break;
	case PSR_MSG_RECT:
		if (request->assembly != NULL)
			decode(conn, request, message, &is_spoilt);
		break;
	case PSR_MSG_FRAME_END:
		on_end(conn, request, message);
		break;
	case PSR_MSG_SUPERSEDED:
		conn_end(conn, request, &(struct conn_answer){ .outcome = CONN_SUPERSEDED });
		break;
	default:
		conn_end(conn, request, &(struct conn_answer){ .outcome = CONN_FAILED, .code = PSR_ERR_CANCELLED });
		break;
	}
}

/* ---- all ---- */

static void on_error(struct conn *conn, const struct psr_message *message)
{
	struct conn_request *request = find(conn, message->id);
	struct psr_msg_error msg;
	struct psr_error err;

	if (psr_msg_error_decode(&msg, message->payload, message->n, &err) != PSR_OK)
		conn_fail(conn, PSR_ERR_PROTOCOL, "%.300s", err.text);
	else if (request != NULL)
		conn_end(conn, request, &(struct conn_answer){ .outcome = CONN_FAILED, .code = psr_wire_error_to(msg.code),
		                                               .text = msg.text });
	else if (message->id == 0)
		conn_fail(conn, psr_wire_error_to(msg.code), "the server refuses: %.400s", msg.text);
	else if (message->id == conn->control_id || message->id <= conn->scene_id)
		conn_fail(conn, psr_wire_error_to(msg.code), "%.400s", msg.text);
	else
		unexpected(conn, message);
}

static void on_ping(struct conn *conn, const struct psr_message *message)
{
	struct psr_msg_ping ping;
	struct psr_error err;

	if (psr_msg_ping_decode(&ping, message->payload, message->n, &err) != PSR_OK) {
		conn_fail(conn, PSR_ERR_PROTOCOL, "%.300s", err.text);
		return;
	}
	while (psr_msg_pong_encode(&conn->out, &ping, NULL) == PSR_ERR_MEMORY)
		if (!conn_grow(conn))
			return;
	conn_flush(conn);
}

void conn_take(struct conn *conn, const struct psr_message *message)
{
	switch (message->type) {
	case PSR_MSG_WELCOME:
		on_welcome(conn, message);
		break;
	case PSR_MSG_OPENED:
		on_opened(conn, message);
		break;
	case PSR_MSG_PROGRESS:
		break;
	case PSR_MSG_FRAME_BEGIN:
	case PSR_MSG_RECT:
	case PSR_MSG_FRAME_END:
	case PSR_MSG_SUPERSEDED:
	case PSR_MSG_CANCELLED:
		on_frame(conn, find(conn, message->id), message);
		break;
	case PSR_MSG_ERROR:
		on_error(conn, message);
		break;
	case PSR_MSG_PING:
		on_ping(conn, message);
		break;
	case PSR_MSG_PONG:
		break;
	case PSR_MSG_GOODBYE:
		conn_fail(conn, PSR_ERR_CONNECTION, "the server said goodbye");
		break;
	default:
		unexpected(conn, message);
		break;
	}
}

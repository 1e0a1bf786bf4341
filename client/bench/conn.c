#include "conn.h"
#include <assert.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include "base/clock.h"
#include "client/cli/cli.h"
#include "conn_inside.h"

#define IN_BYTES (2 * PSR_WIRE_MAX_MESSAGE)
#define MAX_OUT (8u << 20) /* bytes that wait for a server that reads nothing */

int conn_open(struct conn *conn, struct conn_shared *shared, uint32_t index, uint64_t deadline_ns,
              struct psr_error *err)
{
	int fd, code = client_socket_connect(&fd, shared->server, deadline_ns, err);

	memset(conn, 0, sizeof *conn);
	return code == PSR_OK ? conn_begin(conn, shared, index, fd, err) : code;
}

int conn_begin(struct conn *conn, struct conn_shared *shared, uint32_t index, int fd, struct psr_error *err)
{
	struct psr_msg_hello hello = { .major = PSR_PROTO_MAJOR, .minor = PSR_PROTO_MINOR, .client = PSR_PROGRAM,
		                           .routing_key = psr_routing_key(shared->plan->model[0].name) };

	memset(conn, 0, sizeof *conn);
	conn->fd = fd;
	conn->shared = shared;
	conn->index = index;
	conn->next_id = 1;
	conn->view = shared->is_view != 0;
	conn->in = malloc(IN_BYTES);
	conn->handle = calloc(shared->plan->n_models, sizeof *conn->handle);
	if (conn->in == NULL || conn->handle == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for %u connections", index + 1);
	psr_framer_init(&conn->framer, PSR_SERVER, conn->in, IN_BYTES);
	while (psr_msg_hello_encode(&conn->out, &hello, NULL) == PSR_ERR_MEMORY && conn_grow(conn)) {
	}
	conn_flush(conn);
	return conn->state == CONN_OVER ? psr_fail(err, conn->why.code, "%s", conn->why.text) : PSR_OK;
}

static void free_assembly(struct conn_request *request)
{
	if (request->assembly != NULL)
		client_assembly_fini(request->assembly);
	free(request->assembly);
	request->assembly = NULL;
}

void conn_close(struct conn *conn)
{
	const struct psr_msg_goodbye goodbye = { .reason = PSR_GOODBYE_DONE };

	if (conn->shared == NULL)
		return;
	if (conn->state != CONN_OVER && conn->out.size == 0 && psr_msg_goodbye_encode(&conn->out, &goodbye, NULL) == PSR_OK)
		conn_flush(conn);
	for (uint32_t i = 0; conn->request != NULL && i < conn->most_open; i++)
		free_assembly(&conn->request[i]);
	if (conn->fd >= 0)
		close(conn->fd);
	free(conn->in);
	free(conn->out.data);
	free(conn->handle);
	free(conn->request);
	memset(conn, 0, sizeof *conn);
}

void conn_fail(struct conn *conn, int code, const char *format, ...)
{
	char text[PSR_ERROR_TEXT];
	va_list args;

	if (conn->state == CONN_OVER)
		return;
	va_start(args, format);
	vsnprintf(text, sizeof text, format, args);
	va_end(args);
	psr_fail(&conn->why, code, "%.200s: %s", conn->shared->server, text);
	conn->state = CONN_OVER;
	for (uint32_t i = 0; conn->request != NULL && i < conn->most_open; i++)
		if (conn->request[i].id != 0)
			conn_end(conn, &conn->request[i], &(struct conn_answer){ .outcome = CONN_FAILED, .code = code });
}

void conn_end(struct conn *conn, struct conn_request *request, const struct conn_answer *answer)
{
	struct conn_request ended;

	free_assembly(request);
	ended = *request;
	request->id = 0;
	conn->n_open--;
	conn->shared->on_answer(conn, &ended, answer);
}

/* ---- bytes ---- */

int conn_grow(struct conn *conn)
{
	const size_t capacity = conn->out.capacity == 0 ? 2048 : 2 * conn->out.capacity;
	uint8_t *grown = capacity <= MAX_OUT ? realloc(conn->out.data, capacity) : NULL;

	if (grown == NULL) {
		conn_fail(conn, PSR_ERR_MEMORY, "no memory for requests, or the server reads none");
		return 0;
	}
	conn->out.data = grown;
	conn->out.capacity = capacity;
	return 1;
}

/* A server that has closed may have sent the reason before: it is still to be read. */
void conn_flush(struct conn *conn)
{
	struct psr_buf *out = &conn->out;

	while (conn->state != CONN_OVER && conn->out_sent < out->size) {
		const ssize_t n = send(conn->fd, out->data + conn->out_sent, out->size - conn->out_sent, MSG_NOSIGNAL);

		if (n >= 0)
			conn->out_sent += (size_t)n;
		else if (errno == EAGAIN || errno == EWOULDBLOCK)
			break;
		else if (errno != EINTR)
			conn->out_sent = out->size;
	}
	memmove(out->data, out->data + conn->out_sent, out->size - conn->out_sent);
	out->size -= conn->out_sent;
	conn->out_sent = 0;
	conn->wants_out = out->size > 0;
}

void conn_read(struct conn *conn)
{
	struct psr_message message;
	struct psr_error err;
	size_t space;
	uint8_t *to = psr_framer_space(&conn->framer, &space);
	ssize_t n;
	int got = 0;

	do
		n = recv(conn->fd, to, space, 0);
	while (n < 0 && errno == EINTR);
	if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
		return;
	if (n <= 0) {
		conn_fail(conn, PSR_ERR_CONNECTION, n < 0 ? "the connection is lost: %s" : "the server closed the connection",
		          strerror(errno));
		return;
	}
	conn->shared->now_ns = clock_ns();
	conn->shared->n_received += (uint64_t)n;
	psr_framer_filled(&conn->framer, (size_t)n);
	while (conn->state != CONN_OVER && (got = psr_framer_next(&conn->framer, &message, &err)) > 0)
		conn_take(conn, &message);
	if (got < 0)
		conn_fail(conn, PSR_ERR_PROTOCOL, "the server broke the protocol: %.300s", err.text);
}

/* ---- requests ---- */

int conn_ask(struct conn *conn, uint64_t k, uint64_t intended_ns, uint32_t n_clients)
{
	struct conn_shared *shared = conn->shared;
	const uint32_t kind = bench_kind_of(shared->plan, conn->index, k);
	struct psr_msg_frame frame = shared->plan->kind[kind].frame;
	struct conn_request *request = conn->request;
	struct psr_error err;
	int code;

	assert(conn->n_open < conn->most_open);
	while (request->id != 0)
		request++;
	if (conn->next_id == UINT32_MAX) {
		conn_fail(conn, PSR_ERR_LIMIT, "the ids of a connection are used up");
		return 0;
	}
	bench_plan_camera(&frame.camera, shared->plan, conn->index, n_clients, k);
	if (conn->view > 0 && !shared->is_decoded && conn->capabilities & PSR_CAP_BASE)
		frame.base = conn->base;
	while ((code = psr_msg_frame_encode(&conn->out, conn->next_id, conn->view, &frame, &err)) == PSR_ERR_MEMORY)
		if (!conn_grow(conn))
			return 0;
	if (code != PSR_OK) {
		conn_fail(conn, code, "%s", err.text);
		return 0;
	}
	*request = (struct conn_request){ .id = conn->next_id++, .kind = kind, .k = k, .intended_ns = intended_ns };
	conn->n_open++;
	if (shared->is_decoded) {
		request->assembly = malloc(sizeof *request->assembly);
		if (request->assembly == NULL) {
			conn_fail(conn, PSR_ERR_MEMORY, "no memory for a picture");
			return 1;
		}
		client_assembly_init(request->assembly, &frame, 0);
	}
	conn_flush(conn);
	return 1;
}

#define _GNU_SOURCE
#include <assert.h>
#include <errno.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include "conn.h"
#include "server/frames/frames.h"
#include "handshake.h"
#include "server/log.h"
#include "server/models/opener.h"
#include "server/server.h"

#define READ_TURN 262144  /* bytes of one connection before others have their turn */
#define WRITE_TURN 4194304
#define LINGER_US 2000000 /* how long the peer may take to close after the last byte */
#define VECTORS 32

static uint64_t to_us(double seconds)
{
	return (uint64_t)(seconds * 1e6);
}

static int may_take(const struct conn *conn)
{
	return (conn->state == CONN_HELLO || conn->state == CONN_OPEN) && !conn->server->is_draining
	       && conn->out.size <= (uint64_t)conn->server->options->max_queue;
}

/* Reading rests while too much waits to be written: requests of a peer that reads no answers are not taken on. */
static void update_events(struct conn *conn)
{
	uint32_t events = 0;

	if (conn->state == CONN_CLOSED)
		return;
	if (!conn->has_eof && (conn->state == CONN_DRAINING || may_take(conn)))
		events |= EPOLLIN;
	if (conn->out.size > 0)
		events |= EPOLLOUT;
	loop_set(&conn->server->loop, &conn->source, events);
}

void conn_close(struct conn *conn)
{
	struct server *server = conn->server;

	if (conn->state == CONN_CLOSED)
		return;
	log_info("connection %llu: closed after %llu bytes", (unsigned long long)conn->number,
	         (unsigned long long)conn->out.sent);
	conn->state = CONN_CLOSED;
	loop_remove(&server->loop, &conn->source);
	close(conn->fd);
	if (conn->previous != NULL)
		conn->previous->next = conn->next;
	else
		server->conns = conn->next;
	if (conn->next != NULL)
		conn->next->previous = conn->previous;
	conn->next = server->dead;
	server->dead = conn;
	server->n_conns--;
}

void conn_destroy(struct conn *conn)
{
	assert(conn->state == CONN_CLOSED);
	frames_forget(conn->server->frames, conn);
	opener_forget(conn->server->opener, conn);
	session_fini(&conn->session, &conn->server->catalogue);
	outq_fini(&conn->out);
	free(conn->input);
	free(conn);
}

void conn_flush(struct conn *conn)
{
	uint64_t before = conn->out.sent;
	struct iovec iov[VECTORS];
	int had_room;

	if (conn->state == CONN_CLOSED)
		return;
	had_room = may_take(conn);
	while (conn->out.size > 0 && conn->out.sent - before < WRITE_TURN) {
		struct msghdr message = { .msg_iov = iov, .msg_iovlen = (size_t)outq_peek(&conn->out, iov, VECTORS) };
		ssize_t n = sendmsg(conn->fd, &message, MSG_NOSIGNAL | MSG_DONTWAIT);

		if (n < 0 && errno == EINTR)
			continue;
		if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
			break;
		if (n < 0) {
			conn_close(conn);
			return;
		}
		outq_consume(&conn->out, (size_t)n);
		conn->server->stats.bytes_sent += (uint64_t)n;
		conn->active_us = conn->server->loop.now_us;
	}
	if (conn->state == CONN_DRAINING && conn->out.size == 0) {
		if (conn->has_eof) {
			conn_close(conn);
			return;
		}
		if (!conn->is_shut) {
			conn->is_shut = 1;
			conn->drain_us = conn->server->loop.now_us;
			shutdown(conn->fd, SHUT_WR);
		}
	}
	if (!had_room && may_take(conn))
		conn->must_resume = conn->server->must_resume = 1;
	update_events(conn);
}

static void append(struct conn *conn, const struct psr_buf *buf)
{
	if (outq_append(&conn->out, buf->data, buf->size, conn->server->loop.now_us) != 0)
		conn_close(conn);
}

void conn_send(struct conn *conn, const struct psr_buf *buf)
{
	if (conn->state == CONN_HELLO || conn->state == CONN_OPEN)
		append(conn, buf);
}

void conn_send_error(struct conn *conn, uint32_t id, uint16_t view, int code, const char *text)
{
	struct psr_msg_error msg = { .code = psr_wire_error_from(code) };
	uint8_t bytes[PSR_ERROR_TEXT + 64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	strncpy(msg.text, text, sizeof msg.text - 1);
	if (psr_msg_error_encode(&buf, id, view, &msg, NULL) == PSR_OK)
		conn_send(conn, &buf);
}

/* Nothing may be written behind the last message, so nothing of what is open may be answered any more. */
void conn_drain(struct conn *conn)
{
	if (conn->state == CONN_DRAINING || conn->state == CONN_CLOSED)
		return;
	conn->state = CONN_DRAINING;
	conn->drain_us = conn->server->loop.now_us;
}

void conn_fail(struct conn *conn, int code, const char *text)
{
	if (conn->state == CONN_DRAINING || conn->state == CONN_CLOSED)
		return;
	log_info("connection %llu: %s", (unsigned long long)conn->number, text);
	conn->server->stats.dropped_peers++;
	conn_send_error(conn, 0, 0, code, text);
	conn_drain(conn);
}

void conn_goodbye(struct conn *conn, enum psr_goodbye reason, const char *text)
{
	struct psr_msg_goodbye msg = { .reason = (uint16_t)reason };
	uint8_t bytes[512];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	strncpy(msg.text, text, sizeof msg.text - 1);
	if (psr_msg_goodbye_encode(&buf, &msg, NULL) == PSR_OK)
		conn_send(conn, &buf);
	conn_drain(conn);
}

/* All whole messages that are there. */
static void take_messages(struct conn *conn)
{
	struct psr_message message;
	struct psr_error error;
	int code = 0;

	while (may_take(conn) && (code = psr_framer_next(&conn->framer, &message, &error)) > 0) {
		if (conn->state == CONN_HELLO) {
			handshake_take(conn, &message);
		} else {
			int taken = session_take(conn, &message, &error);

			if (taken != PSR_OK)
				conn_fail(conn, taken, error.text);
		}
	}
	if (code == PSR_ERR_FORMAT) { /* no client of psr: not a byte for it */
		conn->server->stats.dropped_peers++;
		conn_close(conn);
	} else if (code < 0) {
		conn_fail(conn, code, error.text);
	}
}

void conn_resume(struct conn *conn)
{
	if (!conn->must_resume)
		return;
	conn->must_resume = 0;
	take_messages(conn);
	conn_flush(conn);
}

/* What a draining connection sends is dropped. 0: nothing more is there; > 0 bytes; < 0: it has ended. */
static ssize_t read_some(struct conn *conn)
{
	uint8_t dropped[16384], *space = dropped;
	size_t room = sizeof dropped;
	ssize_t n;

	if (conn->state != CONN_DRAINING)
		space = psr_framer_space(&conn->framer, &room);
	assert(room > 0);
	do
		n = recv(conn->fd, space, room, MSG_DONTWAIT);
	while (n < 0 && errno == EINTR);
	if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
		return 0;
	if (n <= 0)
		return -1;
	if (conn->state != CONN_DRAINING)
		psr_framer_filled(&conn->framer, (size_t)n);
	conn->server->stats.bytes_received += (uint64_t)n;
	return n;
}

/* A client that has closed its end gets no more answers: it cannot be told from one that is gone. */
static void on_readable(struct conn *conn)
{
	size_t total = 0;
	ssize_t n = 1;

	while (total < READ_TURN && (conn->state == CONN_DRAINING || may_take(conn)) && (n = read_some(conn)) > 0) {
		total += (size_t)n;
		if (conn->state != CONN_DRAINING) {
			conn->active_us = conn->server->loop.now_us;
			take_messages(conn);
		}
	}
	if (n < 0 && conn->state != CONN_CLOSED) {
		conn->has_eof = 1;
		conn_drain(conn);
	}
}

static void on_ready(uint32_t events, void *userdata)
{
	struct conn *conn = userdata;
	uint64_t before = conn->out.size;

	if (events & (EPOLLERR | EPOLLHUP)) { /* no answer can reach the peer any more */
		conn_close(conn);
		return;
	}
	if (events & EPOLLOUT)
		conn_flush(conn);
	if (conn->state != CONN_CLOSED && events & EPOLLIN)
		on_readable(conn);
	conn_flush(conn);
	if (conn->out.size < before)
		frames_pump(conn->server->frames);
}

void conn_accept(struct server *server, int fd)
{
	struct conn *conn = calloc(1, sizeof *conn);
	const int on = 1;

	if (conn != NULL)
		conn->input = malloc(PSR_WIRE_MAX_MESSAGE_HELLO);
	if (conn == NULL || conn->input == NULL) {
		free(conn);
		close(fd);
		return;
	}
	setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on); /* fails on Unix sockets, which need no such thing */
	conn->server = server;
	conn->fd = fd;
	conn->number = ++server->n_numbers;
	conn->is_surplus = server->n_conns >= (unsigned)server->options->max_clients;
	conn->start_us = conn->active_us = server->loop.now_us;
	conn->last_waiting = &conn->waiting;
	outq_init(&conn->out);
	psr_framer_init(&conn->framer, PSR_CLIENT, conn->input, PSR_WIRE_MAX_MESSAGE_HELLO);
	conn->source = (struct loop_source){ .fd = fd, .on_ready = on_ready, .userdata = conn };
	if (loop_add(&server->loop, &conn->source, EPOLLIN, NULL) != PSR_OK) {
		free(conn->input);
		free(conn);
		close(fd);
		return;
	}
	conn->next = server->conns;
	if (conn->next != NULL)
		conn->next->previous = conn;
	server->conns = conn;
	server->n_conns++;
	server->stats.connections_total++;
	log_info("connection %llu: accepted, %u there are", (unsigned long long)conn->number, server->n_conns);
}

void conn_tick(struct conn *conn, uint64_t now_us)
{
	const struct options *options = conn->server->options;

	if (conn->state == CONN_DRAINING) {
		uint64_t patience = conn->is_shut ? LINGER_US : to_us(options->slow_timeout);

		if (now_us - conn->drain_us > patience)
			conn_close(conn);
		return;
	}
	if (conn->state == CONN_HELLO && now_us - conn->start_us > to_us(options->handshake_timeout)) {
		log_info("connection %llu: no HELLO in time", (unsigned long long)conn->number);
		conn->server->stats.dropped_peers++;
		conn_close(conn);
	} else if (outq_is_stalled(&conn->out, now_us, to_us(options->slow_timeout))) {
		/* GOODBYE would wait behind what is not read. */
		log_info("connection %llu: reads too slowly", (unsigned long long)conn->number);
		conn->server->stats.dropped_peers++;
		conn_close(conn);
	} else if (conn->state == CONN_OPEN && options->idle_timeout > 0 && conn->out.size == 0
	           && conn->session.n_open == 0 && now_us > conn->active_us
	           && now_us - conn->active_us > to_us(options->idle_timeout)) {
		conn_goodbye(conn, PSR_GOODBYE_IDLE, "nothing was asked for long");
		conn_flush(conn);
	}
}

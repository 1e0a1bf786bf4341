#define _GNU_SOURCE
#include <assert.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include "conn.h"
#include "server/log.h"

#define READ_TURN 131072   /* bytes of one connection before others have their turn */
#define WRITE_TURN 1048576
#define MESSAGES_TURN 64   /* messages, or bytes of answers to them, of one connection before others have their turn */
#define ANSWERS_TURN 65536
#define VECTORS 32
#define INPUT_OPEN PSR_WIRE_MAX_MESSAGE

static int may_take(const struct conn *conn)
{
	return (conn->state == CONN_HELLO || conn->state == CONN_OPEN) && !conn->all->is_draining
	       && conn->out.size <= conn->all->limits.max_queue;
}

/* Stops reading while too much waits to be written: a peer that reads no answers gets no more requests in. */
static void update_events(struct conn *conn)
{
	uint32_t events = 0;

	if (conn->state == CONN_CLOSED)
		return;
	if (!conn->has_eof && (conn->state == CONN_DRAINING || may_take(conn)))
		events |= EPOLLIN;
	if (conn->out.size > 0)
		events |= EPOLLOUT;
	loop_set(conn->all->loop, &conn->source, events);
}

/* Gives the connection a later turn, as it may have work left. */
static void resume(struct conn *conn)
{
	conn->must_resume = conn->all->must_resume = 1;
}

static int may_send_part(const struct conn *conn)
{
	return conn->has_parts && conn->state == CONN_OPEN && conn->out.control.size <= CONN_PARTS_ROOM;
}

void conn_close(struct conn *conn)
{
	struct conns *all = conn->all;

	if (conn->state == CONN_CLOSED)
		return;
	log_info("connection %llu: closed after %llu bytes", (unsigned long long)conn->number,
	         (unsigned long long)conn->out.sent);
	conn->state = CONN_CLOSED;
	conn->must_resume = 0;
	doors_leave(&all->doors, &conn->guest);
	loop_remove(all->loop, &conn->source);
	close(conn->fd);
	*(conn->previous != NULL ? &conn->previous->next : &all->first) = conn->next;
	if (conn->next != NULL)
		conn->next->previous = conn->previous;
	conn->next = all->dead;
	all->dead = conn;
	all->n--;
	all->n_clients -= (unsigned)conn->is_client;
}

/* Returns 0 if the socket takes no more for now, -1 if it is broken. */
static int write_some(struct conn *conn)
{
	uint64_t before = conn->out.sent;
	struct iovec iov[VECTORS];

	while (conn->out.size > 0 && conn->out.sent - before < WRITE_TURN) {
		struct msghdr message = { .msg_iov = iov, .msg_iovlen = (size_t)outq_peek(&conn->out, iov, VECTORS) };
		ssize_t n = sendmsg(conn->fd, &message, MSG_NOSIGNAL | MSG_DONTWAIT);

		if (n < 0 && errno == EINTR)
			continue;
		if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
			break;
		if (n < 0)
			return -1;
		outq_consume(&conn->out, (size_t)n);
		conn->all->bytes_sent += (uint64_t)n;
	}
	conn->all->has_room |= conn->out.sent > before;
	return 0;
}

void conn_flush(struct conn *conn)
{
	int had_room;

	if (conn->state == CONN_CLOSED)
		return;
	had_room = may_take(conn);
	if (write_some(conn) != 0) {
		conn_close(conn);
		return;
	}
	if (conn->state == CONN_DRAINING && conn->out.size == 0) {
		if (conn->has_eof) {
			conn_close(conn);
			return;
		}
		if (!conn->is_shut) {
			conn->is_shut = 1;
			conn->drain_us = conn->all->loop->now_us;
			shutdown(conn->fd, SHUT_WR);
		}
	}
	if ((!had_room && may_take(conn)) || may_send_part(conn))
		resume(conn);
	update_events(conn);
}

static void append(struct conn *conn, const struct psr_buf *buf)
{
	if (outq_append(&conn->out, buf->data, buf->size, conn->all->loop->now_us) != 0)
		conn_close(conn);
}

/* Sends behind the pushed chunks, as the last answer to `id`. */
static void append_behind(struct conn *conn, uint32_t id, const struct psr_buf *buf)
{
	struct outq_chunk *chunk = outq_chunk_create(buf->size);

	if (chunk == NULL) {
		conn_close(conn);
		return;
	}
	memcpy(chunk->data, buf->data, buf->size);
	chunk->size = buf->size;
	conn_push(conn, id, chunk);
}

void conn_push(struct conn *conn, uint32_t id, struct outq_chunk *first)
{
	outq_push(&conn->out, id, first, conn->all->loop->now_us);
}

void conn_drop(struct conn *conn, uint32_t id, unsigned from,
               void (*on_drop)(const struct outq_chunk *chunk, void *userdata), void *userdata)
{
	int had_room = may_take(conn);

	outq_drop(&conn->out, id, from, on_drop, userdata);
	conn->all->has_room = 1;
	if (!had_room && may_take(conn))
		resume(conn);
}

void conn_go_on(struct conn *conn)
{
	conn->has_parts = 1;
	resume(conn);
}

void conn_send(struct conn *conn, const struct psr_buf *buf)
{
	if (conn->state == CONN_HELLO || conn->state == CONN_OPEN)
		append(conn, buf);
}

void conn_send_last(struct conn *conn, uint32_t id, const struct psr_buf *buf)
{
	if (conn->state != CONN_HELLO && conn->state != CONN_OPEN)
		return;
	if (id != 0 && outq_holds(&conn->out, id))
		append_behind(conn, id, buf);
	else
		append(conn, buf);
}

void conn_send_error(struct conn *conn, uint32_t id, uint16_t view, int code, const char *text)
{
	struct psr_msg_error msg = { .code = psr_wire_error_from(code) };
	uint8_t bytes[PSR_ERROR_TEXT + 64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	strncpy(msg.text, text, sizeof msg.text - 1);
	if (psr_msg_error_encode(&buf, id, view, &msg, NULL) == PSR_OK)
		conn_send_last(conn, id, &buf);
}

/* The last message is queued. No other may follow it, so open requests stay unanswered. */
void conn_drain(struct conn *conn)
{
	if (conn->state == CONN_DRAINING || conn->state == CONN_CLOSED)
		return;
	conn->state = CONN_DRAINING;
	conn->drain_us = conn->all->loop->now_us;
	doors_hurry(&conn->guest);
}

/* Sends ERROR with id 0 as the last message, instead of all pushed chunks, and drains. */
static void fail(struct conn *conn, int code, const char *text)
{
	if (conn->state == CONN_DRAINING || conn->state == CONN_CLOSED)
		return;
	log_info("connection %llu: %s", (unsigned long long)conn->number, text);
	conn->all->n_dropped++;
	conn_drop(conn, 0, 0, NULL, NULL);
	conn_send_error(conn, 0, 0, code, text);
	conn_drain(conn);
}

void conn_goodbye(struct conn *conn, enum psr_goodbye reason, const char *text)
{
	struct psr_msg_goodbye msg = { .reason = (uint16_t)reason };
	uint8_t bytes[512];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	strncpy(msg.text, text, sizeof msg.text - 1);
	if (psr_msg_goodbye_encode(&buf, &msg, NULL) == PSR_OK && conn->state == CONN_OPEN)
		append_behind(conn, 0, &buf);
	conn_drain(conn);
}

/* Takes whole messages, a turn of them. */
static void take_messages(struct conn *conn)
{
	const uint64_t full = conn->out.size + ANSWERS_TURN;
	struct psr_message message;
	struct psr_error error;
	int code = 0;

	for (int n = 0; may_take(conn) && (code = psr_framer_next(&conn->framer, &message, &error)) > 0; n++) {
		const struct conn_user *user = conn->all->user;
		int taken = conn->state == CONN_HELLO ? user->on_hello(conn, &message, &error)
		                                      : user->on_message(conn, &message, &error);

		if (taken != PSR_OK)
			fail(conn, taken, error.text);
		if (n + 1 == MESSAGES_TURN || conn->out.size >= full) {
			resume(conn);
			return;
		}
	}
	if (code == PSR_ERR_FORMAT) { /* not a psr client: psrd sends it no byte */
		conn->all->n_dropped++;
		conn_close(conn);
	} else if (code < 0) {
		fail(conn, code, error.text);
	}
}

void conn_take_turn(struct conn *conn)
{
	conn->must_resume = 0;
	take_messages(conn);
	if (may_send_part(conn))
		conn->has_parts = conn->all->user->on_part(conn);
	conn_flush(conn);
}

int conn_open(struct conn *conn, struct psr_error *err)
{
	struct conns *all = conn->all;
	uint8_t *input;

	if (all->n_clients >= all->limits.max_clients) {
		all->n_busy++;
		return psr_fail(err, PSR_ERR_BUSY, "the server is full: it serves %u clients; try again later",
		                all->n_clients);
	}
	input = malloc(INPUT_OPEN);
	if (input == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "the server has no memory for another client");
	psr_framer_accept(&conn->framer, input, INPUT_OPEN);
	free(conn->input);
	all->bytes_input += INPUT_OPEN - conn->input_bytes;
	conn->input = input;
	conn->input_bytes = INPUT_OPEN;
	conn->state = CONN_OPEN;
	conn->is_client = 1;
	all->n_clients++;
	doors_leave(&all->doors, &conn->guest);
	return PSR_OK;
}

/* Reads into the framer; drops the bytes if the connection drains. Returns their number, and whether the socket had no
 * more; 0: it has none now; < 0: the peer has ended. */
static ssize_t read_some(struct conn *conn, int *is_all)
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
	conn->all->bytes_received += (uint64_t)n;
	*is_all = (size_t)n < room;
	return n;
}

/* A client that has closed its end gets no more answers: psrd cannot tell it from a client that is gone. */
void conn_read(struct conn *conn)
{
	size_t total = 0;
	ssize_t n = 1;
	int is_all = 0;

	while (!is_all && total < READ_TURN && !conn->must_resume && (conn->state == CONN_DRAINING || may_take(conn))
	       && (n = read_some(conn, &is_all)) > 0) {
		total += (size_t)n;
		if (conn->state != CONN_DRAINING) {
			silence_heard(&conn->silence, conn->all->loop->now_us);
			take_messages(conn);
		}
	}
	if (n < 0 && conn->state != CONN_CLOSED) {
		conn->has_eof = 1;
		conn_drain(conn);
	}
}

void conn_on_ready(uint32_t events, void *userdata)
{
	struct conn *conn = userdata;

	if (events & (EPOLLERR | EPOLLHUP)) { /* no answer can reach the peer any more */
		conn_close(conn);
		return;
	}
	if (events & EPOLLOUT) { /* the peer has taken bytes: it lives */
		silence_heard(&conn->silence, conn->all->loop->now_us);
		conn_flush(conn);
	}
	if (conn->state != CONN_CLOSED && events & EPOLLIN)
		conn_read(conn);
	conn_flush(conn);
}

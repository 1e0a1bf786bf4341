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
#include "server/log.h"

#define READ_TURN 262144  /* bytes of one connection before others have their turn */
#define WRITE_TURN 4194304
#define LINGER_US 2000000 /* how long the peer may take to close after the last byte */
#define VECTORS 32
#define INPUT_OPEN (2 * PSR_WIRE_MAX_MESSAGE)

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

void conn_close(struct conn *conn)
{
	struct conns *all = conn->all;

	if (conn->state == CONN_CLOSED)
		return;
	log_info("connection %llu: closed after %llu bytes", (unsigned long long)conn->number,
	         (unsigned long long)conn->out.sent);
	conn->state = CONN_CLOSED;
	loop_remove(all->loop, &conn->source);
	close(conn->fd);
	if (conn->previous != NULL)
		conn->previous->next = conn->next;
	else
		all->first = conn->next;
	if (conn->next != NULL)
		conn->next->previous = conn->previous;
	conn->next = all->dead;
	all->dead = conn;
	all->n--;
}

static void destroy(struct conn *conn)
{
	assert(conn->state == CONN_CLOSED);
	conn->all->user->on_end(conn);
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
		conn->all->bytes_sent += (uint64_t)n;
		conn->active_us = conn->all->loop->now_us;
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
	if (!had_room && may_take(conn))
		conn->must_resume = conn->all->must_resume = 1;
	update_events(conn);
}

static void append(struct conn *conn, const struct psr_buf *buf)
{
	if (outq_append(&conn->out, buf->data, buf->size, conn->all->loop->now_us) != 0)
		conn_close(conn);
}

void conn_push(struct conn *conn, struct outq_chunk *first)
{
	outq_push(&conn->out, first, conn->all->loop->now_us);
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

/* No open request is answered any more: nothing may follow the last message. */
void conn_drain(struct conn *conn)
{
	if (conn->state == CONN_DRAINING || conn->state == CONN_CLOSED)
		return;
	conn->state = CONN_DRAINING;
	conn->drain_us = conn->all->loop->now_us;
}

void conn_fail(struct conn *conn, int code, const char *text)
{
	if (conn->state == CONN_DRAINING || conn->state == CONN_CLOSED)
		return;
	log_info("connection %llu: %s", (unsigned long long)conn->number, text);
	conn->all->n_dropped++;
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

/* Takes all whole messages. */
static void take_messages(struct conn *conn)
{
	struct psr_message message;
	struct psr_error error;
	int code = 0;

	while (may_take(conn) && (code = psr_framer_next(&conn->framer, &message, &error)) > 0) {
		const struct conn_user *user = conn->all->user;
		int taken = conn->state == CONN_HELLO ? user->on_hello(conn, &message, &error)
		                                      : user->on_message(conn, &message, &error);

		if (taken != PSR_OK)
			conn_fail(conn, taken, error.text);
	}
	if (code == PSR_ERR_FORMAT) { /* not a client of psr: it gets no byte */
		conn->all->n_dropped++;
		conn_close(conn);
	} else if (code < 0) {
		conn_fail(conn, code, error.text);
	}
}

int conn_open(struct conn *conn)
{
	uint8_t *input = malloc(INPUT_OPEN);

	if (input == NULL)
		return PSR_ERR_MEMORY;
	psr_framer_accept(&conn->framer, input, INPUT_OPEN);
	free(conn->input);
	conn->input = input;
	conn->state = CONN_OPEN;
	return PSR_OK;
}

/* Drops the input of a draining connection. Returns the bytes; 0: none now; < 0: the peer has ended. */
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
	conn->all->bytes_received += (uint64_t)n;
	return n;
}

/* A client that closed its end gets no more answers: it looks like one that is gone. */
static void on_readable(struct conn *conn)
{
	size_t total = 0;
	ssize_t n = 1;

	while (total < READ_TURN && (conn->state == CONN_DRAINING || may_take(conn)) && (n = read_some(conn)) > 0) {
		total += (size_t)n;
		if (conn->state != CONN_DRAINING) {
			conn->active_us = conn->all->loop->now_us;
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
		conn->all->user->on_room(conn->all->user->userdata);
}

void conn_accept(struct conns *conns, int fd)
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
	setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on); /* fails on Unix sockets, which do not need it */
	conn->all = conns;
	conn->fd = fd;
	conn->number = ++conns->n_ever;
	conn->is_surplus = conns->n >= conns->limits.max_clients;
	conn->start_us = conn->active_us = conns->loop->now_us;
	outq_init(&conn->out);
	psr_framer_init(&conn->framer, PSR_CLIENT, conn->input, PSR_WIRE_MAX_MESSAGE_HELLO);
	conn->source = (struct loop_source){ .fd = fd, .on_ready = on_ready, .userdata = conn };
	if (loop_add(conns->loop, &conn->source, EPOLLIN, NULL) != PSR_OK) {
		free(conn->input);
		free(conn);
		close(fd);
		return;
	}
	conn->next = conns->first;
	if (conn->next != NULL)
		conn->next->previous = conn;
	conns->first = conn;
	conns->n++;
	log_info("connection %llu: accepted, %u open", (unsigned long long)conn->number, conns->n);
}

static void tick(struct conn *conn, uint64_t now_us)
{
	const struct conn_limits *limits = &conn->all->limits;

	if (conn->state == CONN_DRAINING) {
		if (now_us - conn->drain_us > (conn->is_shut ? LINGER_US : limits->slow_us))
			conn_close(conn);
	} else if (conn->state == CONN_HELLO && now_us - conn->start_us > limits->handshake_us) {
		log_info("connection %llu: no HELLO in time", (unsigned long long)conn->number);
		conn->all->n_dropped++;
		conn_close(conn);
	} else if (outq_is_stalled(&conn->out, now_us, limits->slow_us)) {
		/* No GOODBYE: it would wait behind what the peer does not read. */
		log_info("connection %llu: reads too slowly", (unsigned long long)conn->number);
		conn->all->n_dropped++;
		conn_close(conn);
	} else if (conn->state == CONN_OPEN && limits->idle_us > 0 && conn->out.size == 0
	           && !conn->all->user->is_busy(conn) && now_us > conn->active_us
	           && now_us - conn->active_us > limits->idle_us) {
		conn_goodbye(conn, PSR_GOODBYE_IDLE, "no request for too long");
		conn_flush(conn);
	}
}

void conns_init(struct conns *conns, struct loop *loop, const struct conn_limits *limits, const struct conn_user *user)
{
	*conns = (struct conns){ .loop = loop, .limits = *limits, .user = user };
}

void conns_tick(struct conns *conns)
{
	struct conn *next;

	for (struct conn *conn = conns->first; conn != NULL; conn = next) {
		next = conn->next;
		tick(conn, conns->loop->now_us);
	}
}

void conns_resume(struct conns *conns)
{
	while (conns->must_resume) {
		struct conn *next;

		conns->must_resume = 0;
		for (struct conn *conn = conns->first; conn != NULL; conn = next) {
			next = conn->next;
			if (!conn->must_resume)
				continue;
			conn->must_resume = 0;
			take_messages(conn);
			conn_flush(conn);
		}
	}
}

void conns_end_batch(struct conns *conns)
{
	while (conns->dead != NULL) {
		struct conn *conn = conns->dead;

		conns->dead = conn->next;
		destroy(conn);
	}
}

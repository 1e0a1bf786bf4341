/* All connections together: new ones, their timeouts and turns, and the freeing of closed ones. */
#include <assert.h>
#include <stdlib.h>
#include <unistd.h>
#include "conn.h"
#include "server/log.h"

#define LINGER_US 2000000 /* how long the peer may take to close after the last byte */
#define LATE_US 300000    /* a tick that comes later shows that psrd, or its machine, stood still */

void conns_init(struct conns *conns, struct loop *loop, const struct conn_limits *limits, const struct conn_user *user)
{
	*conns = (struct conns){ .loop = loop, .limits = *limits, .user = user };
	doors_init(&conns->doors, limits->max_pending, limits->max_pending_per_origin);
}

static struct conn *guest_conn(struct doors_guest *guest)
{
	return (struct conn *)(void *)((char *)guest - offsetof(struct conn, guest));
}

/* Closes the guest that a newcomer replaces. */
static void show_out(struct doors_guest *guest)
{
	struct conn *conn;

	if (guest == NULL)
		return;
	conn = guest_conn(guest);
	log_info("connection %llu: makes room for a newer one", (unsigned long long)conn->number);
	conn->all->n_dropped++;
	conn_close(conn);
}

int conns_drop_pending(struct conns *conns)
{
	struct doors_guest *guest = doors_oldest(&conns->doors);

	show_out(guest);
	return guest != NULL;
}

static struct conn *create(struct conns *conns, int fd)
{
	struct conn *conn = calloc(1, sizeof *conn);

	if (conn != NULL)
		conn->input = malloc(PSR_WIRE_MAX_MESSAGE_HELLO);
	if (conn == NULL || conn->input == NULL) {
		free(conn);
		return NULL;
	}
	conn->all = conns;
	conn->fd = fd;
	conn->start_us = conns->loop->now_us;
	conn->input_bytes = PSR_WIRE_MAX_MESSAGE_HELLO;
	silence_heard(&conn->silence, conns->loop->now_us);
	outq_init(&conn->out, &conns->bytes_queued);
	conn->out.on_sent = conns->user->on_sent;
	conn->out.userdata = conns->user->userdata;
	psr_framer_init(&conn->framer, PSR_CLIENT, conn->input, PSR_WIRE_MAX_MESSAGE_HELLO);
	conn->source = (struct loop_source){ .fd = fd, .on_ready = conn_on_ready, .userdata = conn };
	if (loop_add(conns->loop, &conn->source, EPOLLIN, NULL) != PSR_OK) {
		free(conn->input);
		free(conn);
		return NULL;
	}
	return conn;
}

/* A HELLO usually arrives with the connection. A client that says it at once takes no place at the doors. */
void conn_accept(struct conns *conns, int fd, const struct sockaddr_storage *peer)
{
	struct conn *conn = create(conns, fd);

	if (conn == NULL) {
		close(fd);
		return;
	}
	conn->number = ++conns->n_ever;
	conn->next = conns->first;
	if (conn->next != NULL)
		conn->next->previous = conn;
	conns->first = conn;
	conns->n++;
	conns->bytes_input += conn->input_bytes;
	log_info("connection %llu: accepted, %u open", (unsigned long long)conn->number, conns->n);
	conn_read(conn);
	conn_flush(conn);
	if (conn->state == CONN_CLOSED || conn->is_client)
		return;
	show_out(doors_enter(&conns->doors, &conn->guest, doors_origin_of(fd, peer)));
	if (conn->state == CONN_DRAINING)
		doors_hurry(&conn->guest);
}

static void drop(struct conn *conn, const char *why)
{
	log_info("connection %llu: %s", (unsigned long long)conn->number, why);
	conn->all->n_dropped++;
	conn_close(conn);
}

static void send_ping(struct conn *conn)
{
	const struct psr_msg_ping ping = { .token = conn->all->loop->now_us };
	uint8_t bytes[64];
	struct psr_buf buf = { .data = bytes, .capacity = sizeof bytes };

	if (psr_msg_ping_encode(&buf, &ping, NULL) == PSR_OK)
		conn_send(conn, &buf);
	conn_flush(conn);
}

/* While answers wait, psrd judges the peer by how much of them it takes. */
static void look_for_silence(struct conn *conn, uint64_t now_us)
{
	struct conns *all = conn->all;

	if (conn->state != CONN_OPEN || conn->out.size > 0)
		return;
	switch (silence_look(&conn->silence, now_us, all->limits.idle_us, all->user->is_busy(conn))) {
	case SILENCE_FINE:
		break;
	case SILENCE_PING:
		send_ping(conn);
		break;
	case SILENCE_IDLE:
		all->n_dropped++;
		all->n_idle++;
		conn_goodbye(conn, PSR_GOODBYE_IDLE, "no request, nor an answer to PING, for too long");
		conn_flush(conn);
		break;
	case SILENCE_DEAD:
		all->n_idle++;
		drop(conn, "does not answer PING");
	}
}

static void tick(struct conn *conn, uint64_t now_us)
{
	const struct conn_limits *limits = &conn->all->limits;

	if (conn->state == CONN_DRAINING) {
		if (now_us - conn->drain_us > (conn->is_shut ? LINGER_US : limits->slow_us))
			conn_close(conn);
	} else if (conn->state == CONN_HELLO && now_us - conn->start_us > limits->handshake_us) {
		drop(conn, "no HELLO in time");
	} else if (outq_is_stalled(&conn->out, now_us, limits->slow_us)) {
		conn->all->n_slow++;
		drop(conn, "reads too slowly"); /* without GOODBYE, which would wait behind unread data */
	} else {
		look_for_silence(conn, now_us);
	}
}

/* psrd heard no peer while it stood still: that time does not count. */
static void forgive(struct conn *conn, uint64_t late_us, uint64_t now_us)
{
	uint64_t *const since_us[] = { &conn->start_us, &conn->drain_us, &conn->silence.heard_us, &conn->silence.pinged_us,
		                           &conn->out.mark_us };

	for (size_t i = 0; i < sizeof since_us / sizeof since_us[0]; i++)
		if (*since_us[i] != 0)
			*since_us[i] = now_us - *since_us[i] > late_us ? *since_us[i] + late_us : now_us;
}

void conns_tick(struct conns *conns)
{
	struct conn *next;

	for (struct conn *conn = conns->first; conn != NULL && conns->loop->late_us > LATE_US; conn = conn->next)
		forgive(conn, conns->loop->late_us, conns->loop->now_us);
	for (struct conn *conn = conns->first; conn != NULL; conn = next) {
		next = conn->next;
		tick(conn, conns->loop->now_us);
	}
}

static void destroy(struct conn *conn)
{
	assert(conn->state == CONN_CLOSED);
	conn->all->user->on_end(conn);
	conn->all->bytes_input -= conn->input_bytes;
	outq_fini(&conn->out);
	free(conn->input);
	free(conn);
}

/* Each connection has one turn; the rest of its work comes in the next batch, which begins at once. */
static void give_turns(struct conns *conns)
{
	struct conn *next;

	if (!conns->must_resume)
		return;
	conns->must_resume = 0;
	for (struct conn *conn = conns->first; conn != NULL; conn = next) {
		next = conn->next;
		if (conn->must_resume)
			conn_take_turn(conn);
	}
	if (conns->must_resume)
		loop_go_on(conns->loop);
}

void conns_end_batch(struct conns *conns)
{
	give_turns(conns);
	if (conns->has_room) {
		conns->has_room = 0;
		conns->user->on_room(conns->user->userdata);
	}
	while (conns->dead != NULL) {
		struct conn *conn = conns->dead;

		conns->dead = conn->next;
		destroy(conn);
	}
}

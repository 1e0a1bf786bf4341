/* Connections: bytes in, messages to the user above, bytes out; states, timeouts, back-pressure.
 *
 * Everything here belongs to the loop's thread. A connection that closes stays in memory until conns_end_batch(). */
#ifndef PSRD_CONN_H
#define PSRD_CONN_H

#include "loop.h"
#include "outq.h"
#include "psr/proto.h"

#define CONN_SPARE 16 /* connections beyond the limit that are told so */

struct conn;

/* What the layer above does with connections. */
struct conn_user {
	int (*on_hello)(struct conn *conn, const struct psr_message *message, struct psr_error *err);
	                                 /* the first message; an error refuses the client with its text */
	int (*on_message)(struct conn *conn, const struct psr_message *message, struct psr_error *err);
	                                 /* a later one; an error: the client broke the protocol */
	int (*is_busy)(const struct conn *conn);   /* requests are unanswered: it is not idle */
	void (*on_room)(void *userdata);           /* the output queue of some connection shrank */
	void (*on_end)(struct conn *conn);         /* before the memory of a closed one goes */
	void *userdata;
};

struct conn_limits {
	unsigned max_clients;
	uint64_t max_queue;                         /* bytes that wait in a queue while messages are still taken */
	uint64_t handshake_us, idle_us, slow_us;    /* idle: 0, never */
};

/* All connections of the daemon. */
struct conns {
	struct loop *loop;
	const struct conn_user *user;
	struct conn_limits limits;
	struct conn *first, *dead; /* dead: closed in this batch */
	unsigned n;
	int is_draining;           /* no more messages are taken */
	int must_resume;           /* a connection has this flag */
	uint64_t n_ever, n_dropped, bytes_sent, bytes_received;
};

enum conn_state {
	CONN_HELLO,    /* only HELLO may come */
	CONN_OPEN,
	CONN_DRAINING, /* sends its last bytes, drops all input, then closes */
	CONN_CLOSED,   /* waits to be freed */
};

struct conn {
	struct conns *all;
	struct conn *next, *previous;
	uint64_t number;           /* for the log */
	enum conn_state state;
	int fd, is_surplus;        /* surplus: beyond max_clients; its HELLO gets ERROR busy */
	int is_shut;               /* DRAINING: all is sent; waits for the peer to close */
	int has_eof, must_resume;  /* resume: the framer may hold messages, and there is room for answers again */
	struct loop_source source;
	struct psr_framer framer;
	uint8_t *input;
	struct outq out;
	uint64_t start_us, active_us, drain_us; /* accepted, last bytes either way, DRAINING since */
	void *session;             /* the user's; NULL until on_hello sets it */
};

void conns_init(struct conns *conns, struct loop *loop, const struct conn_limits *limits, const struct conn_user *user);
void conns_tick(struct conns *conns);      /* timeouts */
void conns_resume(struct conns *conns);    /* takes messages that had to wait for room */
void conns_end_batch(struct conns *conns); /* frees the closed ones */

void conn_accept(struct conns *conns, int fd); /* takes fd */
int conn_open(struct conn *conn);              /* on_hello accepts the client: room for longer messages. MEMORY */

/* One control message; without memory the connection closes. */
void conn_send(struct conn *conn, const struct psr_buf *buf);
void conn_send_error(struct conn *conn, uint32_t id, uint16_t view, int code, const char *text);
void conn_push(struct conn *conn, struct outq_chunk *first); /* takes the chunks */

/* ERROR with id 0, or GOODBYE, then DRAINING. Nothing happens if it drains already. */
void conn_fail(struct conn *conn, int code, const char *text);
void conn_goodbye(struct conn *conn, enum psr_goodbye reason, const char *text);
void conn_drain(struct conn *conn); /* without a word */

void conn_flush(struct conn *conn); /* writes what the socket takes */
void conn_close(struct conn *conn); /* at once */

#endif

/* Connections: bytes in, messages to the layer above, bytes out; states, timeouts, back-pressure.
 *
 * Everything here belongs to the loop's thread. A closed connection stays in memory until conns_end_batch(). A
 * connection handles a limited number of bytes and messages in its turn; the rest waits until all others have had
 * theirs. */
#ifndef PSRD_CONN_H
#define PSRD_CONN_H

#include "doors.h"
#include "loop.h"
#include "outq.h"
#include "proto/proto.h"
#include "silence.h"

#define CONN_SHUTDOWN "the server is shutting down" /* in the ERRORs and the GOODBYE of its end */
#define CONN_PARTS_ROOM 65536 /* bytes of control messages that wait while an answer in parts rests */

struct conn;

/* Calls from here to the layer above. */
struct conn_user {
	int (*on_hello)(struct conn *conn, const struct psr_message *message, struct psr_error *err);
	                                 /* handles the first message; an error refuses the client with its text */
	int (*on_message)(struct conn *conn, const struct psr_message *message, struct psr_error *err);
	                                 /* handles a later message; an error: the client broke the protocol */
	int (*is_busy)(const struct conn *conn);   /* whether requests are unanswered: then the connection is not idle */
	void (*on_room)(void *userdata);           /* output queues of connections shrank; once a batch */
	void (*on_sent)(const struct outq_chunk *chunk, void *userdata); /* the socket took all of a pushed chunk that has
	                                                                  * asked_ns */
	int (*on_part)(struct conn *conn);         /* sends the next part of an answer; 1: there are more, see conn_go_on() */
	void (*on_end)(struct conn *conn);         /* before the memory of a closed one goes */
	void *userdata;
};

struct conn_limits {
	unsigned max_clients;                       /* connections whose HELLO psrd accepted */
	unsigned max_pending, max_pending_per_origin; /* connections that are not clients; see doors.h */
	uint64_t max_queue;                         /* psrd takes no messages while a queue holds more bytes */
	uint64_t handshake_us, idle_us, slow_us;    /* idle: 0, never */
};

/* All connections of the daemon. */
struct conns {
	struct loop *loop;
	const struct conn_user *user;
	struct conn_limits limits;
	struct doors doors;        /* holds connections that are not clients: before HELLO, or refused */
	struct conn *first, *dead; /* dead: closed in this batch */
	unsigned n, n_clients;     /* all connections; those whose HELLO was accepted */
	int is_draining;           /* psrd takes no more messages */
	int must_resume;           /* some connection has must_resume set */
	int has_room;              /* on_room is due */
	uint64_t n_ever, n_busy;   /* accepted; refused, as there were max_clients */
	uint64_t n_dropped, n_slow, n_idle; /* for an error or a limit; of these, for slow reading; for silence */
	uint64_t bytes_sent, bytes_received;
	uint64_t bytes_queued, bytes_input; /* bytes in all output queues, and in all input buffers */
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
	int fd;
	int is_client;             /* psrd accepted its HELLO */
	int is_shut;               /* DRAINING: it has sent everything, and waits for the peer to close */
	int has_eof, must_resume;  /* must_resume: it gets another turn: the framer may hold messages, or has_parts */
	int has_parts;             /* on_part has more to send */
	struct loop_source source;
	struct doors_guest guest;
	struct psr_framer framer;
	uint8_t *input;
	size_t input_bytes;
	struct outq out;
	struct silence silence;
	uint64_t start_us, drain_us; /* when it was accepted, and when it became DRAINING */
	void *session;             /* the layer above's; NULL until on_hello sets it */
};

void conns_init(struct conns *conns, struct loop *loop, const struct conn_limits *limits, const struct conn_user *user);
void conns_tick(struct conns *conns);      /* applies timeouts */
void conns_end_batch(struct conns *conns); /* turns that are due, on_room; frees the closed ones */
int conns_drop_pending(struct conns *conns); /* closes a connection that is not a client, to free its descriptor;
                                              * returns 0 if there is none */

void conn_accept(struct conns *conns, int fd, const struct sockaddr_storage *peer); /* takes fd */

/* on_hello calls it to accept the client: makes room for longer messages. BUSY: the server is full; MEMORY. */
int conn_open(struct conn *conn, struct psr_error *err);

/* Sends one control message, ahead of pushed chunks; without memory the connection closes. No pushed chunk may have its
 * id. */
void conn_send(struct conn *conn, const struct psr_buf *buf);
/* sends an ERROR behind the control messages */
void conn_send_error(struct conn *conn, uint32_t id, uint16_t view, int code, const char *text);
void conn_push(struct conn *conn, uint32_t id, struct outq_chunk *first); /* pushes answers to id, and takes the
                                                                           * chunks */
void conn_send_last(struct conn *conn, uint32_t id, const struct psr_buf *buf); /* sends behind the chunks of id */
/* Frees the pushed chunks of id, from a part on; see outq_drop(). */
void conn_drop(struct conn *conn, uint32_t id, unsigned from,
               void (*on_drop)(const struct outq_chunk *chunk, void *userdata), void *userdata);
void conn_go_on(struct conn *conn);             /* an answer has parts: calls on_part, in turn with other connections */

/* Sends GOODBYE as the last message, behind all pushed chunks, and drains. Does nothing to a connection that drains
 * already. */
void conn_goodbye(struct conn *conn, enum psr_goodbye reason, const char *text);
void conn_drain(struct conn *conn); /* drains without a message */

void conn_flush(struct conn *conn); /* writes as much as the socket takes */
void conn_close(struct conn *conn); /* at once */
void conn_read(struct conn *conn);  /* reads what the socket has, up to a turn */
void conn_take_turn(struct conn *conn); /* handles messages and parts that had to wait */
void conn_on_ready(uint32_t events, void *userdata); /* the source's callback; userdata is the connection */

#endif

/* Connections: bytes in, messages to the session, bytes out; states, timeouts, back-pressure. */
#ifndef PSRD_CONN_H
#define PSRD_CONN_H

#include "loop.h"
#include "outq.h"
#include "proto/proto.h"
#include "server/session/session.h"

struct frame;
struct server;

enum conn_state {
	CONN_HELLO,    /* nothing but HELLO may come */
	CONN_OPEN,
	CONN_DRAINING, /* the last bytes go out, what comes is dropped, then it closes */
	CONN_CLOSED,   /* waits to be freed */
};

struct conn {
	struct server *server;
	struct conn *next, *previous;
	uint64_t number;
	enum conn_state state;
	int fd, is_surplus;        /* surplus: beyond --max-clients, its HELLO is answered by ERROR busy */
	int is_shut;               /* DRAINING: everything is out, the peer's end is awaited */
	int has_eof, must_resume;  /* resume: messages may wait in the framer, and there is room for answers again */
	struct loop_source source;
	struct psr_framer framer;
	uint8_t *input;
	struct outq out;
	uint64_t start_us, active_us, drain_us; /* when it came, last bytes either way, when DRAINING began */
	struct session session;
	/* server/frames/frames.c: */
	struct frame *waiting, **last_waiting, *running;
	struct conn *next_turn;
	int has_turn;
	uint64_t reserved;         /* greatest bytes that its running frames may add to `out` */
};

void conn_accept(struct server *server, int fd); /* takes fd */

/* One control message; without memory the connection closes. */
void conn_send(struct conn *conn, const struct psr_buf *buf);
void conn_send_error(struct conn *conn, uint32_t id, uint16_t view, int code, const char *text);

/* ERROR with id 0, or GOODBYE, then DRAINING. Nothing happens if it is already. */
void conn_fail(struct conn *conn, int code, const char *text);
void conn_goodbye(struct conn *conn, enum psr_goodbye reason, const char *text);
void conn_drain(struct conn *conn); /* without a word */

void conn_flush(struct conn *conn); /* writes what the socket takes */
void conn_resume(struct conn *conn); /* takes messages that had to wait */
void conn_close(struct conn *conn); /* at once; freed at the end of the batch */
void conn_tick(struct conn *conn, uint64_t now_us);
void conn_destroy(struct conn *conn); /* closed ones only */

#endif

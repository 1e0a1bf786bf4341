/* A connection of a load: never blocks, and holds no picture unless asked to. Its owner watches the socket and gives
 * the time. */
#ifndef PSR_CLIENT_BENCH_CONN_H
#define PSR_CLIENT_BENCH_CONN_H

#include "client/lib/internal.h"
#include "plan.h"

enum conn_state { CONN_HELLO, CONN_OPENING, CONN_READY, CONN_OVER };

struct conn_request {
	uint32_t id, kind; /* id 0: this place is free */
	uint64_t k;        /* its number; see bench_plan_camera() */
	uint64_t intended_ns, first_ns; /* first_ns 0: no byte of the answer has come */
	struct psr_msg_settings settings; /* of the frame that began last */
	uint64_t bytes, decode_ns;        /* decode_ns 0: the picture was not decoded */
	struct client_assembly *assembly; /* NULL: the picture is not decoded */
};

enum conn_outcome { CONN_DRAWN, CONN_SUPERSEDED, CONN_FAILED };

struct conn_answer {
	enum conn_outcome outcome;
	int code;                            /* FAILED: enum psr_err; CANCELLED, too */
	const char *text;                    /* FAILED: what the server says of it; NULL: nothing */
	const struct psr_msg_frame_end *end; /* DRAWN: of the last frame */
};

struct conn;

/* What the connections of a thread share. */
struct conn_shared {
	const struct bench_plan *plan;
	const char *server;
	int is_view, is_decoded;
	struct client_decoder *decoder; /* with is_decoded */
	uint64_t now_ns;                /* when the bytes in work were read; clock_ns() */
	uint64_t n_received;            /* bytes of all connections */
	struct psr_msg_frame_begin begin; /* scratch */
	struct psr_msg_frame_end end;
	struct psr_msg_scene scene;
	void *userdata;
	void (*on_ready)(struct conn *conn);
	/* The request ends with this call; it may send another one. */
	void (*on_answer)(struct conn *conn, const struct conn_request *request, const struct conn_answer *answer);
};

struct conn {
	struct conn_shared *shared;
	uint32_t index;          /* among all connections of the load */
	enum conn_state state;
	struct psr_error why;    /* OVER */
	int fd, wants_out;       /* wants_out: watch for EPOLLOUT, too */
	uint16_t view;           /* 0 or 1 */
	uint32_t most_open;      /* requests that may be open */
	struct psr_framer framer;
	uint8_t *in;
	struct psr_buf out;
	size_t out_sent;
	uint32_t next_id, control_id, scene_id, n_opened, base;
	uint32_t *handle;        /* of each model of the plan */
	uint64_t capabilities;
	struct conn_request *request; /* most_open of them */
	uint32_t n_open;
};

/* Connects and sends HELLO. conn_close() is due also after an error. CONNECTION, MEMORY. */
int conn_open(struct conn *conn, struct conn_shared *shared, uint32_t index, uint64_t deadline_ns,
              struct psr_error *err);
/* The same on a socket that is connected and does not block. Takes fd. */
int conn_begin(struct conn *conn, struct conn_shared *shared, uint32_t index, int fd, struct psr_error *err);
void conn_close(struct conn *conn); /* a struct of zeros is fine */

/* Reads what is there, once, and handles whole messages. The state becomes OVER if the connection is lost. */
void conn_read(struct conn *conn);
void conn_flush(struct conn *conn); /* sends what the socket takes; sets wants_out */

/* Sends request k, intended for that time. READY, and less than most_open are open. Returns whether on_answer() will be
 * called for it, or was. */
int conn_ask(struct conn *conn, uint64_t k, uint64_t intended_ns, uint32_t n_clients);

/* Ends the connection: its open requests fail by on_answer(). */
void conn_fail(struct conn *conn, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));

#endif

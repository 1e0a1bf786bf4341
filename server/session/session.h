/* A client's session turns messages into actions. It holds the client's open models, scenes and unanswered requests. */
#ifndef PSRD_SESSION_H
#define PSRD_SESSION_H

#include "server/frames/frames.h"
#include "server/models/opener.h"
#include "server/options.h"
#include "fetches.h"
#include "lists.h"

/* Shared by all sessions. */
struct sessions {
	const struct options *options;
	struct conns *conns;
	struct catalogue *catalogue;
	struct opener *opener;
	struct builder *builder;    /* NULL: the daemon ends */
	struct frames *frames;
	struct psr_pool *pool, *io;
	struct fetch_read *reads;   /* of fetches, on the io pool; NULL: none */
	uint64_t n_fetches;         /* unanswered, of all sessions */
	uint64_t start_us;          /* when the daemon started */
	struct psr_msg_scene scene; /* scratch: 80 KiB */
};

struct session {
	struct sessions *all;
	struct conn *conn;
	uint32_t last_id;
	uint32_t n_open;            /* unanswered requests: LIST, OPEN, FETCH, and FRAME in view 0 */
	struct handles handles;
	struct lists lists;
	struct fetches fetches;
	struct scene *slot[PSR_WIRE_MAX_SCENES];
	struct flow flow;
};

/* The daemon ends: answers unanswered LIST and FETCH requests with ERROR. */
void sessions_refuse(struct session *session, int code, const char *text);

/* Calls from the layers below; userdata of the first is the struct sessions. */
void sessions_conn_user(struct conn_user *user, struct sessions *sessions);
extern const struct opener_user sessions_opener_user;
void sessions_on_frame_end(struct flow *flow, const struct frames_end *end);

#endif

/* A client's session: messages to actions. Models that it has open, scenes, unanswered requests. */
#ifndef PSRD_SESSION_H
#define PSRD_SESSION_H

#include "server/frames/frames.h"
#include "server/models/opener.h"
#include "server/options.h"

/* What all sessions share. */
struct sessions {
	const struct options *options;
	struct conns *conns;
	struct catalogue *catalogue;
	struct opener *opener;
	struct frames *frames;
	struct psr_pool *pool;
	uint64_t start_us;          /* of the daemon */
	struct psr_msg_scene scene; /* scratch: 80 KiB */
};

struct session {
	struct sessions *all;
	struct conn *conn;
	uint32_t last_id;
	uint32_t n_open;            /* OPEN and FRAME requests that are unanswered */
	struct handles handles;
	struct scene *slot[PSR_WIRE_MAX_SCENES];
	struct flow flow;
};

/* What the layers below call; userdata of the first is the struct sessions. */
void sessions_conn_user(struct conn_user *user, struct sessions *sessions);
extern const struct opener_user sessions_opener_user;
void sessions_on_frame_end(struct flow *flow, uint32_t id, uint16_t view, int code, const char *text);

#endif

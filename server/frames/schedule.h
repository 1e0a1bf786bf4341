/* Which frame begins next, and which are given up: views, supersession, window, pauses, shares, memory.
 *
 * A state machine without sockets, threads and clock: requests, ends, acknowledgements and the time come in; it calls
 * its user to begin a frame, to stop one, and to end a request. PROTOCOL.md, "Views", has the rules that clients see.
 *
 * A request gives one frame or several (a plain one, a sharp one, refined ones), which are drawn one after another.
 * A flow is a connection. Flows begin frames by start-time fair queueing: the flow that has used least time on cores
 * comes first; one that was idle counts as having used as much as the least of the others, so that idleness is not
 * saved up. */
#ifndef PSRD_SCHEDULE_H
#define PSRD_SCHEDULE_H

#include <stdint.h>
#include "base/pool.h"

#define SCHEDULE_VIEWS 16            /* a connection has views 0..15 */
#define SCHEDULE_WINDOW 2            /* unacknowledged frames of a view */
#define SCHEDULE_REST_NS 100000000   /* a request that nobody supersedes for so long is at rest */
/* A frame that has used more time on cores leaves its place to others: a short one ends soon. */
#define SCHEDULE_SHORT_NS 4000000
#define SCHEDULE_LONG_NS 100000000
/* A frame that has lacked memory for so long gets room before later ones do: see schedule_starving(). */
#define SCHEDULE_PATIENCE_NS 500000000

struct schedule_flow;

/* Part of its owner; the schedule's from schedule_ask() until on_end() or the end of its last frame. */
struct schedule_request {
	struct schedule_request *next;       /* of its view, by rising id; */
	struct schedule_request *next_begun; /* of all flows */
	struct schedule_flow *flow;          /* NULL: the connection is gone */
	uint32_t id;
	uint16_t view;
	unsigned frame, n_frames;            /* the one that runs, or comes next */
	int has_sharp;                       /* frame 1 is sharp; refinement starts after it */
	int is_running;
	int is_coming;                       /* on_prepare() lacks something; */
	int is_ready;                        /* it has come */
	int is_superseded;                   /* the frame that runs is its last */
	int is_given_up;                     /* it ended, and its frame still runs */
	int is_yielding;                     /* the frame that runs has been asked to give way */
	uint64_t asked_ns;
	uint64_t bytes;                      /* memory that one of its frames takes while it runs, answer included */
	uint64_t answer_bytes;               /* of these, the most that its answer adds to the connection's queue */
	uint64_t round;                      /* of schedule_pump() that looked at it last */
	uint64_t lacks_ns;                   /* when it first lacked memory; 0: it did not */
	uint64_t begun_ns;
	uint64_t used_ns;                    /* the user's, while a frame runs: time on cores that it has used so far */
};

struct schedule_view {
	struct schedule_request *first;
	struct { uint32_t id; unsigned frame; } unacknowledged[SCHEDULE_WINDOW]; /* views > 0 alone */
	unsigned n_unacknowledged;
	int is_paused;
};

struct schedule_flow { /* part of its owner */
	struct schedule_flow *next, *previous; /* flows with requests */
	struct schedule_view view[SCHEDULE_VIEWS];
	uint64_t tag_ns;        /* time on cores, raised to that of the schedule when it wakes */
	unsigned n_requests, n_running;
	uint64_t queued_bytes;  /* the user's: what waits in the connection's queue */
	uint64_t answer_bytes;  /* what running frames may add to it */
};

struct schedule_user {
	/* Before on_begin(): 1: all that the frame needs is in memory, and stays there. 0: schedule_ready() or
	 * schedule_cancel() follows, or has followed. */
	int (*on_prepare)(struct schedule_request *request, void *userdata);
	/* It has come, but there is no room left for the frame: let others have that of what has come, too. */
	void (*on_let_go)(struct schedule_request *request, void *userdata);
	void (*on_begin)(struct schedule_request *request, enum pool_class class, void *userdata);
	/* A running frame is given up: stop it. schedule_done() follows when it has stopped. */
	void (*on_stop)(struct schedule_request *request, void *userdata);
	/* A frame that starves lacks the memory of a refined one that runs: stop it if nothing of it has been sent, and call
	 * schedule_put_back(); else it ends as usual. */
	void (*on_yield)(struct schedule_request *request, void *userdata);
	/* The request ended without a last frame. by: the request that superseded it, or 0 and a code: that of
	 * schedule_cancel(), or PSR_ERR_LIMIT, as its frame can never fit into memory. If it does not run it is the owner's;
	 * else on_stop() follows. */
	void (*on_end)(struct schedule_request *request, int code, uint32_t by, void *userdata);
	/* A frame lacks `bytes`: free what is kept for later, and lower kept_bytes. */
	void (*on_need)(uint64_t bytes, void *userdata);
	void *userdata;
};

struct schedule_limits {
	unsigned n_threads;    /* frames run at once: n + 1 short ones, 2 n + 2 with others, and long ones */
	unsigned max_running;  /* whatever they have used */
	uint64_t max_queue;    /* bytes of answers that may wait for one connection; one frame may exceed it */
	uint64_t max_memory;
};

struct schedule {
	struct schedule_limits limits;
	const struct schedule_user *user;
	struct schedule_flow *first;
	struct schedule_request *begun;    /* frames that run, given up or not */
	uint64_t tag_ns;                   /* of the flow that ran out of requests last */
	uint64_t kept_bytes, queued_bytes; /* the user's: memory of models and idle workers; of queues, which drain */
	uint64_t running_bytes;
	uint64_t round;
	uint64_t waiting_bytes; /* of the smallest frame for which there was no room in this round */
	uint64_t served_ns;     /* when a frame that starved began last */
	unsigned n_waiting, n_running;
	unsigned n_preparing; /* of n_waiting: coming or ready */
	unsigned n_lacking;   /* of n_waiting: lacks_ns is not 0 */
	int is_stopped;
};

enum schedule_next { SCHEDULE_DROPPED, SCHEDULE_FINAL, SCHEDULE_MORE };

void schedule_init(struct schedule *schedule, const struct schedule_limits *limits, const struct schedule_user *user);

/* A request came: id, view, n_frames, has_sharp, bytes and answer_bytes are filled in. Older ones of a view > 0 are
 * superseded, but for a plain frame that runs: it is finished, and is then its request's last. */
void schedule_ask(struct schedule *schedule, struct schedule_flow *flow, struct schedule_request *request,
                  uint64_t now_ns);

/* A running frame ended. used_ns: the time on cores that it took. DROPPED: it was given up before, and the request is
 * the owner's. FINAL: it is the last one, and the request is the owner's. MORE: another frame follows. */
enum schedule_next schedule_done(struct schedule *schedule, struct schedule_request *request, uint64_t used_ns);

/* A running frame failed: no FRAME_END is sent. FINAL: the request is the owner's; or DROPPED. */
enum schedule_next schedule_fail(struct schedule *schedule, struct schedule_request *request, uint64_t used_ns);

struct schedule_request *schedule_find(const struct schedule_flow *flow, uint32_t id); /* open; or NULL */
void schedule_cancel(struct schedule *schedule, struct schedule_request *request, int code); /* on_end() tells code */

/* A running frame has stopped on on_yield(), and begins again later: MORE. DROPPED; or FINAL, as the daemon ends. */
enum schedule_next schedule_put_back(struct schedule *schedule, struct schedule_request *request, uint64_t used_ns);

/* Unknown frames are ignored: their id may have ended without a FRAME_END. Returns whether it was known. */
int schedule_acknowledge(struct schedule_flow *flow, unsigned view, uint32_t id, unsigned frame);
void schedule_pause(struct schedule_flow *flow, unsigned view, int is_paused);

void schedule_ready(struct schedule_request *request); /* on_prepare() has what it lacked */

/* The connection is gone: as schedule_cancel() of all requests. */
void schedule_forget(struct schedule *schedule, struct schedule_flow *flow);

/* The daemon ends: waiting requests end, and frames that run are their requests' last. */
void schedule_stop(struct schedule *schedule, int code);

/* Begins what can begin now. To be called after any of the above, when a queue has shrunk, and at schedule_due(). */
void schedule_pump(struct schedule *schedule, uint64_t now_ns);
uint64_t schedule_due(const struct schedule *schedule, uint64_t now_ns); /* when time alone lets one begin; 0: never */

#endif

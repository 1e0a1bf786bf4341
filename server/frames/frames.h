/* Frame requests: who is drawn next, the drawing, the way back.
 *
 * At most as many frames run at once as the pool has threads. Flows with waiting requests take turns; a request starts
 * only while its connection's output queue, with what its running frames may add, is below max_queue (or empty): this
 * bounds the memory that a slow reader holds. All functions belong to the loop's thread. */
#ifndef PSRD_FRAMES_H
#define PSRD_FRAMES_H

#include "codec.h"
#include "scene.h"
#include "server/net/conn.h"
#include "psr/pool.h"

struct frame;
struct frames;

/* The requests of one connection. */
struct flow {
	struct conn *conn;
	struct frame *waiting, **last_waiting, *running;
	struct flow *next_turn;
	int has_turn;
	uint64_t reserved; /* the most bytes that its running frames may add to the connection's queue */
};

struct frames_parts {
	struct loop *loop;
	struct psr_pool *pool;
	struct codec *codec;
	int64_t max_pixels;  /* of a frame */
	uint64_t max_queue;  /* bytes that wait for a connection */
	/* `id` has ended: its last pass is in the queue (PSR_OK), or it gets none, for this reason. */
	void (*on_end)(struct flow *flow, uint32_t id, uint16_t view, int code, const char *text);
};

struct frames_stats {
	uint64_t drawn, failed, cancelled;
};

int frames_create(struct frames **out, const struct frames_parts *parts); /* MEMORY */
void frames_destroy(struct frames *frames); /* after the pool has ended; NULL is fine */

void flow_init(struct flow *flow, struct conn *conn);

/* Checks a request and queues it; keeps a reference to the scene, NULL if its slot is empty. */
void frames_ask(struct frames *frames, struct flow *flow, const struct psr_message *message,
                const struct psr_msg_frame *request, struct scene *scene);
int frames_cancel(struct frames *frames, struct flow *flow, uint32_t id); /* 1 if it was open: it gets no answer */
void frames_forget(struct frames *frames, struct flow *flow);             /* the connection is gone */
void frames_refuse_waiting(struct frames *frames, struct flow *flow, int code, const char *text);
void frames_stop(struct frames *frames); /* the daemon ends: no further pass starts */

void frames_pump(struct frames *frames); /* starts what can start: after a queue has shrunk */
unsigned frames_waiting(const struct frames *frames);
unsigned frames_running(const struct frames *frames); /* cancelled ones that still draw, too */
struct frames_stats *frames_stats(struct frames *frames);

#endif

/* Frame requests of all connections: the schedule, the drawing, the way back. All functions belong to the loop's
 * thread. */
#ifndef PSRD_FRAMES_H
#define PSRD_FRAMES_H

#include "bases.h"
#include "budget.h"
#include "codec.h"
#include "scene.h"
#include "schedule.h"
#include "server/models/residence.h"
#include "server/net/conn.h"
#include "base/histogram.h"
#include "base/pool.h"

struct frames;

/* The requests of one connection. */
struct flow {
	struct schedule_flow schedule;
	struct conn *conn;
	struct pool_flow *share; /* of the pool's threads */
	struct bases bases;
	uint64_t number;         /* over all flows that ever were */
	struct budget_learnt learnt;
	const struct scene *drawn; /* last: to be compared, not to be read; and how */
	struct psr_msg_settings drawn_with;
};

enum frames_outcome {
	FRAMES_FINAL,      /* its last frame is in the queue */
	FRAMES_SUPERSEDED, /* by a newer request of the view */
	FRAMES_CANCELLED,  /* on request, or as the connection is gone */
	FRAMES_FAILED,     /* it gets no further frame: code, text */
};

struct frames_end {
	enum frames_outcome outcome;
	uint32_t id;
	uint16_t view;
	uint32_t by;
	int code;
	const char *text;
};

/* Memory that others hold, of the one budget. */
struct frames_memory {
	uint64_t (*kept)(void *userdata);                    /* models */
	uint64_t (*queued)(void *userdata);                  /* answers that wait for clients */
	void (*make_room)(uint64_t bytes, void *userdata);   /* let go of models that nobody needs now */
	void *userdata;
};

struct frames_parts {
	struct loop *loop;
	struct psr_pool *pool, *io; /* io frees memory */
	struct codec *codec;
	int64_t max_pixels;   /* of a frame */
	uint64_t max_queue;   /* bytes that wait for a connection */
	uint64_t max_memory;  /* of models, workers, pictures and queues */
	uint64_t timeout_ns;  /* time on cores of a frame without refinement */
	struct residence *residence;
	struct frames_memory memory;
	void (*on_end)(struct flow *flow, const struct frames_end *end);
};

struct frames_stats {
	uint64_t drawn, failed, cancelled, superseded;
	uint64_t late;    /* of failed: over their time */
	uint64_t on_base; /* of drawn */
	uint64_t used_ns; /* time on cores of all */
	struct histogram answered; /* from a FRAME's arrival until the socket took the last byte of its first picture */
};

int frames_create(struct frames **out, const struct frames_parts *parts); /* MEMORY */
void frames_destroy(struct frames *frames); /* after the pool has ended; NULL is fine */

int flow_init(struct flow *flow, struct frames *frames, struct conn *conn); /* MEMORY */
void frames_forget(struct frames *frames, struct flow *flow);               /* the connection is gone; ends the flow */

/* Checks a request and queues it; keeps a reference to the scene, NULL if its slot is empty. */
void frames_ask(struct frames *frames, struct flow *flow, const struct psr_message *message,
                const struct psr_msg_frame *request, struct scene *scene);

/* 1: it was open, and has ended by on_end(). PROTOCOL: it belongs to another view. 0: it is not open. */
int frames_cancel(struct frames *frames, struct flow *flow, uint32_t id, uint16_t view);
void frames_acknowledge(struct frames *frames, struct flow *flow, uint16_t view, uint32_t id, unsigned frame);
void frames_pause(struct frames *frames, struct flow *flow, uint16_t view, int is_paused);

void frames_stop(struct frames *frames, int code); /* the daemon ends: no further frame starts */
void frames_pump(struct frames *frames);           /* starts what can start: after a queue has shrunk, when due */

unsigned frames_waiting(const struct frames *frames);
unsigned frames_lacking(const struct frames *frames); /* of these, that had no memory at their turn */
unsigned frames_running(const struct frames *frames); /* cancelled ones that still draw, too */
uint64_t frames_bytes(const struct frames *frames);   /* of workers, pictures and answers under way */
void frames_free_idle(struct frames *frames, uint64_t bytes); /* workers that draw nothing now, so many or more */
struct frames_stats *frames_stats(struct frames *frames);

#endif

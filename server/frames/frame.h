/* One request under way: its drawing in the pool, and its answer's way into the connection's queue. */
#ifndef PSRD_FRAME_H
#define PSRD_FRAME_H

#include <pthread.h>
#include "draw.h"
#include "frames.h"
#include "workers.h"

struct surveyor;

struct frame {
	struct schedule_request request; /* first: the schedule knows a frame by it */
	struct frames *frames;
	struct loop *loop;
	struct workers_use use;
	struct base *offered;            /* the client holds it: request.base */
	struct base *used, *made;        /* of the frame that runs */
	struct loop_note done_note, emit_note;
	struct residence *residence;
	struct residence_need need;      /* of the scene's models, */
	int is_needing, has_models;      /* which come into memory; which are pinned */
	struct draw_worker *worker;
	struct psr_error error;
	int code;
	struct drawing drawing;          /* the job's while it runs */
	/* Both threads', under the mutex: coded, and not yet in the queue. */
	pthread_mutex_t mutex;
	struct outq_chunk *first, **last;
	uint64_t n_bytes;
	int is_noted;
};

/* The caller sets `frames` and done_note. NULL without memory. */
struct frame *frame_create(const struct frames_parts *parts, struct flow *flow, const struct psr_message *message,
                           const struct psr_msg_frame *request, struct scene *scene);
void frame_destroy(struct frame *frame);

/* NULL: the connection is gone. */
static inline struct flow *frame_flow(const struct frame *frame)
{
	return (struct flow *)frame->request.flow;
}

void frame_put_models(struct frame *frame); /* unpins them, or stops their coming */
void frame_prepare(struct frame *frame, struct surveyor *surveyor); /* for the frame that comes next: resolve.h */

/* It was drawn to its end: its flow, which is there, and all later flows learn what it took. */
void frame_learn(struct frame *frame, struct budget_learnt *of_all);

/* Whether each part between two places where cores change is short by what the frame consists of: the thread of the
 * event loop may draw it. */
int frame_is_slight(const struct frame *frame);

void frame_run(void *frame);       /* the job: draws, codes, and posts done_note */
void frame_send_coded(struct frame *frame);
void frame_send_end(struct frame *frame, int is_final); /* FRAME_END, once all rectangles are in the queue */

/* Frees the frames of an answer, from one on, that wait in the queue. Returns whether the last one was among them. */
int frame_drop_unsent(struct flow *flow, uint32_t id, uint16_t view, unsigned from);

const char *frame_never_fits(struct psr_error *err, const struct frame *frame, const struct schedule *schedule);

#endif

/* One frame from request to answer: the wire's terms to a scene, drawing, encoding, messages. On any thread. */
#ifndef PSRD_DRAW_H
#define PSRD_DRAW_H

#include <stdatomic.h>
#include <stdint.h>
#include "bases.h"
#include "budget.h"
#include "codec.h"
#include "server/net/outq.h"
#include "psr/error.h"
#include "base/pool.h"
#include "proto/proto.h"
#include "scene.h"

struct draw_worker; /* buffers of one frame at a time, kept from frame to frame */

struct draw_worker *draw_worker_create(void); /* NULL without memory */
void draw_worker_destroy(struct draw_worker *worker);
uint64_t draw_worker_bytes(const struct draw_worker *worker);

struct drawing {
	struct psr_pool *pool;
	struct codec *codec;
	uint32_t id;
	uint16_t view;
	struct psr_msg_frame request; /* checked */
	unsigned frame, refine;       /* number within the answer; level of refinement */
	int is_sharp;                 /* scale 1, smooth, lossless, whatever was asked */
	struct psr_msg_settings settings; /* resolved, once a frame: resolve.h */
	struct budget_view seen;      /* what settings are chosen for, and learnt from */
	struct psr_msg_settings kept; /* of the flow's last frame, if it drew the same scene; or scale 0 */
	int is_seen;                  /* `seen` has counts, not lights and sizes alone */
	struct budget_choice choice;  /* of a budget of time or error */
	const struct base *base;      /* what the client holds, and fits; or NULL */
	struct codec_parts *parts;    /* of this frame; NULL in view 0 */
	struct scene *scene;
	uint64_t arrived_ns;          /* clock_ns() when the request came, or the frame before was done */
	uint64_t n_waiting;           /* frames that waited then */
	uint64_t limit_ns;            /* time on cores that a frame without refinement may take */
	atomic_int is_stopped;        /* set by the loop: nobody wants the answer any more */
	atomic_int must_yield;        /* set by the loop: a refined frame ends with BUSY, if nothing of it is emitted yet */
	atomic_uint_fast64_t used_ns; /* so far */
	/* Takes parts of the answer in order, FRAME_BEGIN first, from any thread. */
	void (*emit)(struct outq_chunk *chunks, void *userdata);
	void *userdata;
	struct psr_msg_frame_end end;  /* out: is_final is the caller's; status is that of draw_take_end() */
	uint64_t start_ns;            /* out: clock_ns() when work on the frame started */
	struct budget_spent spent;    /* out: total_ns is the caller's */
	struct outq_chunk *end_chunk; /* room for it */
};

int draw_is_sharp(const struct psr_msg_frame *request); /* what it asks for is sharp by itself */

/* For the settings as they are resolved: parts to be filled in, NULL without memory; whether `base` fits. */
struct codec_parts *draw_parts(const struct drawing *d);
int draw_fits(const struct drawing *d, const struct base *base);

/* The most memory that a frame takes while it is drawn, its answer included; and the answer alone. */
uint64_t draw_bytes(const struct psr_msg_frame *request, const struct scene *scene, int n_threads);
uint64_t draw_answer_bytes(const struct psr_msg_frame *request);

/* CANCELLED: it was stopped on the way; BUSY: it gave way; LIMIT: it took too long; errors of the renderer and the
 * encoder. */
int draw_frame(struct drawing *d, struct draw_worker *worker, struct psr_error *err);

/* FRAME_END, once d->end.is_final and d->spent.total_ns are set. */
struct outq_chunk *draw_take_end(struct drawing *d);

#endif

/* One pass of a frame from request to answer: the wire's terms to a scene, drawing, encoding, messages. On any
 * thread. */
#ifndef PSRD_DRAW_H
#define PSRD_DRAW_H

#include <stdatomic.h>
#include <stdint.h>
#include "codec.h"
#include "server/net/outq.h"
#include "psr/error.h"
#include "base/pool.h"
#include "psr/proto.h"
#include "scene.h"

struct draw_worker; /* buffers of one frame at a time, kept from frame to frame */

struct draw_worker *draw_worker_create(void); /* NULL without memory */
void draw_worker_destroy(struct draw_worker *worker);
uint64_t draw_worker_bytes(const struct draw_worker *worker);

struct drawing {
	struct psr_pool *pool;
	struct codec *codec;
	uint32_t id;
	struct psr_msg_frame request; /* checked */
	unsigned pass, last_pass;
	struct scene *scene;
	uint64_t arrived_ns;          /* clock_ns() when the request came, or the pass before was done */
	uint64_t n_waiting;           /* frames that waited then */
	atomic_int is_abandoned;      /* set by the loop: nobody wants the answer any more */
	struct outq_chunk *answer;    /* out: FRAME_BEGIN, RECT..., FRAME_END; the caller's */
};

/* CANCELLED: it was abandoned on the way; errors of the renderer and the encoder. */
int draw_frame(struct drawing *d, struct draw_worker *worker, struct psr_error *err);

#endif

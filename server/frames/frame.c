#include <inttypes.h>
#include <stdlib.h>
#include "base/clock.h"
#include "frame.h"
#include "resolve.h"

#define SLIGHT_PIXELS 16384
#define SLIGHT_INSTANCES 16
#define SLIGHT_BLOCKS 262144
#define EMIT_BYTES 32768 /* coded bytes that are worth a note to the loop */

/* ---- on the pool's threads ---- */

static void emit(struct outq_chunk *chunks, void *userdata)
{
	struct frame *frame = userdata;
	int must_note = 0;

	pthread_mutex_lock(&frame->mutex);
	*frame->last = chunks;
	for (; chunks != NULL; chunks = chunks->next) {
		frame->last = &chunks->next;
		frame->n_bytes += chunks->size;
	}
	if (!frame->is_noted && frame->n_bytes >= EMIT_BYTES)
		frame->is_noted = must_note = 1;
	pthread_mutex_unlock(&frame->mutex);
	if (must_note)
		loop_post(frame->loop, &frame->emit_note);
}

void frame_run(void *userdata)
{
	struct frame *frame = userdata;

	frame->code = draw_frame(&frame->drawing, frame->worker, &frame->error);
	loop_post(frame->loop, &frame->done_note);
}

/* ---- on the loop's ---- */

/* Into the connection's queue, as parts of the frame. */
static void push(struct frame *frame, struct outq_chunk *first)
{
	for (struct outq_chunk *chunk = first; chunk != NULL; chunk = chunk->next)
		chunk->part = (uint16_t)frame->drawing.frame;
	conn_push(frame_flow(frame)->conn, frame->drawing.id, first);
}

void frame_send_coded(struct frame *frame)
{
	struct outq_chunk *first;

	pthread_mutex_lock(&frame->mutex);
	first = frame->first;
	frame->first = NULL;
	frame->last = &frame->first;
	frame->n_bytes = 0;
	frame->is_noted = 0;
	pthread_mutex_unlock(&frame->mutex);
	if (first == NULL)
		return;
	if (frame->request.is_given_up || frame_flow(frame)->conn->state != CONN_OPEN)
		outq_chunks_destroy(first);
	else
		push(frame, first);
}

static void on_emitted(void *userdata)
{
	struct frame *frame = userdata;

	frame_send_coded(frame);
	if (frame_flow(frame) != NULL)
		conn_flush(frame_flow(frame)->conn);
}

void frame_send_end(struct frame *frame, int is_final)
{
	struct flow *flow = frame_flow(frame);
	struct outq_chunk *chunk;

	frame->drawing.end.is_final = (uint8_t)is_final;
	chunk = draw_take_end(&frame->drawing);
	chunk->ends_part = 1;
	chunk->ends_answer = (uint8_t)is_final;
	chunk->asked_ns = frame->drawing.end.pass == 0 ? frame->request.asked_ns : 0;
	push(frame, chunk);
	if (frame->made != NULL)
		bases_add(&flow->bases, frame->made);
	frame->made = NULL;
}

struct dropping {
	struct flow *flow;
	uint16_t view;
	int had_last;
};

/* A frame that the client never gets is not acknowledged, either. */
static void on_drop(const struct outq_chunk *chunk, void *userdata)
{
	struct dropping *dropping = userdata;

	if (chunk->ends_part && dropping->view > 0)
		schedule_acknowledge(&dropping->flow->schedule, dropping->view, chunk->id, chunk->part);
	dropping->had_last |= chunk->ends_answer;
}

int frame_drop_unsent(struct flow *flow, uint32_t id, uint16_t view, unsigned from)
{
	struct dropping dropping = { flow, view, 0 };

	conn_drop(flow->conn, id, from, on_drop, &dropping);
	return dropping.had_last;
}

/* What the client holds: the last acknowledged frame of this answer, or what the request offers. */
static struct base *find_base(const struct frame *frame)
{
	struct base *base = bases_find(&frame_flow(frame)->bases, frame->drawing.view, frame->drawing.id);

	if (base == NULL && frame->offered != NULL)
		base = base_ref(frame->offered);
	if (base != NULL && !draw_fits(&frame->drawing, base)) {
		base_unref(base);
		base = NULL;
	}
	return base;
}

/* Without memory for its parts the frame is no base of later ones, and stands on none: its parts are compared. */
static void set_bases(struct frame *frame)
{
	struct drawing *d = &frame->drawing;
	struct codec_parts *parts = draw_parts(d);

	base_unref(frame->used);
	base_unref(frame->made);
	frame->made = parts != NULL ? base_create(d->id, d->view, d->frame, parts) : NULL;
	frame->used = frame->made != NULL ? find_base(frame) : NULL;
	d->base = frame->used;
	d->parts = frame->made != NULL ? parts : NULL;
}

void frame_prepare(struct frame *frame, struct surveyor *surveyor)
{
	const struct schedule_request *request = &frame->request;
	struct drawing *d = &frame->drawing;
	struct flow *flow = frame_flow(frame);

	d->frame = request->frame;
	d->is_sharp = request->has_sharp && request->frame > 0;
	d->refine = request->frame - (unsigned)d->is_sharp;
	atomic_store(&d->used_ns, 0);
	atomic_store(&d->must_yield, 0);
	scene_bind(d->scene);
	d->kept = flow->drawn == d->scene ? flow->drawn_with : (struct psr_msg_settings){ .scale = 0 };
	resolve_settings(d, &flow->learnt, surveyor);
	flow->drawn = d->scene;
	flow->drawn_with = d->settings;
	if (d->view > 0)
		set_bases(frame);
}

void frame_learn(struct frame *frame, struct budget_learnt *of_all)
{
	struct drawing *d = &frame->drawing;

	d->spent.total_ns = (double)(clock_ns() - d->start_ns);
	if (d->refine > 0 || d->settings.splats) /* budgets choose none */
		return;
	budget_learn(&frame_flow(frame)->learnt, &d->seen, d->is_seen, &d->settings, &d->spent);
	budget_learn(of_all, &d->seen, d->is_seen, &d->settings, &d->spent);
}

int frame_is_slight(const struct frame *frame)
{
	const struct psr_msg_frame *request = &frame->drawing.request;
	const struct scene *scene = frame->drawing.scene;

	return frame->request.n_frames == 1 && frame->drawing.settings.pass == 0
	       && frame->drawing.settings.smooth != PSR_SMOOTH_FINE && !frame->drawing.settings.splats
	       && (uint64_t)request->width * request->height <= SLIGHT_PIXELS
	       && scene->scene.n_instances <= SLIGHT_INSTANCES && scene_blocks(scene) <= SLIGHT_BLOCKS
	       && scene_shadow_lights(scene) == 0;
}

const char *frame_never_fits(struct psr_error *err, const struct frame *frame, const struct schedule *schedule)
{
	const struct psr_msg_frame *request = &frame->drawing.request;
	const uint64_t limit = schedule->limits.max_memory, kept = schedule->kept_bytes;

	psr_fail(err, PSR_ERR_LIMIT,
	         "a frame of %" PRIu32 "x%" PRIu32 " takes up to %" PRIu64 " MB of memory; the models in use leave %" PRIu64
	         " of %" PRIu64 " MB (--max-memory)", request->width, request->height, (frame->request.bytes >> 20) + 1,
	         (limit > kept ? limit - kept : 0) >> 20, limit >> 20);
	return err->text;
}

struct frame *frame_create(const struct frames_parts *parts, struct flow *flow, const struct psr_message *message,
                           const struct psr_msg_frame *request, struct scene *scene)
{
	struct frame *frame = calloc(1, sizeof *frame);
	struct drawing *d;

	if (frame == NULL)
		return NULL;
	frame->loop = parts->loop;
	frame->residence = parts->residence;
	frame->use = (struct workers_use){ scene_shadow_lights(scene) > 0 ? flow->number : 0, request->width, request->height };
	frame->offered = request->base != 0 ? bases_find(&flow->bases, message->view, request->base) : NULL;
	d = &frame->drawing;
	d->pool = parts->pool;
	d->codec = parts->codec;
	d->limit_ns = parts->timeout_ns;
	frame->last = &frame->first;
	pthread_mutex_init(&frame->mutex, NULL);
	frame->emit_note = (struct loop_note){ .fn = on_emitted, .userdata = frame };
	d->id = message->id;
	d->view = message->view;
	d->request = *request;
	d->scene = scene_ref(scene);
	d->arrived_ns = clock_ns();
	d->emit = emit;
	d->userdata = frame;
	frame->request.id = message->id;
	frame->request.view = message->view;
	frame->request.has_sharp = request->flags & PSR_WIRE_FRAME_SHARP && !draw_is_sharp(request);
	frame->request.n_frames = 1 + (unsigned)frame->request.has_sharp + request->pass_limit;
	frame->request.bytes = draw_bytes(request, scene, psr_pool_threads(parts->pool));
	frame->request.answer_bytes = draw_answer_bytes(request);
	return frame;
}

void frame_put_models(struct frame *frame)
{
	if (frame->is_needing)
		residence_cancel(&frame->need);
	if (frame->has_models)
		residence_put(frame->residence, frame->need.model, frame->need.n);
	frame->is_needing = frame->has_models = 0;
}

void frame_destroy(struct frame *frame)
{
	frame_put_models(frame);
	scene_unref(frame->drawing.scene);
	base_unref(frame->offered);
	base_unref(frame->used);
	base_unref(frame->made);
	outq_chunks_destroy(frame->first);
	outq_chunks_destroy(frame->drawing.end_chunk);
	pthread_mutex_destroy(&frame->mutex);
	free(frame);
}

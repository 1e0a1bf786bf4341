#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "check.h"
#include "draw.h"
#include "frames.h"

#define IDLE_BYTES (UINT64_C(512) << 20) /* memory that idle workers keep, all together */

struct frame {
	struct frame *next;
	struct flow *flow;       /* NULL: nobody waits for the answer any more */
	struct frames *frames;
	uint64_t reserved;
	struct loop_note note;
	/* The job's while it runs: */
	struct drawing drawing;
	struct draw_worker *worker;
	struct psr_error error;
	int code;
};

struct frames {
	struct frames_parts parts;
	struct frames_stats stats;
	int is_stopped;
	struct draw_worker **idle;
	unsigned n_idle;
	uint64_t idle_bytes;
	struct flow *first_turn, **last_turn; /* flows with waiting requests */
	unsigned n_waiting, n_running;
};

int frames_create(struct frames **out, const struct frames_parts *parts)
{
	struct frames *frames = calloc(1, sizeof *frames);

	if (frames == NULL)
		return PSR_ERR_MEMORY;
	frames->idle = calloc((size_t)psr_pool_threads(parts->pool), sizeof *frames->idle);
	if (frames->idle == NULL) {
		free(frames);
		return PSR_ERR_MEMORY;
	}
	frames->parts = *parts;
	frames->last_turn = &frames->first_turn;
	*out = frames;
	return PSR_OK;
}

void frames_destroy(struct frames *frames)
{
	if (frames == NULL)
		return;
	while (frames->n_idle > 0)
		draw_worker_destroy(frames->idle[--frames->n_idle]);
	free(frames->idle);
	free(frames);
}

static struct draw_worker *take_worker(struct frames *frames)
{
	struct draw_worker *worker;

	if (frames->n_idle == 0)
		return draw_worker_create();
	worker = frames->idle[--frames->n_idle];
	frames->idle_bytes -= draw_worker_bytes(worker);
	return worker;
}

/* The array holds a worker for each frame that can run. */
static void put_worker(struct frames *frames, struct draw_worker *worker)
{
	uint64_t bytes;

	if (worker == NULL)
		return;
	bytes = draw_worker_bytes(worker);
	if (frames->idle_bytes + bytes > IDLE_BYTES) {
		draw_worker_destroy(worker);
		return;
	}
	frames->idle_bytes += bytes;
	frames->idle[frames->n_idle++] = worker;
}

static void destroy_frame(struct frame *frame)
{
	scene_unref(frame->drawing.scene);
	outq_chunks_destroy(frame->drawing.answer);
	free(frame);
}

static void run(void *userdata)
{
	struct frame *frame = userdata;

	if (atomic_load(&frame->drawing.is_abandoned))
		frame->code = PSR_ERR_CANCELLED;
	else
		frame->code = draw_frame(&frame->drawing, frame->worker, &frame->error);
	loop_post(frame->frames->parts.loop, &frame->note);
}

static void take_out_running(struct flow *flow, struct frame *frame)
{
	struct frame **at = &flow->running;

	while (*at != frame)
		at = &(*at)->next;
	*at = frame->next;
}

static void add_turn(struct frames *frames, struct flow *flow)
{
	if (flow->has_turn)
		return;
	flow->has_turn = 1;
	flow->next_turn = NULL;
	*frames->last_turn = flow;
	frames->last_turn = &flow->next_turn;
}

static struct flow *take_turn(struct frames *frames)
{
	struct flow *flow = frames->first_turn;

	frames->first_turn = flow->next_turn;
	if (frames->first_turn == NULL)
		frames->last_turn = &frames->first_turn;
	flow->has_turn = 0;
	return flow;
}

static void remove_turn(struct frames *frames, struct flow *flow)
{
	struct flow **at = &frames->first_turn;

	if (!flow->has_turn)
		return;
	while (*at != flow)
		at = &(*at)->next_turn;
	*at = flow->next_turn;
	if (frames->last_turn == &flow->next_turn)
		frames->last_turn = at;
	flow->has_turn = 0;
}

/* Behind the flow's earlier requests. */
static void add_waiting(struct frames *frames, struct flow *flow, struct frame *frame)
{
	frame->drawing.arrived_ns = clock_ns();
	frame->drawing.n_waiting = frames->n_waiting;
	frame->next = NULL;
	*flow->last_waiting = frame;
	flow->last_waiting = &frame->next;
	frames->n_waiting++;
	add_turn(frames, flow);
}

static struct frame *take_waiting(struct frames *frames, struct flow *flow, struct frame **at)
{
	struct frame *frame = *at;

	*at = frame->next;
	if (flow->last_waiting == &frame->next)
		flow->last_waiting = at;
	frames->n_waiting--;
	if (flow->waiting == NULL)
		remove_turn(frames, flow);
	return frame;
}

/* Sends a pass that is done. 1: the frame waits for its next pass. */
static int answer(struct frames *frames, struct flow *flow, struct frame *frame)
{
	struct drawing *drawing = &frame->drawing;

	frames->stats.drawn++;
	conn_push(flow->conn, drawing->answer);
	drawing->answer = NULL;
	if (drawing->pass == drawing->last_pass) {
		frames->parts.on_end(flow, drawing->id, 0, PSR_OK, NULL);
		return 0;
	}
	if (frames->is_stopped) {
		frames->parts.on_end(flow, drawing->id, 0, PSR_ERR_CANCELLED, "the server is shutting down");
		return 0;
	}
	drawing->pass++;
	add_waiting(frames, flow, frame);
	return 1;
}

static void on_done(void *userdata)
{
	struct frame *frame = userdata;
	struct frames *frames = frame->frames;
	struct flow *flow = frame->flow;
	int goes_on = 0;

	frames->n_running--;
	put_worker(frames, frame->worker);
	if (flow != NULL) {
		take_out_running(flow, frame);
		flow->reserved -= frame->reserved;
		if (frame->code != PSR_OK) {
			frames->stats.failed++;
			frames->parts.on_end(flow, frame->drawing.id, 0, frame->code, frame->error.text);
		} else if (flow->conn->state == CONN_OPEN) {
			goes_on = answer(frames, flow, frame);
		}
		conn_flush(flow->conn);
	}
	if (!goes_on)
		destroy_frame(frame);
	frames_pump(frames);
}

static int can_start(const struct frames *frames, const struct flow *flow)
{
	uint64_t held = flow->conn->out.size + flow->reserved;

	return held == 0 || held + flow->waiting->reserved <= frames->parts.max_queue;
}

static void start(struct frames *frames, struct flow *flow)
{
	struct frame *frame = take_waiting(frames, flow, &flow->waiting);

	frame->worker = take_worker(frames);
	if (frame->worker == NULL || psr_pool_submit(frames->parts.pool, run, frame) != PSR_OK) {
		put_worker(frames, frame->worker);
		frames->parts.on_end(flow, frame->drawing.id, 0, PSR_ERR_MEMORY, "no memory to draw a frame");
		destroy_frame(frame);
		return;
	}
	frames->n_running++;
	frame->next = flow->running;
	flow->running = frame;
	flow->reserved += frame->reserved;
}

/* Ends after a round over the flows without a start: a flow whose reader is slow keeps its turn. */
void frames_pump(struct frames *frames)
{
	struct flow *first_blocked = NULL;

	while (frames->first_turn != NULL && frames->n_running < (unsigned)psr_pool_threads(frames->parts.pool)) {
		struct flow *flow = frames->first_turn;

		if (flow == first_blocked)
			return;
		take_turn(frames);
		if (can_start(frames, flow)) {
			start(frames, flow);
			first_blocked = NULL;
		} else if (first_blocked == NULL) {
			first_blocked = flow;
		}
		if (flow->waiting != NULL)
			add_turn(frames, flow);
	}
}

void flow_init(struct flow *flow, struct conn *conn)
{
	*flow = (struct flow){ .conn = conn, .last_waiting = &flow->waiting };
}

void frames_ask(struct frames *frames, struct flow *flow, const struct psr_message *message,
                const struct psr_msg_frame *request, struct scene *scene)
{
	uint64_t n = (uint64_t)request->width * request->height;
	struct frame *frame = NULL;
	struct psr_error error;
	int code = frame_check(request, message->view, frames->parts.max_pixels, &error);

	if (code == PSR_OK && scene == NULL)
		code = psr_fail(&error, PSR_ERR_NOT_FOUND, "slot %u holds no scene: send SCENE first", request->slot);
	if (code == PSR_OK) {
		frame = calloc(1, sizeof *frame);
		if (frame == NULL)
			code = psr_fail(&error, PSR_ERR_MEMORY, "no memory to draw a frame");
	}
	if (code != PSR_OK) {
		frames->stats.failed++;
		frames->parts.on_end(flow, message->id, message->view, code, error.text);
		return;
	}
	frame->flow = flow;
	frame->frames = frames;
	frame->drawing.pool = frames->parts.pool;
	frame->drawing.codec = frames->parts.codec;
	frame->drawing.id = message->id;
	frame->drawing.request = *request;
	frame->drawing.scene = scene_ref(scene);
	frame->drawing.last_pass = request->pass_limit;
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (request->planes >> plane & 1)
			frame->reserved += n * psr_plane_pixel_bytes(plane, request->depth_format);
	frame->note = (struct loop_note){ .fn = on_done, .userdata = frame };
	add_waiting(frames, flow, frame);
	frames_pump(frames);
}

/* A running job sees this at its next check, and on_done() drops it. */
static void abandon(struct frame *frame)
{
	atomic_store(&frame->drawing.is_abandoned, 1);
	frame->flow = NULL;
}

static int take_out(struct frames *frames, struct flow *flow, uint32_t id)
{
	for (struct frame **at = &flow->waiting; *at != NULL; at = &(*at)->next) {
		if ((*at)->drawing.id == id) {
			destroy_frame(take_waiting(frames, flow, at));
			return 1;
		}
	}
	for (struct frame **at = &flow->running; *at != NULL; at = &(*at)->next) {
		struct frame *frame = *at;

		if (frame->drawing.id == id) {
			*at = frame->next;
			flow->reserved -= frame->reserved;
			abandon(frame);
			return 1;
		}
	}
	return 0;
}

int frames_cancel(struct frames *frames, struct flow *flow, uint32_t id)
{
	int was_open = take_out(frames, flow, id);

	frames->stats.cancelled += (uint64_t)was_open;
	return was_open;
}

void frames_forget(struct frames *frames, struct flow *flow)
{
	while (flow->waiting != NULL)
		destroy_frame(take_waiting(frames, flow, &flow->waiting));
	while (flow->running != NULL) {
		struct frame *frame = flow->running;

		flow->running = frame->next;
		abandon(frame);
	}
	flow->reserved = 0;
}

void frames_refuse_waiting(struct frames *frames, struct flow *flow, int code, const char *text)
{
	while (flow->waiting != NULL) {
		struct frame *frame = take_waiting(frames, flow, &flow->waiting);

		frames->parts.on_end(flow, frame->drawing.id, 0, code, text);
		destroy_frame(frame);
	}
}

void frames_stop(struct frames *frames)
{
	frames->is_stopped = 1;
}

unsigned frames_waiting(const struct frames *frames)
{
	return frames->n_waiting;
}

unsigned frames_running(const struct frames *frames)
{
	return frames->n_running;
}

struct frames_stats *frames_stats(struct frames *frames)
{
	return &frames->stats;
}

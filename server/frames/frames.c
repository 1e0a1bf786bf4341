#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include "base/clock.h"
#include "server/net/conn.h"
#include "draw.h"
#include "frames.h"
#include "server/server.h"

#define IDLE_BYTES (UINT64_C(512) << 20) /* workers that wait keep this much memory, all together */

struct frame {
	struct frame *next;
	struct conn *conn;       /* NULL: nobody waits for the answer any more */
	struct server *server;
	uint64_t reserved;
	struct loop_note note;
	/* Belong to the job while it runs: */
	struct drawing drawing;
	struct draw_worker *worker;
	struct psr_error error;
	int code;
};

struct frames {
	struct server *server;
	struct draw_worker **idle;
	unsigned n_idle;
	uint64_t idle_bytes;
	struct conn *first_turn, **last_turn; /* connections with waiting requests */
	unsigned n_waiting, n_running;
};

int frames_create(struct frames **out, struct server *server)
{
	struct frames *frames = calloc(1, sizeof *frames);

	if (frames == NULL)
		return PSR_ERR_MEMORY;
	frames->idle = calloc((size_t)psr_pool_threads(server->pool), sizeof *frames->idle);
	if (frames->idle == NULL) {
		free(frames);
		return PSR_ERR_MEMORY;
	}
	frames->server = server;
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

/* There are no more workers than frames run at once, so the array holds them all. */
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
	loop_post(&frame->server->loop, &frame->note);
}

static void take_out_running(struct conn *conn, struct frame *frame)
{
	struct frame **at = &conn->running;

	while (*at != frame)
		at = &(*at)->next;
	*at = frame->next;
}

static void add_turn(struct frames *frames, struct conn *conn)
{
	if (conn->has_turn)
		return;
	conn->has_turn = 1;
	conn->next_turn = NULL;
	*frames->last_turn = conn;
	frames->last_turn = &conn->next_turn;
}

/* Behind what its connection has asked for before. */
static void add_waiting(struct frames *frames, struct conn *conn, struct frame *frame)
{
	frame->drawing.arrived_ns = clock_ns();
	frame->drawing.n_waiting = frames->n_waiting;
	frame->next = NULL;
	*conn->last_waiting = frame;
	conn->last_waiting = &frame->next;
	frames->n_waiting++;
	add_turn(frames, conn);
}

static void on_done(void *userdata)
{
	struct frame *frame = userdata;
	struct server *server = frame->server;
	struct conn *conn = frame->conn;

	server->frames->n_running--;
	put_worker(server->frames, frame->worker);
	if (conn != NULL) {
		take_out_running(conn, frame);
		conn->reserved -= frame->reserved;
		if (frame->code != PSR_OK) {
			server->stats.frames_failed++;
			session_refuse(conn, frame->drawing.id, 0, frame->code, frame->error.text);
		} else if (conn->state == CONN_OPEN) {
			server->stats.frames++;
			outq_push(&conn->out, frame->drawing.answer, server->loop.now_us);
			frame->drawing.answer = NULL;
			if (frame->drawing.pass < frame->drawing.last_pass && !server->is_draining) {
				frame->drawing.pass++;
				add_waiting(server->frames, conn, frame);
				frame = NULL;
			} else if (frame->drawing.pass < frame->drawing.last_pass) {
				session_refuse(conn, frame->drawing.id, 0, PSR_ERR_CANCELLED, "the server ends");
			} else {
				conn->session.n_open--;
			}
		}
		conn_flush(conn);
	}
	if (frame != NULL)
		destroy_frame(frame);
	frames_pump(server->frames);
}

static struct conn *take_turn(struct frames *frames)
{
	struct conn *conn = frames->first_turn;

	frames->first_turn = conn->next_turn;
	if (frames->first_turn == NULL)
		frames->last_turn = &frames->first_turn;
	conn->has_turn = 0;
	return conn;
}

static void remove_turn(struct frames *frames, struct conn *conn)
{
	struct conn **at = &frames->first_turn;

	if (!conn->has_turn)
		return;
	while (*at != conn)
		at = &(*at)->next_turn;
	*at = conn->next_turn;
	if (frames->last_turn == &conn->next_turn)
		frames->last_turn = at;
	conn->has_turn = 0;
}

static struct frame *take_waiting(struct frames *frames, struct conn *conn, struct frame **at)
{
	struct frame *frame = *at;

	*at = frame->next;
	if (conn->last_waiting == &frame->next)
		conn->last_waiting = at;
	frames->n_waiting--;
	if (conn->waiting == NULL)
		remove_turn(frames, conn);
	return frame;
}

static int can_start(const struct frames *frames, const struct conn *conn)
{
	uint64_t held = conn->out.size + conn->reserved;

	return held == 0 || held + conn->waiting->reserved <= (uint64_t)frames->server->options->max_queue;
}

static void start(struct frames *frames, struct conn *conn)
{
	struct frame *frame = take_waiting(frames, conn, &conn->waiting);

	frame->worker = take_worker(frames);
	if (frame->worker == NULL || psr_pool_submit(frames->server->pool, run, frame) != PSR_OK) {
		put_worker(frames, frame->worker);
		session_refuse(conn, frame->drawing.id, 0, PSR_ERR_MEMORY, "no memory to draw a frame");
		destroy_frame(frame);
		return;
	}
	frames->n_running++;
	frame->next = conn->running;
	conn->running = frame;
	conn->reserved += frame->reserved;
}

/* One round over the connections at most without a start: what waits for its reader keeps its turn. */
void frames_pump(struct frames *frames)
{
	struct conn *first_blocked = NULL;

	while (frames->first_turn != NULL && frames->n_running < (unsigned)psr_pool_threads(frames->server->pool)) {
		struct conn *conn = frames->first_turn;

		if (conn == first_blocked)
			return;
		take_turn(frames);
		if (can_start(frames, conn)) {
			start(frames, conn);
			first_blocked = NULL;
		} else if (first_blocked == NULL) {
			first_blocked = conn;
		}
		if (conn->waiting != NULL)
			add_turn(frames, conn);
	}
}

void frames_ask(struct frames *frames, struct conn *conn, uint32_t id, const struct psr_msg_frame *request,
                struct scene *scene)
{
	struct frame *frame = calloc(1, sizeof *frame);
	uint64_t n = (uint64_t)request->width * request->height;

	if (frame == NULL) {
		session_refuse(conn, id, 0, PSR_ERR_MEMORY, "no memory to draw a frame");
		return;
	}
	frame->conn = conn;
	frame->server = frames->server;
	frame->drawing.pool = frames->server->pool;
	frame->drawing.codec = frames->server->codec;
	frame->drawing.id = id;
	frame->drawing.request = *request;
	frame->drawing.scene = scene_ref(scene);
	frame->drawing.last_pass = request->pass_limit;
	for (unsigned plane = 0; plane < PSR_N_PLANES; plane++)
		if (request->planes >> plane & 1)
			frame->reserved += n * psr_plane_pixel_bytes(plane, request->depth_format);
	frame->note = (struct loop_note){ .fn = on_done, .userdata = frame };
	add_waiting(frames, conn, frame);
	frames_pump(frames);
}

/* What draws already goes on to the next place where it looks, and is then dropped. */
static void abandon(struct frame *frame)
{
	atomic_store(&frame->drawing.is_abandoned, 1);
	frame->conn = NULL;
}

int frames_cancel(struct frames *frames, struct conn *conn, uint32_t id)
{
	for (struct frame **at = &conn->waiting; *at != NULL; at = &(*at)->next) {
		if ((*at)->drawing.id == id) {
			destroy_frame(take_waiting(frames, conn, at));
			return 1;
		}
	}
	for (struct frame **at = &conn->running; *at != NULL; at = &(*at)->next) {
		struct frame *frame = *at;

		if (frame->drawing.id == id) {
			*at = frame->next;
			conn->reserved -= frame->reserved;
			abandon(frame);
			return 1;
		}
	}
	return 0;
}

void frames_forget(struct frames *frames, struct conn *conn)
{
	while (conn->waiting != NULL)
		destroy_frame(take_waiting(frames, conn, &conn->waiting));
	while (conn->running != NULL) {
		struct frame *frame = conn->running;

		conn->running = frame->next;
		abandon(frame);
	}
	conn->reserved = 0;
}

void frames_refuse_waiting(struct frames *frames, struct conn *conn, int code, const char *text)
{
	while (conn->waiting != NULL) {
		struct frame *frame = take_waiting(frames, conn, &conn->waiting);

		session_refuse(conn, frame->drawing.id, 0, code, text);
		destroy_frame(frame);
	}
}

unsigned frames_waiting(const struct frames *frames)
{
	return frames->n_waiting;
}

unsigned frames_running(const struct frames *frames)
{
	return frames->n_running;
}

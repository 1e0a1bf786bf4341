#include <stdlib.h>
#include "base/clock.h"
#include "check.h"
#include "frame.h"
#include "render/survey.h"
#include "workers.h"

#define MAX_RUNNING 128           /* frames, each with a thread of its own */
#define IDLE_PART 4               /* of the memory is the most that idle workers keep */
#define LOOK_NS UINT64_C(5000000) /* how often frames that wait look who has run long */

struct frames {
	struct frames_parts parts;
	struct frames_stats stats;
	struct schedule schedule;
	struct schedule_user user;
	struct workers workers;
	uint64_t n_flows, bases_bytes;
	struct budget_learnt learnt; /* of all flows: where new ones start */
	struct surveyor *surveyor;   /* NULL: there was no memory */
	int is_pumping, must_pump_again;
};

static struct frame *frame_of(struct schedule_request *request)
{
	return (struct frame *)request;
}

static void tell_end(struct frame *frame, struct frames_end end)
{
	struct frames_stats *stats = &frame->frames->stats;
	struct flow *flow = frame_flow(frame);

	stats->superseded += end.outcome == FRAMES_SUPERSEDED;
	stats->cancelled += end.outcome == FRAMES_CANCELLED;
	stats->failed += end.outcome == FRAMES_FAILED;
	end.id = frame->drawing.id;
	end.view = frame->drawing.view;
	if (end.outcome == FRAMES_CANCELLED)
		frame_drop_unsent(flow, end.id, end.view, 0);
	else if (end.outcome == FRAMES_SUPERSEDED)
		frame_drop_unsent(flow, end.id, end.view, 1); /* a plain frame is sent, or a slow line would show nothing */
	else if (end.outcome == FRAMES_FAILED)
		frame_drop_unsent(flow, end.id, end.view, frame->request.frame);
	frame->frames->parts.on_end(flow, &end);
}

/* At any time, so nobody else sends it. */
static void tell_failure(struct frame *frame, int code, const char *text)
{
	tell_end(frame, (struct frames_end){ .outcome = FRAMES_FAILED, .code = code, .text = text });
	conn_flush(frame_flow(frame)->conn);
}

static void on_done(void *userdata)
{
	struct frame *frame = userdata;
	struct frames *frames = frame->frames;
	struct conn *conn = frame_flow(frame) != NULL ? frame_flow(frame)->conn : NULL;
	const uint64_t used_ns = atomic_load(&frame->drawing.used_ns);
	enum schedule_next next;

	frames->stats.used_ns += used_ns;
	if (conn == NULL)
		frame->use.flow = 0;
	workers_put(&frames->workers, &frame->use, frame->worker);
	frame_put_models(frame);
	frame_send_coded(frame);
	next = (frame->code == PSR_OK ? schedule_done : frame->code == PSR_ERR_BUSY ? schedule_put_back : schedule_fail)(
		&frames->schedule, &frame->request, used_ns);
	if (next != SCHEDULE_DROPPED && frame->code == PSR_OK) {
		frame_learn(frame, &frames->learnt);
		if (conn->state == CONN_OPEN)
			frame_send_end(frame, next == SCHEDULE_FINAL);
		frames->stats.drawn++;
		frames->stats.on_base += frame->used != NULL;
	}
	frames->stats.late += next == SCHEDULE_FINAL && frame->code == PSR_ERR_LIMIT && used_ns > frame->drawing.limit_ns;
	if (next == SCHEDULE_FINAL && frame->code == PSR_OK)
		tell_end(frame, (struct frames_end){ .outcome = FRAMES_FINAL });
	else if (next == SCHEDULE_FINAL && frame->code == PSR_ERR_BUSY)
		tell_failure(frame, PSR_ERR_CANCELLED, CONN_SHUTDOWN);
	else if (next == SCHEDULE_FINAL)
		tell_failure(frame, frame->code, frame->error.text);
	if (next == SCHEDULE_MORE)
		frame->drawing.arrived_ns = clock_ns();
	else
		frame_destroy(frame);
	if (conn != NULL)
		conn_flush(conn);
	frames_pump(frames);
}

/* ---- what the schedule decides ---- */

/* The scene's models are in memory and pinned; or they cannot be. */
static void on_models(const struct psr_error *error, void *userdata)
{
	struct frame *frame = userdata;
	struct frames *frames = frame->frames;

	frame->is_needing = 0;
	if (error == NULL) {
		frame->has_models = 1;
		schedule_ready(&frame->request);
	} else {
		frame->error = *error;
		schedule_cancel(&frames->schedule, &frame->request, error->code);
	}
	frames_pump(frames);
}

static int on_prepare(struct schedule_request *request, void *userdata)
{
	struct frame *frame = frame_of(request);
	struct scene *scene = frame->drawing.scene;

	(void)userdata;
	if (frame->has_models)
		return 1;
	frame->need = (struct residence_need){ .model = scene->model, .n = scene->n_models, .on_end = on_models,
		                                   .userdata = frame };
	frame->is_needing = 1;
	if (!residence_get(frame->residence, &frame->need))
		return 0;
	frame->is_needing = 0;
	frame->has_models = 1;
	return 1;
}

static void on_let_go(struct schedule_request *request, void *userdata)
{
	(void)userdata;
	frame_put_models(frame_of(request));
}

static void on_begin(struct schedule_request *request, enum pool_class class, void *userdata)
{
	struct frames *frames = userdata;
	struct frame *frame = frame_of(request);
	struct pool_job job = { frame_flow(frame)->share, class, frame_run, frame, 0 };

	frame->drawing.n_waiting = frames->schedule.n_waiting;
	frame_prepare(frame, frames->surveyor);
	job.is_lent_to = frame_is_slight(frame);
	frame->worker = workers_take(&frames->workers, &frame->use, request->bytes);
	if (frame->worker != NULL && psr_pool_submit(frames->parts.pool, &job) == PSR_OK)
		return;
	if (frame->worker != NULL)
		workers_put(&frames->workers, &frame->use, frame->worker);
	schedule_fail(&frames->schedule, request, 0);
	tell_failure(frame, PSR_ERR_MEMORY, "no memory to draw a frame");
	frame_destroy(frame);
}

static void on_stop(struct schedule_request *request, void *userdata)
{
	(void)userdata;
	atomic_store(&frame_of(request)->drawing.is_stopped, 1);
}

static void on_yield(struct schedule_request *request, void *userdata)
{
	(void)userdata;
	atomic_store(&frame_of(request)->drawing.must_yield, 1);
}

static void on_end(struct schedule_request *request, int code, uint32_t by, void *userdata)
{
	struct frames *frames = userdata;
	struct frame *frame = frame_of(request);
	struct psr_error error;

	if (by != 0)
		tell_end(frame, (struct frames_end){ .outcome = FRAMES_SUPERSEDED, .by = by });
	else if (!request->is_running && frame->error.code != PSR_OK) /* a job that runs has it for itself */
		tell_failure(frame, frame->error.code, frame->error.text);
	else if (code == PSR_ERR_LIMIT)
		tell_failure(frame, code, frame_never_fits(&error, frame, &frames->schedule));
	else if (frames->schedule.is_stopped)
		tell_failure(frame, PSR_ERR_CANCELLED, CONN_SHUTDOWN);
	else
		tell_end(frame, (struct frames_end){ .outcome = FRAMES_CANCELLED });
	if (!request->is_running)
		frame_destroy(frame);
}

static void look_at_memory(struct frames *frames)
{
	const struct frames_memory *memory = &frames->parts.memory;

	frames->schedule.kept_bytes = memory->kept(memory->userdata) + frames->workers.bytes + frames->bases_bytes;
	frames->schedule.queued_bytes = memory->queued(memory->userdata);
}

/* Idle workers first: models take longer to come back. */
static void on_need(uint64_t bytes, void *userdata)
{
	struct frames *frames = userdata;
	const struct frames_memory *memory = &frames->parts.memory;
	const uint64_t idle = frames->workers.bytes;

	workers_free(&frames->workers, bytes);
	if (idle < bytes)
		memory->make_room(bytes - idle, memory->userdata);
	look_at_memory(frames);
}

static void look_at_load(struct frames *frames)
{
	struct schedule *schedule = &frames->schedule;

	look_at_memory(frames);
	for (struct schedule_flow *flow = schedule->first; flow != NULL; flow = flow->next)
		flow->queued_bytes = ((struct flow *)flow)->conn->out.size;
	for (struct schedule_request *request = schedule->begun; request != NULL; request = request->next_begun)
		request->used_ns = atomic_load_explicit(&frame_of(request)->drawing.used_ns, memory_order_relaxed);
}

static void set_wake(struct frames *frames)
{
	const struct schedule *schedule = &frames->schedule;
	const uint64_t now_ns = clock_ns();
	uint64_t due_ns = schedule_due(schedule, now_ns);

	if (schedule->n_waiting > 0 && schedule->n_running > 0 && (due_ns == 0 || due_ns > now_ns + LOOK_NS))
		due_ns = now_ns + LOOK_NS;
	loop_wake_at(frames->parts.loop, (due_ns + 999) / 1000);
}

/* What it begins may call it again. */
void frames_pump(struct frames *frames)
{
	frames->must_pump_again = 1;
	if (frames->is_pumping)
		return;
	frames->is_pumping = 1;
	while (frames->must_pump_again) {
		frames->must_pump_again = 0;
		look_at_load(frames);
		schedule_pump(&frames->schedule, clock_ns());
	}
	frames->is_pumping = 0;
	set_wake(frames);
}

/* ---- requests ---- */

/* Sharp and refined frames of answers that are drawn to their end, and have not left yet. */
static void supersede_drawn(struct frames *frames, struct flow *flow, uint32_t by, uint16_t view)
{
	const struct schedule_view *v = &flow->schedule.view[view];

	for (unsigned i = v->n_unacknowledged; i-- > 0;) {
		struct frames_end end = { .outcome = FRAMES_SUPERSEDED, .id = v->unacknowledged[i].id, .view = view, .by = by };

		if (v->unacknowledged[i].frame > 0 && schedule_find(&flow->schedule, end.id) == NULL
		    && frame_drop_unsent(flow, end.id, view, 1)) {
			frames->stats.superseded++;
			frames->parts.on_end(flow, &end);
			i = v->n_unacknowledged;
		}
	}
}

void frames_ask(struct frames *frames, struct flow *flow, const struct psr_message *message,
                const struct psr_msg_frame *request, struct scene *scene)
{
	struct frame *frame = NULL;
	struct psr_error error;
	int code = frame_check(request, message->id, message->view, frames->parts.max_pixels, &error);

	if (code == PSR_OK)
		code = frame_check_scene(request, scene, &error);
	if (code == PSR_OK) {
		frame = frame_create(&frames->parts, flow, message, request, scene);
		if (frame == NULL)
			code = psr_fail(&error, PSR_ERR_MEMORY, "no memory to draw a frame");
	}
	if (code != PSR_OK) {
		const struct frames_end end = { FRAMES_FAILED, message->id, message->view, 0, code, error.text };

		frames->stats.failed++;
		frames->parts.on_end(flow, &end);
		return;
	}
	frame->frames = frames;
	frame->done_note = (struct loop_note){ .fn = on_done, .userdata = frame };
	if (message->view > 0)
		supersede_drawn(frames, flow, message->id, message->view);
	schedule_ask(&frames->schedule, &flow->schedule, &frame->request, frame->drawing.arrived_ns);
	frames_pump(frames);
}

int frames_cancel(struct frames *frames, struct flow *flow, uint32_t id, uint16_t view)
{
	struct schedule_request *request = schedule_find(&flow->schedule, id);

	if (request == NULL)
		return 0;
	if (request->view != view)
		return PSR_ERR_PROTOCOL;
	schedule_cancel(&frames->schedule, request, PSR_ERR_CANCELLED);
	frames_pump(frames);
	return 1;
}

void frames_acknowledge(struct frames *frames, struct flow *flow, uint16_t view, uint32_t id, unsigned frame)
{
	bases_acknowledge(&flow->bases, view, id, frame);
	if (schedule_acknowledge(&flow->schedule, view, id, frame))
		frames_pump(frames);
}

void frames_pause(struct frames *frames, struct flow *flow, uint16_t view, int is_paused)
{
	schedule_pause(&flow->schedule, view, is_paused);
	frames_pump(frames);
}

int flow_init(struct flow *flow, struct frames *frames, struct conn *conn)
{
	*flow = (struct flow){ .conn = conn, .bases.bytes = &frames->bases_bytes, .number = ++frames->n_flows };
	budget_inherit(&flow->learnt, &frames->learnt);
	return pool_flow_create(&flow->share, frames->parts.pool);
}

void frames_forget(struct frames *frames, struct flow *flow)
{
	schedule_forget(&frames->schedule, &flow->schedule);
	workers_forget(&frames->workers, flow->number);
	bases_fini(&flow->bases);
	pool_flow_destroy(flow->share);
	flow->share = NULL;
}

/* ---- life ---- */

int frames_create(struct frames **out, const struct frames_parts *parts)
{
	const struct schedule_limits limits = { (unsigned)psr_pool_threads(parts->pool), MAX_RUNNING, parts->max_queue,
		                                    parts->max_memory };
	struct frames *frames = calloc(1, sizeof *frames);

	if (frames == NULL)
		return PSR_ERR_MEMORY;
	frames->parts = *parts;
	frames->surveyor = surveyor_create();
	budget_init(&frames->learnt);
	frames->user = (struct schedule_user){ on_prepare, on_let_go, on_begin, on_stop, on_yield, on_end, on_need,
	                                        frames };
	schedule_init(&frames->schedule, &limits, &frames->user);
	workers_init(&frames->workers, parts->io, parts->max_memory / IDLE_PART);
	*out = frames;
	return PSR_OK;
}

void frames_destroy(struct frames *frames)
{
	if (frames == NULL)
		return;
	workers_fini(&frames->workers);
	surveyor_destroy(frames->surveyor);
	free(frames);
}

void frames_stop(struct frames *frames, int code)
{
	schedule_stop(&frames->schedule, code);
}

unsigned frames_waiting(const struct frames *frames)
{
	return frames->schedule.n_waiting;
}

unsigned frames_lacking(const struct frames *frames)
{
	return frames->schedule.n_lacking;
}

unsigned frames_running(const struct frames *frames)
{
	return frames->schedule.n_running;
}

uint64_t frames_bytes(const struct frames *frames)
{
	return frames->schedule.running_bytes + frames->workers.bytes + frames->bases_bytes;
}

void frames_free_idle(struct frames *frames, uint64_t bytes)
{
	workers_free(&frames->workers, bytes);
}

struct frames_stats *frames_stats(struct frames *frames)
{
	return &frames->stats;
}

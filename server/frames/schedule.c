#include <assert.h>
#include <string.h>
#include "psr/error.h"
#include "schedule_choose.h"

void schedule_init(struct schedule *s, const struct schedule_limits *limits, const struct schedule_user *user)
{
	*s = (struct schedule){ .limits = *limits, .user = user };
}

/* ---- lists ---- */

/* Of the flow with requests that has used least; without any, of the last one that had some. */
static uint64_t least_tag(const struct schedule *s)
{
	uint64_t least = s->first != NULL ? UINT64_MAX : s->tag_ns;

	for (const struct schedule_flow *flow = s->first; flow != NULL; flow = flow->next)
		least = flow->tag_ns < least ? flow->tag_ns : least;
	return least;
}

/* Who was idle has no claim to the time that others used meanwhile. */
static void add_flow(struct schedule *s, struct schedule_flow *flow)
{
	const uint64_t least = least_tag(s);

	if (flow->tag_ns < least)
		flow->tag_ns = least;
	flow->previous = NULL;
	flow->next = s->first;
	if (flow->next != NULL)
		flow->next->previous = flow;
	s->first = flow;
}

static void remove_flow(struct schedule *s, struct schedule_flow *flow)
{
	if (flow->previous != NULL)
		flow->previous->next = flow->next;
	else
		s->first = flow->next;
	if (flow->next != NULL)
		flow->next->previous = flow->previous;
	s->tag_ns = flow->tag_ns;
}

static void add_request(struct schedule *s, struct schedule_flow *flow, struct schedule_request *request)
{
	struct schedule_request **at = &flow->view[request->view].first;

	while (*at != NULL)
		at = &(*at)->next;
	request->next = NULL;
	*at = request;
	if (flow->n_requests++ == 0)
		add_flow(s, flow);
	s->n_waiting++;
}

static void end_preparing(struct schedule *s, struct schedule_request *request)
{
	s->n_preparing -= request->is_coming || request->is_ready;
	request->is_coming = request->is_ready = 0;
}

static void end_lacking(struct schedule *s, struct schedule_request *request)
{
	s->n_lacking -= request->lacks_ns != 0;
	request->lacks_ns = 0;
}

static void remove_request(struct schedule *s, struct schedule_request *request)
{
	struct schedule_request **at = &request->flow->view[request->view].first;

	end_preparing(s, request);
	end_lacking(s, request);
	while (*at != request)
		at = &(*at)->next;
	*at = request->next;
	if (--request->flow->n_requests == 0)
		remove_flow(s, request->flow);
	if (!request->is_running)
		s->n_waiting--;
}

/* ---- frames that run ---- */

static void begin(struct schedule *s, struct schedule_request *request, uint64_t now_ns)
{
	struct schedule_flow *flow = request->flow;
	struct schedule_view *view = &flow->view[request->view];
	uint64_t beside;

	if (request == schedule_starving(&beside, s, now_ns))
		s->served_ns = now_ns;
	end_preparing(s, request);
	end_lacking(s, request);
	request->is_running = 1;
	request->is_yielding = 0;
	request->begun_ns = now_ns;
	request->used_ns = 0;
	request->next_begun = s->begun;
	s->begun = request;
	s->n_waiting--;
	s->n_running++;
	s->running_bytes += request->bytes;
	flow->n_running++;
	flow->answer_bytes += request->answer_bytes;
	if (request->view > 0) {
		assert(view->n_unacknowledged < SCHEDULE_WINDOW);
		view->unacknowledged[view->n_unacknowledged].id = request->id;
		view->unacknowledged[view->n_unacknowledged++].frame = request->frame;
	}
	s->user->on_begin(request, schedule_class(request), s->user->userdata);
}

static void finish(struct schedule *s, struct schedule_request *request, uint64_t used_ns)
{
	struct schedule_request **at = &s->begun;

	while (*at != request)
		at = &(*at)->next_begun;
	*at = request->next_begun;
	s->n_running--;
	s->running_bytes -= request->bytes;
	if (request->flow != NULL) {
		request->flow->tag_ns += used_ns;
		request->flow->n_running--;
		request->flow->answer_bytes -= request->answer_bytes;
	}
}

static void forget_frame(struct schedule_view *view, uint32_t id, unsigned frame)
{
	for (unsigned i = 0; i < view->n_unacknowledged; i++) {
		if (view->unacknowledged[i].id == id && view->unacknowledged[i].frame == frame) {
			view->n_unacknowledged--;
			memmove(&view->unacknowledged[i], &view->unacknowledged[i + 1],
			        (view->n_unacknowledged - i) * sizeof view->unacknowledged[0]);
			return;
		}
	}
}

/* The request ends without a last frame. */
static void give_up(struct schedule *s, struct schedule_request *request, int code, uint32_t by)
{
	const int is_running = request->is_running;

	remove_request(s, request);
	if (is_running) {
		forget_frame(&request->flow->view[request->view], request->id, request->frame);
		request->is_given_up = 1;
	}
	s->user->on_end(request, code, by, s->user->userdata);
	if (is_running)
		s->user->on_stop(request, s->user->userdata);
}

static enum schedule_next end_frame(struct schedule *s, struct schedule_request *request, uint64_t used_ns, int is_last)
{
	finish(s, request, used_ns);
	if (request->is_given_up)
		return SCHEDULE_DROPPED;
	if (is_last || request->frame + 1 >= request->n_frames || s->is_stopped || request->is_superseded) {
		remove_request(s, request);
		return SCHEDULE_FINAL;
	}
	request->is_running = 0;
	request->frame++;
	s->n_waiting++;
	return SCHEDULE_MORE;
}

enum schedule_next schedule_done(struct schedule *s, struct schedule_request *request, uint64_t used_ns)
{
	return end_frame(s, request, used_ns, 0);
}

enum schedule_next schedule_fail(struct schedule *s, struct schedule_request *request, uint64_t used_ns)
{
	if (!request->is_given_up)
		forget_frame(&request->flow->view[request->view], request->id, request->frame);
	return end_frame(s, request, used_ns, 1);
}

enum schedule_next schedule_put_back(struct schedule *s, struct schedule_request *request, uint64_t used_ns)
{
	finish(s, request, used_ns);
	if (request->is_given_up)
		return SCHEDULE_DROPPED;
	if (s->is_stopped) {
		remove_request(s, request);
		return SCHEDULE_FINAL;
	}
	forget_frame(&request->flow->view[request->view], request->id, request->frame);
	request->is_running = 0;
	s->n_waiting++;
	return SCHEDULE_MORE;
}

/* ---- what clients say ---- */

void schedule_ask(struct schedule *s, struct schedule_flow *flow, struct schedule_request *request, uint64_t now_ns)
{
	request->flow = flow;
	request->frame = 0;
	request->is_running = request->is_superseded = request->is_given_up = 0;
	request->is_coming = request->is_ready = 0;
	request->round = request->lacks_ns = 0;
	request->asked_ns = now_ns;
	add_request(s, flow, request);
	if (request->view == 0)
		return;
	for (struct schedule_request *old = flow->view[request->view].first, *next; old != request; old = next) {
		next = old->next;
		old->is_superseded = 1;
		if (!old->is_running || old->frame > 0)
			give_up(s, old, PSR_ERR_CANCELLED, request->id);
	}
}

struct schedule_request *schedule_find(const struct schedule_flow *flow, uint32_t id)
{
	for (unsigned v = 0; v < SCHEDULE_VIEWS; v++)
		for (struct schedule_request *request = flow->view[v].first; request != NULL; request = request->next)
			if (request->id == id)
				return request;
	return NULL;
}

void schedule_cancel(struct schedule *s, struct schedule_request *request, int code)
{
	give_up(s, request, code, 0);
}

int schedule_acknowledge(struct schedule_flow *flow, unsigned view, uint32_t id, unsigned frame)
{
	struct schedule_view *v = &flow->view[view];
	const unsigned before = v->n_unacknowledged;

	forget_frame(v, id, frame);
	return v->n_unacknowledged < before;
}

void schedule_pause(struct schedule_flow *flow, unsigned view, int is_paused)
{
	flow->view[view].is_paused = is_paused;
}

void schedule_forget(struct schedule *s, struct schedule_flow *flow)
{
	for (unsigned v = 0; v < SCHEDULE_VIEWS; v++)
		while (flow->view[v].first != NULL)
			give_up(s, flow->view[v].first, PSR_ERR_CANCELLED, 0);
	for (struct schedule_request *request = s->begun; request != NULL; request = request->next_begun)
		if (request->flow == flow)
			request->flow = NULL;
}

void schedule_stop(struct schedule *s, int code)
{
	struct schedule_flow *next_flow;

	s->is_stopped = 1;
	for (struct schedule_flow *flow = s->first; flow != NULL; flow = next_flow) {
		next_flow = flow->next;
		for (unsigned v = 0; v < SCHEDULE_VIEWS; v++) {
			for (struct schedule_request *request = flow->view[v].first, *next; request != NULL; request = next) {
				next = request->next;
				if (!request->is_running)
					give_up(s, request, code, 0);
			}
		}
	}
}

/* ---- what begins ---- */

/* While something is missing the request is not looked at; it may have ended when this returns 0. */
static int prepare(struct schedule *s, struct schedule_request *request)
{
	if (request->is_ready)
		return 1;
	request->is_coming = 1;
	s->n_preparing++;
	if (!s->user->on_prepare(request, s->user->userdata))
		return 0;
	end_preparing(s, request);
	return 1;
}

void schedule_ready(struct schedule_request *request)
{
	request->is_coming = 0;
	request->is_ready = 1;
}

static void let_go(struct schedule *s, struct schedule_request *request)
{
	end_preparing(s, request);
	s->user->on_let_go(request, s->user->userdata);
}

/* Whoever pauses a view keeps nobody waiting for what has come. */
static struct schedule_request *find_paused(const struct schedule *s)
{
	for (struct schedule_flow *flow = s->n_preparing > 0 ? s->first : NULL; flow != NULL; flow = flow->next)
		for (unsigned v = 0; v < SCHEDULE_VIEWS; v++)
			for (struct schedule_request *r = flow->view[v].first; r != NULL && flow->view[v].is_paused; r = r->next)
				if (r->is_ready)
					return r;
	return NULL;
}

/* Refined frames may run for as long as somebody else wants the cores. */
static void make_refined_yield(struct schedule *s)
{
	for (struct schedule_request *request = s->begun; request != NULL; request = request->next_begun) {
		if (schedule_class(request) != POOL_REFINING || request->is_given_up || request->is_yielding)
			continue;
		request->is_yielding = 1;
		s->user->on_yield(request, s->user->userdata);
	}
}

/* A frame that lacks memory lets others by: they may be small. */
static void note_lack(struct schedule *s, struct schedule_request *request, uint64_t now_ns)
{
	uint64_t beside;

	if (request->lacks_ns == 0 && schedule_class(request) != POOL_REFINING) {
		request->lacks_ns = now_ns;
		s->n_lacking++;
	}
	if (request == schedule_starving(&beside, s, now_ns)) /* keeps its models: the others leave theirs */
		make_refined_yield(s);
	else if (request->is_ready)
		let_go(s, request);
}

void schedule_pump(struct schedule *s, uint64_t now_ns)
{
	struct schedule_request *request;

	s->round++;
	s->waiting_bytes = UINT64_MAX;
	while ((request = find_paused(s)) != NULL)
		let_go(s, request);
	while (!s->is_stopped && s->n_waiting > 0 && (request = schedule_choose(s, now_ns)) != NULL) {
		const enum schedule_fit how = schedule_fit(s, request, now_ns);

		request->round = s->round;
		if ((how == SCHEDULE_LACKS || how == SCHEDULE_MUST_LEAVE_ROOM) && request->bytes < s->waiting_bytes)
			s->waiting_bytes = request->bytes;
		if (how == SCHEDULE_NEVER_FITS)
			give_up(s, request, PSR_ERR_LIMIT, 0);
		else if (how == SCHEDULE_LACKS)
			note_lack(s, request, now_ns);
		else if (how == SCHEDULE_MUST_LEAVE_ROOM && request->is_ready)
			let_go(s, request);
		else if (how == SCHEDULE_FITS && prepare(s, request))
			begin(s, request, now_ns);
	}
}

uint64_t schedule_due(const struct schedule *s, uint64_t now_ns)
{
	uint64_t due = 0;

	for (const struct schedule_flow *flow = s->first; flow != NULL; flow = flow->next) {
		for (unsigned v = 1; v < SCHEDULE_VIEWS; v++) {
			const struct schedule_request *request = flow->view[v].first;
			const uint64_t at = request != NULL ? request->asked_ns + SCHEDULE_REST_NS : 0;

			if (request != NULL && !request->is_running && request->frame > 0 && at > now_ns && (due == 0 || at < due))
				due = at;
		}
	}
	return due;
}

#include <stddef.h>
#include "schedule_choose.h"

enum pool_class schedule_class(const struct schedule_request *request)
{
	if (request->frame > (unsigned)request->has_sharp)
		return POOL_REFINING;
	return request->view > 0 && request->frame == 0 ? POOL_MOVING : POOL_RESTING;
}

/* But for places and memory. Only in view 0 several requests of a view run at once. Later frames of a view > 0 wait until
 * the camera rests. */
static int may_begin(const struct schedule_request *request, uint64_t now_ns)
{
	const struct schedule_view *view = &request->flow->view[request->view];

	if (request->is_running || request->is_coming || view->is_paused)
		return 0;
	if (request->view == 0)
		return 1;
	return view->n_unacknowledged < SCHEDULE_WINDOW && view->first == request
	       && (request->frame == 0 || now_ns >= request->asked_ns + SCHEDULE_REST_NS);
}

/* Without the second rule each of thousands would be looked at in each round. */
static int must_look_at(const struct schedule *s, const struct schedule_request *request)
{
	return request->round != s->round && (request->bytes < s->waiting_bytes || request->is_ready);
}

/* A reader that holds answers gets further ones only within the limit. */
static int has_queue(const struct schedule *s, const struct schedule_request *request)
{
	const uint64_t held = request->flow->queued_bytes + request->flow->answer_bytes;

	return held == 0 || held + request->answer_bytes <= s->limits.max_queue;
}

/* The next of a flow: its classes in order, then the oldest. */
static struct schedule_request *next_of(const struct schedule *s, const struct schedule_flow *flow, uint64_t now_ns)
{
	struct schedule_request *best = NULL;

	for (unsigned v = 0; v < SCHEDULE_VIEWS; v++)
		for (struct schedule_request *request = flow->view[v].first; request != NULL; request = request->next)
			if (must_look_at(s, request) && may_begin(request, now_ns) && has_queue(s, request)
			    && (best == NULL || schedule_class(request) < schedule_class(best)
			        || (schedule_class(request) == schedule_class(best) && request->id < best->id)))
				best = request;
	return best;
}

struct places { /* that frames take */
	unsigned n_short, n_not_long, n_refining;
};

static struct places count_places(const struct schedule *s)
{
	struct places n = { 0, 0, 0 };

	for (const struct schedule_request *request = s->begun; request != NULL; request = request->next_begun) {
		const int is_refining = schedule_class(request) == POOL_REFINING;

		n.n_refining += (unsigned)is_refining;
		n.n_short += !is_refining && request->used_ns < SCHEDULE_SHORT_NS;
		n.n_not_long += !is_refining && request->used_ns < SCHEDULE_LONG_NS;
	}
	return n;
}

/* Few frames at once are in the caches; short ones end soon. The further frames of a flow leave places to the first ones
 * of others, so that a flow with many requests keeps nobody out. */
static int has_place(const struct schedule *s, const struct places *places, const struct schedule_request *request)
{
	const unsigned n = s->limits.n_threads, is_further = request->flow->n_running > 0;

	if (s->n_running >= s->limits.max_running)
		return 0;
	if (schedule_class(request) == POOL_REFINING)
		return places->n_refining < n;
	return places->n_short + is_further < n + 1 && places->n_not_long < (is_further ? n + 1 : 2 * n + 2);
}

/* Refining comes last; then flows without a running frame come first; then who used least. */
static int is_before(const struct schedule_request *a, const struct schedule_request *b)
{
	const int a_refines = schedule_class(a) == POOL_REFINING, b_refines = schedule_class(b) == POOL_REFINING;

	if (a_refines != b_refines)
		return b_refines;
	if (!a->flow->n_running != !b->flow->n_running)
		return a->flow->n_running == 0;
	return a->flow->tag_ns < b->flow->tag_ns;
}

/* When a request that lacks memory has waited for long enough. */
static uint64_t starves_from(const struct schedule *s, const struct schedule_request *request)
{
	return (request->lacks_ns > s->served_ns ? request->lacks_ns : s->served_ns) + SCHEDULE_PATIENCE_NS;
}

static struct schedule_request *find_starving(const struct schedule *s, const struct places *places, uint64_t now_ns)
{
	struct schedule_request *first = NULL;

	for (const struct schedule_flow *flow = s->first; flow != NULL; flow = flow->next)
		for (unsigned v = 0; v < SCHEDULE_VIEWS; v++)
			for (struct schedule_request *request = flow->view[v].first; request != NULL; request = request->next)
				if (request->lacks_ns != 0 && starves_from(s, request) <= now_ns && may_begin(request, now_ns)
				    && has_queue(s, request) && has_place(s, places, request)
				    && (first == NULL || request->lacks_ns < first->lacks_ns))
					first = request;
	return first;
}

struct schedule_request *schedule_starving(uint64_t *beside, const struct schedule *s, uint64_t now_ns)
{
	const struct places places = count_places(s);
	struct schedule_request *starving = s->n_lacking > 0 ? find_starving(s, &places, now_ns) : NULL;

	*beside = 0;
	if (starving == NULL)
		return NULL;
	for (const struct schedule_request *request = s->begun; request != NULL; request = request->next_begun)
		*beside += request->begun_ns >= starves_from(s, starving) ? request->bytes : 0;
	return starving;
}

struct schedule_request *schedule_choose(const struct schedule *s, uint64_t now_ns)
{
	const struct places places = count_places(s);
	struct schedule_request *best = s->n_lacking > 0 ? find_starving(s, &places, now_ns) : NULL;

	if (best != NULL && best->round != s->round)
		return best;
	best = NULL;
	for (struct schedule_flow *flow = s->first; flow != NULL; flow = flow->next) {
		struct schedule_request *request = next_of(s, flow, now_ns);

		if (request != NULL && has_place(s, &places, request) && (best == NULL || is_before(request, best)))
			best = request;
	}
	return best;
}

/* ---- memory ---- */

/* Whether frames of so many bytes fit beside what is kept and queued. Lets go of what is kept for later, but not for a
 * frame that has to wait for others all the same. */
static int has_room(struct schedule *s, uint64_t bytes)
{
	const uint64_t limit = s->limits.max_memory, least = s->queued_bytes + bytes;

	if (least + s->kept_bytes > limit && (least <= limit || s->n_running == 0))
		s->user->on_need(least + s->kept_bytes - limit, s->user->userdata);
	return s->kept_bytes + s->queued_bytes + bytes <= limit;
}

enum schedule_fit schedule_fit(struct schedule *s, const struct schedule_request *request, uint64_t now_ns)
{
	uint64_t beside;
	const struct schedule_request *starving = schedule_starving(&beside, s, now_ns);

	if (has_room(s, s->running_bytes + request->bytes)) {
		if (starving == NULL || starving == request || has_room(s, beside + request->bytes + starving->bytes))
			return SCHEDULE_FITS;
		return SCHEDULE_MUST_LEAVE_ROOM;
	}
	if (s->n_running > 0 || s->n_preparing > (unsigned)request->is_ready
	    || s->kept_bytes + request->bytes <= s->limits.max_memory)
		return SCHEDULE_LACKS;
	return SCHEDULE_NEVER_FITS;
}

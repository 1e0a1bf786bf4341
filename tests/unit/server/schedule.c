/* The schedule as a state machine with a simulated clock: a million random steps, and shares of equal and unequal
 * clients. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include "base/random.h"
#include "psr/error.h"
#include "server/frames/schedule.h"

#define N_FLOWS 12
#define N_VIEWS 4 /* that clients use */
#define MS UINT64_C(1000000)
#define MEMORY 1000

struct frame_seen {
	uint32_t id;
	unsigned frame;
};

struct client {
	struct schedule_flow flow;
	uint32_t last_id;
	struct frame_seen begun[N_VIEWS][4]; /* unacknowledged, as the client counts them */
	unsigned n_begun[N_VIEWS];
	uint32_t newest[N_VIEWS];            /* request of the view that must be drawn; 0: it was cancelled */
	uint32_t drawn[N_VIEWS];             /* newest request whose frame 0 was */
	unsigned n_asked, n_ended;
};

struct request {
	struct schedule_request schedule;
	struct client *client;
	int n_ends, is_stopped, is_ready, must_yield;
};

struct world {
	struct schedule schedule;
	struct client client[N_FLOWS];
	struct request *running[64], *coming[N_FLOWS * 64 * 2];
	unsigned n_running, n_coming;
	int with_models, must_pump;
	uint64_t random, now_ns, kept;
};

static void drop_begun(struct client *client, unsigned view, uint32_t id, unsigned frame)
{
	for (unsigned i = 0; i < client->n_begun[view]; i++) {
		if (client->begun[view][i].id == id && client->begun[view][i].frame == frame) {
			client->begun[view][i] = client->begun[view][--client->n_begun[view]];
			return;
		}
	}
}

static int on_prepare(struct schedule_request *r, void *userdata)
{
	struct world *w = userdata;
	struct request *request = (struct request *)r;

	assert_int_equal(request->n_ends, 0);
	if (request->is_ready || !w->with_models || random_below(&w->random, 3) > 0)
		return 1;
	w->must_pump = 1;
	switch (random_below(&w->random, 8)) { /* sooner or later, or never: the model is gone */
	case 0:
		request->is_ready = 1;
		schedule_ready(r);
		break;
	case 1:
		schedule_cancel(&w->schedule, r, PSR_ERR_NOT_FOUND);
		break;
	default:
		w->coming[w->n_coming++] = request;
	}
	return 0;
}

static void on_let_go(struct schedule_request *r, void *userdata)
{
	struct request *request = (struct request *)r;

	(void)userdata;
	assert_true(request->is_ready);
	request->is_ready = 0;
}

static void on_begin(struct schedule_request *r, enum pool_class class, void *userdata)
{
	struct world *w = userdata;
	struct request *request = (struct request *)r;
	struct client *client = request->client;

	(void)class;
	assert_int_equal(request->n_ends, 0);
	assert_true(w->n_running < 64);
	assert_true(w->schedule.kept_bytes + w->schedule.queued_bytes + w->schedule.running_bytes <= MEMORY);
	w->running[w->n_running++] = request;
	if (r->view > 0) {
		assert_true(client->n_begun[r->view] < SCHEDULE_WINDOW);
		client->begun[r->view][client->n_begun[r->view]++] = (struct frame_seen){ r->id, r->frame };
		assert_true(r->id == client->newest[r->view] || r->frame == 0);
	}
}

static void on_stop(struct schedule_request *r, void *userdata)
{
	(void)userdata;
	((struct request *)r)->is_stopped = 1;
}

static void on_yield(struct schedule_request *r, void *userdata)
{
	struct request *request = (struct request *)r;

	(void)userdata;
	assert_true(r->is_running && r->frame > (unsigned)r->has_sharp);
	assert_false(request->is_stopped);
	request->must_yield = 1;
}

static void end(struct request *request)
{
	assert_int_equal(request->n_ends++, 0);
	request->client->n_ended++;
}

static void on_end(struct schedule_request *r, int code, uint32_t by, void *userdata)
{
	struct world *w = userdata;
	struct request *request = (struct request *)r;

	for (unsigned i = 0; i < w->n_coming; i++)
		if (w->coming[i] == request)
			w->coming[i--] = w->coming[--w->n_coming];
	if (by != 0) {
		assert_true(r->view > 0);
		assert_true(by > r->id);
	} else if (r->view > 0 && request->client->newest[r->view] == r->id) {
		assert_true(code == PSR_ERR_CANCELLED || code == PSR_ERR_LIMIT || code == PSR_ERR_NOT_FOUND);
		request->client->newest[r->view] = 0;
	}
	end(request);
	if (r->is_running)
		drop_begun(request->client, r->view, r->id, r->frame);
	else
		free(request);
}

static void on_need(uint64_t bytes, void *userdata)
{
	struct world *w = userdata;

	w->schedule.kept_bytes -= bytes < w->schedule.kept_bytes ? bytes : w->schedule.kept_bytes;
}

static const struct schedule_user user = { on_prepare, on_let_go, on_begin, on_stop, on_yield, on_end, on_need, NULL };

static void begin_world(struct world *w, struct schedule_user *mine, const struct schedule_limits *limits)
{
	memset(w, 0, sizeof *w);
	*mine = user;
	mine->userdata = w;
	w->now_ns = 1000 * MS;
	schedule_init(&w->schedule, limits, mine);
}

static void ask(struct world *w, struct client *client, unsigned view, unsigned n_frames, uint64_t bytes)
{
	struct request *request = calloc(1, sizeof *request);

	assert_non_null(request);
	request->client = client;
	request->schedule.id = ++client->last_id;
	request->schedule.view = (uint16_t)view;
	request->schedule.n_frames = n_frames;
	request->schedule.has_sharp = view > 0 && n_frames > 1 && (n_frames & 1);
	request->schedule.bytes = bytes;
	request->schedule.answer_bytes = bytes / 2;
	client->newest[view] = request->schedule.id;
	client->n_asked++;
	schedule_ask(&w->schedule, &client->flow, &request->schedule, w->now_ns);
}

/* It begins again later. */
static void put_back(struct world *w, unsigned i)
{
	struct request *request = w->running[i];
	struct schedule_request *r = &request->schedule;
	const unsigned frame = r->frame;

	w->running[i] = w->running[--w->n_running];
	request->must_yield = 0;
	if (schedule_put_back(&w->schedule, r, MS) == SCHEDULE_MORE) {
		assert_int_equal(request->n_ends, 0);
		drop_begun(request->client, r->view, r->id, frame);
	} else {
		assert_int_equal(request->n_ends, 1);
		free(request);
	}
}

/* What ran ends: done, failed or given up. */
static void finish(struct world *w, unsigned i, uint64_t used_ns, int fails)
{
	struct request *request = w->running[i];
	struct schedule_request *r = &request->schedule;
	const unsigned frame = r->frame, was_ended = (unsigned)request->n_ends;
	enum schedule_next next;

	w->running[i] = w->running[--w->n_running];
	next = fails ? schedule_fail(&w->schedule, r, used_ns) : schedule_done(&w->schedule, r, used_ns);
	assert_int_equal(next == SCHEDULE_DROPPED, was_ended);
	assert_int_equal(next == SCHEDULE_DROPPED, request->is_stopped);
	if (next != SCHEDULE_DROPPED && !fails && frame == 0 && r->id > request->client->drawn[r->view])
		request->client->drawn[r->view] = r->id;
	if (next == SCHEDULE_DROPPED) {
		free(request);
		return;
	}
	if (fails) {
		drop_begun(request->client, r->view, r->id, frame);
		if (request->client->newest[r->view] == r->id)
			request->client->newest[r->view] = 0;
	}
	if (next == SCHEDULE_FINAL) {
		end(request);
		free(request);
	}
}

static void acknowledge_one(struct client *client, unsigned view)
{
	const struct frame_seen seen = client->begun[view][0];

	drop_begun(client, view, seen.id, seen.frame);
	assert_true(schedule_acknowledge(&client->flow, view, seen.id, seen.frame));
}

/* A client acknowledges what has ended, not what still runs. */
static int is_running(const struct world *w, const struct client *client, unsigned view)
{
	for (unsigned i = 0; i < w->n_running; i++)
		if (w->running[i]->client == client && w->running[i]->schedule.view == view && !w->running[i]->is_stopped
		    && w->running[i]->schedule.id == client->begun[view][0].id
		    && w->running[i]->schedule.frame == client->begun[view][0].frame)
			return 1;
	return 0;
}

/* A model has come into memory. */
static void come(struct world *w)
{
	struct request *request = w->coming[--w->n_coming];

	request->is_ready = 1;
	schedule_ready(&request->schedule);
}

static void acknowledge(struct world *w, struct client *client, unsigned view)
{
	if (client->n_begun[view] > 0 && !is_running(w, client, view))
		acknowledge_one(client, view);
}

static void cancel(struct world *w, struct client *client)
{
	const uint32_t id = client->last_id - random_below(&w->random, 4);
	struct schedule_request *request = schedule_find(&client->flow, id);

	if (request != NULL)
		schedule_cancel(&w->schedule, request, PSR_ERR_CANCELLED);
}

static void leave(struct world *w, struct client *client)
{
	schedule_forget(&w->schedule, &client->flow);
	assert_int_equal(client->n_asked, client->n_ended);
	assert_int_equal(client->flow.n_requests, 0);
	memset(client->newest, 0, sizeof client->newest);
	memset(client->n_begun, 0, sizeof client->n_begun);
	memset(&client->flow, 0, sizeof client->flow);
}

static void end_one(struct world *w)
{
	const unsigned i = w->n_running > 0 ? random_below(&w->random, w->n_running) : 0;

	if (w->n_running == 0)
		return;
	if (w->running[i]->must_yield && random_below(&w->random, 2))
		put_back(w, i);
	else
		finish(w, i, random_below(&w->random, 200) * MS, random_below(&w->random, 20) == 0);
}

static void step(struct world *w)
{
	struct client *client = &w->client[random_below(&w->random, N_FLOWS)];
	const unsigned view = random_below(&w->random, N_VIEWS);

	switch (random_below(&w->random, 16)) {
	case 0:
	case 1:
	case 2:
	case 3:
		if (client->flow.n_requests < 64)
			ask(w, client, view, 1 + random_below(&w->random, 4), 1 + random_below(&w->random, 400));
		break;
	case 4:
		cancel(w, client);
		if (w->n_coming > 0)
			come(w);
		break;
	case 5:
		schedule_pause(&client->flow, view, (int)random_below(&w->random, 2));
		break;
	case 6:
		if (random_below(&w->random, 20) == 0)
			leave(w, client);
		break;
	case 7:
		w->schedule.kept_bytes = random_below(&w->random, MEMORY);
		w->schedule.queued_bytes = random_below(&w->random, 100);
		break;
	case 8:
	case 9:
		w->now_ns += random_below(&w->random, 50) * MS;
		break;
	case 10:
	case 11:
		acknowledge(w, client, view);
		break;
	default:
		end_one(w);
	}
	if (w->schedule.kept_bytes + w->schedule.queued_bytes + w->schedule.running_bytes > MEMORY)
		w->schedule.kept_bytes = w->schedule.queued_bytes = 0;
	schedule_pump(&w->schedule, w->now_ns);
}

/* Everybody resumes, reads and acknowledges. */
static void settle(struct world *w)
{
	w->schedule.kept_bytes = w->schedule.queued_bytes = 0;
	for (int left = 1; left || w->must_pump;) {
		left = w->must_pump = 0;
		for (unsigned i = 0; i < N_FLOWS; i++)
			for (unsigned v = 0; v < N_VIEWS; v++) {
				schedule_pause(&w->client[i].flow, v, 0);
				acknowledge(w, &w->client[i], v);
			}
		w->now_ns += SCHEDULE_REST_NS;
		for (; w->n_coming > 0; left = 1)
			come(w);
		schedule_pump(&w->schedule, w->now_ns);
		while (w->n_running > 0) {
			left = 1;
			finish(w, w->n_running - 1, MS, 0);
		}
	}
	assert_int_equal(w->schedule.n_waiting, 0);
	assert_int_equal(w->schedule.n_running, 0);
	assert_true(w->schedule.running_bytes == 0);
	assert_int_equal(w->schedule.n_preparing, 0);
	assert_int_equal(w->schedule.n_lacking, 0);
	for (unsigned i = 0; i < N_FLOWS; i++) {
		struct client *client = &w->client[i];

		assert_int_equal(client->n_asked, client->n_ended);
		for (unsigned v = 1; v < N_VIEWS; v++)
			assert_true(client->newest[v] == 0 || client->drawn[v] == client->newest[v]);
	}
}

/* Exactly one terminal a request; the last request of a view is drawn; at most two frames of a view are
 * unacknowledged; memory stays within its limit: checked where these happen. */
static void a_million_random_steps_keep_the_rules(void **state)
{
	const struct schedule_limits limits = { .n_threads = 2, .max_running = 16, .max_queue = 500, .max_memory = MEMORY };
	static struct world w;
	struct schedule_user mine;

	(void)state;
	begin_world(&w, &mine, &limits);
	w.random = 7;
	w.with_models = 1;
	for (int i = 0; i < 1000000; i++) {
		step(&w);
		if (i % 5000 == 0)
			settle(&w);
	}
	settle(&w);
}

/* ---- shares ---- */

/* Frames that run share the cores in turns of a millisecond. Each client keeps `depth` requests open. */
struct load {
	unsigned depth;
	uint64_t cost_ns;
};

static void share(const struct load *load, unsigned n_clients, uint64_t *used_ns, unsigned *n_frames)
{
	const struct schedule_limits limits = { .n_threads = 2, .max_running = 256, .max_queue = UINT64_MAX,
		                                    .max_memory = UINT64_MAX };
	static struct world w;
	struct schedule_user mine;
	unsigned turn = 0;

	begin_world(&w, &mine, &limits);
	for (uint64_t ms = 0; ms < 4000; ms++) {
		for (unsigned i = 0; i < n_clients; i++)
			while (w.client[i].flow.n_requests < load[i].depth)
				ask(&w, &w.client[i], 0, 1, 1);
		w.now_ns += MS;
		schedule_pump(&w.schedule, w.now_ns);
		/* two cores, each frame in turn: what is fair is the order in which they begin */
		for (int core = 0; core < 2 && w.n_running > 0; core++) {
			const unsigned best = turn++ % w.n_running;
			struct request *request = w.running[best];
			const unsigned client = (unsigned)(request->client - w.client);

			request->schedule.used_ns += MS;
			used_ns[client] += MS;
			if (request->schedule.used_ns >= load[client].cost_ns) {
				n_frames[client]++;
				finish(&w, best, request->schedule.used_ns, 0);
			}
		}
	}
	for (unsigned i = 0; i < n_clients; i++)
		schedule_forget(&w.schedule, &w.client[i].flow);
	while (w.n_running > 0)
		finish(&w, 0, 0, 0);
}

static void a_client_with_many_requests_gets_no_more_frames(void **state)
{
	struct load load[N_FLOWS];
	uint64_t used_ns[N_FLOWS] = { 0 };
	unsigned n_frames[N_FLOWS] = { 0 };

	(void)state;
	for (unsigned i = 0; i < N_FLOWS; i++)
		load[i] = (struct load){ i == 0 ? 64 : 1, 5 * MS };
	share(load, N_FLOWS, used_ns, n_frames);
	for (unsigned i = 1; i < N_FLOWS; i++) /* a frame more or less at either end */
		assert_in_range(n_frames[i] + 2, n_frames[0], n_frames[0] + 4);
}

/* A twentieth of the mean, and one frame. */
static void frames_of_different_sizes_get_equal_time(void **state)
{
	struct load load[N_FLOWS];
	uint64_t used_ns[N_FLOWS] = { 0 }, mean = 0;
	unsigned n_frames[N_FLOWS] = { 0 };

	(void)state;
	for (unsigned i = 0; i < N_FLOWS; i++) {
		load[i] = (struct load){ 1 + i % 2, (1 + i * i) * MS };
	}
	share(load, N_FLOWS, used_ns, n_frames);
	for (unsigned i = 0; i < N_FLOWS; i++)
		mean += used_ns[i] / N_FLOWS;
	for (unsigned i = 0; i < N_FLOWS; i++)
		assert_in_range(used_ns[i] + mean / 20 + load[i].cost_ns, mean, mean + 2 * (mean / 20 + load[i].cost_ns));
}

static void use(struct world *w, uint64_t used_ns)
{
	for (unsigned i = 0; i < w->n_running; i++)
		w->running[i]->schedule.used_ns = used_ns;
	schedule_pump(&w->schedule, w->now_ns);
}

/* Frames of half a minute take every place, and leave them one after another as they turn out to be long. */
static void long_frames_keep_nobody_out(void **state)
{
	const struct schedule_limits limits = { .n_threads = 2, .max_running = 16, .max_queue = UINT64_MAX,
		                                    .max_memory = UINT64_MAX };
	static struct world w;
	struct schedule_user mine;

	(void)state;
	begin_world(&w, &mine, &limits);
	for (unsigned i = 0; i < 10; i++)
		ask(&w, &w.client[i], 0, 1, 1);
	use(&w, 0);
	assert_int_equal(w.n_running, 3);
	use(&w, SCHEDULE_SHORT_NS);
	assert_int_equal(w.n_running, 6);
	use(&w, SCHEDULE_SHORT_NS);
	assert_int_equal(w.n_running, 6);
	use(&w, SCHEDULE_LONG_NS);
	assert_int_equal(w.n_running, 9);
	use(&w, SCHEDULE_LONG_NS);
	assert_int_equal(w.n_running, 10);
	while (w.n_running > 0)
		finish(&w, 0, 0, 0);
}

static void a_frame_that_never_fits_into_memory_is_refused(void **state)
{
	const struct schedule_limits limits = { .n_threads = 2, .max_running = 16, .max_queue = UINT64_MAX,
		                                    .max_memory = MEMORY };
	static struct world w;
	struct schedule_user mine;

	(void)state;
	begin_world(&w, &mine, &limits);
	ask(&w, &w.client[0], 0, 1, MEMORY + 1);
	schedule_pump(&w.schedule, w.now_ns);
	assert_int_equal(w.client[0].n_ended, 1);
	w.schedule.queued_bytes = MEMORY / 2; /* what others have not read yet goes away: wait */
	ask(&w, &w.client[0], 0, 1, MEMORY);
	schedule_pump(&w.schedule, w.now_ns);
	assert_int_equal(w.client[0].n_ended, 1);
	w.schedule.queued_bytes = 0;
	schedule_pump(&w.schedule, w.now_ns);
	assert_int_equal(w.n_running, 1);
	finish(&w, 0, 0, 0);
}

static unsigned n_needs;

static void count_need(uint64_t bytes, void *userdata)
{
	(void)bytes;
	(void)userdata;
	n_needs++;
}

/* Each would be compared with each. */
static void frames_without_room_are_not_all_asked(void **state)
{
	const struct schedule_limits limits = { .n_threads = 2, .max_running = 16, .max_queue = UINT64_MAX,
		                                    .max_memory = MEMORY };
	static struct world w;
	struct schedule_user mine;

	(void)state;
	begin_world(&w, &mine, &limits);
	mine.on_need = count_need;
	ask(&w, &w.client[0], 0, 1, 1);
	schedule_pump(&w.schedule, w.now_ns);
	w.schedule.kept_bytes = MEMORY / 2 + 1;
	for (int i = 0; i < 40; i++)
		ask(&w, &w.client[i % 2], 0, 1, MEMORY / 2 + 1);
	ask(&w, &w.client[1], 0, 1, MEMORY / 4);
	n_needs = 0;
	schedule_pump(&w.schedule, w.now_ns);
	assert_int_equal(w.n_running, 2); /* a smaller one goes by */
	assert_in_range(n_needs, 1, 2);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_million_random_steps_keep_the_rules),
		cmocka_unit_test(a_client_with_many_requests_gets_no_more_frames),
		cmocka_unit_test(frames_of_different_sizes_get_equal_time),
		cmocka_unit_test(long_frames_keep_nobody_out),
		cmocka_unit_test(a_frame_that_never_fits_into_memory_is_refused),
		cmocka_unit_test(frames_without_room_are_not_all_asked),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

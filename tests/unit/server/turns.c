/* The schedule when memory is short: large frames get their turn beside small ones without end, and the other way
 * round. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <string.h>
#include "base/random.h"
#include "psr/error.h"
#include "server/frames/schedule.h"

#define N_FLOWS 8
#define DEPTH 3 /* requests that a flow keeps open */
#define MEMORY 1000
#define MS UINT64_C(1000000)
#define LONGEST_MS 200 /* that a frame runs */

struct request {
	struct schedule_request schedule;
	uint64_t runs_ms;
	int is_open, is_yielding;
};

struct flow {
	struct schedule_flow schedule;
	struct request request[DEPTH];
	uint32_t last_id;
	uint64_t n_frames, longest_wait_ns;
	uint64_t least, most; /* bytes of its frames */
	unsigned n_refined;
	uint64_t least_ms; /* that they run */
};

struct world {
	struct schedule schedule;
	struct schedule_user user;
	struct flow flow[N_FLOWS];
	uint64_t random, now_ns;
	uint64_t kept_for_later; /* of kept_bytes */
};

static struct world w;

static int on_prepare(struct schedule_request *request, void *userdata)
{
	(void)request;
	(void)userdata;
	return 1;
}

static void on_let_go(struct schedule_request *request, void *userdata)
{
	(void)request;
	(void)userdata;
	fail_msg("nothing was prepared");
}

static void on_begin(struct schedule_request *r, enum pool_class class, void *userdata)
{
	struct request *request = (struct request *)r;
	struct flow *flow = (struct flow *)r->flow;

	(void)userdata;
	assert_true(w.schedule.kept_bytes + w.schedule.queued_bytes + w.schedule.running_bytes <= MEMORY);
	request->is_yielding = 0;
	request->runs_ms = flow->least_ms + 1 + random_below(&w.random, LONGEST_MS);
	if (class == POOL_REFINING)
		return;
	if (w.now_ns - r->asked_ns > flow->longest_wait_ns)
		flow->longest_wait_ns = w.now_ns - r->asked_ns;
	flow->n_frames++;
}

static void on_stop(struct schedule_request *r, void *userdata)
{
	(void)r;
	(void)userdata;
	fail_msg("nobody gives up");
}

static void on_yield(struct schedule_request *r, void *userdata)
{
	(void)userdata;
	((struct request *)r)->is_yielding = 1;
}

static void on_end(struct schedule_request *r, int code, uint32_t by, void *userdata)
{
	(void)r;
	(void)code;
	(void)by;
	(void)userdata;
	fail_msg("every frame fits");
}

static void on_need(uint64_t bytes, void *userdata)
{
	const uint64_t freed = bytes < w.kept_for_later ? bytes : w.kept_for_later;

	(void)userdata;
	w.kept_for_later -= freed;
	w.schedule.kept_bytes -= freed;
}

static void begin_world(unsigned max_running)
{
	const struct schedule_limits limits = { .n_threads = max_running, .max_running = max_running,
		                                    .max_queue = UINT64_MAX, .max_memory = MEMORY };

	memset(&w, 0, sizeof w);
	w.now_ns = 1000 * MS;
	w.random = 3;
	w.user = (struct schedule_user){ on_prepare, on_let_go, on_begin, on_stop, on_yield, on_end, on_need, NULL };
	schedule_init(&w.schedule, &limits, &w.user);
}

/* A flow keeps `depth` requests open. */
static void ask(struct flow *flow, unsigned depth)
{
	for (unsigned i = 0; i < depth; i++) {
		struct request *request = &flow->request[i];

		if (request->is_open)
			continue;
		*request = (struct request){ .is_open = 1 };
		request->schedule.id = ++flow->last_id;
		request->schedule.n_frames = 1 + flow->n_refined;
		request->schedule.bytes = flow->least + random_below(&w.random, (uint32_t)(flow->most - flow->least + 1));
		schedule_ask(&w.schedule, &flow->schedule, &request->schedule, w.now_ns);
	}
}

/* A refined frame runs while no other does, or gives way. */
static void run(struct request *request, int others_run)
{
	struct schedule_request *r = &request->schedule;
	const int is_refined = r->frame > 0;

	if (is_refined && request->is_yielding) {
		assert_int_equal(schedule_put_back(&w.schedule, r, MS), SCHEDULE_MORE);
		return;
	}
	if (is_refined && others_run)
		return;
	r->used_ns += MS;
	if (--request->runs_ms == 0)
		request->is_open = schedule_done(&w.schedule, r, r->used_ns) == SCHEDULE_MORE;
}

static void run_for(uint64_t seconds, unsigned depth)
{
	for (uint64_t end_ns = w.now_ns + 1000 * seconds * MS; w.now_ns < end_ns; w.now_ns += MS) {
		int others_run = 0;

		for (unsigned i = 0; i < N_FLOWS; i++)
			if (w.flow[i].most > 0)
				ask(&w.flow[i], depth);
		schedule_pump(&w.schedule, w.now_ns);
		for (const struct schedule_request *r = w.schedule.begun; r != NULL; r = r->next_begun)
			others_run |= r->frame == 0;
		for (unsigned i = 0; i < N_FLOWS; i++)
			for (unsigned j = 0; j < DEPTH; j++)
				if (w.flow[i].request[j].is_open && w.flow[i].request[j].schedule.is_running)
					run(&w.flow[i].request[j], others_run);
	}
}

static void load(unsigned flow, uint64_t least, uint64_t most, unsigned n_refined)
{
	w.flow[flow].least = least;
	w.flow[flow].most = most;
	w.flow[flow].n_refined = n_refined;
}

/* A frame's turn comes after its patience, and when all that ran then have ended; the frames that starved before it have
 * such turns, too: one of each flow, as only the first of a flow is looked at. Its flow's earlier ones go first. */
static uint64_t longest_turn(unsigned n_large, unsigned depth)
{
	return depth * n_large * (SCHEDULE_PATIENCE_NS + (LONGEST_MS + 2) * MS);
}

static void a_large_frame_gets_its_turn_beside_small_ones_without_end(void **state)
{
	(void)state;
	begin_world(64);
	load(0, MEMORY, MEMORY, 0);
	for (unsigned i = 1; i < N_FLOWS; i++)
		load(i, 50, 150, 0);
	run_for(60, 1);
	assert_true(w.flow[0].n_frames > 30);
	assert_true(w.flow[0].longest_wait_ns <= longest_turn(1, 1));
}

static void small_frames_have_their_time_between_large_ones(void **state)
{
	(void)state;
	begin_world(64);
	for (unsigned i = 0; i < 4; i++)
		load(i, MEMORY - 100, MEMORY, 0);
	for (unsigned i = 4; i < N_FLOWS; i++)
		load(i, 150, 200, 0);
	run_for(60, DEPTH);
	for (unsigned i = 0; i < 4; i++) {
		assert_true(w.flow[i].n_frames > 10);
		assert_true(w.flow[i].longest_wait_ns <= longest_turn(4, DEPTH));
	}
	for (unsigned i = 4; i < N_FLOWS; i++) {
		assert_true(w.flow[i].n_frames > w.flow[i - 4].n_frames);
		assert_true(w.flow[i].longest_wait_ns <= longest_turn(4, DEPTH));
	}
}

/* Half of the memory is left beside it, and it waits for a second. */
static void small_frames_go_on_beside_one_that_starves_if_they_leave_it_room(void **state)
{
	(void)state;
	begin_world(64);
	load(0, MEMORY / 2, MEMORY / 2, 0);
	load(1, MEMORY / 2, MEMORY / 2, 0);
	w.flow[0].least_ms = w.flow[1].least_ms = 1000;
	for (unsigned i = 2; i < 6; i++)
		load(i, 80, 120, 0);
	run_for(20, 1);
	for (unsigned i = 0; i < 2; i++)
		assert_in_range(w.flow[i].longest_wait_ns, 1000 * MS, (1000 + LONGEST_MS + 2) * MS);
	for (unsigned i = 2; i < 6; i++)
		assert_int_equal(w.flow[i].longest_wait_ns, 0);
}

/* Theirs would not end while small frames keep the cores. */
static void refined_frames_give_way_to_one_that_starves(void **state)
{
	(void)state;
	begin_world(64);
	load(0, MEMORY - 100, MEMORY - 100, 0);
	load(1, 300, 300, 3);
	load(2, 300, 300, 3);
	for (unsigned i = 3; i < 6; i++)
		load(i, 20, 60, 0);
	run_for(60, 2);
	assert_true(w.flow[0].n_frames > 30);
	assert_true(w.flow[0].longest_wait_ns <= longest_turn(1, 2));
}

/* Any loads: nobody waits for longer than the others' turns. */
static void nobody_starves_under_any_load(void **state)
{
	uint64_t random = 11;

	(void)state;
	for (int round = 0; round < 30; round++) {
		unsigned n = 0;

		begin_world(2 + random_below(&random, 20));
		w.random = random_next(&random);
		w.schedule.kept_bytes = w.kept_for_later = random_below(&random, MEMORY);
		for (unsigned i = 0; i < N_FLOWS; i++) {
			const uint32_t least = 1 + random_below(&random, random_below(&random, 3) ? 100 : MEMORY);

			load(i, least, least + random_below(&random, MEMORY - least + 1), random_below(&random, 2));
			n++;
		}
		run_for(10, 1 + random_below(&random, DEPTH));
		for (unsigned i = 0; i < N_FLOWS; i++)
			assert_true(w.flow[i].n_frames > 0 && w.flow[i].longest_wait_ns <= longest_turn(n, DEPTH));
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_large_frame_gets_its_turn_beside_small_ones_without_end),
		cmocka_unit_test(small_frames_have_their_time_between_large_ones),
		cmocka_unit_test(small_frames_go_on_beside_one_that_starves_if_they_leave_it_room),
		cmocka_unit_test(refined_frames_give_way_to_one_that_starves),
		cmocka_unit_test(nobody_starves_under_any_load),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdlib.h>
#include "base/clock.h"
#include "base/pool.h"

#define N_TILES 64

static struct psr_pool *make(int n_cores)
{
	struct psr_pool *pool = NULL;

	assert_int_equal(psr_pool_create_for_jobs(&pool, n_cores, NULL), PSR_OK);
	return pool;
}

static struct pool_flow *make_flow(struct psr_pool *pool)
{
	struct pool_flow *flow = NULL;

	assert_int_equal(pool_flow_create(&flow, pool), PSR_OK);
	return flow;
}

static void work_for(uint64_t ns)
{
	const uint64_t start = clock_ns();

	while (clock_ns() - start < ns)
		;
}

/* How many threads are inside of a job's serial part or of an index. */
static atomic_int n_inside, most_inside;

static void go_in(void)
{
	const int n = atomic_fetch_add(&n_inside, 1) + 1;
	int most = atomic_load(&most_inside);

	while (n > most && !atomic_compare_exchange_weak(&most_inside, &most, n))
		;
}

static void go_out(void)
{
	atomic_fetch_sub(&n_inside, 1);
}

struct frame {
	struct psr_pool *pool;
	uint64_t index_ns, serial_ns;
	int n_loops, tile[N_TILES], sum; /* not atomic: the thread sanitizer watches the hand-over */
	atomic_int *n_done;
};

static void draw_tile(int i, void *userdata)
{
	struct frame *frame = userdata;

	go_in();
	work_for(frame->index_ns);
	frame->tile[i]++;
	go_out();
}

static void draw_frame(void *userdata)
{
	struct frame *frame = userdata;

	for (int k = 0; k < frame->n_loops; k++) {
		go_in();
		work_for(frame->serial_ns);
		go_out();
		psr_pool_for(frame->pool, N_TILES, draw_tile, frame);
	}
	for (int i = 0; i < N_TILES; i++)
		frame->sum += frame->tile[i];
	atomic_fetch_add(frame->n_done, 1);
}

static void submit(struct frame *frame, struct pool_flow *flow, enum pool_class class)
{
	const struct pool_job job = { .flow = flow, .class = class, .fn = draw_frame, .userdata = frame };

	assert_int_equal(psr_pool_submit(frame->pool, &job), PSR_OK);
}

static void stress(int n_cores, int n_flows, int n_frames)
{
	struct psr_pool *pool = make(n_cores);
	struct pool_flow **flow = calloc((size_t)n_flows, sizeof *flow);
	struct frame *frames = calloc((size_t)n_frames, sizeof *frames);
	atomic_int n_done = 0;

	atomic_store(&most_inside, 0);
	for (int i = 0; i < n_flows; i++)
		flow[i] = make_flow(pool);
	for (int i = 0; i < n_frames; i++) {
		/* some indices are above the quantum, so that cores change hands within loops */
		frames[i] = (struct frame){ .pool = pool, .index_ns = i % 7 == 0 ? 30000 : i % 3 * 1000u, .serial_ns = 2000,
		                            .n_loops = i % 7 == 0 ? 2 : 5, .n_done = &n_done };
		submit(&frames[i], i % 5 == 0 ? NULL : flow[i % n_flows], (enum pool_class)(i % 3));
	}
	for (int i = 0; i < n_flows; i++)
		pool_flow_destroy(flow[i]);
	psr_pool_destroy(pool);
	assert_int_equal(atomic_load(&n_done), n_frames);
	for (int i = 0; i < n_frames; i++)
		assert_int_equal(frames[i].sum, frames[i].n_loops * N_TILES);
	assert_in_range(atomic_load(&most_inside), 1, n_cores);
	free(frames);
	free(flow);
}

static void every_index_runs_once_on_at_most_as_many_threads_as_cores(void **state)
{
	(void)state;
	stress(1, 3, 60);
	stress(2, 4, 120);
	stress(5, 9, 120);
}

/* A job of flow `a` with a loop, beside one of flow `b` that comes while the first index runs. */
struct pair {
	struct psr_pool *pool;
	struct frame guest;
	int n_before; /* indices that ended before the guest's job did */
	atomic_int has_begun, is_submitted, n_done;
};

static void run_beside_guest(int i, void *userdata)
{
	struct pair *pair = userdata;

	(void)i;
	atomic_store(&pair->has_begun, 1);
	while (!atomic_load(&pair->is_submitted))
		sched_yield();
	work_for(1000000);
	pair->n_before += atomic_load(&pair->n_done) == 0;
}

static void run_host(void *userdata)
{
	struct pair *pair = userdata;

	psr_pool_for(pair->pool, 20, run_beside_guest, pair);
}

/* On one core. */
static int indices_before_guest(enum pool_class class)
{
	struct pair pair = { .pool = make(1) };
	struct pool_flow *a = make_flow(pair.pool), *b = make_flow(pair.pool);
	const struct pool_job host = { .flow = a, .class = class, .fn = run_host, .userdata = &pair };

	pair.guest = (struct frame){ .pool = pair.pool, .n_loops = 2, .n_done = &pair.n_done };
	assert_int_equal(psr_pool_submit(pair.pool, &host), PSR_OK);
	while (!atomic_load(&pair.has_begun))
		sched_yield();
	submit(&pair.guest, b, POOL_MOVING);
	atomic_store(&pair.is_submitted, 1);
	pool_flow_destroy(a);
	pool_flow_destroy(b);
	psr_pool_destroy(pair.pool);
	assert_int_equal(pair.guest.sum, 2 * N_TILES);
	return pair.n_before;
}

static void a_job_waits_for_an_index_of_another_flow_and_not_for_its_frame(void **state)
{
	(void)state;
	assert_int_equal(indices_before_guest(POOL_MOVING), 1);
	assert_int_equal(indices_before_guest(POOL_REFINING), 1);
}

struct crowd {
	struct psr_pool *pool;
	atomic_int n_here;
	uint64_t used_ns, used_inside_ns;
};

static void meet(int i, void *userdata)
{
	struct crowd *crowd = userdata;

	(void)i;
	atomic_fetch_add(&crowd->n_here, 1);
	while (atomic_load(&crowd->n_here) < 3)
		sched_yield();
	work_for(1000000);
}

static void gather(void *userdata)
{
	struct crowd *crowd = userdata;

	work_for(2000000); /* a small job would call nobody, and wait in its first index for ever */
	psr_pool_for(crowd->pool, 3, meet, crowd);
	crowd->used_inside_ns = pool_job_used_ns();
	psr_pool_for(crowd->pool, 1, meet, crowd);
	crowd->used_ns = pool_job_used_ns();
}

static void one_flow_has_all_cores_and_pays_for_all(void **state)
{
	struct crowd crowd = { .pool = make(3) };
	struct pool_flow *flow = make_flow(crowd.pool);
	const struct pool_job job = { .flow = flow, .fn = gather, .userdata = &crowd };

	(void)state;
	assert_int_equal(psr_pool_submit(crowd.pool, &job), PSR_OK);
	while (pool_flow_used_ns(flow) < 6000000) /* ends only if three threads take part */
		sched_yield();
	pool_flow_destroy(flow);
	psr_pool_destroy(crowd.pool);
	assert_true(crowd.used_inside_ns >= 5000000);
	assert_true(crowd.used_ns >= crowd.used_inside_ns + 1000000);
	assert_int_equal(pool_job_used_ns(), 0);
}

/* Long indices beside short ones, each flow with more to do than the cores. */
static void flows_of_long_and_of_short_indices_both_end(void **state)
{
	struct psr_pool *pool = make(2);
	struct pool_flow *flow[2] = { make_flow(pool), make_flow(pool) };
	atomic_int n_done = 0;
	struct frame frames[20];

	(void)state;
	for (int i = 0; i < 20; i++) {
		frames[i] = (struct frame){ .pool = pool, .index_ns = i < 2 ? 500000 : 5000, .serial_ns = 1000, .n_loops = i < 2 ? 1 : 8,
		                            .n_done = &n_done };
		submit(&frames[i], flow[i >= 2], POOL_MOVING);
	}
	pool_flow_destroy(flow[0]);
	pool_flow_destroy(flow[1]);
	pool_flow_destroy(NULL);
	psr_pool_destroy(pool);
	assert_int_equal(atomic_load(&n_done), 20);
	for (int i = 0; i < 20; i++)
		assert_int_equal(frames[i].sum, frames[i].n_loops * N_TILES);
}

/* ---- giving way ---- */

struct asking {
	struct psr_pool *pool;
	int in_index;
	atomic_int has_begun, is_submitted, n_done;
	struct frame guest;
};

static void ask_until_guest_is_done(int i, void *userdata)
{
	struct asking *asking = userdata;

	(void)i;
	atomic_store(&asking->has_begun, 1);
	while (!atomic_load(&asking->is_submitted))
		sched_yield();
	while (atomic_load(&asking->n_done) == 0)
		pool_give_way();
}

static void ask(void *userdata)
{
	struct asking *asking = userdata;

	if (asking->in_index)
		psr_pool_for(asking->pool, 2, ask_until_guest_is_done, asking);
	else
		ask_until_guest_is_done(0, asking);
}

/* On one core: ends only if the guest gets it in the midst of the other job. */
static void check_giving_way(int in_index, enum pool_class class)
{
	struct asking asking = { .pool = make(1), .in_index = in_index };
	struct pool_flow *a = make_flow(asking.pool), *b = make_flow(asking.pool);
	const struct pool_job job = { .flow = a, .class = class, .fn = ask, .userdata = &asking };

	asking.guest = (struct frame){ .pool = asking.pool, .n_loops = 2, .n_done = &asking.n_done };
	assert_int_equal(psr_pool_submit(asking.pool, &job), PSR_OK);
	while (!atomic_load(&asking.has_begun))
		sched_yield();
	submit(&asking.guest, b, POOL_MOVING);
	atomic_store(&asking.is_submitted, 1);
	pool_flow_destroy(a);
	pool_flow_destroy(b);
	psr_pool_destroy(asking.pool);
	assert_int_equal(asking.guest.sum, 2 * N_TILES);
}

static void a_long_part_gives_way_where_it_asks(void **state)
{
	(void)state;
	for (int in_index = 0; in_index < 2; in_index++) {
		check_giving_way(in_index, POOL_MOVING);
		check_giving_way(in_index, POOL_REFINING);
	}
	pool_give_way();
}

/* ---- threads that lend themselves ---- */

struct lent {
	struct psr_pool *pool;
	pthread_t thread;
	int is_long;   /* it goes on until its thread is back */
	int is_a_loop; /* whose indices ask */
	atomic_int is_back, is_done;
};

static void ask_until_back(int i, void *userdata)
{
	const struct lent *lent = userdata;

	(void)i;
	while (lent->is_long && !atomic_load(&lent->is_back))
		pool_give_way();
}

static void run_lent(void *userdata)
{
	struct lent *lent = userdata;

	lent->thread = pthread_self();
	if (lent->is_a_loop)
		psr_pool_for(lent->pool, 3, ask_until_back, lent);
	else
		ask_until_back(0, lent);
	atomic_store(&lent->is_done, 1);
}

/* Returns whether the job began on this thread. */
static int lend_once(struct psr_pool *pool, struct pool_flow *flow, int is_long, int is_a_loop, uint64_t most_ns)
{
	struct lent lent = { .pool = pool, .is_long = is_long, .is_a_loop = is_a_loop };
	const struct pool_job job = { .flow = flow, .fn = run_lent, .userdata = &lent, .is_lent_to = 1 };

	assert_int_equal(psr_pool_submit(pool, &job), PSR_OK);
	psr_pool_lend(pool, most_ns);
	atomic_store(&lent.is_back, 1);
	while (!atomic_load(&lent.is_done))
		sched_yield();
	return pthread_equal(lent.thread, pthread_self());
}

/* A flow's first job goes to a core, since nobody knows how long it takes. */
static void a_thread_that_lends_itself_runs_a_job_and_gets_back(void **state)
{
	struct psr_pool *pool = make(2);
	struct pool_flow *flow = make_flow(pool);

	(void)state;
	assert_false(lend_once(pool, flow, 0, 0, UINT64_C(1) << 60));
	for (int is_a_loop = 0; is_a_loop < 2; is_a_loop++) {
		while (!lend_once(pool, flow, 0, is_a_loop, UINT64_C(1) << 60))
			;
		while (!lend_once(pool, flow, 1, is_a_loop, 1000000))
			lend_once(pool, flow, 0, is_a_loop, 0);
	}
	psr_pool_lend(pool, 1000000);
	pool_flow_destroy(flow);
	psr_pool_destroy(pool);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_index_runs_once_on_at_most_as_many_threads_as_cores),
		cmocka_unit_test(a_job_waits_for_an_index_of_another_flow_and_not_for_its_frame),
		cmocka_unit_test(one_flow_has_all_cores_and_pays_for_all),
		cmocka_unit_test(flows_of_long_and_of_short_indices_both_end),
		cmocka_unit_test(a_long_part_gives_way_where_it_asks),
		cmocka_unit_test(a_thread_that_lends_itself_runs_a_job_and_gets_back),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

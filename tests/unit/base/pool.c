#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <fenv.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "psr/error.h"
#include "base/pool.h"

#define N 1000

struct tally {
	int plain[N]; /* not atomic: the thread sanitizer watches the hand-over */
	int order[N], n_order;
};

static void count(int i, void *userdata)
{
	((struct tally *)userdata)->plain[i]++;
}

static void record(int i, void *userdata)
{
	struct tally *t = userdata;

	t->order[t->n_order++] = i;
}

static struct psr_pool *make(int n_threads, int with_jobs)
{
	struct psr_pool *pool = NULL;

	const int code = with_jobs ? psr_pool_create_for_jobs(&pool, n_threads, NULL)
	                           : psr_pool_create(&pool, n_threads, NULL);

	assert_int_equal(code, PSR_OK);
	return pool;
}

static int submit(struct psr_pool *pool, void (*fn)(void *userdata), void *userdata)
{
	return psr_pool_submit(pool, &(struct pool_job){ .fn = fn, .userdata = userdata });
}

static void thread_counts_outside_of_the_range_are_refused(void **state)
{
	struct psr_pool *pool = NULL;
	struct psr_error err;

	(void)state;
	assert_int_equal(psr_pool_create(&pool, -1, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "1 to 256"));
	assert_int_equal(psr_pool_create(&pool, 257, NULL), PSR_ERR_ARG);
	assert_int_equal(psr_pool_create_for_jobs(&pool, -1, NULL), PSR_ERR_ARG);
	assert_int_equal(psr_pool_create_for_jobs(&pool, 257, NULL), PSR_ERR_ARG);
	assert_null(pool);
}

static void no_thread_count_is_one_thread_a_core(void **state)
{
	struct psr_pool *pool = make(0, 0);
	const long n = sysconf(_SC_NPROCESSORS_ONLN);

	(void)state;
	assert_int_equal(psr_pool_threads(pool), n < 256 ? n : 256);
	psr_pool_destroy(pool);
}

static void null_pool_runs_the_loop_in_order(void **state)
{
	struct tally *t = calloc(1, sizeof *t);

	(void)state;
	psr_pool_for(NULL, N, record, t);
	assert_int_equal(t->n_order, N);
	for (int i = 0; i < N; i++)
		assert_int_equal(t->order[i], i);
	assert_int_equal(psr_pool_threads(NULL), 1);
	psr_pool_destroy(NULL);
	free(t);
}

static void every_index_runs_once_with_any_number_of_threads(void **state)
{
	static const int threads[] = { 1, 2, 3, 8, 64, 256 };

	(void)state;
	for (size_t k = 0; k < sizeof threads / sizeof threads[0]; k++) {
		struct psr_pool *pool = make(threads[k], k % 2 == 1);
		struct tally *t = calloc(1, sizeof *t);

		assert_int_equal(psr_pool_threads(pool), threads[k]);
		for (int n = 0; n <= N; n += n < 4 ? 1 : 249)
			psr_pool_for(pool, n, count, t);
		for (int i = 0; i < N; i++) {
			int expected = 0;

			for (int n = 0; n <= N; n += n < 4 ? 1 : 249)
				expected += i < n;
			assert_int_equal(t->plain[i], expected);
		}
		psr_pool_destroy(pool);
		free(t);
	}
}

struct chain {
	struct psr_pool *pool;
	pthread_mutex_t mutex;
	int next;
	int order[N];
};

static struct chain one_chain = { .mutex = PTHREAD_MUTEX_INITIALIZER };

static void append(void *userdata)
{
	int *slot = userdata;

	pthread_mutex_lock(&one_chain.mutex);
	*slot = one_chain.next++;
	pthread_mutex_unlock(&one_chain.mutex);
}

static void loops_after_a_wake_are_whole(void **state)
{
	(void)state;
	psr_pool_wake(NULL);
	for (int with_jobs = 0; with_jobs <= 1; with_jobs++) {
		struct psr_pool *pool = make(3, with_jobs);
		struct tally *t = calloc(1, sizeof *t);

		for (int round = 1; round <= 100; round++) {
			psr_pool_wake(pool);
			psr_pool_for(pool, N, count, t);
			for (int i = 0; i < N; i++)
				assert_int_equal(t->plain[i], round);
		}
		psr_pool_destroy(pool);
		free(t);
	}
}

static void jobs_run_in_order_and_destroy_waits_for_all(void **state)
{
	struct psr_pool *pool = make(1, 1);

	(void)state;
	one_chain.next = 0;
	for (int i = 0; i < N; i++)
		assert_int_equal(submit(pool, append, &one_chain.order[i]), PSR_OK);
	psr_pool_destroy(pool);
	assert_int_equal(one_chain.next, N);
	for (int i = 0; i < N; i++)
		assert_int_equal(one_chain.order[i], i);
}

struct frame {
	struct psr_pool *pool;
	int tile[64], sum;
	atomic_int *n_done;
};

static void draw_tile(int i, void *userdata)
{
	struct frame *f = userdata;

	f->tile[i] += i + 1;
}

static void draw_frame(void *userdata)
{
	struct frame *f = userdata;

	for (int pass = 0; pass < 5; pass++)
		psr_pool_for(f->pool, 64, draw_tile, f);
	for (int i = 0; i < 64; i++)
		f->sum += f->tile[i];
	atomic_fetch_add(f->n_done, 1);
}

static void stress_with(int n_threads, int n_frames)
{
	struct psr_pool *pool = make(n_threads, 1);
	struct frame *frames = calloc((size_t)n_frames, sizeof *frames);
	struct tally *t = calloc(1, sizeof *t);
	atomic_int n_done = 0;

	for (int i = 0; i < n_frames; i++) {
		frames[i].pool = pool;
		frames[i].n_done = &n_done;
		assert_int_equal(submit(pool, draw_frame, &frames[i]), PSR_OK);
		if (i % 16 == 0)
			psr_pool_for(pool, 100, count, t); /* from outside, meanwhile */
	}
	psr_pool_destroy(pool);
	assert_int_equal(atomic_load(&n_done), n_frames);
	for (int i = 0; i < n_frames; i++)
		assert_int_equal(frames[i].sum, 5 * 64 * 65 / 2);
	for (int i = 0; i < 100; i++)
		assert_int_equal(t->plain[i], (n_frames + 15) / 16);
	free(frames);
	free(t);
}

static void frames_with_loops_all_finish_however_busy_the_workers(void **state)
{
	(void)state;
	stress_with(1, 200);
	stress_with(2, 400);
	stress_with(7, 400);
}

/* Both workers sit in jobs that wait until the other's loop is through: only the callers are left to run the loops. */
struct rendezvous {
	struct psr_pool *pool;
	atomic_int *arrived;
	int done[16];
};

static void mark(int i, void *userdata)
{
	((struct rendezvous *)userdata)->done[i]++;
}

static void meet_then_loop(void *userdata)
{
	struct rendezvous *r = userdata;

	atomic_fetch_add(r->arrived, 1);
	while (atomic_load(r->arrived) < 2)
		sched_yield();
	psr_pool_for(r->pool, 16, mark, r);
	atomic_fetch_add(r->arrived, 1);
	while (atomic_load(r->arrived) < 4)
		sched_yield();
}

static void caller_finishes_its_loop_alone_when_all_workers_are_busy(void **state)
{
	struct psr_pool *pool = make(2, 1);
	atomic_int arrived = 0;
	struct rendezvous r[2] = { { .pool = pool, .arrived = &arrived }, { .pool = pool, .arrived = &arrived } };

	(void)state;
	for (int i = 0; i < 2; i++)
		assert_int_equal(submit(pool, meet_then_loop, &r[i]), PSR_OK);
	psr_pool_destroy(pool);
	for (int i = 0; i < 16; i++)
		assert_true(r[0].done[i] == 1 && r[1].done[i] == 1);
}

static void all_arrive(int i, void *userdata)
{
	atomic_int *n = userdata;

	(void)i;
	atomic_fetch_add(n, 1);
	while (atomic_load(n) < 3)
		sched_yield();
}

static void idle_threads_help_a_running_loop(void **state)
{
	struct psr_pool *pool = make(3, 0);
	atomic_int n = 0;

	(void)state;
	psr_pool_for(pool, 3, all_arrive, &n); /* returns only if three threads take part */
	assert_int_equal(atomic_load(&n), 3);
	psr_pool_destroy(pool);
}

struct chaining {
	struct psr_pool *pool;
	atomic_int left;
};

static void resubmit(void *userdata)
{
	struct chaining *c = userdata;

	if (atomic_fetch_sub(&c->left, 1) > 1)
		submit(c->pool, resubmit, c);
}

static void destroy_also_runs_what_jobs_submit(void **state)
{
	struct psr_pool *pool = make(3, 1);
	struct chaining c = { .pool = pool, .left = 500 };

	(void)state;
	assert_int_equal(submit(pool, resubmit, &c), PSR_OK);
	psr_pool_destroy(pool);
	assert_int_equal(atomic_load(&c.left), 0);
}

/* Says so from question `last` on. */
struct patience {
	struct tally tally;
	atomic_int n_asked;
	int last;
};

static int is_over(void *userdata)
{
	struct patience *p = userdata;

	return atomic_fetch_add(&p->n_asked, 1) >= p->last;
}

static void a_loop_ends_at_the_question_that_says_so(void **state)
{
	struct psr_pool *pool = make(3, 0);

	(void)state;
	for (int k = 0; k < 2; k++)
		for (int last = 0; last <= N + 1; last += last < 4 || last >= N - 4 ? 1 : 166) {
			struct patience *p = calloc(1, sizeof *p);
			const struct psr_cancel cancel = { is_over, p };
			int n_run = 0;

			p->last = last;
			assert_int_equal(psr_pool_for_until(k ? pool : NULL, &cancel, N, count, &p->tally),
			                 last <= N ? PSR_ERR_CANCELLED : PSR_OK);
			for (int i = 0; i < N; i++)
				n_run += p->tally.plain[i];
			assert_int_equal(n_run, last < N ? last : N);
			free(p);
		}
	psr_pool_destroy(pool);
}

static void a_loop_that_nobody_can_stop_is_whole(void **state)
{
	static const struct psr_cancel nobody = { NULL, NULL };
	struct tally *t = calloc(1, sizeof *t);

	(void)state;
	assert_int_equal(psr_pool_for_until(NULL, NULL, N, record, t), PSR_OK);
	assert_int_equal(psr_pool_for_until(NULL, &nobody, N, count, t), PSR_OK);
	for (int i = 0; i < N; i++)
		assert_true(t->order[i] == i && t->plain[i] == 1);
	free(t);
}

struct environment {
	int rounding[64];
};

static void look_around(int i, void *userdata)
{
	struct environment *e = userdata;

	e->rounding[i] = fegetround();
}

static void loops_run_in_the_default_environment_and_give_the_callers_back(void **state)
{
	struct psr_pool *pool;
	struct environment e;

	(void)state;
	assert_int_equal(fesetround(FE_TOWARDZERO), 0);
	pool = make(4, 1);
	psr_pool_for(pool, 64, look_around, &e);
	assert_int_equal(fegetround(), FE_TOWARDZERO);
	fesetround(FE_TONEAREST);
	psr_pool_destroy(pool);
	for (int i = 0; i < 64; i++)
		assert_int_equal(e.rounding[i], FE_TONEAREST);
}

#if defined(__SSE2__)
#include <xmmintrin.h>

static void divide(int i, void *userdata)
{
	volatile float tiny = 0x1p-126f;
	float *out = userdata;

	out[i] = tiny / 4;
}

static void denormal_numbers_survive_a_caller_that_flushes_them(void **state)
{
	unsigned before = _mm_getcsr();
	struct psr_pool *pool;
	float out[64];

	(void)state;
	_mm_setcsr(before | 0x8040);
	pool = make(3, 0);
	psr_pool_for(pool, 64, divide, out);
	psr_pool_for(NULL, 1, divide, out);
	assert_int_equal(_mm_getcsr() & 0x8040, 0x8040);
	_mm_setcsr(before);
	psr_pool_destroy(pool);
	for (int i = 0; i < 64; i++)
		assert_true(out[i] == 0x1p-128f);
}
#endif

static void look_at_signals(void *userdata)
{
	pthread_sigmask(SIG_BLOCK, NULL, userdata);
}

static void workers_leave_signals_to_the_program(void **state)
{
	struct psr_pool *pool = make(1, 1);
	sigset_t seen, own;

	(void)state;
	sigemptyset(&seen);
	assert_int_equal(submit(pool, look_at_signals, &seen), PSR_OK);
	psr_pool_destroy(pool);
	assert_int_equal(sigismember(&seen, SIGTERM), 1);
	assert_int_equal(sigismember(&seen, SIGHUP), 1);
	assert_int_equal(sigismember(&seen, SIGSEGV), 0);
	pthread_sigmask(SIG_BLOCK, NULL, &own);
	assert_int_equal(sigismember(&own, SIGTERM), 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(thread_counts_outside_of_the_range_are_refused),
		cmocka_unit_test(no_thread_count_is_one_thread_a_core),
		cmocka_unit_test(null_pool_runs_the_loop_in_order),
		cmocka_unit_test(every_index_runs_once_with_any_number_of_threads),
		cmocka_unit_test(loops_after_a_wake_are_whole),
		cmocka_unit_test(jobs_run_in_order_and_destroy_waits_for_all),
		cmocka_unit_test(frames_with_loops_all_finish_however_busy_the_workers),
		cmocka_unit_test(caller_finishes_its_loop_alone_when_all_workers_are_busy),
		cmocka_unit_test(idle_threads_help_a_running_loop),
		cmocka_unit_test(a_loop_ends_at_the_question_that_says_so),
		cmocka_unit_test(a_loop_that_nobody_can_stop_is_whole),
		cmocka_unit_test(destroy_also_runs_what_jobs_submit),
		cmocka_unit_test(loops_run_in_the_default_environment_and_give_the_callers_back),
#if defined(__SSE2__)
		cmocka_unit_test(denormal_numbers_survive_a_caller_that_flushes_them),
#endif
		cmocka_unit_test(workers_leave_signals_to_the_program),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

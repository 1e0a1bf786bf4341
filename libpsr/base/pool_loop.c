#include <assert.h>
#include <fenv.h>
#include <limits.h>
#include "clock.h"
#include "pool_core.h"
#include "turns.h"

/* While others wait, a thread asks after each index whether its core is to go to them, but not more often than this:
 * asking takes the mutex. Refining asks always. */
#define SLICE_NS 50000

/* A small job has one core. Waking another takes some 50 us, and so does its spinning, many times a job: of a frame of
 * 64x64 that is more than the frame. */
#define SMALL_NS 1000000

/* How long a thread computes before it lets those in who wait for its processor. */
#define TURN_NS 500000

/* Reading the clock at each question of a small frame takes some 5 % of it. */
#define LENT_QUESTIONS 4

int pool_is_taken(const struct loop *loop)
{
	return atomic_load_explicit(&loop->taken, memory_order_relaxed) >= loop->n;
}

/* Whether somebody but the job itself waits, as far as can be seen without the mutex. */
static int is_contended(const struct psr_pool *pool)
{
	return atomic_load_explicit(&pool->n_wanting, memory_order_relaxed) > 1;
}

/* By the time that it used, or by that of the flow's last one. */
static int is_small(const struct job *job)
{
	return job->flow->last_ns < SMALL_NS && atomic_load_explicit(&job->used_ns, memory_order_relaxed) < SMALL_NS;
}

static void call_helpers(struct psr_pool *pool, struct job *job, struct loop *loop)
{
	if (is_small(job))
		return;
	pool_call(pool, loop->n_silent);
	loop->n_silent = 0;
}

void psr_pool_wake(struct psr_pool *pool)
{
	const struct job *job = pool_current_job();

	if (pool == NULL || pool->n_workers == 0)
		return;
	pthread_mutex_lock(&pool->mutex);
	if (job == NULL || !is_small(job)) {
		pool_offer(pool);
		pool_call(pool, pool->n_workers);
	}
	pthread_mutex_unlock(&pool->mutex);
}

static void let_others_in(struct worker *worker, uint64_t now)
{
	if (now - worker->turn_ns < TURN_NS)
		return;
	worker->turn_ns = now;
	turns_let_others_in();
}

/* After an index; 0: the core goes to another job. */
static int may_go_on(struct psr_pool *pool, struct worker *helper, struct job *job, struct loop *loop,
                     uint64_t *asked_ns)
{
	const uint64_t now = clock_ns();
	int stays = 1;

	let_others_in(helper != NULL ? helper : job->worker, now);
	pool_mark(helper != NULL ? helper : job->worker, job, now);
	if (helper == NULL && loop->n_silent > 0
	    && atomic_load_explicit(&job->used_ns, memory_order_relaxed) >= SMALL_NS) {
		pthread_mutex_lock(&pool->mutex);
		call_helpers(pool, job, loop);
		pthread_mutex_unlock(&pool->mutex);
	}
	if (!(helper == NULL && pool_is_overdue(job->worker, now))
	    && (!is_contended(pool) || (job->claim.class != POOL_REFINING && now - *asked_ns < SLICE_NS)))
		return 1;
	*asked_ns = now;
	pthread_mutex_lock(&pool->mutex);
	if (helper == NULL)
		pool_yield(pool, job, now);
	else
		stays = shares_rival(&pool->shares, &job->claim, now) == NULL;
	pthread_mutex_unlock(&pool->mutex);
	return stays;
}

/* Without a loop whose indices are wanted, the job itself is not among those who want. */
static int is_wanted(const struct psr_pool *pool, const struct job *job)
{
	return atomic_load_explicit(&pool->n_wanting, memory_order_relaxed)
	       > (unsigned)(job->loop != NULL && !pool_is_taken(job->loop));
}

void pool_give_way(void)
{
	struct worker *self = pool_current_worker();
	struct job *job = pool_current_job();
	struct psr_pool *pool;
	uint64_t now;

	if (job == NULL || (self->until_ns != 0 && ++job->n_asked % LENT_QUESTIONS != 0))
		return;
	pool = self->pool;
	now = clock_ns();
	let_others_in(self, now);
	if (self->is_helping || (self->until_ns == 0 && !is_wanted(pool, job)))
		return;
	if (now - job->asked_ns < SLICE_NS)
		return;
	job->asked_ns = now;
	pool_mark(job->worker, job, now);
	pthread_mutex_lock(&pool->mutex);
	pool_yield(pool, job, now);
	pthread_mutex_unlock(&pool->mutex);
}

/* Runs functions with the default rounding and with denormal numbers: a library that sets flush-to-zero in one thread
 * must not change frames. */
void pool_run_indices(struct psr_pool *pool, struct worker *helper, struct job *job, struct loop *loop)
{
	const int is_timed = job != NULL && pool->with_jobs;
	uint64_t asked_ns = is_timed ? (helper != NULL ? helper : job->worker)->marked_ns : 0;
	fenv_t callers;
	int i;

	fegetenv(&callers);
	fesetenv(FE_DFL_ENV);
	while ((i = atomic_fetch_add_explicit(&loop->taken, 1, memory_order_relaxed)) < loop->n) {
		loop->fn(i, loop->userdata);
		if (is_timed && !may_go_on(pool, helper, job, loop, &asked_ns))
			break;
	}
	fesetenv(&callers);
}

/* Some 50 us; where others want the core, about as long as it takes to hand it over. */
static void spin_until_left(const struct psr_pool *pool, const struct loop *loop)
{
	for (int i = 0; i < 4096 && atomic_load_explicit(&loop->n_helpers, memory_order_acquire) > 0; i++) {
		if (i >= 512 && atomic_load_explicit(&pool->n_wanting, memory_order_relaxed) > 0)
			return;
		pause_briefly();
	}
}

static void offer_loop(struct psr_pool *pool, struct job *job, struct loop *loop, uint64_t now)
{
	job->loop = loop;
	pool_want(pool, job, 1, now);
}

/* Takes the offer back. Helpers may still be there. */
static void withdraw_loop(struct psr_pool *pool, struct job *job, struct loop *loop)
{
	pool_want(pool, job, 0, pool_now(pool));
	if (loop->n_helpers > 0) {
		pthread_mutex_unlock(&pool->mutex);
		spin_until_left(pool, loop);
		pthread_mutex_lock(&pool->mutex);
	}
}

static void run_in_job(struct psr_pool *pool, struct job *job, struct loop *loop)
{
	const uint64_t begun = pool_now(pool);

	pool_mark(job->worker, job, begun);
	loop->n_silent = loop->n - 1;
	pthread_mutex_lock(&pool->mutex);
	offer_loop(pool, job, loop, begun);
	call_helpers(pool, job, loop);
	pool_yield(pool, job, begun);
	pthread_mutex_unlock(&pool->mutex);

	pool_run_indices(pool, NULL, job, loop);

	pthread_mutex_lock(&pool->mutex);
	withdraw_loop(pool, job, loop);
	if (loop->n_helpers > 0)
		pool_wait_for_helpers(pool, job);
	job->loop = NULL;
	pool_yield(pool, job, pool_now(pool));
	pthread_mutex_unlock(&pool->mutex);
}

/* A thread that lends itself stays for half a millisecond, in which nobody else would come to help. */
static int is_lent(const struct job *job)
{
	return job->worker->until_ns != 0;
}

/* A loop of one index is serial. */
static void run_in_place(struct psr_pool *pool, struct job *job, struct loop *loop)
{
	uint64_t now;

	pool_run_indices(pool, NULL, NULL, loop);
	now = pool_now(pool);
	pool_mark(job->worker, job, now);
	if (atomic_load_explicit(&pool->n_wanting, memory_order_relaxed) == 0)
		return;
	pthread_mutex_lock(&pool->mutex);
	pool_yield(pool, job, now);
	pthread_mutex_unlock(&pool->mutex);
}

/* The caller has no core of the pool; each such loop is a flow of its own. */
static void run_from_outside(struct psr_pool *pool, struct loop *loop)
{
	struct pool_flow flow = { .pool = pool };
	struct job job = { .flow = &flow };
	const uint64_t begun = pool_now(pool);

	pthread_cond_init(&loop->left, NULL);
	shares_flow_init(&flow.shares);
	pthread_mutex_lock(&pool->mutex);
	shares_enter(&pool->shares, &job.claim, &flow.shares, POOL_MOVING, begun);
	offer_loop(pool, &job, loop, begun);
	pool_call(pool, loop->n - 1);
	pthread_mutex_unlock(&pool->mutex);

	pool_run_indices(pool, NULL, NULL, loop);

	pthread_mutex_lock(&pool->mutex);
	withdraw_loop(pool, &job, loop);
	while (loop->n_helpers > 0)
		pthread_cond_wait(&loop->left, &pool->mutex);
	shares_leave(&pool->shares, &job.claim, pool_now(pool));
	pthread_mutex_unlock(&pool->mutex);
	pthread_cond_destroy(&loop->left);
}

void psr_pool_for(struct psr_pool *pool, int n, void (*fn)(int i, void *userdata), void *userdata)
{
	struct worker *self = pool_current_worker();
	struct job *job = pool_current_job();
	struct loop loop = { .fn = fn, .userdata = userdata, .n = n };

	/* Each thread may take one index beyond the end. */
	assert(n <= INT_MAX - POOL_MAX_CORES - 1);
	if (n <= 0)
		return;
	if (pool != NULL && job != NULL && job->worker == self && self->pool == pool)
		(n == 1 || is_lent(job) ? run_in_place : run_in_job)(pool, job, &loop);
	else if (n == 1 || psr_pool_threads(pool) == 1)
		pool_run_indices(pool, NULL, NULL, &loop);
	else
		run_from_outside(pool, &loop);
}

struct until {
	const struct psr_cancel *cancel;
	void (*fn)(int i, void *userdata);
	void *userdata;
};

static void run_unless_cancelled(int i, void *userdata)
{
	const struct until *until = userdata;

	if (!psr_is_cancelled(until->cancel))
		until->fn(i, until->userdata);
}

int psr_pool_for_until(struct psr_pool *pool, const struct psr_cancel *cancel, int n,
                       void (*fn)(int i, void *userdata), void *userdata)
{
	struct until until = { cancel, fn, userdata };

	psr_pool_for(pool, n, run_unless_cancelled, &until);
	return psr_is_cancelled(cancel) ? PSR_ERR_CANCELLED : PSR_OK;
}

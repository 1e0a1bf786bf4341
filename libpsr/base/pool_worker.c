#include <signal.h>
#include <stdlib.h>
#include "clock.h"
#include "pool_core.h"
#include "turns.h"

#define SPIN_NS 50000

static _Thread_local struct job *current_job;
static _Thread_local struct worker *current_worker;

struct job *pool_current_job(void)
{
	return current_job;
}

struct worker *pool_current_worker(void)
{
	return current_worker;
}

/* Work that came while a worker was on its way may need another one. */
static void pass_on(struct psr_pool *pool)
{
	if (atomic_load_explicit(&pool->n_wanting, memory_order_relaxed) > 0)
		pool_call(pool, 1);
}

static void end_job(struct psr_pool *pool, struct job *job, uint64_t now)
{
	struct pool_flow *flow = job->flow;

	flow->last_ns = atomic_load_explicit(&job->used_ns, memory_order_relaxed);
	shares_leave(&pool->shares, &job->claim, now);
	if (flow->is_destroyed && flow->shares.first == NULL)
		free(flow);
	if (pool->n_fibers < POOL_MAX_FIBERS) {
		pool->fiber[pool->n_fibers++] = job->fiber;
	} else {
		pthread_mutex_unlock(&pool->mutex);
		fiber_destroy(job->fiber);
		pthread_mutex_lock(&pool->mutex);
	}
	free(job);
	if (--pool->n_jobs == 0) {
		pthread_cond_broadcast(&pool->all_done);
		pool_offer(pool); /* whoever spins has nothing to spin for */
	}
}

static void run_fiber(struct worker *self, struct job *job, uint64_t now)
{
	struct psr_pool *pool = self->pool;
	int has_left;

	job->is_waiting = 0;
	job->worker = self;
	pool_begin(self, job, now);
	pool_want(pool, job, job->loop != NULL && !pool_is_taken(job->loop), now);
	pass_on(pool);
	pthread_mutex_unlock(&pool->mutex);
	current_job = job;
	has_left = fiber_enter(job->fiber);
	current_job = NULL;
	pthread_mutex_lock(&pool->mutex);
	now = pool_now(pool);
	pool_end(self, job, now);
	if (has_left)
		pool_after_leave(self, job, now);
	else
		end_job(pool, job, now);
}

void psr_pool_lend(struct psr_pool *pool, uint64_t most_ns)
{
	const uint64_t now = pool_now(pool);
	struct worker guest = { .pool = pool, .until_ns = now + most_ns };
	struct job *job;

	if (!atomic_load_explicit(&pool->is_lent_to, memory_order_relaxed))
		return;
	pthread_mutex_lock(&pool->mutex);
	atomic_store(&pool->is_lent_to, 0);
	job = pool_best(pool, now);
	if (job != NULL && job->is_waiting && pool->n_jobs == 1 && job->flow->last_ns != 0
	    && job->flow->last_ns < most_ns) {
		current_worker = &guest;
		run_fiber(&guest, job, now);
		current_worker = NULL;
	}
	pass_on(pool);
	pthread_mutex_unlock(&pool->mutex);
}

static void help(struct worker *self, struct job *job, uint64_t now)
{
	struct psr_pool *pool = self->pool;
	struct loop *loop = job->loop;

	atomic_fetch_add_explicit(&loop->n_helpers, 1, memory_order_relaxed);
	pool_begin(self, job, now);
	pass_on(pool);
	pthread_mutex_unlock(&pool->mutex);
	current_job = job->fiber != NULL ? job : NULL;
	self->is_helping = 1;
	pool_run_indices(pool, self, job, loop);
	self->is_helping = 0;
	current_job = NULL;
	pthread_mutex_lock(&pool->mutex);
	now = pool_now(pool);
	pool_end(self, job, now);
	pool_after_help(pool, job, now);
}

/* A frame is a dozen loops, each well below a millisecond, and waking a thread costs some 50 us: workers spin for as
 * long before they sleep, while there is a frame. */
static int spin_until_offer(struct psr_pool *pool, unsigned n_offers)
{
	const uint64_t start = clock_ns();

	do {
		for (int i = 0; i < 64; i++) {
			if (atomic_load_explicit(&pool->n_offers, memory_order_acquire) != n_offers)
				return 1;
			pause_briefly();
		}
	} while (clock_ns() - start < SPIN_NS);
	return 0;
}

static int spin(struct psr_pool *pool)
{
	const unsigned n_offers = atomic_load_explicit(&pool->n_offers, memory_order_relaxed);
	int has_offer;

	pool->n_coming++;
	pthread_mutex_unlock(&pool->mutex);
	has_offer = spin_until_offer(pool, n_offers);
	pthread_mutex_lock(&pool->mutex);
	pool->n_coming--;
	return has_offer;
}

static void sleep_until_called(struct worker *self)
{
	struct psr_pool *pool = self->pool;

	self->next = pool->asleep;
	pool->asleep = self;
	while (!self->is_called && !pool->stopping)
		pthread_cond_wait(&self->called, &pool->mutex);
	if (self->is_called)
		pool->n_coming--;
	self->is_called = 0;
}

static void *work(void *userdata)
{
	struct worker *self = userdata;
	struct psr_pool *pool = self->pool;
	int has_spun = 1;

	current_worker = self;
	if (pool->with_jobs)
		turns_be_short(); /* of which it gives up what is left, see turns.h */
	pthread_mutex_lock(&pool->mutex);
	for (;;) {
		const uint64_t now = pool_now(pool);
		struct job *job = pool_best(pool, now);

		if (job != NULL) {
			(job->is_waiting ? run_fiber : help)(self, job, now);
			has_spun = 0;
		} else if (pool->stopping) {
			break;
		} else if (has_spun || (pool->with_jobs && pool->n_jobs == 0)) {
			sleep_until_called(self);
			has_spun = 0;
		} else {
			has_spun = !spin(pool);
		}
	}
	pthread_mutex_unlock(&pool->mutex);
	return NULL;
}

/* Blocks signals, which belong to the program's threads, except those of faults. */
static int start_thread(struct worker *worker)
{
	static const int faults[] = { SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGABRT, SIGSYS };
	sigset_t blocked, before;
	int failed;

	sigfillset(&blocked);
	for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++)
		sigdelset(&blocked, faults[i]);
	pthread_sigmask(SIG_BLOCK, &blocked, &before);
	failed = pthread_create(&worker->thread, NULL, work, worker);
	pthread_sigmask(SIG_SETMASK, &before, NULL);
	return failed ? PSR_ERR_MEMORY : PSR_OK;
}

int pool_start_worker(struct psr_pool *pool)
{
	struct worker *worker = calloc(1, sizeof *worker);

	if (worker == NULL)
		return PSR_ERR_MEMORY;
	worker->pool = pool;
	pthread_cond_init(&worker->called, NULL);
	if (start_thread(worker) != PSR_OK) {
		pthread_cond_destroy(&worker->called);
		free(worker);
		return PSR_ERR_MEMORY;
	}
	pool->worker[pool->n_workers++] = worker;
	return PSR_OK;
}

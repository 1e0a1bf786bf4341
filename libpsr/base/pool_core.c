#include "clock.h"
#include "pool_core.h"

uint64_t pool_now(const struct psr_pool *pool)
{
	return pool->with_jobs ? clock_ns() : 0;
}

void pool_offer(struct psr_pool *pool)
{
	atomic_fetch_add_explicit(&pool->n_offers, 1, memory_order_release);
}

void pool_want(struct psr_pool *pool, struct job *job, int wants, uint64_t now)
{
	shares_want(&pool->shares, &job->claim, wants, now);
	atomic_store_explicit(&pool->n_wanting,
	                      pool->shares.n_wanting[SHARES_FOREGROUND] + pool->shares.n_wanting[SHARES_REFINING],
	                      memory_order_relaxed);
	if (wants)
		pool_offer(pool);
}

struct job *pool_best(struct psr_pool *pool, uint64_t now)
{
	struct job *job;

	while ((job = (struct job *)shares_best(&pool->shares, now)) != NULL && !job->is_waiting && job->loop != NULL
	       && pool_is_taken(job->loop))
		pool_want(pool, job, 0, now);
	return job;
}

void pool_begin(struct worker *worker, struct job *job, uint64_t now)
{
	worker->begun_ns = worker->marked_ns = now;
	shares_begin(&job->claim, now);
}

void pool_mark(struct worker *worker, struct job *job, uint64_t now)
{
	atomic_fetch_add_explicit(&job->used_ns, now - worker->marked_ns, memory_order_relaxed);
	worker->marked_ns = now;
}

void pool_end(struct worker *worker, struct job *job, uint64_t now)
{
	pool_mark(worker, job, now);
	shares_end(&job->claim, worker->begun_ns, now);
}

void pool_call(struct psr_pool *pool, int n)
{
	for (n -= pool->n_coming; n > 0 && pool->asleep != NULL; n--) {
		struct worker *worker = pool->asleep;

		pool->asleep = worker->next;
		pool->n_coming++;
		worker->is_called = 1;
		pthread_cond_signal(&worker->called);
	}
}

/* Others may change the job only after its fiber has left: pool_after_leave() says what it waits for. */
static void leave(struct psr_pool *pool, struct job *job, enum pool_leave why)
{
	job->worker->leave = why;
	pthread_mutex_unlock(&pool->mutex);
	fiber_leave(job->fiber);
	pthread_mutex_lock(&pool->mutex);
}

void pool_yield(struct psr_pool *pool, struct job *job, uint64_t now)
{
	if (pool_is_overdue(job->worker, now) || shares_rival(&pool->shares, &job->claim, now) != NULL)
		leave(pool, job, POOL_YIELDS);
}

void pool_wait_for_helpers(struct psr_pool *pool, struct job *job)
{
	leave(pool, job, POOL_ENDS_A_LOOP);
}

static void wait_for_a_core(struct psr_pool *pool, struct job *job, uint64_t now)
{
	job->is_waiting = 1;
	pool_want(pool, job, 1, now);
}

static void end_loop(struct psr_pool *pool, struct job *job, uint64_t now)
{
	job->is_ending = 0;
	job->loop = NULL;
	wait_for_a_core(pool, job, now);
}

void pool_after_leave(struct worker *worker, struct job *job, uint64_t now)
{
	job->worker = NULL;
	if (worker->leave == POOL_YIELDS)
		wait_for_a_core(worker->pool, job, now);
	else if (atomic_load_explicit(&job->loop->n_helpers, memory_order_acquire) == 0)
		end_loop(worker->pool, job, now);
	else
		job->is_ending = 1;
}

void pool_after_help(struct psr_pool *pool, struct job *job, uint64_t now)
{
	struct loop *loop = job->loop;

	if (!job->is_waiting && pool_is_taken(loop))
		pool_want(pool, job, 0, now);
	if (atomic_fetch_sub_explicit(&loop->n_helpers, 1, memory_order_release) > 1)
		return;
	if (job->fiber == NULL)
		pthread_cond_signal(&loop->left);
	if (job->is_ending)
		end_loop(pool, job, now);
}

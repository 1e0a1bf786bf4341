#include <assert.h>
#include <stdlib.h>
#include <unistd.h>
#include "pool_core.h"
#include "turns.h"

int psr_pool_all_cores(void)
{
	const long n = sysconf(_SC_NPROCESSORS_ONLN);

	return n < 1 ? 1 : n > POOL_MAX_CORES ? POOL_MAX_CORES : (int)n;
}

/* It is held for less than a microsecond: who is called spins until the caller has left it. */
static void init_mutex(pthread_mutex_t *mutex)
{
	pthread_mutexattr_t attributes;

	pthread_mutexattr_init(&attributes);
	pthread_mutexattr_settype(&attributes, PTHREAD_MUTEX_ADAPTIVE_NP);
	pthread_mutex_init(mutex, &attributes);
	pthread_mutexattr_destroy(&attributes);
}

static int create(struct psr_pool **out, int n_threads, int with_jobs, struct psr_error *err)
{
	struct psr_pool *pool;
	int n_workers;

	if (n_threads == 0)
		n_threads = psr_pool_all_cores();
	n_workers = with_jobs ? n_threads : n_threads - 1;
	if (n_threads < 1 || n_threads > POOL_MAX_CORES)
		return psr_fail(err, PSR_ERR_ARG, "a pool of %d threads: it has 1 to %d, or 0 for one a core", n_threads,
		                POOL_MAX_CORES);
	pool = calloc(1, sizeof *pool);
	if (pool == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a pool of threads");
	init_mutex(&pool->mutex);
	pthread_cond_init(&pool->all_done, NULL);
	shares_init(&pool->shares);
	shares_flow_init(&pool->shared.shares);
	pool->n_threads = n_threads;
	pool->with_jobs = with_jobs;
	for (int i = 0; i < n_workers; i++) {
		int code;

		pthread_mutex_lock(&pool->mutex);
		code = pool_start_worker(pool);
		pthread_mutex_unlock(&pool->mutex);
		if (code != PSR_OK) {
			psr_pool_destroy(pool);
			return psr_fail(err, PSR_ERR_MEMORY, "the system starts no more than %d of %d threads", i, n_workers);
		}
	}
	*out = pool;
	return PSR_OK;
}

int psr_pool_create(struct psr_pool **out, int n_threads, struct psr_error *err)
{
	return create(out, n_threads, 0, err);
}

int psr_pool_create_for_jobs(struct psr_pool **out, int n_threads, struct psr_error *err)
{
	return create(out, n_threads, 1, err);
}

void psr_pool_keep_apart(struct psr_pool *pool)
{
	pthread_t thread[POOL_MAX_CORES];

	assert(pool->with_jobs);
	for (int i = 0; i < pool->n_workers; i++)
		thread[i] = pool->worker[i]->thread;
	turns_keep_apart(thread, pool->n_workers);
}

void psr_pool_destroy(struct psr_pool *pool)
{
	if (pool == NULL)
		return;
	pthread_mutex_lock(&pool->mutex);
	if (pool->n_jobs > 0)
		pool_call(pool, 1); /* nobody lends a thread any more */
	while (pool->n_jobs > 0)
		pthread_cond_wait(&pool->all_done, &pool->mutex);
	pool->stopping = 1;
	pool_offer(pool);
	for (int i = 0; i < pool->n_workers; i++)
		pthread_cond_signal(&pool->worker[i]->called);
	pthread_mutex_unlock(&pool->mutex);
	for (int i = 0; i < pool->n_workers; i++) {
		pthread_join(pool->worker[i]->thread, NULL);
		pthread_cond_destroy(&pool->worker[i]->called);
		free(pool->worker[i]);
	}
	for (int i = 0; i < pool->n_fibers; i++)
		fiber_destroy(pool->fiber[i]);
	assert(pool->shares.flows.next == &pool->shares.flows);
	pthread_cond_destroy(&pool->all_done);
	pthread_mutex_destroy(&pool->mutex);
	free(pool);
}

int psr_pool_threads(const struct psr_pool *pool)
{
	return pool != NULL ? pool->n_threads : 1;
}

int pool_flow_create(struct pool_flow **out, struct psr_pool *pool)
{
	struct pool_flow *flow = calloc(1, sizeof *flow);

	assert(pool->with_jobs);
	if (flow == NULL)
		return PSR_ERR_MEMORY;
	shares_flow_init(&flow->shares);
	flow->pool = pool;
	*out = flow;
	return PSR_OK;
}

void pool_flow_destroy(struct pool_flow *flow)
{
	struct psr_pool *pool;
	int is_unused;

	if (flow == NULL)
		return;
	pool = flow->pool;
	pthread_mutex_lock(&pool->mutex);
	flow->is_destroyed = 1;
	is_unused = flow->shares.first == NULL;
	pthread_mutex_unlock(&pool->mutex);
	if (is_unused)
		free(flow);
}

uint64_t pool_flow_used_ns(const struct pool_flow *flow)
{
	uint64_t used;

	pthread_mutex_lock(&flow->pool->mutex);
	used = shares_used_ns(&flow->shares, pool_now(flow->pool));
	pthread_mutex_unlock(&flow->pool->mutex);
	return used;
}

static int take_fiber(struct psr_pool *pool, struct fiber **out)
{
	*out = NULL;
	pthread_mutex_lock(&pool->mutex);
	if (pool->n_fibers > 0)
		*out = pool->fiber[--pool->n_fibers];
	pthread_mutex_unlock(&pool->mutex);
	return *out != NULL ? PSR_OK : fiber_create(out);
}

int psr_pool_submit(struct psr_pool *pool, const struct pool_job *job)
{
	struct job *own;
	uint64_t now;

	assert(pool->with_jobs);
	own = calloc(1, sizeof *own);
	if (own == NULL || take_fiber(pool, &own->fiber) != PSR_OK) {
		free(own);
		return PSR_ERR_MEMORY;
	}
	fiber_set(own->fiber, job->fn, job->userdata);
	own->flow = job->flow != NULL ? job->flow : &pool->shared;
	own->is_waiting = 1;
	now = pool_now(pool);
	pthread_mutex_lock(&pool->mutex);
	pool->n_jobs++;
	shares_enter(&pool->shares, &own->claim, &own->flow->shares, job->class, now);
	pool_want(pool, own, 1, now);
	atomic_store(&pool->is_lent_to, job->is_lent_to && pool->n_jobs == 1);
	if (!job->is_lent_to || pool->n_jobs > 1)
		pool_call(pool, 1);
	pthread_mutex_unlock(&pool->mutex);
	return PSR_OK;
}

uint64_t pool_job_used_ns(void)
{
	const struct job *job = pool_current_job();

	return job != NULL ? atomic_load_explicit(&job->used_ns, memory_order_relaxed) : 0;
}

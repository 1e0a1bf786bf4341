#include <assert.h>
#include <fenv.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <unistd.h>
#include "clock.h"
#include "pool.h"

#define MAX_THREADS 256
#define SPIN_NS 50000

struct job {
	struct job *next;
	void (*fn)(void *userdata);
	void *userdata;
};

/* On its caller's stack. Helpers use it only while they are counted, which changes under the mutex. */
struct loop {
	struct loop *next, *previous;
	void (*fn)(int i, void *userdata);
	void *userdata;
	int n;
	atomic_int n_helpers; /* changed under the mutex */
	atomic_int taken;     /* indices handed out */
	pthread_cond_t left;
};

struct psr_pool {
	pthread_mutex_t mutex;
	pthread_cond_t work;
	struct job *first_job, **last_job;
	struct loop loops; /* head of a ring */
	atomic_int n_jobs; /* queued */
	atomic_uint n_offers; /* counts loops, jobs and the end; idle workers spin on it before they sleep */
	int n_threads, n_workers, n_asleep, with_jobs, stopping;
	pthread_t worker[MAX_THREADS];
};

/* Runs functions with the default rounding and with denormal numbers: a library that sets flush-to-zero in one thread
 * must not change frames. */
static void run_indices(struct loop *loop, const atomic_int *n_jobs)
{
	fenv_t callers;
	int i;
	fegetenv(&callers);
	fesetenv(FE_DFL_ENV);
	while ((n_jobs == NULL || atomic_load_explicit(n_jobs, memory_order_relaxed) == 0)
	       && (i = atomic_fetch_add_explicit(&loop->taken, 1, memory_order_relaxed)) < loop->n)
		loop->fn(i, loop->userdata);
	fesetenv(&callers);
}

/* The running loop with indices left and the fewest helpers, the oldest if several; or NULL. */
static struct loop *neediest_loop(struct psr_pool *pool)
{
	struct loop *best = NULL;
	for (struct loop *loop = pool->loops.next; loop != &pool->loops; loop = loop->next)
		if (atomic_load_explicit(&loop->taken, memory_order_relaxed) < loop->n
		    && (best == NULL || loop->n_helpers < best->n_helpers))
			best = loop;
	return best;
}

static void run_job(struct psr_pool *pool)
{
	struct job *job = pool->first_job;
	pool->first_job = job->next;
	if (pool->first_job == NULL)
		pool->last_job = &pool->first_job;
	atomic_fetch_sub_explicit(&pool->n_jobs, 1, memory_order_relaxed);
	pthread_mutex_unlock(&pool->mutex);
	fesetenv(FE_DFL_ENV);
	job->fn(job->userdata);
	free(job);
	pthread_mutex_lock(&pool->mutex);
}

static void help(struct psr_pool *pool, struct loop *loop)
{
	loop->n_helpers++;
	pthread_mutex_unlock(&pool->mutex);
	run_indices(loop, &pool->n_jobs);
	pthread_mutex_lock(&pool->mutex);
	if (--loop->n_helpers == 0)
		pthread_cond_signal(&loop->left);
}

static void pause_briefly(void)
{
#ifdef __x86_64__
	__builtin_ia32_pause();
#endif
}

/* A frame is a dozen loops, each well below a millisecond, and waking a thread costs some 50 us: workers spin for as
 * long before they sleep. */
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

static void offer(struct psr_pool *pool)
{
	atomic_fetch_add_explicit(&pool->n_offers, 1, memory_order_release);
	if (pool->n_asleep > 0)
		pthread_cond_broadcast(&pool->work);
}

static void *work(void *userdata)
{
	struct psr_pool *pool = userdata;
	struct loop *loop;
	int has_spun = 0;
	pthread_mutex_lock(&pool->mutex);
	for (;;) {
		const unsigned n_offers = atomic_load_explicit(&pool->n_offers, memory_order_relaxed);
		if (pool->first_job != NULL) {
			run_job(pool);
			has_spun = 0;
		} else if ((loop = neediest_loop(pool)) != NULL) {
			help(pool, loop);
			has_spun = 0;
		} else if (pool->stopping) {
			break;
		} else if (!has_spun) {
			pthread_mutex_unlock(&pool->mutex);
			has_spun = !spin_until_offer(pool, n_offers);
			pthread_mutex_lock(&pool->mutex);
		} else {
			pool->n_asleep++;
			pthread_cond_wait(&pool->work, &pool->mutex);
			pool->n_asleep--;
			has_spun = 0;
		}
	}
	pthread_mutex_unlock(&pool->mutex);
	return NULL;
}

/* Blocks signals, which belong to the program's threads, except those of faults. */
static int start_worker(struct psr_pool *pool)
{
	static const int faults[] = { SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGABRT, SIGSYS };
	sigset_t blocked, before;
	int failed;

	sigfillset(&blocked);
	for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++)
		sigdelset(&blocked, faults[i]);
	pthread_sigmask(SIG_BLOCK, &blocked, &before);
	failed = pthread_create(&pool->worker[pool->n_workers], NULL, work, pool);
	pthread_sigmask(SIG_SETMASK, &before, NULL);
	if (failed)
		return PSR_ERR_MEMORY;
	pool->n_workers++;
	return PSR_OK;
}

int psr_pool_all_cores(void)
{
	const long n = sysconf(_SC_NPROCESSORS_ONLN);

	return n < 1 ? 1 : n > MAX_THREADS ? MAX_THREADS : (int)n;
}

static int create(struct psr_pool **out, int n_threads, int with_jobs, struct psr_error *err)
{
	struct psr_pool *pool;
	int n_workers;

	if (n_threads == 0)
		n_threads = psr_pool_all_cores();
	n_workers = with_jobs ? n_threads : n_threads - 1;
	if (n_threads < 1 || n_threads > MAX_THREADS)
		return psr_fail(err, PSR_ERR_ARG, "a pool of %d threads: it has 1 to %d, or 0 for one a core", n_threads,
		                MAX_THREADS);
	pool = calloc(1, sizeof *pool);
	if (pool == NULL)
		return psr_fail(err, PSR_ERR_MEMORY, "no memory for a pool of threads");
	pthread_mutex_init(&pool->mutex, NULL);
	pthread_cond_init(&pool->work, NULL);
	pool->last_job = &pool->first_job;
	pool->loops.next = pool->loops.previous = &pool->loops;
	pool->n_threads = n_threads;
	pool->with_jobs = with_jobs;
	for (int i = 0; i < n_workers; i++) {
		if (start_worker(pool) != PSR_OK) {
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

void psr_pool_destroy(struct psr_pool *pool)
{
	if (pool == NULL)
		return;
	pthread_mutex_lock(&pool->mutex);
	pool->stopping = 1;
	offer(pool);
	pthread_mutex_unlock(&pool->mutex);
	for (int i = 0; i < pool->n_workers; i++)
		pthread_join(pool->worker[i], NULL);
	assert(pool->first_job == NULL && pool->loops.next == &pool->loops);
	pthread_cond_destroy(&pool->work);
	pthread_mutex_destroy(&pool->mutex);
	free(pool);
}

void psr_pool_wake(struct psr_pool *pool)
{
	if (pool == NULL || pool->n_workers == 0)
		return;
	pthread_mutex_lock(&pool->mutex);
	offer(pool);
	pthread_mutex_unlock(&pool->mutex);
}

int psr_pool_threads(const struct psr_pool *pool)
{
	return pool != NULL ? pool->n_threads : 1;
}

void psr_pool_for(struct psr_pool *pool, int n, void (*fn)(int i, void *userdata), void *userdata)
{
	struct loop loop = { .fn = fn, .userdata = userdata, .n = n };
	/* Each thread may take one index beyond the end. */
	assert(n <= INT_MAX - MAX_THREADS - 1);
	if (n <= 0)
		return;
	if (pool == NULL || pool->n_workers == 0 || n == 1) {
		run_indices(&loop, NULL);
		return;
	}
	pthread_cond_init(&loop.left, NULL);
	pthread_mutex_lock(&pool->mutex);
	loop.next = &pool->loops;
	loop.previous = pool->loops.previous;
	loop.previous->next = loop.next->previous = &loop;
	offer(pool);
	pthread_mutex_unlock(&pool->mutex);

	run_indices(&loop, NULL);

	pthread_mutex_lock(&pool->mutex);
	loop.previous->next = loop.next;
	loop.next->previous = loop.previous;
	if (loop.n_helpers > 0) {
		pthread_mutex_unlock(&pool->mutex);
		for (int i = 0; i < 4096 && atomic_load_explicit(&loop.n_helpers, memory_order_acquire) > 0; i++)
			pause_briefly();
		pthread_mutex_lock(&pool->mutex);
	}
	while (loop.n_helpers > 0)
		pthread_cond_wait(&loop.left, &pool->mutex);
	pthread_mutex_unlock(&pool->mutex);
	pthread_cond_destroy(&loop.left);
}

int psr_pool_submit(struct psr_pool *pool, void (*fn)(void *userdata), void *userdata)
{
	struct job *job;
	assert(pool->with_jobs);
	job = malloc(sizeof *job);
	if (job == NULL)
		return PSR_ERR_MEMORY;
	*job = (struct job){ .fn = fn, .userdata = userdata };
	pthread_mutex_lock(&pool->mutex);
	*pool->last_job = job;
	pool->last_job = &job->next;
	atomic_fetch_add_explicit(&pool->n_jobs, 1, memory_order_relaxed);
	offer(pool);
	pthread_mutex_unlock(&pool->mutex);
	return PSR_OK;
}

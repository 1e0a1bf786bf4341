/* What the files of the pool share: threads, jobs, and who runs what. All of it changes under the pool's mutex, but for
 * the atomics and what a thread writes of itself. */
#ifndef PSR_BASE_POOL_CORE_H
#define PSR_BASE_POOL_CORE_H

#include <pthread.h>
#include <stdatomic.h>
#include "fiber.h"
#include "pool.h"
#include "shares.h"

#define POOL_MAX_CORES 256
#define POOL_MAX_FIBERS 64 /* that rest */

/* Why a job left its thread. */
enum pool_leave {
	POOL_YIELDS, /* it wants a core again */
	POOL_ENDS_A_LOOP, /* when the helpers have left its loop */
};

/* A core. */
struct worker {
	struct worker *next; /* sleeping ones */
	struct psr_pool *pool;
	pthread_t thread;
	pthread_cond_t called;
	int is_called;
	int is_helping; /* the thread's own: it runs indices of a job whose fiber is elsewhere */
	enum pool_leave leave;
	uint64_t begun_ns;  /* the core works for the job since then */
	uint64_t marked_ns; /* until then, that time is the job's */
	uint64_t turn_ns;   /* when it last let others in: the thread's own */
	uint64_t until_ns;  /* when a thread that lends itself wants to go; 0: never */
};

/* On its caller's stack. Helpers use it only while they are counted, which changes under the mutex. */
struct loop {
	void (*fn)(int i, void *userdata);
	void *userdata;
	int n;
	int n_silent;         /* sleepers that could help, and were not woken: the owner's */
	atomic_int n_helpers; /* changed under the mutex */
	atomic_int taken;     /* indices handed out */
	pthread_cond_t left;  /* for a caller from outside */
};

/* Or a loop from outside, which has no fiber. */
struct job {
	struct shares_claim claim; /* the first member */
	struct pool_flow *flow;
	struct fiber *fiber;   /* runs the serial parts, and takes part in the loops */
	struct worker *worker; /* on which the fiber is; NULL while it waits */
	struct loop *loop;
	int is_waiting; /* the fiber wants a core: before it has begun, too */
	int is_ending;  /* the fiber waits for helpers at the end of a loop */
	uint64_t asked_ns; /* the fiber's: when it last gave way, or would have */
	unsigned n_asked;  /* the fiber's: questions on a thread that lends itself */
	atomic_uint_fast64_t used_ns;
};

struct pool_flow {
	struct shares_flow shares;
	struct psr_pool *pool;
	uint64_t last_ns; /* that its last job used */
	int is_destroyed;
};

struct psr_pool {
	pthread_mutex_t mutex;
	pthread_cond_t all_done; /* no job is left */
	struct shares shares;
	struct pool_flow shared; /* of jobs without a flow */
	struct worker *asleep;
	atomic_uint n_wanting; /* claims */
	atomic_uint n_offers;  /* counts claims and the end; idle workers spin on it before they sleep */
	int n_threads, with_jobs, stopping;
	int n_coming; /* workers that were called or spin, and will look for work */
	int n_jobs;
	atomic_int is_lent_to; /* a job waits for a thread that lends itself, and no core was called */
	int n_workers, n_fibers;
	struct fiber *fiber[POOL_MAX_FIBERS]; /* that rest */
	struct worker *worker[POOL_MAX_CORES];
};

/* The job that the thread works for, NULL outside; and the thread, if it belongs to a pool. A job that leaves may come
 * back on another thread. */
struct job *pool_current_job(void);
struct worker *pool_current_worker(void);

/* Time matters where there are jobs. Without them all claims are level, and the one with the fewest helpers is best. */
uint64_t pool_now(const struct psr_pool *pool);

void pool_want(struct psr_pool *pool, struct job *job, int wants, uint64_t now);

/* The job that gets the next core, or NULL. */
struct job *pool_best(struct psr_pool *pool, uint64_t now);

/* The worker's core works for the job, or ends to. */
void pool_begin(struct worker *worker, struct job *job, uint64_t now);
void pool_end(struct worker *worker, struct job *job, uint64_t now);
void pool_mark(struct worker *worker, struct job *job, uint64_t now); /* needs no mutex */

static inline int pool_is_overdue(const struct worker *worker, uint64_t now)
{
	return worker->until_ns != 0 && now >= worker->until_ns;
}

void pool_offer(struct psr_pool *pool);

/* Wakes sleeping workers, so that n come. */
void pool_call(struct psr_pool *pool, int n);

/* In the job's fiber: leaves the core to a better claim, if there is one, and returns when it has one again. */
void pool_yield(struct psr_pool *pool, struct job *job, uint64_t now);

/* In the job's fiber: leaves the core, and returns when helpers have left the loop and it has one again. */
void pool_wait_for_helpers(struct psr_pool *pool, struct job *job);

/* The job's fiber has left the worker's thread. */
void pool_after_leave(struct worker *worker, struct job *job, uint64_t now);

/* A helper has left the job's loop. */
void pool_after_help(struct psr_pool *pool, struct job *job, uint64_t now);

int pool_start_worker(struct psr_pool *pool); /* MEMORY */

/* Runs indices until none is left, or the core is to go to another job. helper is NULL in the job's own fiber; job is
 * NULL where nobody counts the time. */
void pool_run_indices(struct psr_pool *pool, struct worker *helper, struct job *job, struct loop *loop);
int pool_is_taken(const struct loop *loop); /* all indices are handed out */

static inline void pause_briefly(void)
{
#ifdef __x86_64__
	__builtin_ia32_pause();
#endif
}

#endif

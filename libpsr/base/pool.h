/* The pool's work. A job is a whole frame, a loop its tiles or rows.
 *
 * psr_pool_create() makes threads that help loops: the caller of psr_pool_for() takes part in its own.
 * psr_pool_create_for_jobs() makes a scheduler of parallel loops. It has n_threads cores, each a thread. A job has a
 * fiber for its serial parts. Any core may enter the fiber, and the fiber waits while none does; so a job may be on one
 * thread before a loop and on another after it, and holds no mutex across one. Any core may run indices of any job's
 * loop. Jobs belong to flows; shares.h decides after each index or serial part where a core goes. So one flow has all
 * cores, many share them, and none waits for another's frame.
 *
 * Nothing that a frame holds may depend on which thread ran what, or when. */
#ifndef PSR_BASE_POOL_H
#define PSR_BASE_POOL_H

#include <stddef.h>
#include <stdint.h>
#include "psr/pool.h"

/* The purpose of a job: parts of a moving picture; parts of one at rest; refinement, which takes only time that nobody
 * else wants. */
enum pool_class { POOL_MOVING, POOL_RESTING, POOL_REFINING };

/* Returns the number of cores, 256 at most. */
int psr_pool_all_cores(void);

/* Makes a pool that takes jobs: n_threads cores, beside the threads of callers. Errors as of psr_pool_create(). */
int psr_pool_create_for_jobs(struct psr_pool **out, int n_threads, struct psr_error *err);

/* Each thread of a pool that takes jobs stays on a core of its own, if the process may use just as many. */
void psr_pool_keep_apart(struct psr_pool *pool);

/* Wakes sleeping threads for a loop that comes in some microseconds. NULL is fine. */
void psr_pool_wake(struct psr_pool *pool);

/* Calls fn(i, userdata) once for each i in 0..n-1, in any order, on any thread, and returns when all are done. With a
 * NULL pool the caller runs them in order. May be called from inside a job; not from inside a loop. */
void psr_pool_for(struct psr_pool *pool, int n, void (*fn)(int i, void *userdata), void *userdata);

/* Returns whether work has to end; cancel may be NULL. */
static inline int psr_is_cancelled(const struct psr_cancel *cancel)
{
	return cancel != NULL && cancel->is_cancelled != NULL && cancel->is_cancelled(cancel->userdata);
}

/* psr_pool_for() that asks `cancel` before each index and at the end. Returns CANCELLED if the work has to end, after
 * all indices under way: then it has left out others, and the results are not to be used. cancel may be NULL; after an
 * answer other than 0 it must never answer 0 again. */
int psr_pool_for_until(struct psr_pool *pool, const struct psr_cancel *cancel, int n,
                       void (*fn)(int i, void *userdata), void *userdata);

/* A source of jobs, such as a connection. Flows share the cores of their pool evenly. */
struct pool_flow;

int pool_flow_create(struct pool_flow **out, struct psr_pool *pool); /* MEMORY; for a pool with jobs */

/* Call it before the pool's. Jobs that still run keep everything that they need. NULL is fine. */
void pool_flow_destroy(struct pool_flow *flow);

/* Returns how long the flow's jobs have held cores so far, by the clock and not in processor time. A core that another
 * process or a page of a file holds up is lost to the other flows all the same; and reading the processor's time takes
 * a system call, where the clock is read after each index. */
uint64_t pool_flow_used_ns(const struct pool_flow *flow);

struct pool_job {
	struct pool_flow *flow; /* NULL: the flow that all jobs without one share */
	enum pool_class class;
	void (*fn)(void *userdata);
	void *userdata;
	int is_lent_to; /* the caller lends itself next; until then a core is called only if there are other jobs */
};

/* Queues the job, and returns at once. Jobs of one flow and class begin in their order. psr_pool_destroy() waits for
 * all of them. MEMORY. */
int psr_pool_submit(struct psr_pool *pool, const struct pool_job *job);

/* The calling thread, which is none of the pool's, works as a core for the job that is_lent_to, if that is the only job,
 * and its flow's last one took less than most_ns. If it takes longer nevertheless, it goes to a core after its next
 * index or question. So a short job costs no wake-up of another thread. */
void psr_pool_lend(struct psr_pool *pool, uint64_t most_ns);

/* Inside a job: leaves the core to a better claim, as after an index. For serial parts and long indices, which ask more
 * often than they end; the caller holds no mutex, and may come back on another thread. Does nothing in an index that
 * another core runs for the job, and outside. */
void pool_give_way(void);

/* Inside a job, or an index of one of its loops: returns how long the job has held cores, all threads together, up to
 * the last index or part that has ended. 0 outside. */
uint64_t pool_job_used_ns(void);

#endif

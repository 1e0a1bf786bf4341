/* The pool's work. A job is a whole frame; jobs run in the order in which they came. A loop is a frame's tiles or rows.
 * The caller of psr_pool_for() takes part in its own loop, and idle threads help: all of them with one frame under
 * way, one a frame with many. Nothing that a frame holds may depend on who ran what. */
#ifndef PSR_BASE_POOL_H
#define PSR_BASE_POOL_H

#include "psr/pool.h"

/* One thread a core, 256 at most. */
int psr_pool_all_cores(void);

/* A pool that takes jobs, too: n_threads workers, beside the caller. Errors as of psr_pool_create(). */
int psr_pool_create_for_jobs(struct psr_pool **out, int n_threads, struct psr_error *err);

/* Wakes sleeping threads for a loop that comes in some microseconds. NULL is fine. */
void psr_pool_wake(struct psr_pool *pool);

/* Calls fn(i, userdata) once for each i in 0..n-1, in any order, on any thread, and returns when all are done. With a
 * NULL pool the caller runs them in order. May be called from inside a job; not from inside a loop. */
void psr_pool_for(struct psr_pool *pool, int n, void (*fn)(int i, void *userdata), void *userdata);

/* Queues fn(userdata) for one of the workers of psr_pool_create_for_jobs(), and returns at once. psr_pool_destroy()
 * waits for all of them. MEMORY. */
int psr_pool_submit(struct psr_pool *pool, void (*fn)(void *userdata), void *userdata);

#endif

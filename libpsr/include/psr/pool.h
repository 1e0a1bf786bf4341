/* A pool of threads for frames and for the loops inside of a frame.
 *
 * Two kinds of work: jobs (whole frames; taken in the order in which they came) and loops (a frame's tiles or rows).
 * The caller of psr_pool_for takes part in its own loop, and idle threads help: with one frame under way every thread
 * works on it, with many each frame has one. Nothing that a frame holds may depend on who ran what. */
#ifndef PSR_POOL_H
#define PSR_POOL_H

#ifdef __cplusplus
extern "C" {
#endif

struct psr_pool;

/* n_threads >= 1 counts the threads that work on one frame. A pool that only serves psr_pool_for through its caller
 * needs n_threads - 1 workers; one that also takes jobs (with_jobs != 0) starts n_threads. PSR_ERR_ARG outside of
 * 1..256, PSR_ERR_MEMORY when a thread cannot be started. */
int psr_pool_create(struct psr_pool **out, int n_threads, int with_jobs);

/* Runs what was submitted to its end, then stops the threads. NULL is fine. */
void psr_pool_destroy(struct psr_pool *pool);

int psr_pool_threads(const struct psr_pool *pool); /* 1 for NULL */

/* Says that a loop comes in some microseconds: sleeping threads wake meanwhile. NULL is fine. */
void psr_pool_wake(struct psr_pool *pool);

/* Calls fn(i, userdata) once for each i in 0..n-1, in any order, on any thread, and returns when all are done.
 * A NULL pool runs them in the caller, in order. May be called from inside a job; not from inside a loop. */
void psr_pool_for(struct psr_pool *pool, int n, void (*fn)(int i, void *userdata), void *userdata);

/* Queues fn(userdata) for one of the workers of a pool made with_jobs; never blocks on running work. PSR_ERR_MEMORY. */
int psr_pool_submit(struct psr_pool *pool, void (*fn)(void *userdata), void *userdata);

#ifdef __cplusplus
}
#endif
#endif

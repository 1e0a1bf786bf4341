/* A pool of threads that draw a frame together. Frames do not depend on how many there are. */
#ifndef PSR_POOL_H
#define PSR_POOL_H

#include "error.h"

#ifdef __cplusplus
extern "C" {
#endif

struct psr_pool;

/* Starts the threads. n_threads counts the caller of psr_render() as one of them: 1..256; 0: one a core. ARG, MEMORY
 * (also when the system starts no more threads). */
int psr_pool_create(struct psr_pool **out, int n_threads, struct psr_error *err);

/* No call that uses the pool may be running. NULL is fine. */
void psr_pool_destroy(struct psr_pool *pool);

int psr_pool_threads(const struct psr_pool *pool); /* 1 for NULL, which stands for the caller's thread alone */

/* How a caller stops work under way. The work asks is_cancelled(userdata) every few microseconds, from all threads of
 * its pool and from several at a time, so the answer must be cheap: best a flag that another thread sets. An answer
 * other than 0 ends the work: its call returns PSR_ERR_CANCELLED. NULL for is_cancelled: nobody stops the work. */
struct psr_cancel {
	int (*is_cancelled)(void *userdata);
	void *userdata;
};

#ifdef __cplusplus
}
#endif
#endif

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

#ifdef __cplusplus
}
#endif
#endif

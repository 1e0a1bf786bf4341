/* Scratch memory of the threads that run the indices of a loop. An index takes a slot, and gives it back at its end. So
 * indices can be as small as a tile, after which a core may go to another frame. */
#ifndef PSR_RENDER_SLOTS_H
#define PSR_RENDER_SLOTS_H

#include <stdatomic.h>
#include "base/pool.h"

#define SLOTS_MOST 257 /* a pool's threads, and the caller of a loop */

struct slots {
	_Atomic uint8_t is_taken[SLOTS_MOST];
};

/* Returns how many slots a loop of the pool takes at most: who calls it may be none of the pool's threads. */
static inline int slots_most(const struct psr_pool *pool)
{
	return pool != NULL ? psr_pool_threads(pool) + 1 : 1;
}

/* The first one that is free, which most often is in the caches. */
static inline int slots_take(struct slots *slots)
{
	int i = 0;

	while (atomic_exchange_explicit(&slots->is_taken[i], 1, memory_order_acquire))
		i++;
	return i;
}

static inline void slots_give(struct slots *slots, int i)
{
	atomic_store_explicit(&slots->is_taken[i], 0, memory_order_release);
}

#endif

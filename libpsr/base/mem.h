/* Memory for arrays: checks sizes for overflow, and aligns to cache lines. */
#ifndef PSR_BASE_MEM_H
#define PSR_BASE_MEM_H

#include <stddef.h>

#define PSR_ALIGNMENT 64

/* Allocates n * size undefined bytes, aligned to PSR_ALIGNMENT and padded to a multiple of it; at least one byte. NULL
 * if the product overflows or there is no memory. The caller frees with psr_free(). */
void *psr_alloc_array(size_t n, size_t size) __attribute__((alloc_size(1, 2), malloc, warn_unused_result));
void psr_free(void *memory); /* NULL is fine */

/* Allocates zeroed memory, in huge pages if the system has them: for models and other large arrays. Aligned to 2 MiB
 * from that size on, else to a page. NULL on failure or for 0 bytes. psr_free_huge() takes the same size, and NULL. */
void *psr_alloc_huge(size_t n_bytes) __attribute__((warn_unused_result));
void psr_free_huge(void *memory, size_t n_bytes);

/* Returns at least n_bytes: `memory` itself if its *capacity suffices, else a new block, without the old contents,
 * which it frees. `memory` may be NULL with a capacity of 0. On failure returns NULL, with the old block freed and a
 * capacity of 0. */
void *psr_grow_huge(void *memory, size_t *capacity, size_t n_bytes) __attribute__((warn_unused_result));

/* The same in ordinary pages, for arrays that threads fill little by little: the system clears a page as a thread first
 * writes to it, and a huge one holds up that thread for milliseconds. psr_free_huge() frees it. */
void *psr_grow_by_pages(void *memory, size_t *capacity, size_t n_bytes) __attribute__((warn_unused_result));

#endif

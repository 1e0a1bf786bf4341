/* Memory for arrays: sizes are checked for overflow, and everything begins on a cache line. */
#ifndef PSR_BASE_MEM_H
#define PSR_BASE_MEM_H

#include <stddef.h>

#define PSR_ALIGNMENT 64

/* n * size bytes, aligned to PSR_ALIGNMENT and padded to a multiple of it, of undefined content. NULL if the product
 * overflows or there is no memory; never NULL for 0 bytes. Belongs to the caller; psr_free() it. */
void *psr_alloc_array(size_t n, size_t size) __attribute__((alloc_size(1, 2), malloc, warn_unused_result));
void psr_free(void *memory); /* NULL is fine */

/* Anonymous memory, zeroed, in huge pages where the system has them: for models and what is as large. Aligned to 2 MiB
 * from that size on, else to a page. NULL on failure or for 0 bytes. psr_free_huge() takes the same size, and NULL. */
void *psr_alloc_huge(size_t n_bytes) __attribute__((warn_unused_result));
void psr_free_huge(void *memory, size_t n_bytes);

/* Room for n_bytes in `memory`, which has *capacity of them or is NULL with 0; what was there is gone if it had less,
 * and then also on failure, with NULL and a capacity of 0. */
void *psr_grow_huge(void *memory, size_t *capacity, size_t n_bytes) __attribute__((warn_unused_result));

#endif

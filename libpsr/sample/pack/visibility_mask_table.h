/* Visibility masks as a model stores them: blocks that are hidden from nearly the same directions share one. */
#ifndef PSR_SAMPLE_PACK_VISIBILITY_MASK_TABLE_H
#define PSR_SAMPLE_PACK_VISIBILITY_MASK_TABLE_H

#include <stdint.h>
#include "model/blocks.h"
#include "base/pool.h"

/* A run has one mask for this many of its blocks, rounded up; so an index has eight bits at most. */
#define VISIBILITY_SHARE 4

struct visibility_table {
	uint32_t n_masks;
	uint64_t (*mask)[2];
	uint8_t *index; /* as psr/model.h has it */
};

/* Fills the table, and visibility_first of the runs, from a mask a block. The stored mask of a block has all bits of
 * its own, so that culling stays conservative; as few samples as possible are drawn because of the others. They do not
 * count where the block's cone culls it anyway. Blocks are joined greedily with those that follow them, which are near,
 * as the blocks of a cluster are in Morton order; then each takes the best mask of its run.
 *
 * `blocks` needs all arrays but masks. The same table whatever the number of threads. MEMORY, and then the table is
 * empty. */
int visibility_table_make(struct visibility_table *table, const struct psr_blocks *blocks, const uint64_t (*mask)[2],
                          struct psr_run *run, struct psr_pool *pool);
void visibility_table_fini(struct visibility_table *table); /* an empty one is fine */

#endif

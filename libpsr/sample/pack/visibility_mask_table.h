/* Visibility masks as a model stores them: blocks that are hidden from similar directions share one. */
#ifndef PSR_SAMPLE_PACK_VISIBILITY_MASK_TABLE_H
#define PSR_SAMPLE_PACK_VISIBILITY_MASK_TABLE_H

#include <stdint.h>
#include "base/pool.h"
#include "model/blocks.h"

/* Blocks a mask in a run, rounded up: an index has eight bits at most. */
#define VISIBILITY_MASK_SHARE 4

struct visibility_mask_table {
	uint32_t n_masks;
	uint64_t (*mask)[2];
	uint8_t *index; /* as model/blocks.h has it */
};

/* Fills the table, and visibility_first of the runs, from a mask a block. A block's stored mask has all bits of its
 * own, so culling stays conservative, and adds as few drawn samples as possible; directions from which the block's
 * cone culls it do not count. Blocks are joined greedily with those that follow them, which are near in Morton order;
 * then each takes the best mask of its run.
 *
 * `blocks` needs all arrays but masks. The same table whatever the number of threads. MEMORY, and then the table is
 * empty. */
int visibility_mask_table_make(struct visibility_mask_table *table, const struct psr_blocks *blocks,
                               const uint64_t (*mask)[2], struct psr_run *run, struct psr_pool *pool);
void visibility_mask_table_fini(struct visibility_mask_table *table); /* an empty one is fine */

#endif

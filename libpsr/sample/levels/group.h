/* The blocks of a draft's groups under construction. */
#ifndef PSR_SAMPLE_LEVELS_GROUP_H
#define PSR_SAMPLE_LEVELS_GROUP_H

#include "draft.h"

struct group_blocks {
	struct draft_block *block;
	uint32_t n, capacity, most;
	int is_over; /* there would be more */
};

int group_add(struct group_blocks *blocks, const struct draft_block *block); /* MEMORY */

/* Adds the blocks of a coarse level: for each group the samples that it needs. blocks->block[0..n_pieces-1] are the
 * finest level's, cut from the draft's first n_finest. MEMORY. */
int group_split(struct group_blocks *blocks, const struct draft *draft, unsigned level, uint32_t n_finest,
                uint32_t n_pieces, struct psr_pool *pool);

#endif

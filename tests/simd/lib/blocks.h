/* Random blocks as the rules of psr/model.h allow them, in buffers of exactly their size. */
#ifndef TESTS_SIMD_BLOCKS_H
#define TESTS_SIMD_BLOCKS_H

#include "model/blocks.h"
#include "check.h"

/* n_samples of each block: 1..64, or 0 for any. */
void check_blocks(struct check *c, struct psr_blocks *blocks, uint32_t n_blocks, uint32_t n_projections,
                  uint32_t n_samples);

#endif

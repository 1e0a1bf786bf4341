/* The studies of [G] 6.5: how many blocks visibility cones and masks cull (figures 6.7 and 6.8, table 8.3). */
#ifndef PSR_MEASURE_CULL_H
#define PSR_MEASURE_CULL_H

#include <stdint.h>
#include "psr/error.h"
#include "psr/model.h"

#define CULL_MASKS 5        /* bits of a mask: 0 (none), 8, 32, 128, 512: index 0, then 1 + level of the triangles */
#define CULL_SUBDIVISIONS 7 /* of the screen: 2^n x 2^n regions, n = 0..6 */

extern const int cull_mask_bits[CULL_MASKS];

/* What one choice of tests does, over all views. */
struct cull_cell {
	double culled;  /* fraction of the level 0 blocks */
	double seconds; /* CPU time of testing, a frame: screen masks, cones, masks */
	double speedup; /* of a whole frame on one thread against no test at all: 0.18 is 18 % */
};

struct cull_study {
	uint64_t n_views, n_blocks;    /* blocks: of level 0, a view */
	double frame_seconds;          /* a whole frame with no test, one thread; */
	double block_seconds;          /* of it, what warping costs a block */
	struct cull_cell cell[2][CULL_MASKS][CULL_SUBDIVISIONS]; /* [with cones][bits of the mask][n] */
};

/* Random views from outside of the unit sphere that it just fills, 40 degrees high, as many pixels high as its resolution
 * asks for. Masks of all sizes come from those of 512 bits, which are made here (visibility_masks_at): four bits of one are
 * one bit of the next. A mask is tested against that of the smallest node of a binary tree of screen regions that holds
 * the block, masks of regions coming from the projected triangles of directions ([G] 6.3). Only level 0 of the model takes
 * part. speedup = frame / (frame - culled * n_blocks * block + seconds) - 1. MEMORY, ARG for a model without blocks. */
int measure_cull_study(const struct psr_model *model, int n_views, int n_threads, struct cull_study *study,
                       struct psr_error *err);

#endif

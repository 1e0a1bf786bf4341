/* The inside of a cull_set. */
#ifndef PSR_MODELS_STUDIES_CULL_SET_H
#define PSR_MODELS_STUDIES_CULL_SET_H

#include "cull.h"

struct cull_set {
	struct psr_model *model, *base;
	uint32_t n_blocks, *index; /* of base's blocks in model */
	int finest;
	uint64_t *mask[CULL_FINEST + 1]; /* by level: words of block after block */
	struct screen screen;
};

#endif

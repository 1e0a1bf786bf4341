/* Models made of some of another's blocks. */
#ifndef PSR_MODELS_STUDIES_CULL_PART_H
#define PSR_MODELS_STUDIES_CULL_PART_H

#include "model/blocks.h"
#include "psr/model.h"

/* The blocks of level 0 for which is_kept[b] is not 0 (all of them if is_kept is NULL), in their order, without cones
 * and masks; world coordinates of an untransformed instance are inner ones. index (may be NULL): the blocks' numbers in
 * `model`. ARG if none is kept, MEMORY. */
int cull_part(struct psr_model **out, const struct psr_model *model, const uint8_t *is_kept, uint32_t *index,
              struct psr_error *err);

#endif

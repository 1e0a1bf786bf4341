/* From drafts to the arrays of a model. */
#ifndef PSR_SAMPLE_PACK_PACK_H
#define PSR_SAMPLE_PACK_PACK_H

#include "sample/levels/draft.h"
#include "psr/error.h"
#include "psr/model.h"
#include "base/pool.h"

/* A cluster for each group and level, coarse levels first; in a cluster blocks are in the order of the Morton code of
 * their centres. Depths are quantised. The box of info is filled in; the rest of it must be set. MEMORY, LIMIT. */
int pack_model(struct psr_model **out, struct psr_model_info *info, const struct psr_presets *presets,
               const struct ray_scene *scene, const struct draft *draft, struct psr_pool *pool, struct psr_error *err);

#endif

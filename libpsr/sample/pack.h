/* From chosen blocks to the arrays of a model. */
#ifndef PSR_SAMPLE_PACK_H
#define PSR_SAMPLE_PACK_H

#include "lattice.h"
#include "psr/error.h"
#include "psr/model.h"
#include "select.h"

/* Blocks in the order of the Morton code of their centres, cut into clusters; depths quantised. The box of info is
 * filled in; the rest of it must be set. MOST_PROJECTIONS of projections and lattices. MEMORY, LIMIT. */
int pack_model(struct psr_model **out, struct psr_model_info *info, const struct psr_presets *presets,
               const struct ray_scene *scene,
               const struct psr_projection *projection, const struct lattice *lattice,
               const struct selection *selection, struct psr_error *err);

#endif

/* From a draft to the arrays of a model. */
#ifndef PSR_SAMPLE_PACK_PACK_H
#define PSR_SAMPLE_PACK_PACK_H

#include "base/pool.h"
#include "psr/error.h"
#include "sample/levels/draft.h"

struct pack_source {
	const struct ray_scene *scene; /* of the object, at the stipple of level 0 */
	const struct surface *surface; /* for opacities */
	const struct draft *draft;     /* joined */
	const struct psr_presets *presets;
	struct psr_pool *pool;
};

/* Makes a cluster for each group and level, coarse levels first; a cluster's blocks are in the order of the Morton
 * codes of their centres. Quantises depths. Fills in the box and n_lost of info; the caller sets the rest. MEMORY,
 * LIMIT. */
int pack_model(struct psr_model **out, struct psr_model_info *info, const struct pack_source *source,
               struct psr_error *err);

#endif

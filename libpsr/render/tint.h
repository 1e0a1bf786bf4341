/* Colours by height, or by what a scan measured, in the place of a surface's own. */
#ifndef PSR_RENDER_TINT_H
#define PSR_RENDER_TINT_H

#include "plan.h"

/* Prepares the instances' tints, when all else of the plan's instances and view is there. */
void plan_tints(struct plan *plan, const struct psr_scene *scene);

/* Colours a strip's samples that have tints, and makes them unlit. The strip is resolved, with STRIP_POSITION. */
void tint_strip(struct strip *strip, const struct plan *plan);

#endif

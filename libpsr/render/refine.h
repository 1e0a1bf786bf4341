/* What refinement needs of a renderer. */
#ifndef PSR_RENDER_REFINE_H
#define PSR_RENDER_REFINE_H

#include "splat.h"

/* Draws the outline of the scene in a plain frame, width * height: 1 where a pixel has a sample, or cells cover at
 * least half of it. */
int renderer_outline(struct psr_renderer *renderer, const struct psr_scene *scene, const struct render_settings *settings,
                     struct psr_pool *pool, uint8_t *is_object, struct psr_error *err);

/* Sets the pixels that frames with splats are inside of; NULL: unknown. The caller keeps them alive. */
void renderer_set_inside(struct psr_renderer *renderer, const struct inside *inside);

#endif

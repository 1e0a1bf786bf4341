/* The renderer's functions for refinement. */
#ifndef PSR_RENDER_REFINE_H
#define PSR_RENDER_REFINE_H

#include "splat.h"

/* Draws the outline of the scene in a plain frame into is_object[width * height]: 1 where a pixel has a sample, or
 * cells cover more than half of it. */
int renderer_outline(struct psr_renderer *renderer, const struct psr_scene *scene,
                     const struct render_settings *settings, struct psr_pool *pool, uint8_t *is_object,
                     struct psr_error *err);

/* Sets which pixels of frames with splats are inside the object; NULL: unknown. The caller keeps them alive. */
void renderer_set_inside(struct psr_renderer *renderer, const struct inside *inside);

/* The colours of the last frame, if it was wide: three planes of base/root.h, as wide as the frame. The renderer's, until
 * its next call. */
struct wide_light {
	const uint16_t *channel[3];
};
struct wide_light renderer_light(const struct psr_renderer *renderer);

/* The kernels that it draws with. */
const struct simd *renderer_simd(const struct psr_renderer *renderer);

#endif

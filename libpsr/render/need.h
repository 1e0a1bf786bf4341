/* The memory that frames will take, before they are drawn. */
#ifndef PSR_RENDER_NEED_H
#define PSR_RENDER_NEED_H

#include "psr/render.h"

struct renderer_need {
	uint32_t width, height;
	unsigned pass;            /* the last one */
	unsigned n_shadow_lights;
	int has_sheer;            /* some model has samples that let light through */
	int has_octrees;          /* some instance is drawn as one */
	int with_splats;          /* and that is so */
	int n_threads;            /* of the pool */
	uint64_t n_blocks;        /* of all instances */
};

/* The most that psr_renderer_bytes() comes to. Measured with a reserve, but for sheer surfaces, whose memory has a bound:
 * depth buffers of many levels, and lights near large models, may take more. */
uint64_t renderer_need(const struct renderer_need *need);

#endif

/* The renderer: memory and results of its stages. For pipeline.c, which runs them, and renderer.c alone. */
#ifndef PSR_RENDER_RENDERER_H
#define PSR_RENDER_RENDERER_H

#include <fenv.h>
#include "buffers.h"
#include "cull.h"
#include "fill.h"
#include "refine.h"
#include "shadow.h"
#include "sheer.h"
#include "smooth.h"

struct psr_renderer {
	const struct simd *simd;
	struct plan plan;
	struct bins bins;
	struct shadow *shadow; /* NULL until a light casts one */
	struct fill fill;
	struct smooth smooth;
	struct sheer sheer;
	struct buffers buffers;
	struct refiner *refiner; /* NULL until psr_render draws a pass above 0 */
	float (*lit)[4]; /* diffuse light by normal */
	size_t lit_size;
	const uint8_t *srgb;         /* 8 bits of 16-bit linear light */
	const struct inside *inside; /* of frames with splats, or NULL */
	struct psr_report report;    /* of the stages up to the z-stack */
	/* Of the call in progress. */
	uint8_t *is_object; /* renderer_outline's */
	struct psr_frame *frame;
	int has_planes; /* the frame has more planes than colour and depth */
	struct shade_picture picture;
	float *depth; /* where depths go, or NULL */
	uint8_t *place; /* where places of smoothing go, or NULL */
};

static inline int has_colors(const struct psr_renderer *r)
{
	return r->frame->rgb != NULL || r->plan.is_wide;
}

/* Sets the default rounding, as in the pool's threads; the caller restores its own by fesetenv(). */
static inline void set_environment(fenv_t *callers)
{
	fegetenv(callers);
	fesetenv(FE_DFL_ENV);
}

#endif

/* The renderer: cull - warp - gap - shade - fill ([G] 7).
 *
 * A frame is a pure function of scene and settings: any number of threads, any machine, the same bytes. */
#ifndef PSR_RENDER_H
#define PSR_RENDER_H

#include <stdint.h>
#include "error.h"
#include "frame.h"
#include "pool.h"
#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PSR_MAX_DEPTH_LEVEL 7 /* the coarsest level buffer has cells of 2^7 pixels */

/* What may leave out blocks that cannot show, beside the frustum. All are conservative: without any of them a frame has
 * the same bytes. */
enum psr_cull_test {
	PSR_CULL_CONES = 1,     /* [G] 6.4 */
	PSR_CULL_MASKS = 2,     /* [G] 6.3: from outside of a model's unit sphere, if it was measured to lose nothing by
	                         * them */
	PSR_CULL_OCCLUSION = 4, /* what is drawn nearer, where many samples fall into a tile */
	PSR_CULL_ALL = 7
};

/* How cells of the depth buffers cover the pixels behind them ([G] 4.6). */
enum psr_gap_method {
	PSR_GAPS_BILINEAR, /* by the distance to the cells' centres */
	PSR_GAPS_OPAQUE    /* whole, as opaque squares: the simplest, kept for comparison */
};

/* A part of a larger picture: pixel (0, 0) of the frame is (left, top) there. It may reach beyond the picture, and
 * shows what a larger one would. */
struct psr_window {
	uint32_t picture_width, picture_height; /* up to PSR_MAX_PICTURE_SIDE; 0: the frame is the whole picture */
	int32_t left, top;                      /* -PSR_MAX_SIDE..PSR_MAX_PICTURE_SIDE */
};
#define PSR_MAX_PICTURE_SIDE (1 << 20)

struct psr_settings {
	uint32_t width, height; /* 1..PSR_MAX_SIDE each, PSR_MAX_PIXELS at most together */
	struct psr_window window;
	unsigned cull_tests;    /* enum psr_cull_test, OR-ed; all by default */
	int is_full;            /* 1: nothing is left out that could be; the same bytes, later. For proofs and benchmarks */
	int with_splats; /* 0: samples fill pixels, and depth buffers tell where gaps are ([G] 4). 1: samples are discs on
	                  * the surface that close the gaps themselves: for pixels finer than samples */
	double gap_threshold;   /* in pixel widths at the sample's depth ([G] 7.2 found three); 0..64 */
	enum psr_gap_method gap_method; /* bilinear by default */
	/* The greatest distance between neighbouring samples that is good enough, in pixels: drawn is the coarsest level
	 * that keeps it, or the finest. 1/64..64; 1 by default, [G]'s adequate sampling. */
	double spacing;
	/* 1: anti-aliasing of the frame ([G] 9.1.1), at a third of its time. A pixel at an edge, which any sample fills, is
	 * blended with what is behind the edge, by how many of its eight neighbours are there; others with the neighbours
	 * of their surface, since a pixel shows one of the samples that fall into it. Only colour changes. 0 by default;
	 * passes above 0 do without. */
	int is_smooth;
};
void psr_settings_default(struct psr_settings *settings, uint32_t width, uint32_t height);

struct psr_renderer; /* buffers for one frame at a time; kept from frame to frame */

int psr_renderer_create(struct psr_renderer **out, struct psr_error *err); /* MEMORY */
void psr_renderer_destroy(struct psr_renderer *renderer); /* NULL is fine */
uint64_t psr_renderer_bytes(const struct psr_renderer *renderer);

/* The whole pipeline into frame->rgb and the other planes that are not NULL; all of the caller's, at the size of the
 * settings. pool may be NULL. ARG or LIMIT for what the door refuses, MEMORY. */
int psr_render(struct psr_renderer *renderer, const struct psr_scene *scene, const struct psr_settings *settings,
               struct psr_pool *pool, struct psr_frame *frame, struct psr_error *err);

/* The same, cut in two where stacks could be merged by minimum: psr_warp leaves words and level buffers in the
 * renderer's z-stack, psr_finish does gaps, resolve, shade and fill on it. The stack is the renderer's and holds until
 * the next psr_warp; `scene` must stay as it was. */
struct psr_zstack {
	uint32_t width, height;
	uint32_t gap;       /* words between a row's last and the next row's first */
	uint64_t *word;     /* (width + gap) * height: bits of the float z' << 32 | sample id; PSR_WORD_EMPTY */
	uint32_t levels;    /* bit k: level[k] is in use, 1 <= k <= PSR_MAX_DEPTH_LEVEL */
	struct {
		float *z;       /* plain minimum of z' a cell, +inf where nothing is; a guard band of one cell on each side */
		uint32_t width, height; /* cells with the band: ceil(frame / 2^k) + 2 */
	} level[PSR_MAX_DEPTH_LEVEL + 1];
	int exponent;       /* z' here is world z' * 2^-exponent: no stage knows an absolute length */
};
#define PSR_WORD_EMPTY UINT64_C(0x7f800000ffffffff)

static inline uint64_t *psr_zstack_row(const struct psr_zstack *stack, uint32_t y)
{
	return stack->word + (size_t)y * (stack->width + stack->gap);
}

int psr_warp(struct psr_renderer *renderer, const struct psr_scene *scene, const struct psr_settings *settings,
             struct psr_pool *pool, struct psr_zstack **stack, struct psr_report *report, struct psr_error *err);
int psr_finish(struct psr_renderer *renderer, struct psr_zstack *stack, struct psr_pool *pool, struct psr_frame *frame,
               struct psr_error *err);

/* ---- refinement ([G] 9.1.1): the anti-aliased still of a camera that rests ---- */

#define PSR_MAX_PASS 4

/* Draws passes with a renderer of the caller's, which must outlive it. */
struct psr_refiner;
int psr_refiner_create(struct psr_refiner **out, struct psr_renderer *renderer);
void psr_refiner_destroy(struct psr_refiner *refiner); /* NULL is fine */
uint64_t psr_refiner_bytes(const struct psr_refiner *refiner); /* without the renderer's; two bytes a pixel of the
                                                                * largest picture, the rest independent of its size */

/* Asked between the windows of a pass; anything but 0 ends it. */
typedef int psr_refine_cancelled_fn(void *userdata);

/* Pass 0 is the frame of psr_render. Pass p draws the picture with 2^p x 2^p sub-pixels a pixel, for which blocks
 * choose levels and depth buffers, so that samples no longer fill whole pixels, and gives each pixel the mean of its
 * sub-pixels' light and the least of their depths. What shows between samples is closed well inside of what the frame
 * of pass 0 covers. The finer picture is drawn in windows, so that memory does not grow with the pass. Either of rgb
 * and depth may be NULL; without rgb nothing is resolved or lit.
 *
 * A pass is a function of scene, settings and p alone. settings->window must be that of a whole picture. Times and
 * counts are of all windows together: they count sub-pixels, and blocks and samples once in every window that draws
 * them. is_cancelled may be NULL. ARG or LIMIT for what the door refuses, MEMORY, CANCELLED; UNSUPPORTED for planes
 * other than colour and depth in passes above 0. */
int psr_refine(struct psr_refiner *refiner, const struct psr_scene *scene, const struct psr_settings *settings,
               unsigned pass, struct psr_pool *pool, psr_refine_cancelled_fn *is_cancelled, void *userdata,
               struct psr_frame *frame, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif

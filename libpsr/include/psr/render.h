/* The renderer: cull - warp - gap - shade - fill ([G] 7).
 *
 * A frame is a pure function of scene and settings: any number of threads, any machine, the same bytes. */
#ifndef PSR_RENDER_H
#define PSR_RENDER_H

#include <stdint.h>
#include "psr/error.h"
#include "psr/pool.h"
#include "psr/scene.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PSR_MAX_SIDE 16384
#define PSR_MAX_PIXELS (64u << 20)
#define PSR_MAX_DEPTH_LEVEL 7 /* the coarsest level buffer has cells of 2^7 pixels */

/* What may leave out blocks that cannot show, beside the frustum. All are conservative: without any of them a frame has
 * the same bytes. */
enum psr_cull_test {
	PSR_CULL_CONES = 1,     /* [G] 6.4 */
	PSR_CULL_MASKS = 2,     /* [G] 6.3: from outside of a model's unit sphere, if it was measured to lose nothing by them */
	PSR_CULL_OCCLUSION = 4, /* what is drawn nearer, where many samples fall into a tile */
	PSR_CULL_ALL = 7
};

struct psr_settings {
	uint32_t width, height; /* 1..PSR_MAX_SIDE each, PSR_MAX_PIXELS at most together */
	unsigned cull_tests;    /* enum psr_cull_test, OR-ed; all by default */
	double gap_threshold;   /* in pixel widths at the sample's depth ([G] 7.2 found three); 0..64 */
};
void psr_settings_default(struct psr_settings *settings, uint32_t width, uint32_t height);

enum psr_stage {
	PSR_STAGE_PLAN,    /* count: instances */
	PSR_STAGE_CULL,    /* count: blocks tested: those of clusters of the chosen levels that are in view */
	PSR_STAGE_WARP,    /* count: samples that fell into the picture and do not face away */
	PSR_STAGE_GAPS,    /* count: pixels with a sample whose weight is below 1 */
	PSR_STAGE_RESOLVE, /* count: pixels resolved: they have a sample and weight above 0 */
	PSR_STAGE_SHADE,   /* count: pixels shaded */
	PSR_STAGE_FILL,    /* count: pixels whose colour the fill changed */
	PSR_N_STAGES
};
const char *psr_stage_name(enum psr_stage stage); /* "warp" */

struct psr_report {
	uint64_t ns[PSR_N_STAGES];    /* wall time; resolve and shade run together and divide it by their own clocks */
	uint64_t count[PSR_N_STAGES];
	uint64_t n_blocks, n_samples; /* of all instances, all levels */
	uint64_t n_blocks_drawn, n_samples_drawn; /* of the levels that are drawn, after culling; all samples of those blocks */
	uint64_t n_masked;            /* blocks that only their visibility mask culls */
	uint64_t n_tile_blocks, n_occluded; /* blocks by tile, once in each that they touch; those that were occluded there */
	uint64_t n_covered;           /* pixels that a sample keeps: weight above 0 before the fill */
	uint64_t n_filled;            /* pixels of weight 0 that the fill gave a colour of the scene */
	uint32_t levels;              /* bit k: level buffer k was in use */
	uint32_t n_clamped;           /* blocks that wanted a level beyond PSR_MAX_DEPTH_LEVEL: holes are possible there */
	double error_bound;           /* pixels: half a pixel + depth step + largest cell that gave a pixel its depth */
};

struct psr_frame {
	uint32_t width, height;
	uint8_t *rgb;     /* 3 * width * height, sRGB, rows top-down, packed */
	float *depth;     /* width * height, z' in world units, +inf where nothing is; NULL to leave it out */
	struct psr_report report;
};

struct psr_renderer; /* buffers for one frame at a time; kept from frame to frame */

int psr_renderer_create(struct psr_renderer **out);
void psr_renderer_destroy(struct psr_renderer *renderer); /* NULL is fine */
uint64_t psr_renderer_bytes(const struct psr_renderer *renderer);

/* The whole pipeline into frame->rgb and, if not NULL, frame->depth; both of the caller's, at the size of the
 * settings. pool may be NULL. ARG or LIMIT for what the door refuses, MEMORY. */
int psr_render(struct psr_renderer *renderer, const struct psr_scene *scene, const struct psr_settings *settings,
               struct psr_pool *pool, struct psr_frame *frame, struct psr_error *err);

/* The same, cut in two where stacks could be merged by minimum: psr_warp leaves words and level buffers in the
 * renderer's z-stack, psr_finish does gaps, resolve, shade and fill on it. The stack is the renderer's and holds until
 * the next psr_warp; `scene` must stay as it was. */
struct psr_zstack {
	uint32_t width, height;
	uint64_t *word;     /* width * height: bits of the float z' << 32 | sample id; PSR_WORD_EMPTY */
	uint32_t levels;    /* bit k: level[k] is in use, 1 <= k <= PSR_MAX_DEPTH_LEVEL */
	struct {
		float *z;       /* plain minimum of z' a cell, +inf where nothing is; a guard band of one cell on each side */
		uint32_t width, height; /* cells with the band: ceil(frame / 2^k) + 2 */
	} level[PSR_MAX_DEPTH_LEVEL + 1];
	int exponent;       /* z' here is world z' * 2^-exponent: no stage knows an absolute length */
};
#define PSR_WORD_EMPTY UINT64_C(0x7f800000ffffffff)

int psr_warp(struct psr_renderer *renderer, const struct psr_scene *scene, const struct psr_settings *settings,
             struct psr_pool *pool, struct psr_zstack **stack, struct psr_report *report, struct psr_error *err);
int psr_finish(struct psr_renderer *renderer, struct psr_zstack *stack, struct psr_pool *pool, struct psr_frame *frame,
               struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif

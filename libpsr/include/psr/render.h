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
	PSR_CULL_MASKS = 2,     /* [G] 6.3: from outside of a model's unit sphere, if it was measured to lose nothing by
	                         * them */
	PSR_CULL_OCCLUSION = 4, /* what is drawn nearer, where many samples fall into a tile */
	PSR_CULL_ALL = 7
};

/* What a frame is asked to do only where it can change a pixel, or saves more than it costs. The protocol has the
 * numbers of effects and reasons, too. */
enum psr_effect {
	PSR_EFFECT_CONES,     /* count: blocks tested */
	PSR_EFFECT_MASKS,     /* count: blocks that only their mask culls */
	PSR_EFFECT_OCCLUSION, /* count: blocks left out, once in each tile that they touch */
	PSR_EFFECT_FACING,    /* count: blocks some of whose samples may face away, which are asked one by one */
	PSR_EFFECT_LEVELS,    /* count: depth buffers beside the picture's own */
	PSR_EFFECT_FILL,      /* count: pixels whose colour changed */
	PSR_EFFECT_TWO_SIDED, /* count: pixels whose normals may be turned to the eye */
	PSR_EFFECT_SPECULAR,  /* count: pixels whose highlights are looked for */
	PSR_EFFECT_POSITIONS, /* count: pixels whose samples' positions are worked out */
	PSR_EFFECT_SHADOWS,   /* count: shadow maps in use */
	PSR_EFFECT_TABLE,     /* count: normals whose diffuse light is tabulated ([B] 4.1) */
	PSR_EFFECT_SMOOTH,    /* count: pixels at edges, blended with what is behind */
	PSR_EFFECT_SHEER,     /* count: pixels with surfaces that let a part of the light through */
	PSR_N_EFFECTS
};
enum psr_why {
	PSR_WHY_RAN,
	PSR_WHY_OFF,     /* the settings leave it out */
	PSR_WHY_NOTHING, /* nothing in view calls for it */
	PSR_WHY_VOID,    /* it would not hold here */
	PSR_WHY_COST,    /* it would cost more than it saves, and changes nothing */
};
const char *psr_effect_name(enum psr_effect effect); /* "specular" */
const char *psr_effect_counts(enum psr_effect effect); /* what its count counts: "pixels looked at for highlights" */
/* Why an effect was left out, as the end of a sentence: "no sample in view is specular"; "" if it ran. */
const char *psr_effect_why(enum psr_effect effect, enum psr_why why);

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

enum psr_stage {
	PSR_STAGE_PLAN,    /* count: instances */
	PSR_STAGE_SHADOW,  /* count: samples drawn into the shadow maps that were made for this frame */
	PSR_STAGE_CULL,    /* count: blocks tested: those of clusters of the chosen levels that are in view */
	PSR_STAGE_WARP,    /* count: samples that fell into the picture and do not face away */
	PSR_STAGE_GAPS,    /* count: pixels with a sample whose weight is below 1 */
	PSR_STAGE_RESOLVE, /* count: pixels resolved: they have a sample and weight above 0; 0 without rgb */
	PSR_STAGE_SHADE,   /* count: pixels shaded; 0 without rgb */
	PSR_STAGE_FILL,    /* count: pixels whose colour the fill changed */
	PSR_STAGE_SMOOTH,  /* count: pixels at edges */
	PSR_N_STAGES
};
const char *psr_stage_name(enum psr_stage stage); /* "warp" */

struct psr_report {
	uint64_t ns[PSR_N_STAGES];    /* wall time; resolve and shade run together and divide it by their own clocks */
	uint64_t count[PSR_N_STAGES];
	uint64_t n_blocks, n_samples; /* of all instances, all levels */
	uint64_t n_blocks_drawn, n_samples_drawn; /* of the levels that are drawn, after culling; all samples of those
	                                           * blocks */
	uint64_t n_covered;           /* pixels that a sample keeps: weight above 0 before the fill */
	uint64_t n_filled;            /* pixels of weight 0 that the fill gave a colour of the scene */
	uint32_t levels;              /* bit k: level buffer k was in use */
	uint32_t n_clamped;           /* blocks that wanted a level beyond PSR_MAX_DEPTH_LEVEL: holes are possible there */
	uint32_t n_shadow_maps;       /* in use */
	uint32_t n_shadow_maps_drawn; /* of these made for this frame; the others were kept from frames before */
	struct {
		uint64_t count;
		enum psr_why why;
	} effect[PSR_N_EFFECTS];
	double error_bound;           /* pixels: half a pixel + depth step + largest cell that gave a pixel its depth */
};

struct psr_frame {
	uint32_t width, height;
	uint8_t *rgb;     /* 3 * width * height, sRGB, rows top-down, packed; NULL to leave it out, and nothing is lit
	                   * then */
	float *depth;     /* width * height, z' in world units, +inf where nothing is; NULL to leave it out. Of surfaces
	                   * that let light through, the nearest's where they keep back half of it, or are before nothing */
	/* Of the sample that a pixel shows behind all such surfaces, each NULL to leave it out. Where the weight is 0 there
	 * is none, though colour and depth may have been filled in. */
	int16_t *normal;  /* 3 * width * height, world space, round(32767 * n), turned to the eye where the block is
	                   * two-sided; 0, 0, 0 without a sample */
	uint32_t *id;     /* width * height, index of its instance; UINT32_MAX without a sample */
	uint8_t *block;   /* 3 * width * height: of its block the model's level, the level k of the depth buffer, and enum
	                   * psr_facing; 255, 255, 255 without a sample */
	/* Of the stages before, NULL to leave it out: */
	uint8_t *weight;  /* width * height, round(255 * weight) before the fill ([G] 4.6); 255 where nothing is and nothing
	                   * covers */
	uint64_t *words;  /* width * height, as warped: bits of the float z' in world units << 32 | sample id;
	                   * PSR_WORD_EMPTY. The sample id is 64 * (block, counted over all instances' models) + place in
	                   * the block */
	struct psr_report report;
};

/* What the cull knew of a block that is drawn ([G] 6.4, 7.3.2). */
enum psr_facing {
	PSR_FACING_EYE,       /* its cone faces the eye, and so do all of its samples; or it is bent, and not all of it
	                       * faces away */
	PSR_FACING_MIXED,     /* some may face away: each was asked */
	PSR_FACING_TWO_SIDED, /* none was asked */
};

struct psr_renderer; /* buffers for one frame at a time; kept from frame to frame */

int psr_renderer_create(struct psr_renderer **out);
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

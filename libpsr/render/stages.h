/* The renderer with all of its switches, stage by stage: for the passes of a still, for proofs, studies and tests. */
#ifndef PSR_RENDER_STAGES_H
#define PSR_RENDER_STAGES_H

#include "psr/render.h"
#include "simd/gaps.h"

/* What may leave out blocks that cannot show, beside the frustum. All are conservative: without any of them a frame has
 * the same colours. Its words may tell of other hidden samples, between those of a surface. */
enum psr_cull_test {
	PSR_CULL_CONES = 1,     /* [G] 6.4 */
	PSR_CULL_MASKS = 2,     /* [G] 6.3: from outside of a model's unit sphere, if it was measured to lose nothing by
	                         * them */
	PSR_CULL_OCCLUSION = 4, /* what is drawn nearer, where many samples fall into a tile */
	PSR_CULL_ALL = 7
};

/* A part of a larger picture: pixel (0, 0) of the frame is (left, top) there. It may reach beyond the picture, and
 * shows what a larger one would. */
struct psr_window {
	uint32_t picture_width, picture_height; /* up to PSR_MAX_PICTURE_SIDE; 0: the frame is the whole picture */
	int32_t left, top;                      /* -PSR_MAX_SIDE..PSR_MAX_PICTURE_SIDE */
};
#define PSR_MAX_PICTURE_SIDE (1 << 20)
#define PSR_MAX_SHADOW_SIDE 2048

struct render_settings {
	uint32_t width, height; /* these as in struct psr_settings */
	double spacing_px;
	enum psr_smooth smooth; /* FINE for refiner_draw() only */
	unsigned pass;          /* read by refiner_draw() only */
	struct psr_cancel cancel; /* answers 0 never again after another answer; renderer_finish() asks it, too */

	struct psr_window window;
	unsigned cull_tests;    /* enum psr_cull_test, OR-ed; all by default */
	int is_full;            /* debug: disables every shortcut that does not change the output */
	int with_splats; /* 0: samples fill pixels, and depth buffers tell where gaps are ([G] 4). 1: samples are discs on
	                  * the surface that close the gaps themselves: for pixels finer than samples */
	int with_ewa; /* 1: leaves of octrees are quantised EWA splats ([B] 5.2). No discs at the same time; pass 0 */
	int is_wide;     /* 1: colours are not clamped at 1, and stay in the renderer, see renderer_light(); the frame has no
	                  * rgb, and is not smoothed */
	double gap_threshold;   /* in pixel widths at the sample's depth ([G] 7.2 found three); 0..64 */
	enum psr_gap_method gap_method; /* PSR_GAPS_CLOSED by default */
	int cell_bias;          /* depth buffers whose cells are 2^cell_bias times as wide as samples ask for; -4..4, 0 by
	                         * default */
	int no_fill;            /* 1: pixels that the gaps left without a colour show the background */
	uint32_t shadow_side;   /* texels a side of a shadow map, at most: 64..PSR_MAX_SHADOW_SIDE, which is the default */
};
void render_settings_default(struct render_settings *settings, uint32_t width, uint32_t height);

/* psr_render() of pass 0, with these settings. */
int renderer_draw(struct psr_renderer *renderer, const struct psr_scene *scene, const struct render_settings *settings,
                  struct psr_pool *pool, struct psr_frame *frame, struct psr_error *err);

/* The same in two halves. renderer_warp() leaves words and level buffers in the renderer's z-stack, which holds until
 * the next call; renderer_finish() does gaps, resolve, shade and fill on it, with the scene unchanged, and gives the
 * report of both. */
int renderer_warp(struct psr_renderer *renderer, const struct psr_scene *scene, const struct render_settings *settings,
                  struct psr_pool *pool, struct psr_zstack **stack, struct psr_error *err);
int renderer_finish(struct psr_renderer *renderer, struct psr_zstack *stack, struct psr_pool *pool,
                    struct psr_frame *frame, struct psr_error *err);

/* ---- refinement ([G] 9.1.1): the anti-aliased still of a camera that rests ---- */

/* Draws passes with a renderer of the caller's, which must outlive it. */
struct refiner;
int refiner_create(struct refiner **out, struct psr_renderer *renderer, struct psr_error *err); /* MEMORY */
void refiner_destroy(struct refiner *refiner); /* NULL is fine */
/* Without the renderer's: two bytes a pixel of the largest picture, the rest independent of its size. */
uint64_t refiner_bytes(const struct refiner *refiner);
uint64_t refiner_most_bytes(uint64_t n_pixels); /* for frames of so many pixels */
uint64_t refiner_window(uint32_t width, uint32_t height, unsigned pass); /* pixels that it draws at once; fine: pass 1 */

/* psr_render() of settings->pass, or of a fine picture. Blocks choose levels and depth buffers for 2^p x 2^p sub-pixels a pixel, so that
 * samples no longer fill whole pixels. Gaps between samples are closed well inside of the pixels that pass 0 covers.
 * The finer picture is drawn in windows, so that memory does not grow with the pass; settings->window is that of a
 * whole picture. */
int refiner_draw(struct refiner *refiner, const struct psr_scene *scene, const struct render_settings *settings,
                 struct psr_pool *pool, struct psr_frame *frame, struct psr_error *err);

/* The refiner that psr_render() keeps with the renderer; NULL before its first pass above 0. */
struct refiner **renderer_refiner(struct psr_renderer *renderer);

#endif

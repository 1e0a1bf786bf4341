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

#define PSR_MAX_PASS 4
#define PSR_LEAST_SPACING (1.0 / 64) /* pixels */

/* FINE: draws 2x2 sub-pixels a pixel, each as EDGES would draw it in a picture of twice the size, and gives each pixel
 * the mean of their light and the least of their depths. Takes five times as long, and draws colour and depth only. */
enum psr_smooth { PSR_SMOOTH_NONE = 0, PSR_SMOOTH_EDGES = 1, PSR_SMOOTH_FINE = 2 };

struct psr_settings {
	uint32_t width, height; /* 1..PSR_MAX_SIDE each, PSR_MAX_PIXELS at most together */
	/* The greatest distance between neighbouring samples, in pixels: the renderer draws the coarsest level that
	 * keeps it, or else the finest. PSR_LEAST_SPACING..64; 1 by default, [G]'s adequate sampling. */
	double spacing_px;
	/* EDGES: anti-aliasing in one pass ([G] 9.1.1), for a third of the frame's time. Blends a pixel at an edge with the
	 * surface behind it, by how many of its eight neighbours belong to the near surface, and any other pixel with
	 * samples of its own surface around it, by where they lie. Only colour changes. NONE by default; passes above 0
	 * ignore it. */
	enum psr_smooth smooth;
	/* Pass p > 0 draws 2^p x 2^p sub-pixels a pixel, and gives each pixel the mean of their light and the least of
	 * their depths. It draws colour and depth only, takes about 4^p times as long, and needs no other pass before
	 * it. 0..PSR_MAX_PASS; 0 by default. */
	unsigned pass;
	/* 1: octrees are drawn as anti-aliased splats ([B] 5.2) in place of points and the gaps between them: leaves of one
	 * surface are mixed. Other instances are drawn as without it. A frame takes 32 bytes more a pixel that it draws at
	 * once. 0 by default; passes above 0 ignore it, and report why (PSR_EFFECT_SPLATS): their leaves are discs. */
	int with_splats;
	struct psr_cancel cancel; /* ends the frame within some milliseconds; nobody by default */
};
void psr_settings_default(struct psr_settings *settings, uint32_t width, uint32_t height);

/* Buffers for one frame at a time, kept from frame to frame. One thread at a time may draw with a renderer. */
struct psr_renderer;
int psr_renderer_create(struct psr_renderer **out, struct psr_error *err); /* MEMORY */
void psr_renderer_destroy(struct psr_renderer *renderer); /* NULL is fine */
uint64_t psr_renderer_bytes(const struct psr_renderer *renderer);

/* Draws the planes of the frame that are not NULL. The caller owns them (psr_frame_alloc()); their size must be that of
 * the settings. pool NULL: draws in the caller's thread alone. Fills frame->report with times and counts; in passes
 * above 0 these count sub-pixels. ARG or LIMIT for a field outside of its range, MEMORY, CANCELLED; UNSUPPORTED for
 * planes other than colour and depth in passes above 0 and fine pictures. A failure leaves the planes undefined, and has
 * no effect on the renderer's next frame. */
int psr_render(struct psr_renderer *renderer, const struct psr_scene *scene, const struct psr_settings *settings,
               struct psr_pool *pool, struct psr_frame *frame, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif

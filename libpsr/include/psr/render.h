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

struct psr_settings {
	uint32_t width, height; /* 1..PSR_MAX_SIDE each, PSR_MAX_PIXELS at most together */
	/* The greatest distance between neighbouring samples that is good enough, in pixels: the renderer draws the
	 * coarsest level that keeps it, or the finest. 1/64..64; 1 by default, [G]'s adequate sampling. */
	double spacing;
	/* 1: anti-aliasing in one pass ([G] 9.1.1), at a third of the frame's time. A pixel at an edge is blended with the
	 * surface behind it, by how many of its eight neighbours are there; others with the neighbours of their own
	 * surface. Only colour changes. 0 by default; passes above 0 ignore it. */
	int is_smooth;
	/* Pass p > 0 draws 2^p x 2^p sub-pixels a pixel, and gives each pixel the mean of their light and the least of
	 * their depths. It draws colour and depth only, takes about 4^p times as long, and depends on no other pass. 0, by
	 * default, to PSR_MAX_PASS. */
	unsigned pass;
	int (*is_cancelled)(void *userdata); /* asked several times in a pass above 0; not 0 ends it. NULL by default */
	void *userdata;
};
void psr_settings_default(struct psr_settings *settings, uint32_t width, uint32_t height);

/* Buffers for one frame at a time, kept from frame to frame. One thread at a time may draw with a renderer. */
struct psr_renderer;
int psr_renderer_create(struct psr_renderer **out, struct psr_error *err); /* MEMORY */
void psr_renderer_destroy(struct psr_renderer *renderer); /* NULL is fine */
uint64_t psr_renderer_bytes(const struct psr_renderer *renderer);

/* Draws the frame's planes that are not NULL; they are the caller's (psr_frame_alloc()), of the size of the settings.
 * pool: NULL for the caller's thread alone. frame->report tells times and counts; of a pass above 0 they are of all
 * sub-pixels. ARG or LIMIT for a field outside of its range, MEMORY, CANCELLED; UNSUPPORTED for planes other than colour
 * and depth in passes above 0. */
int psr_render(struct psr_renderer *renderer, const struct psr_scene *scene, const struct psr_settings *settings,
               struct psr_pool *pool, struct psr_frame *frame, struct psr_error *err);

#ifdef __cplusplus
}
#endif
#endif

/* What warping a selection costs ([G] 7.1), for block sides and lattices that the renderer does not have.
 *
 * A loop in the manner of the renderer's: perspective frames at magnification 1, blocks outside of their visibility
 * cones ([G] 6.4, about the mean normal) left out, a set-up for each of the others, a row and a lane at a time, the
 * minimum of 64-bit words. Neither level buffers nor tiles nor the test of single normals are in it. */
#ifndef PSR_MODELS_STUDIES_GREEDY_WARP_H
#define PSR_MODELS_STUDIES_GREEDY_WARP_H

#include "greedy.h"

struct greedy_warp;

/* From what is kept, which is copied. MEMORY. */
int greedy_warp_create(struct greedy_warp **out, const struct greedy *greedy, struct psr_error *err);
void greedy_warp_destroy(struct greedy_warp *warp); /* NULL is fine */

struct greedy_warp_time {
	double seconds; /* of this thread's processor time, a frame; the least of some repetitions */
	double culled;  /* fraction of the blocks that cones left out */
};

/* Frames of options.resolution^2 pixels from n_frames directions, evenly spread. MEMORY. */
int greedy_warp_run(struct greedy_warp *warp, int n_frames, struct greedy_warp_time *time, struct psr_error *err);

#endif

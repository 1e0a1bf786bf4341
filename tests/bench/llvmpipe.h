/* Mesa's software OpenGL, offscreen: the same object as triangles and as points. */
#ifndef TESTS_BENCH_LLVMPIPE_H
#define TESTS_BENCH_LLVMPIPE_H

#include "peer.h"

enum llvmpipe_way {
	LLVMPIPE_MESH,          /* triangles, back faces culled, light a fragment */
	LLVMPIPE_POINTS,        /* a pixel a sample, light a fragment */
	LLVMPIPE_POINTS_VERTEX, /* the same, light a vertex: the same pixels, other costs */
};

/* Draws n_frames of the film's frames into a frame buffer object and reads each back. rgb takes frame 0, rows top-down,
 * unless NULL. `mesh` or `points` may be NULL, as the way wants. Meant to run in a process of its own. */
void llvmpipe_measure(struct peer_result *out, enum llvmpipe_way way, const struct scene_film *film,
                      const struct peer_mesh *mesh, const struct peer_points *points, int n_frames, uint8_t *rgb);

#endif

/* Embree on the mesh: primary rays in packets of 16, light as in frames, and a shadow ray if wanted. */
#ifndef TESTS_BENCH_EMBREE_H
#define TESTS_BENCH_EMBREE_H

#include "peer.h"

/* Draws n_frames of the film's frames. rgb takes frame 0 unless NULL. Meant to run in a process of its own. */
void embree_measure(struct peer_result *out, const struct scene_film *film, const struct peer_mesh *mesh,
                    int has_shadow, int n_threads, int n_frames, uint8_t *rgb);

#endif

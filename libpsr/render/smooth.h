/* Smooth: anti-aliasing ([G] 9.1.1). */
#ifndef PSR_RENDER_SMOOTH_H
#define PSR_RENDER_SMOOTH_H

#include <stdatomic.h>
#include "plan.h"

/* A picture to be smoothed: 3 * width * height, and its depths in world units. */
struct smooth {
	uint8_t *rgb;
	float *depth;
	uint8_t *place; /* of plans with places, else NULL */
	void *storage;
	size_t storage_size;
	_Atomic uint64_t n_edges; /* of the picture in progress */
};

/* Makes room for a picture, its places, and its depths if `depth` is NULL. MEMORY. */
int smooth_begin(struct smooth *smooth, const struct plan *plan, float *depth);
void smooth_clear(struct smooth *smooth);

/* Smooths the picture into `rgb`. CANCELLED. */
int smooth_picture(struct smooth *smooth, const struct simd *simd, const struct plan *plan, struct psr_pool *pool,
                   uint8_t *rgb);

#endif

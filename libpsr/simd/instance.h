/* Which instances the samples of a strip are of, the same for all variants. */
#ifndef PSR_SIMD_INSTANCE_H
#define PSR_SIMD_INSTANCE_H

#include "simd/simd.h"

static inline const struct warp_instance *instance_of(const struct strip_view *view, uint32_t slot)
{
	uint32_t low = 0, high = view->n_instances;
	while (high - low > 1) {
		const uint32_t middle = (low + high) / 2;
		if (view->instance[middle].first_slot <= slot)
			low = middle;
		else
			high = middle;
	}
	return &view->instance[low];
}

/* The instance of sample `first`, and in *end where the run of its samples ends. */
static inline const struct warp_instance *instance_run(uint32_t *end, const struct strip_pixels *p,
                                                       const struct strip_view *view, uint32_t first)
{
	const struct warp_instance *in = instance_of(view, p->id[first] / PSR_BLOCK_SAMPLES);
	uint32_t i = view->n_instances > 1 ? first + 1 : p->n;
	while (i < p->n && p->id[i] / PSR_BLOCK_SAMPLES - in->first_slot < in->blocks->n_blocks)
		i++;
	*end = i;
	return in;
}

#endif

#include "smooth.h"

#include <math.h>
#include <string.h>
#include "base/mem.h"

#define EDGE 3.0 /* least step in depth, in pixel widths, as for gaps ([G] 7.2) */

struct smoothing {
	struct smooth *smooth;
	const struct simd *simd;
	const struct plan *plan;
	struct smooth_target target;
};

int smooth_begin(struct smooth *smooth, const struct plan *plan, float *depth)
{
	const size_t area = (size_t)plan->width * plan->height, depths = depth != NULL ? 0 : area * sizeof *depth;

	smooth->storage = psr_grow_huge(smooth->storage, &smooth->storage_size, depths + (plan->place_bits ? 4 : 3) * area);
	if (smooth->storage == NULL)
		return PSR_ERR_MEMORY;
	smooth->depth = depth != NULL ? depth : smooth->storage;
	smooth->rgb = (uint8_t *)smooth->storage + depths;
	smooth->place = plan->place_bits ? smooth->rgb + 3 * area : NULL;
	return PSR_OK;
}

void smooth_clear(struct smooth *smooth)
{
	psr_free_huge(smooth->storage, smooth->storage_size);
}

static uint32_t end_of_part(const struct plan *plan, uint32_t x)
{
	const uint32_t end = (x / PART_WIDTH + 1) * PART_WIDTH;

	return end < plan->width ? end : plan->width;
}

/* A row of parts, two at a time that are not quiet. Copies the background of quiet ones. */
static void smooth_row(int row, void *userdata)
{
	struct smoothing *s = userdata;
	const struct plan *plan = s->plan;
	const struct smooth_target *t = &s->target;
	const uint32_t y0 = (uint32_t)row * PART_HEIGHT, below = y0 + PART_HEIGHT;
	const uint32_t y1 = below < plan->height ? below : plan->height;
	uint64_t n_edges = 0;

	for (uint32_t x0 = 0, x1; x0 < plan->width; x0 = x1) {
		x1 = end_of_part(plan, x0);
		if (!plan_is_quiet(plan, x0, y0)) {
			if (x1 < plan->width && !plan_is_quiet(plan, x1, y0))
				x1 = end_of_part(plan, x1);
			n_edges += s->simd->smooth(t, x0, x1, y0, y1);
			continue;
		}
		for (uint32_t y = y0; y < y1; y++) {
			const size_t first = 3 * ((size_t)y * plan->width + x0);

			memcpy(t->to + first, t->from + first, 3 * (size_t)(x1 - x0));
		}
	}
	atomic_fetch_add_explicit(&s->smooth->n_edges, n_edges, memory_order_relaxed);
}
_Static_assert(2 * PART_WIDTH <= SMOOTH_WIDTH, "");

int smooth_picture(struct smooth *smooth, const struct simd *simd, const struct plan *plan, struct psr_pool *pool,
                   uint8_t *rgb)
{
	const float step = (float)(EDGE / (double)plan->focal);
	struct smoothing smoothing = {
		smooth, simd, plan, { .from = smooth->rgb, .to = rgb, .depth = smooth->depth, .width = plan->width,
		                      .height = plan->height, .perspective = plan->perspective, .scale = 1 / (1 + step),
		                      .place = smooth->place },
	};

	if (!plan->perspective) {
		smoothing.target.scale = 1;
		smoothing.target.offset = ldexpf(step, plan->exponent);
	}
	atomic_store(&smooth->n_edges, 0);
	return psr_pool_for_until(pool, &plan->cancel, (int)plan->parts_y, smooth_row, &smoothing);
}

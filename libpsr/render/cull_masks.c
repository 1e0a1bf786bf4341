#include <string.h>
#include "cull.h"
#include "base/direction.h"
#include "screen.h"

/* The tree node of a region: a one, then the coordinates' bits interleaved, x first. */
static uint32_t node_of(uint32_t x, uint32_t y)
{
	uint32_t node = 1;

	for (int bit = SCREEN_SPLITS - 1; bit >= 0; bit--)
		node = node << 2 | (x >> bit & 1) << 1 | (y >> bit & 1);
	return node;
}

void cull_masks_make(struct cull_masks *masks, const struct plan *plan, const struct plan_instance *in)
{
	uint64_t region[2 << 2 * SCREEN_SPLITS][SCREEN_WORDS];
	struct screen screen = { .mask = region };

	if (plan->perspective) {
		screen_make(&screen, SCREEN_SPLITS, in->turn, plan->tangent, 2);
	} else { /* all rays have one direction */
		const unsigned triangle = psr_direction_encode(in->cull.eye) >> 8;
		memset(region, 0, sizeof region);
		for (uint32_t node = node_of(0, 0); node < 2u << 2 * SCREEN_SPLITS; node++)
			region[node][triangle >> 6] = UINT64_C(1) << (triangle & 63);
	}
	memset(masks->range, 0, sizeof masks->range);
	for (int x1 = 0; x1 < SCREEN_SIDE; x1++)
		for (int x0 = 0; x0 <= x1; x0++)
			for (int y1 = 0; y1 < SCREEN_SIDE; y1++)
				for (int y0 = 0; y0 <= y1; y0++)
					for (int r = 0, across = x1 - x0 + 1; r < across * (y1 - y0 + 1); r++)
						for (int w = 0; w < 2; w++)
							masks->range[screen_range(x0, x1) * SCREEN_RANGES + screen_range(y0, y1)][w] |=
								region[node_of((uint32_t)(x0 + r % across), (uint32_t)(y0 + r / across))][w];
}

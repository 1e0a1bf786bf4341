#include "psr/direction.h"
#include "render/render.h"

static void target_make(struct warp_target *t, const struct plan *plan, const struct psr_zstack *stack, uint32_t tile)
{
	t->instance = plan->warp;
	t->direction = psr_direction_tens();
	t->near_z = plan->near_z;
	t->perspective = plan->perspective;
	uint32_t tx = tile % plan->tiles_x, ty = tile / plan->tiles_x;
	t->word = stack->word;
	t->stride = stack->width;
	t->x0 = (int32_t)(tx * TILE_WIDTH);
	t->y0 = (int32_t)(ty * TILE_HEIGHT);
	int last_x = tx + 1 == plan->tiles_x, last_y = ty + 1 == plan->tiles_y;
	t->x1 = last_x ? (int32_t)plan->width : t->x0 + TILE_WIDTH;
	t->y1 = last_y ? (int32_t)plan->height : t->y0 + TILE_HEIGHT;
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		if (!(stack->levels >> k & 1))
			continue;
		struct warp_cells *c = &t->cells[k];
		c->z = stack->level[k].z;
		c->stride = stack->level[k].width;
		c->x0 = tx ? t->x0 : -(1 << k);
		c->y0 = ty ? t->y0 : -(1 << k);
		c->x1 = last_x ? (int32_t)(stack->level[k].width - 1) << k : t->x1;
		c->first = (uint32_t)((c->y0 >> k) + 1) * c->stride + (uint32_t)((c->x0 >> k) + 1);
		c->y1 = last_y ? (int32_t)(stack->level[k].height - 1) << k : t->y1;
	}
}

uint64_t warp_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins, struct psr_zstack *stack, uint32_t tile)
{
	const uint32_t begin = bins->tile_begin[tile], end = bins->tile_begin[tile + 1];
	struct warp_target target;
	target_make(&target, plan, stack, tile);
	simd->warp_clear(&target, stack->levels);
	return simd->warp(&target, bins->entry + begin, end - begin);
}

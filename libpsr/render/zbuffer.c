#include "zbuffer.h"

#include "base/direction.h"

size_t zbuffer_measure(struct psr_zstack *stack, uint32_t width, uint32_t height, uint32_t levels)
{
	size_t n_cells = 0;

	stack->width = width;
	stack->height = height;
	stack->levels = levels;
	for (int k = 0; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		const uint32_t side = 1u << k;

		stack->level[k].width = (width + side - 1) / side + 2;
		stack->level[k].height = (height + side - 1) / side + 2;
		if (levels >> k & 1)
			n_cells += (size_t)stack->level[k].width * stack->level[k].height;
	}
	return n_cells;
}

float *zbuffer_place_cells(struct psr_zstack *stack, float *cells)
{
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		stack->level[k].z = stack->levels >> k & 1 ? cells : NULL;
		if (stack->level[k].z != NULL)
			cells += (size_t)stack->level[k].width * stack->level[k].height;
	}
	return cells;
}

uint32_t warp_gap(uint32_t width)
{
	const uint32_t page = 4096 / sizeof(uint64_t), line = 64 / sizeof(uint64_t), beyond = (width + line) % page;

	return beyond < 2 * line ? 2 * line - beyond : 0;
}

void warp_target_make(struct warp_target *t, const struct plan *plan, const struct psr_zstack *stack,
                      uint32_t tile, uint64_t *own)
{
	t->instance = plan->warp;
	t->direction = psr_direction_tens();
	t->cubes = NULL;
	t->near_z = plan->near_z;
	t->perspective = plan->perspective;
	uint32_t tx = tile % plan->tiles_x, ty = tile / plan->tiles_x;
	t->place_bits = own != NULL ? 0 : plan->place_bits;
	t->stride = own != NULL ? WARP_OWN_STRIDE : stack->width + stack->gap;
	t->x0 = (int32_t)(tx * TILE_WIDTH);
	t->y0 = (int32_t)(ty * TILE_HEIGHT);
	t->word = own != NULL ? own : psr_zstack_row(stack, (uint32_t)t->y0) + t->x0;
	int last_x = tx + 1 == plan->tiles_x, last_y = ty + 1 == plan->tiles_y;
	t->x1 = last_x ? (int32_t)plan->width : t->x0 + TILE_WIDTH;
	t->y1 = last_y ? (int32_t)plan->height : t->y0 + TILE_HEIGHT;
	t->above = t->below = 0;
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

uint32_t warp_parts(const struct plan *plan, const uint8_t *map, uint32_t tile)
{
	const uint32_t x0 = tile % plan->tiles_x * TILE_WIDTH, y0 = tile / plan->tiles_x * TILE_HEIGHT;
	uint32_t bits = ALL_PARTS;

	for (uint32_t y = 0; y < TILE_HEIGHT && y0 + y < plan->height; y += PART_HEIGHT)
		for (uint32_t x = 0; x < TILE_WIDTH && x0 + x < plan->width; x += PART_WIDTH)
			if (!map[(y0 + y) / PART_HEIGHT * plan->parts_x + (x0 + x) / PART_WIDTH])
				bits &= ~part_bit(x, y);
	return bits;
}

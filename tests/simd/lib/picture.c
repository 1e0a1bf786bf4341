#include <math.h>
#include <string.h>
#include "base/direction.h"
#include "base/maths.h"
#include "picture.h"

static uint32_t random_side(struct check *c, uint32_t tile)
{
	static const uint32_t odd[] = { 1, 2, 3, 15, 16, 17, 31, 33, 64, 127 };
	if (check_one_in(c, 2))
		return odd[check_below(c, sizeof odd / sizeof odd[0])] + (check_one_in(c, 3) ? tile : 0);
	return 1 + check_below(c, 2 * tile);
}

float picture_depth(struct check *c)
{
	if (check_one_in(c, 3))
		return INFINITY;
	return (float)check_real(c, 0, 2);
}

void picture_make(struct check *c, struct picture *p, uint32_t width, uint32_t height, uint32_t levels)
{
	struct warp_target *t = &p->target;
	const uint32_t tiles_x = (width + TILE_WIDTH - 1) / TILE_WIDTH, tiles_y = (height + TILE_HEIGHT - 1) / TILE_HEIGHT;
	const uint32_t tx = check_below(c, tiles_x), ty = check_below(c, tiles_y);
	const int is_last_x = tx + 1 == tiles_x, is_last_y = ty + 1 == tiles_y;

	memset(p, 0, sizeof *p);
	p->width = width;
	p->height = height;
	p->levels = levels & 0xfe;
	t->direction = psr_direction_tens();
	t->stride = width + (check_one_in(c, 2) ? check_below(c, 20) : 0);
	t->x0 = (int32_t)(tx * TILE_WIDTH);
	t->y0 = (int32_t)(ty * TILE_HEIGHT);
	t->x1 = is_last_x ? (int32_t)width : t->x0 + TILE_WIDTH;
	t->y1 = is_last_y ? (int32_t)height : t->y0 + TILE_HEIGHT;
	uint64_t *word = check_out(c, (size_t)t->stride * height, sizeof *word);
	for (size_t i = 0; i < (size_t)t->stride * height; i++)
		word[i] = (uint64_t)psr_bits_from_float(picture_depth(c)) << 32 | check_u32(c);
	t->word = word + (size_t)t->y0 * t->stride + (size_t)t->x0;
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++) {
		if (!(p->levels >> k & 1))
			continue;
		struct warp_cells *cells = &t->cells[k];
		const uint32_t side = 1u << k, cells_x = (width + side - 1) / side + 2,
					   cells_y = (height + side - 1) / side + 2;
		cells->stride = cells_x;
		cells->x0 = tx ? t->x0 : -(1 << k);
		cells->y0 = ty ? t->y0 : -(1 << k);
		cells->x1 = is_last_x ? (int32_t)(cells_x - 1) << k : t->x1;
		cells->y1 = is_last_y ? (int32_t)(cells_y - 1) << k : t->y1;
		cells->first = (uint32_t)((cells->y0 >> k) + 1) * cells_x + (uint32_t)((cells->x0 >> k) + 1);
		cells->z = check_out(c, (size_t)cells_x * cells_y, sizeof *cells->z);
		for (size_t i = 0; i < (size_t)cells_x * cells_y; i++)
			cells->z[i] = picture_depth(c);
	}
}

void picture_random(struct check *c, struct picture *p)
{
	picture_make(c, p, random_side(c, TILE_WIDTH), random_side(c, TILE_HEIGHT), check_u32(c) & check_u32(c));
}

void picture_sight(struct check *c, struct warp_instance *in, const struct warp_target *t, int is_spoilt)
{
	for (int k = 0; k < 3; k++) {
		in->du[k] = t->perspective ? (float)check_real(c, -0.01, 0.01) : 0;
		in->dv[k] = t->perspective ? (float)check_real(c, -0.01, 0.01) : 0;
		in->d0[k] = (float)check_real(c, -1, 1);
		if (is_spoilt && check_one_in(c, 6))
			in->du[k] = check_float(c);
		if (is_spoilt && check_one_in(c, 6))
			in->d0[k] = check_float(c);
	}
}

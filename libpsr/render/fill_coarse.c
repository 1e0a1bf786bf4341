#include <string.h>
#include "fill_bricks.h"

static uint8_t *coarse_at(const struct fill *fill, int l, uint32_t x, uint32_t y)
{
	return &fill->coarse[fill->coarse_first[l] + (size_t)y * fill->level[l].width + x];
}

/* Pulls weight and depth of a coarse cell; the bricks below it are to pull their colours. */
static void pull_tree(struct fill *fill, int l, uint32_t x, uint32_t y)
{
	uint8_t *state = coarse_at(fill, l, x, y);

	if (*state & FILL_PULLED || plan_is_cancelled(fill->plan))
		return;
	*state |= FILL_PULLED;
	if (l == fill->brick_top) {
		const size_t brick = (size_t)y * fill->bricks_x + x;

		fill->wants[brick] = (uint8_t)l;
		while (fill->pulled[brick] < l)
			fill_pull_weights(fill, x, x + 1, y, ++fill->pulled[brick]);
		return;
	}
	for (uint32_t v = 2 * y; v <= 2 * y + 1 && v < fill->level[l - 1].height; v++)
		for (uint32_t u = 2 * x; u <= 2 * x + 1 && u < fill->level[l - 1].width; u++)
			pull_tree(fill, l - 1, u, v);
	const struct fill_row to = fill_row_at(&fill->level[l], (int32_t)x, (int32_t)y);
	const struct fill_row upper = fill_row_at(&fill->level[l - 1], (int32_t)(2 * x), (int32_t)(2 * y));
	const struct fill_row lower = fill_row_at(&fill->level[l - 1], (int32_t)(2 * x), (int32_t)(2 * y + 1));
	if (fill->simd->fill_pull_weights(&to, &upper, &lower, 1, fill_scale(fill->plan, l), fill_offset(fill->plan, l))
	    < WEIGHT_ONE / 2)
		fill_note_depth(fill, l);
}

void fill_find_coarse(struct fill *fill)
{
	const size_t n_bricks = (size_t)fill->bricks_x * fill->bricks_y;
	int is_whole = 0;

	memset(fill->coarse, 0, fill->n_coarse);
	for (size_t i = 0; i < n_bricks; i++)
		fill->coarse[i] = fill->whole[i] > fill->brick_top ? FILL_NEEDED : 0;
	for (int l = fill->brick_top; l < fill->top && !is_whole; l++) {
		const struct fill_level *from = &fill->level[l], *to = from + 1;

		is_whole = 1;
		for (uint32_t y = 0; y < from->height; y++)
			for (uint32_t x = 0; x < from->width; x++) {
				const uint32_t px = x / 2, py = y / 2, nx = x & 1 ? px + 1 : px - 1, ny = y & 1 ? py + 1 : py - 1;

				if (!(*coarse_at(fill, l, x, y) & FILL_NEEDED)
				    || fill_row_at(from, (int32_t)x, (int32_t)y).weight[0] == WEIGHT_ONE)
					continue;
				is_whole = 0;
				pull_tree(fill, l + 1, px, py);
				*coarse_at(fill, l + 1, px, py) |= FILL_NEEDED;
				if (nx < to->width) {
					pull_tree(fill, l + 1, nx, py);
					*coarse_at(fill, l + 1, nx, py) |= FILL_NEEDED;
				}
				if (ny < to->height) {
					pull_tree(fill, l + 1, px, ny);
					*coarse_at(fill, l + 1, px, ny) |= FILL_NEEDED;
				}
			}
	}
}

/* Makes the single cell at the top whole: its own colour, or the background if it is empty. */
static void finish_top(const struct fill_level *top, const struct plan *plan)
{
	const struct fill_row cell = fill_row_at(top, 0, 0);
	uint16_t *const rgb[3] = { cell.r, cell.g, cell.b };
	const uint32_t w = cell.weight[0];

	for (int k = 0; k < 3; k++)
		*rgb[k] = (uint16_t)(w ? *rgb[k] * (uint32_t)WEIGHT_ONE / w : plan->background[k]);
	cell.weight[0] = WEIGHT_ONE;
}

void fill_run_coarse(struct fill *fill)
{
	for (int l = fill->brick_top; l < fill->top; l++) {
		const struct fill_level *from = &fill->level[l], *to = from + 1;

		for (int32_t y = 0; y < (int32_t)to->height; y++) {
			const struct fill_row row = fill_row_at(to, 0, y), upper = fill_row_at(from, 0, 2 * y);
			const struct fill_row lower = fill_row_at(from, 0, 2 * y + 1);

			fill->simd->fill_pull_weights(&row, &upper, &lower, to->width, fill_scale(fill->plan, l + 1),
			                              fill_offset(fill->plan, l + 1));
			if (fill_has_colors(fill))
				fill->simd->fill_pull_colors(&row, &upper, &lower, to->width, 0);
		}
	}
	finish_top(&fill->level[fill->top], fill->plan);
	for (int l = fill->top - 1; l >= fill->brick_top; l--) {
		const struct fill_level *to = &fill->level[l], *from = to + 1;

		for (int32_t y = 0; y < (int32_t)to->height; y++) {
			const int32_t parent = y >> 1;
			const struct fill_row row = fill_row_at(to, 0, y);
			const struct fill_parents parents = {
				fill_row_at(from, 0, parent), fill_row_at(from, 0, y & 1 ? parent + 1 : parent - 1), from->width,
				fill_scale(fill->plan, l + 1), fill_offset(fill->plan, l + 1),
			};

			fill->simd->fill_push(&row, &parents);
		}
	}
}

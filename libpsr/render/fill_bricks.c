#include <math.h>
#include <string.h>
#include "render/render.h"

/* Rows of the picture reach no further than the picture: one that does is copied, with a border. */
struct picture_row {
	float z[FILL_WIDTH + 1];
	uint16_t r[FILL_WIDTH + 1], g[FILL_WIDTH + 1], b[FILL_WIDTH + 1], weight[FILL_WIDTH + 1];
};

/* Pixel (x, y) and the n - 1 to the right of it; without depths or colours where they are not asked for. */
static struct fill_row picture_row_at(struct picture_row *to, const struct fill *fill, uint32_t x, uint32_t y,
                                      uint32_t n, int has_depths, int has_colors)
{
	const struct fill_picture *p = &fill->picture;
	const uint32_t width = p->stack->width, n_inside = y >= p->stack->height ? 0 : x + n > width ? width - x : n;
	const size_t first = (size_t)y * width + x;
	if (n_inside && has_depths)
		fill->simd->fill_depths(to->z, psr_zstack_row(p->stack, y) + x, n_inside);
	if (n_inside == n && has_colors)
		return (struct fill_row){ p->r + first, p->g + first, p->b + first, p->weight + first, to->z };
	if (n_inside == n)
		return (struct fill_row){ NULL, NULL, NULL, p->weight + first, to->z };
	if (n_inside)
		memcpy(to->weight, p->weight + first, n_inside * sizeof *to->weight);
	if (n_inside && has_colors) {
		memcpy(to->r, p->r + first, n_inside * sizeof *to->r);
		memcpy(to->g, p->g + first, n_inside * sizeof *to->g);
		memcpy(to->b, p->b + first, n_inside * sizeof *to->b);
	}
	for (uint32_t i = n_inside; i < n; i++) {
		to->z[i] = NAN;
		to->weight[i] = WEIGHT_ONE;
		to->r[i] = to->g[i] = to->b[i] = 0;
	}
	return (struct fill_row){ to->r, to->g, to->b, to->weight, to->z };
}

static uint32_t least_of(uint32_t a, uint32_t b)
{
	return a < b ? a : b;
}

void fill_pull_bricks(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t by, int level, enum fill_what what)
{
	const int has_colors = what == FILL_COLORS;
	struct picture_row rows[2];
	for (int l = 1; l <= level; l++) {
		const struct fill_level *to = &fill->level[l], *from = to - 1;
		const uint32_t side = BRICK >> l, x0 = bx0 * side, x1 = least_of(bx1 * side, to->width);
		const uint32_t y1 = least_of((by + 1) * side, to->height);
		const float scale = fill_scale(fill->plan, l), offset = fill_offset(fill->plan, l);
		uint16_t least = WEIGHT_ONE;
		for (uint32_t y = by * side; y < y1; y++) {
			struct fill_row row = fill_row_at(to, (int32_t)x0, (int32_t)y), upper, lower;
			if (!has_colors)
				row.r = row.g = row.b = NULL;
			if (l == 1) {
				upper = picture_row_at(&rows[0], fill, 2 * x0, 2 * y, 2 * (x1 - x0), 1, has_colors);
				lower = picture_row_at(&rows[1], fill, 2 * x0, 2 * y + 1, 2 * (x1 - x0), 1, has_colors);
			} else {
				upper = fill_row_at(from, (int32_t)(2 * x0), (int32_t)(2 * y));
				lower = fill_row_at(from, (int32_t)(2 * x0), (int32_t)(2 * y + 1));
			}
			const uint16_t weight = fill->simd->fill_pull(&row, &upper, &lower, x1 - x0, l == 1, scale, offset);
			least = weight < least ? weight : least;
		}
		if (least < WEIGHT_ONE / 2)
			fill_note_depth(fill, l);
		if (what == FILL_WEIGHTS_UNTIL_WHOLE && least == WEIGHT_ONE)
			return;
	}
}

/* Rows that look at no cells of the bricks above and below. */
static struct rows { uint32_t first, end; } rows_of(uint32_t by, uint32_t side, uint32_t height, int is_early)
{
	return (struct rows){ by * side + (is_early ? 1 : 0), least_of((by + 1) * side - (is_early ? 1 : 0), height) };
}

void fill_push_level(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t by, int level, int is_early)
{
	const struct fill_level *to = &fill->level[level], *from = to + 1;
	const uint32_t side = BRICK >> level, x0 = bx0 * side, x1 = least_of(bx1 * side, to->width);
	const struct rows rows = rows_of(by, side, to->height, is_early);
	const float scale = fill_scale(fill->plan, level + 1), offset = fill_offset(fill->plan, level + 1);
	for (uint32_t y = rows.first; y < rows.end; y++) {
		const int32_t parent = (int32_t)(y >> 1), x = (int32_t)(x0 >> 1);
		const struct fill_row row = fill_row_at(to, (int32_t)x0, (int32_t)y), own = fill_row_at(from, x, parent);
		const struct fill_row beside = fill_row_at(from, x, y & 1 ? parent + 1 : parent - 1);
		fill->simd->fill_push(&row, &own, &beside, (x1 - x0 + 1) / 2, scale, offset);
	}
}

/* Gives pixels their colors and depths, and makes them whole. */
static void write_pixels(struct fill *fill, size_t first, const uint16_t *place, uint32_t n_places,
                         const struct fill_row *row)
{
	const struct fill_picture *p = &fill->picture;
	const uint8_t *srgb = p->srgb;
	const uint16_t *r = row->r, *g = row->g, *b = row->b;
	uint16_t *weight = p->weight + first;
	uint8_t *rgb = p->rgb + 3 * first;
	uint32_t n_filled = 0, n_moved = 0;
	for (uint32_t i = 0; i < n_places && p->rgb; i++) {
		const uint32_t at = place[i];
		rgb[3 * at] = srgb[r[at]];
		rgb[3 * at + 1] = srgb[g[at]];
		rgb[3 * at + 2] = srgb[b[at]];
	}
	for (uint32_t i = 0; i < n_places && p->depth; i++)
		if (weight[place[i]] < WEIGHT_ONE / 2)
			p->depth[first + place[i]] = ldexpf(row->z[place[i]], p->stack->exponent);
	for (uint32_t i = 0; i < n_places; i++) {
		n_filled += (weight[place[i]] == 0) & (row->z[place[i]] < INFINITY);
		n_moved += weight[place[i]] < WEIGHT_ONE / 2;
		weight[place[i]] = WEIGHT_ONE;
	}
	atomic_fetch_add_explicit(&fill->n_changed, n_places, memory_order_relaxed);
	atomic_fetch_add_explicit(&fill->n_filled, n_filled, memory_order_relaxed);
	atomic_fetch_add_explicit(&fill->n_moved, n_moved, memory_order_relaxed);
}

void fill_push_bricks(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t by, int is_early)
{
	const struct fill_level *from = &fill->level[1];
	const uint32_t width = fill->width, x0 = bx0 * BRICK, n_cells = (least_of(bx1 * BRICK, width) - x0 + 1) / 2;
	const struct rows rows = rows_of(by, BRICK, fill->height, is_early);
	const float scale = fill_scale(fill->plan, 1), offset = fill_offset(fill->plan, 1);
	uint16_t place[FILL_WIDTH + 1];
	struct picture_row pixels, filled;
	const struct fill_row row = { filled.r, filled.g, filled.b, NULL, filled.z };
	uint32_t *left = fill->left + (size_t)by * fill->bricks_x + bx0;
	_Static_assert(BRICK == 32 && FILL_BLOCK * 2 == BRICK, "a bit a row, and a block is a brick wide");
	for (uint32_t y = rows.first; y < rows.end; y++) {
		const int32_t parent = (int32_t)(y >> 1), x = (int32_t)(x0 >> 1);
		const struct fill_row was = picture_row_at(&pixels, fill, x0, y, 2 * n_cells, 0, 1);
		const struct fill_row own = fill_row_at(from, x, parent);
		const struct fill_row beside = fill_row_at(from, x, y & 1 ? parent + 1 : parent - 1);
		const uint32_t n_places = fill->simd->fill_push_picture(&row, place, left, 1u << y % BRICK, &was, &own, &beside,
		                                                        n_cells, scale, offset);
		if (n_places)
			write_pixels(fill, (size_t)y * width + x0, place, n_places, &row);
	}
}

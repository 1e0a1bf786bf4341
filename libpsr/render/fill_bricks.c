#include "fill_bricks.h"

#include <math.h>
#include <string.h>
#include "base/maths.h"

/* A copy of a piece of the picture that reaches over its border, padded. */
struct picture_row {
	float z[FILL_PIECE + 1];
	uint16_t r[FILL_PIECE + 1], g[FILL_PIECE + 1], b[FILL_PIECE + 1], weight[FILL_PIECE + 1];
};
_Static_assert(FILL_PIECE / 2 <= FILL_WIDTH && FILL_PIECE % BRICK == 0, "");

/* Pixel (x, y) and the n - 1 to the right of it; depths are undefined. */
static inline struct fill_row picture_row_at(struct picture_row *to, const struct fill *fill, uint32_t x, uint32_t y,
                                             uint32_t n)
{
	const struct fill_picture *p = &fill->picture;
	const uint32_t width = fill->width, n_inside = y >= fill->height ? 0 : x + n > width ? width - x : n;
	const size_t first = (size_t)y * width + x;

	if (n_inside == n)
		return (struct fill_row){ p->r + first, p->g + first, p->b + first, p->weight + first, to->z, NULL };
	if (n_inside) {
		memcpy(to->weight, p->weight + first, n_inside * sizeof *to->weight);
		memcpy(to->r, p->r + first, n_inside * sizeof *to->r);
		memcpy(to->g, p->g + first, n_inside * sizeof *to->g);
		memcpy(to->b, p->b + first, n_inside * sizeof *to->b);
	}
	for (uint32_t i = n_inside; i < n; i++) {
		to->weight[i] = WEIGHT_ONE;
		to->r[i] = to->g[i] = to->b[i] = 0;
	}
	return (struct fill_row){ to->r, to->g, to->b, to->weight, to->z, NULL };
}

/* Weights and depths of the same pixels. is_own: `own` has the depths. */
static inline struct fill_row picture_depths_at(struct picture_row *to, const struct fill *fill, uint32_t x, uint32_t y,
                                                uint32_t n, int is_own)
{
	const struct fill_picture *p = &fill->picture;
	const uint32_t width = fill->width, n_inside = y >= fill->height ? 0 : x + n > width ? width - x : n;
	const size_t first = (size_t)y * width + x;
	float *z = is_own ? fill_own_row(fill, y) + x : to->z;

	if (n_inside && !is_own)
		fill->simd->fill_depths(z, psr_zstack_row(p->stack, y) + x, n_inside);
	if (n_inside == n)
		return (struct fill_row){ NULL, NULL, NULL, p->weight + first, z, NULL };
	if (n_inside)
		memcpy(to->weight, p->weight + first, n_inside * sizeof *to->weight);
	for (uint32_t i = n_inside; i < n; i++) {
		to->z[i] = NAN;
		to->weight[i] = WEIGHT_ONE;
	}
	return (struct fill_row){ NULL, NULL, NULL, to->weight, z, NULL };
}

static uint32_t least_of(uint32_t a, uint32_t b)
{
	return a < b ? a : b;
}

/* The cells of a level in bricks bx0..bx1-1 of brick row `by`. */
static struct cells { uint32_t x0, x1, y0, y1; } cells_of(const struct fill *fill, uint32_t bx0, uint32_t bx1,
                                                          uint32_t by, int level)
{
	const struct fill_level *to = &fill->level[level];
	const uint32_t side = BRICK >> level;

	return (struct cells){ bx0 * side, least_of(bx1 * side, to->width), by * side,
		                   least_of((by + 1) * side, to->height) };
}

/* Cells of a row in one call: the picture is copied by piece, levels are used in place. */
static uint32_t piece_of(uint32_t n, int level)
{
	return level == 1 ? least_of(n, FILL_PIECE / 2) : n;
}

uint16_t fill_pull_weights(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t by, int level)
{
	const struct fill_level *to = &fill->level[level], *from = to - 1;
	const struct cells c = cells_of(fill, bx0, bx1, by, level);
	const float scale = fill_scale(fill->plan, level), offset = fill_offset(fill->plan, level);
	const int is_own = fill->looks && fill->picture.bricks[by * fill->bricks_x + bx0];
	struct picture_row rows[2];
	uint16_t least = WEIGHT_ONE;

	for (uint32_t y = c.y0; y < c.y1; y++)
		for (uint32_t x = c.x0, n; x < c.x1; x += n) {
			const struct fill_row row = fill_row_at(to, (int32_t)x, (int32_t)y);
			struct fill_row upper, lower;

			n = piece_of(c.x1 - x, level);
			if (level == 1) {
				upper = picture_depths_at(&rows[0], fill, 2 * x, 2 * y, 2 * n, is_own);
				lower = picture_depths_at(&rows[1], fill, 2 * x, 2 * y + 1, 2 * n, is_own);
			} else {
				upper = fill_row_at(from, (int32_t)(2 * x), (int32_t)(2 * y));
				lower = fill_row_at(from, (int32_t)(2 * x), (int32_t)(2 * y + 1));
			}
			const uint16_t weight = fill->simd->fill_pull_weights(&row, &upper, &lower, n, scale, offset);
			least = weight < least ? weight : least;
		}
	if (least < WEIGHT_ONE / 2)
		fill_note_depth(fill, level);
	return least;
}

void fill_pull_colors(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t by, int level)
{
	const struct fill_level *to = &fill->level[level], *from = to - 1;
	const struct cells c = cells_of(fill, bx0, bx1, by, level);
	struct picture_row rows[2];

	for (uint32_t y = c.y0; y < c.y1; y++)
		for (uint32_t x = c.x0, n; x < c.x1; x += n) {
			const struct fill_row row = fill_row_at(to, (int32_t)x, (int32_t)y);
			struct fill_row upper, lower;

			n = piece_of(c.x1 - x, level);
			if (level == 1) {
				upper = picture_row_at(&rows[0], fill, 2 * x, 2 * y, 2 * n);
				lower = picture_row_at(&rows[1], fill, 2 * x, 2 * y + 1, 2 * n);
			} else {
				upper = fill_row_at(from, (int32_t)(2 * x), (int32_t)(2 * y));
				lower = fill_row_at(from, (int32_t)(2 * x), (int32_t)(2 * y + 1));
			}
			fill->simd->fill_pull_colors(&row, &upper, &lower, n, level == 1);
		}
}

/* is_early: the rows that read no cells of the bricks above and below. */
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
		const struct fill_row row = fill_row_at(to, (int32_t)x0, (int32_t)y);
		const struct fill_parents parents = { fill_row_at(from, x, parent),
			                                  fill_row_at(from, x, y & 1 ? parent + 1 : parent - 1),
			                                  (x1 - x0 + 1) / 2, scale, offset };

		fill->simd->fill_push(&row, &parents);
	}
}

/* Writes the colours and depths of listed pixels of a row that begins at `first`. */
static void write_pixels(const struct fill *fill, size_t first, const struct fill_places *places, uint32_t n)
{
	const struct fill_picture *p = &fill->picture;
	const uint8_t *srgb = p->srgb;
	uint8_t *rgb = p->rgb != NULL ? p->rgb + 3 * first : NULL;
	float to_world[2];

	psr_power_factors(to_world, p->stack->exponent);
	for (uint32_t i = 0; i < n && rgb != NULL; i++) {
		const uint32_t at = places->at[i];

		rgb[3 * at] = srgb[places->r[i]];
		rgb[3 * at + 1] = srgb[places->g[i]];
		rgb[3 * at + 2] = srgb[places->b[i]];
	}
	for (uint32_t i = 0; i < n && fill->plan->is_wide; i++) {
		p->r[first + places->at[i]] = places->r[i];
		p->g[first + places->at[i]] = places->g[i];
		p->b[first + places->at[i]] = places->b[i];
	}
	for (uint32_t i = 0; i < n && p->depth != NULL; i++)
		if (places->weight[i] < WEIGHT_ONE / 2)
			p->depth[first + places->at[i]] = places->z[i] * to_world[0] * to_world[1];
}

void fill_push_bricks(struct fill *fill, struct fill_counts *counts, uint32_t bx0, uint32_t bx1, uint32_t by,
                      int is_early)
{
	const struct fill_level *from = &fill->level[1];
	const uint32_t width = fill->width, x1 = least_of(bx1 * BRICK, width);
	const struct rows rows = rows_of(by, BRICK, fill->height, is_early);
	const float scale = fill_scale(fill->plan, 1), offset = fill_offset(fill->plan, 1);
	struct fill_places places;
	struct picture_row pixels;
	uint32_t *left = fill->left + (size_t)by * fill->bricks_x;

	_Static_assert(BRICK == 32 && FILL_BLOCK * 2 == BRICK, "a bit a row, and a block is a brick wide");
	for (uint32_t y = rows.first; y < rows.end; y++)
		for (uint32_t x = bx0 * BRICK; x < x1; x += FILL_PIECE) {
			const uint32_t n_pixels = least_of(x1 - x, FILL_PIECE), n_cells = (n_pixels + 1) / 2;
			const size_t first = (size_t)y * width + x;
			const int32_t parent = (int32_t)(y >> 1), px = (int32_t)(x >> 1);
			const struct fill_row was = picture_row_at(&pixels, fill, x, y, 2 * n_cells);
			const struct fill_row beside = fill_row_at(from, px, y & 1 ? parent + 1 : parent - 1);
			const struct fill_parents parents = { fill_row_at(from, px, parent), beside, n_cells, scale, offset };
			const uint32_t n =
				fill->simd->fill_push_picture(&places, left + x / BRICK, 1u << y % BRICK, &was, &parents);

			if (!n)
				continue;
			if (was.weight == pixels.weight)
				memcpy(fill->picture.weight + first, was.weight, n_pixels * sizeof *was.weight);
			fill_note_depths(counts, fill, x, y, &places, n);
			write_pixels(fill, first, &places, n);
			counts->n_changed += n;
			counts->n_filled += places.n_filled;
		}
}

#include <math.h>
#include <string.h>
#include "base/mem.h"
#include "fill_bricks.h"

/* Beyond the paper, both phases use depth. The nearest surface should show through a hole, so averages count only
 * pixels within a cell's threshold of the nearest. A near edge's colour is not mixed with the background's before it
 * fills a hole, and depths are filled along with colours.
 *
 * A whole cell needs nothing from coarser levels, and a cell above whole cells is whole. So a brick needs the levels up
 * to the first that is whole in it and in the eight bricks around it, which hold all that its pixels and their
 * ancestors read. */

/* Sets all cells as outside of the picture; the fill writes those inside before it reads them. Returns early if the
 * frame is cancelled. */
static void clear_level(const struct fill_level *level, size_t area, const struct plan *plan)
{
	const struct fill_row *cell = &level->cell;

	for (size_t first = 0; first < area && !plan_is_cancelled(plan); first += level->stride)
		for (size_t i = first; i < first + level->stride; i++) {
			cell->r[i] = cell->g[i] = cell->b[i] = 0;
			cell->weight[i] = WEIGHT_ONE;
			cell->z[i] = NAN;
		}
}

static int prepare(struct fill *fill, uint32_t width, uint32_t height)
{
	uint16_t *values;
	uint8_t *near;
	float *z;

	if (fill->width == width && fill->height == height)
		return PSR_OK;
	const uint32_t bricks_x = (width + BRICK - 1) / BRICK, bricks_y = (height + BRICK - 1) / BRICK;
	const size_t n_bricks = (size_t)bricks_x * bricks_y;
	size_t cells = 0;
	int top = 0;
	for (uint32_t w = width, h = height; top == 0 || w > 1 || h > 1; top++) {
		w = (w + 1) / 2;
		h = (h + 1) / 2;
		cells += (size_t)(w + 2) * (h + 2);
	}
	const size_t n_own = (size_t)(width + 2) * (height + 2);
	const size_t size = (cells + n_own) * sizeof(float) + cells * (4 * sizeof(uint16_t) + 1)
	                    + (sizeof *fill->left + 6) * n_bricks + 2 * FILL_LEVELS * (bricks_x + bricks_y);
	fill->width = fill->height = 0;
	fill->storage = psr_grow_huge(fill->storage, &fill->storage_size, size);
	if (fill->storage == NULL)
		return PSR_ERR_MEMORY;
	z = fill->storage;
	fill->own = z + cells;
	fill->left = (uint32_t *)(fill->own + n_own);
	values = (uint16_t *)(fill->left + n_bricks);
	near = (uint8_t *)(values + 4 * cells);
	uint32_t w = width, h = height;
	for (int l = 1; l <= top; l++) {
		w = (w + 1) / 2;
		h = (h + 1) / 2;
		const size_t area = (size_t)(w + 2) * (h + 2);
		fill->level[l] = (struct fill_level){ .width = w, .height = h, .left = -1, .top = -1, .stride = w + 2,
			.cell = { values, values + area, values + 2 * area, values + 3 * area, z, near } };
		clear_level(&fill->level[l], area, fill->plan);
		z += area;
		values += 4 * area;
		near += area;
	}
	if (plan_is_cancelled(fill->plan))
		return PSR_ERR_CANCELLED;
	fill->pulled = near;
	fill->whole = fill->pulled + n_bricks;
	fill->needs = fill->whole + n_bricks;
	fill->wants = fill->needs + n_bricks;
	fill->coarse = fill->wants + n_bricks;
	fill->top = top;
	fill->brick_top = top < FILL_BRICK_LEVELS ? top : FILL_BRICK_LEVELS;
	fill->n_coarse = 0;
	for (int l = fill->brick_top; l <= top; l++) {
		fill->coarse_first[l] = fill->n_coarse;
		fill->n_coarse += (size_t)fill->level[l].width * fill->level[l].height;
	}
	memset(fill->pulled, 0, n_bricks);
	for (size_t i = 0; i < n_own; i++)
		fill->own[i] = NAN;
	fill->bricks_x = bricks_x;
	fill->bricks_y = bricks_y;
	fill->width = width;
	fill->height = height;
	return PSR_OK;
}

int fill_begin(struct fill *fill, const struct simd *simd, const struct plan *plan, const struct fill_picture *picture)
{
	fill->simd = simd;
	fill->plan = plan;
	fill->picture = *picture;
	fill->looks = plan->with_splats || picture->stack->levels >> FILL_CLOSE == 0;
	fill->deepest = 0;
	fill->n_changed = fill->n_filled = fill->n_far = 0;
	fill->reach = 0;
	return prepare(fill, picture->stack->width, picture->stack->height);
}

void fill_clear(struct fill *fill)
{
	psr_free_huge(fill->storage, fill->storage_size);
	memset(fill, 0, sizeof *fill);
}

/* The finest level that is whole in a brick, whose weights are pulled that far. */
static int whole_level(const struct fill *fill, uint32_t bx, uint32_t by)
{
	for (int l = 1; l <= fill->brick_top; l++) {
		const struct fill_level *level = &fill->level[l];
		const uint32_t side = BRICK >> l;
		uint16_t least = WEIGHT_ONE;

		for (uint32_t y = by * side; y < (by + 1) * side && y < level->height && least == WEIGHT_ONE; y++) {
			const uint16_t *weight = fill_row_at(level, 0, (int32_t)y).weight;

			for (uint32_t x = bx * side; x < (bx + 1) * side && x < level->width; x++)
				least = weight[x] < least ? weight[x] : least;
		}
		if (least == WEIGHT_ONE)
			return l;
	}
	return fill->brick_top + 1;
}

/* The end of the run of bricks of row `by` with values above `least` in a map. */
static uint32_t run_end(const struct fill *fill, const uint8_t *map, uint32_t bx, uint32_t by, int least)
{
	const uint8_t *row = map + (size_t)by * fill->bricks_x;
	uint32_t end = bx + 1;

	while (end < fill->bricks_x && row[end] > least)
		end++;
	return end;
}

void fill_look(struct fill *fill, uint32_t row)
{
	const uint8_t *bricks = fill->picture.bricks + (size_t)row * fill->bricks_x;
	uint8_t *whole = fill->whole + (size_t)row * fill->bricks_x;
	uint8_t *pulled = fill->pulled + (size_t)row * fill->bricks_x;

	memset(whole, 0, fill->bricks_x);
	for (uint32_t bx = 0, end; bx < fill->bricks_x; bx = end) {
		int level = 1;

		end = bx + 1;
		if (!bricks[bx]) {
			if (pulled[bx])
				fill_forget_own(fill, bx, row);
			pulled[bx] = 0;
			continue;
		}
		end = run_end(fill, fill->picture.bricks, bx, row, 0);
		if (fill->looks)
			fill_note_own(fill, bx, end, row);
		while (fill_pull_weights(fill, bx, end, row, level) < WEIGHT_ONE && level < fill->brick_top)
			level++;
		memset(pulled + bx, level, end - bx);
		for (uint32_t b = bx; b < end; b++)
			whole[b] = (uint8_t)whole_level(fill, b, row);
	}
}

/* The greatest value of a map at a brick and the eight around it. */
static uint8_t greatest_around(const struct fill *fill, const uint8_t *map, uint32_t bx, uint32_t by)
{
	uint8_t greatest = 0;

	for (uint32_t y = by ? by - 1 : 0; y <= by + 1 && y < fill->bricks_y; y++)
		for (uint32_t x = bx ? bx - 1 : 0; x <= bx + 1 && x < fill->bricks_x; x++) {
			const uint8_t value = map[(size_t)y * fill->bricks_x + x];

			greatest = value > greatest ? value : greatest;
		}
	return greatest;
}

const uint8_t *fill_wants(struct fill *fill)
{
	const size_t n_bricks = (size_t)fill->bricks_x * fill->bricks_y;

	fill->is_coarse = 0;
	for (uint32_t by = 0, i = 0; by < fill->bricks_y; by++)
		for (uint32_t bx = 0; bx < fill->bricks_x; bx++, i++) {
			fill->needs[i] = fill->whole[i] ? greatest_around(fill, fill->whole, bx, by) : 0;
			fill->is_coarse |= fill->whole[i] > fill->brick_top;
		}
	fill->needed = 0;
	for (size_t i = 0; i < n_bricks; i++) {
		fill->left[i] = fill->needs[i] ? UINT32_MAX : 0;
		fill->needs[i] = fill->needs[i] > fill->brick_top ? (uint8_t)fill->brick_top : fill->needs[i];
		fill->needed = fill->needs[i] > fill->needed ? fill->needs[i] : fill->needed;
	}
	for (uint32_t by = 0, i = 0; by < fill->bricks_y; by++)
		for (uint32_t bx = 0; bx < fill->bricks_x; bx++, i++)
			fill->wants[i] = greatest_around(fill, fill->needs, bx, by);
	if (fill->is_coarse)
		fill_find_coarse(fill);
	return fill->wants;
}

static void push_level(struct fill *fill, uint32_t row, int level, int is_early)
{
	const uint8_t *wants = fill->wants + (size_t)row * fill->bricks_x;

	for (uint32_t bx = 0, end; bx < fill->bricks_x; bx = end) {
		end = bx + 1;
		if (wants[bx] <= level)
			continue;
		end = run_end(fill, fill->wants, bx, row, level);
		fill_push_level(fill, bx, end, row, level, is_early);
	}
}

static void push_pixels(struct fill *fill, uint32_t row, int is_early)
{
	const uint8_t *needs = fill->needs + (size_t)row * fill->bricks_x;
	struct fill_counts counts = { 0, 0, 0, atomic_load_explicit(&fill->reach, memory_order_relaxed) };
	float reach = counts.reach;

	for (uint32_t bx = 0, end; bx < fill->bricks_x; bx = end) {
		end = bx + 1;
		if (!needs[bx])
			continue;
		end = run_end(fill, fill->needs, bx, row, 0);
		fill_push_bricks(fill, &counts, bx, end, row, is_early);
	}
	atomic_fetch_add_explicit(&fill->n_changed, counts.n_changed, memory_order_relaxed);
	atomic_fetch_add_explicit(&fill->n_filled, counts.n_filled, memory_order_relaxed);
	atomic_fetch_add_explicit(&fill->n_far, counts.n_far, memory_order_relaxed);
	while (reach < counts.reach && !atomic_compare_exchange_weak(&fill->reach, &reach, counts.reach))
		;
}

static void push_row(int i, void *userdata)
{
	struct fill *fill = userdata;

	if (fill->pushed)
		push_level(fill, (uint32_t)i, fill->pushed, 0);
	else
		push_pixels(fill, (uint32_t)i, 0);
}

/* Pulls weights and depths of bricks bx0..bx1-1 to a level where fill_look did not. */
static void complete_weights(struct fill *fill, uint32_t bx0, uint32_t bx1, uint32_t row, int level)
{
	const uint8_t *pulled = fill->pulled + (size_t)row * fill->bricks_x;

	for (uint32_t bx = bx0, end; bx < bx1; bx = end) {
		end = bx + 1;
		if (pulled[bx] >= level)
			continue;
		while (end < bx1 && pulled[end] < level)
			end++;
		fill_pull_weights(fill, bx, end, row, level);
	}
}

void fill_pull(struct fill *fill, uint32_t row)
{
	const uint8_t *wants = fill->wants + (size_t)row * fill->bricks_x;

	for (uint32_t bx = 0, end; bx < fill->bricks_x; bx = end) {
		int level = 0;

		end = wants[bx] ? run_end(fill, fill->wants, bx, row, 0) : bx + 1;
		for (uint32_t b = bx; b < end; b++)
			level = wants[b] > level ? wants[b] : level;
		for (int l = 1; l <= level; l++) {
			complete_weights(fill, bx, end, row, l);
			if (fill_has_colors(fill))
				fill_pull_colors(fill, bx, end, row, l);
		}
	}
	for (int l = fill->needed - 1; l > 0; l--)
		push_level(fill, row, l, 1);
	push_pixels(fill, row, 1);
}

int fill_push(struct fill *fill, struct psr_pool *pool, struct psr_report *report)
{
	int rc = PSR_OK;

	if (fill->is_coarse)
		fill_run_coarse(fill);
	for (fill->pushed = fill->needed - 1; fill->pushed >= 0 && rc == PSR_OK; fill->pushed--)
		rc = psr_pool_for_until(pool, &fill->plan->cancel, (int)fill->bricks_y, push_row, fill);
	report->count[PSR_STAGE_FILL] += fill->n_changed;
	report->n_filled += fill->n_filled;
	fill_add_error(report, fill);
	return rc;
}

/* Coverage of pixels by cells ([G] 4.6), and the guard against pinholes. Plain loops, which the compiler turns into vectors;
 * compiled once for each ISA. */
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "simd/simd.h"

#define TILE_STRIDE (GAPS_WIDTH + 32) /* a column of neighbours on each side, and aligned rows */
#define TILE_LEFT 16
#define MAX_CELLS (GAPS_WIDTH / 2 + 2)
#define MAX_SPREAD (GAPS_WIDTH + 2 * (1 << PSR_MAX_DEPTH_LEVEL))

/* Depths of a piece of the picture and of the pixels around it. */
struct gaps_tile {
	_Alignas(64) float z[GAPS_BRICK + 2][TILE_STRIDE];
	int32_t has_samples[GAPS_BRICK + 2]; /* by row */
	uint32_t x0, y0, width, height;
};

static void load_depths(struct gaps_tile *tile, const struct psr_zstack *stack)
{
	const uint32_t first = tile->x0 ? tile->x0 - 1 : 0;
	const uint32_t end = tile->x0 + tile->width < stack->width ? tile->x0 + tile->width + 1 : stack->width;
	for (uint32_t i = 0; i < tile->height + 2; i++) {
		float *z = &tile->z[i][TILE_LEFT];
		int32_t has_samples = 0;
		z[-1] = z[tile->width] = INFINITY;
		tile->has_samples[i] = 0;
		if (tile->y0 + i < 1 || tile->y0 + i > stack->height) {
			for (uint32_t x = 0; x < tile->width; x++)
				z[x] = INFINITY;
			continue;
		}
		const uint64_t *word = stack->word + (size_t)(tile->y0 + i - 1) * stack->width + first;
		float *to = z + first - tile->x0;
		for (uint32_t x = 0; x < end - first; x++)
			to[x] = psr_float_from_bits((uint32_t)(word[x] >> 32));
		for (uint32_t x = 0; x < end - first; x++)
			has_samples |= to[x] < INFINITY;
		tile->has_samples[i] = has_samples;
	}
}

/* What lies beyond these depths is covered by the cells of a row, `own`; `either`: by the cells or the four cells of the next
 * finer level in each. Repeated for each pixel. */
struct limits {
	float own[MAX_SPREAD], either[MAX_SPREAD];
	uint32_t i, j, n; /* cells from (i, j), which counts from the guard band's corner */
	int32_t is_empty, has_either;
};

/* Repeats each of n values 2^k times. */
static void spread(float *values, uint32_t n, int k)
{
	float once[MAX_SPREAD / 2];
	for (; k > 0; k--, n *= 2) {
		for (uint32_t i = 0; i < n; i++)
			once[i] = values[i];
		for (uint32_t i = 0; i < n; i++)
			values[2 * i] = values[2 * i + 1] = once[i];
	}
}

static void find_limits(struct limits *to, const struct gaps_target *t, int k, uint32_t i, uint32_t j, uint32_t n)
{
	const float *cell = t->stack->level[k].z + (size_t)j * t->stack->level[k].width + i;
	const float scale = t->scale[k], offset = t->offset[k];
	int32_t has_any = 0;
	for (uint32_t c = 0; c < n; c++) {
		to->own[c] = cell[c] * scale + offset;
		has_any |= cell[c] < INFINITY;
	}
	to->i = i;
	to->j = j;
	to->n = n;
	to->is_empty = !has_any;
	to->has_either = 0;
	if (has_any)
		spread(to->own, n, k);
	else
		for (uint32_t x = 0; x < MAX_SPREAD; x++)
			to->own[x] = INFINITY;
}

static void find_either(struct limits *to, const struct gaps_target *t, int k)
{
	const struct psr_zstack *stack = t->stack;
	const float scale = t->scale[k - 1], offset = t->offset[k - 1];
	const uint32_t width = stack->level[k - 1].width, height = stack->level[k - 1].height, n = to->n;
	/* The finer level has no cell where 2 i - 1 is below 0, and may have none at its other end. */
	const uint32_t before = to->i ? 0 : 1, u0 = 2 * to->i + before - 1, most = 2 * n - before;
	const uint32_t n_children = width - u0 < most ? width - u0 : most;
	float children[2 * MAX_CELLS];
	if (to->has_either)
		return;
	to->has_either = 1;
	children[0] = children[2 * n - 1] = INFINITY;
	const float *cell = stack->level[k].z + (size_t)to->j * stack->level[k].width + to->i;
	for (uint32_t c = 0; c < n; c++)
		to->either[c] = cell[c] * t->scale[k] + t->offset[k];
	for (uint32_t v = to->j ? 2 * to->j - 1 : 0; v <= 2 * to->j && v < height; v++) {
		const float *fine = stack->level[k - 1].z + (size_t)v * width + u0;
		for (uint32_t c = 0; c < n_children; c++)
			children[before + c] = fine[c] * scale + offset;
		for (uint32_t c = 0; c < n; c++) {
			const float a = children[2 * c], b = children[2 * c + 1], two = a < b ? a : b;
			to->either[c] = two < to->either[c] ? two : to->either[c];
		}
	}
	spread(to->either, n, k);
}

/* Where pixels stand between the centres of a level's cells, in units of a half pixel. */
struct between {
	int32_t left[GAPS_WIDTH], right[GAPS_WIDTH]; /* shares of the cell on either side: they add up to 2^(k+1) */
};

/* Bilinear coverage of a row of pixels; upper and lower limits begin with the left neighbours of the first pixel. */
static void cover_row(int32_t *cover, const float *z, const float *upper, const float *lower, const struct between *at, int k,
                      int32_t fy, uint32_t n)
{
	const uint32_t step = 1u << k;
	const int32_t rest = (2 << k) - fy, up = k < 3 ? 6 - 2 * k : 0, down = k > 3 ? 2 * k - 6 : 0;
	for (uint32_t x = 0; x < n; x++) {
		const int32_t above = (upper[x] < z[x] ? at->left[x] : 0) + (upper[x + step] < z[x] ? at->right[x] : 0);
		const int32_t below = (lower[x] < z[x] ? at->left[x] : 0) + (lower[x + step] < z[x] ? at->right[x] : 0);
		cover[x] = (above * rest + below * fy) << up >> down;
	}
}

/* Lowers weights by the coverage of level k; returns whether there was anything to cover them.
 *
 * A surface may pass from blocks of one level to blocks of the next within a pixel's neighbourhood, and then neither
 * level covers it whole ([G] 9.1.2). Where the coarser one covers a part of a pixel, what counts is the coverage by
 * the coarser cells that either level fills: not the sum, which would take weight twice where blocks of both levels
 * hold the same surface. */
static int cover_level(const struct gaps_target *t, const struct gaps_tile *tile, int k)
{
	const int has_finer = k > 1 && (t->stack->levels >> (k - 1) & 1);
	const uint32_t half = 1u << (k - 1), n = tile->width;
	const uint32_t i = tile->x0 >> k, n_cells = ((n - 1 + half) >> k) + 2;
	struct limits limits[2], *upper = &limits[0], *lower = &limits[1];
	struct between at;
	int32_t cover[GAPS_WIDTH], either[GAPS_WIDTH];
	int has_cells = 0;

	for (uint32_t x = 0; x < GAPS_WIDTH; x++) {
		at.right[x] = (int32_t)((2 * x + 1 + (1u << k)) & ((2u << k) - 1));
		at.left[x] = (2 << k) - at.right[x];
	}
	for (uint32_t y = 0; y < tile->height; y++) {
		const uint32_t from_top = 2 * (tile->y0 + y) + 1 + (1u << k); /* a cell further down: not below 0 */
		const uint32_t j = from_top >> (k + 1);
		const int32_t fy = (int32_t)(from_top & ((2u << k) - 1));
		if (y == 0)
			find_limits(lower, t, k, i, j, n_cells);
		if (y == 0 || fy == 1) {
			struct limits *was = upper;
			upper = lower;
			lower = was;
			find_limits(lower, t, k, i, j + 1, n_cells);
		}
		if (upper->is_empty && lower->is_empty)
			continue;
		has_cells = 1;
		const float *z = &tile->z[y + 1][TILE_LEFT];
		uint16_t *weight = t->weight + (size_t)(tile->y0 + y) * t->stack->width + tile->x0;
		cover_row(cover, z, upper->own + half, lower->own + half, &at, k, fy, n);
		if (has_finer) {
			find_either(upper, t, k);
			find_either(lower, t, k);
			cover_row(either, z, upper->either + half, lower->either + half, &at, k, fy, n);
			for (uint32_t x = 0; x < n; x++)
				cover[x] = cover[x] > 0 && cover[x] < GAPS_WHOLE ? either[x] : cover[x];
		}
		for (uint32_t x = 0; x < n; x++) {
			const int32_t left = GAPS_WHOLE - cover[x], was = weight[x];
			weight[x] = (uint16_t)(left < was ? left : was);
		}
	}
	return has_cells;
}

/* The same by opaque squares. */
static int cover_opaque(const struct gaps_target *t, const struct gaps_tile *tile, int k)
{
	const struct psr_zstack *stack = t->stack;
	int has_cells = 0;
	for (uint32_t y = 0; y < tile->height; y++) {
		const float *cell = stack->level[k].z + (size_t)(((tile->y0 + y) >> k) + 1) * stack->level[k].width + (tile->x0 >> k) + 1;
		const float *z = &tile->z[y + 1][TILE_LEFT];
		uint16_t *weight = t->weight + (size_t)(tile->y0 + y) * stack->width + tile->x0;
		for (uint32_t x = 0; x < tile->width; x++) {
			has_cells |= cell[x >> k] < INFINITY;
			weight[x] = cell[x >> k] * t->scale[k] + t->offset[k] < z[x] ? 0 : weight[x];
		}
	}
	return has_cells;
}

/* Samples of level 0 leave no pixel out but for rounding, and then a single one: the guard takes pixels that lie behind at
 * least seven of their eight neighbours, where those are one surface: within one threshold of each other, since deep in a
 * crevice there may be anything; but within that of a coarser level where the pixel is empty, since what is seen through a
 * model is seldom one pixel wide. */
#define ALIKE 1
#define ALIKE_BEFORE_NOTHING 4

static uint32_t guard_row(const struct gaps_target *t, const struct gaps_tile *tile, uint32_t y, uint16_t *weight)
{
	const float scale = t->scale[1], offset = t->offset[1];
	const float alike = t->scale[ALIKE], alike_offset = t->offset[ALIKE];
	const float nothing = t->scale[ALIKE_BEFORE_NOTHING], nothing_offset = t->offset[ALIKE_BEFORE_NOTHING];
	const float *above = &tile->z[y][TILE_LEFT], *own = above + TILE_STRIDE, *below = own + TILE_STRIDE;
	uint32_t n_pinholes = 0;

	if (!(tile->has_samples[y] | tile->has_samples[y + 2]))
		return 0;
	/* Most rows have none: one of the two beside it lies before a pinhole, and one of those above and below. Where cells cover
	 * the pixel already, nothing is left to take. */
	for (uint32_t x = 0; x < tile->width; x++) {
		const float side = own[(int32_t)x - 1] < own[x + 1] ? own[(int32_t)x - 1] : own[x + 1];
		const float line = above[x] < below[x] ? above[x] : below[x];
		const float later = side < line ? line : side;
		n_pinholes |= (later * scale + offset < own[x]) & (weight[x] > 0);
	}
	if (!n_pinholes)
		return 0;
	n_pinholes = 0;
	for (uint32_t x = 0; x < tile->width; x++) {
		const int32_t left = (int32_t)x - 1, right = (int32_t)x + 1;
		const float z[8] = { above[left], above[x], above[right], own[left], own[right], below[left], below[x], below[right] };
		float nearest = INFINITY, farthest = 0;
		int32_t n_before = 0;
		for (int i = 0; i < 8; i++) {
			const int32_t is_before = z[i] * scale + offset < own[x];
			const float seen = is_before ? z[i] : 0;
			n_before += is_before;
			nearest = z[i] < nearest ? z[i] : nearest;
			farthest = seen > farthest ? seen : farthest;
		}
		const float limit = nearest * alike + alike_offset, limit_before_nothing = nearest * nothing + nothing_offset;
		const int32_t is_pinhole = (weight[x] > 0) & (n_before >= 7) & (farthest <= (own[x] < INFINITY ? limit : limit_before_nothing));
		weight[x] = is_pinhole ? 0 : weight[x];
		n_pinholes += (uint32_t)is_pinhole;
	}
	return n_pinholes;
}

static struct gaps_counts gaps(const struct gaps_target *t, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1, uint8_t *marks)
{
	struct gaps_tile tile = { .x0 = x0, .y0 = y0, .width = x1 - x0, .height = y1 - y0 };
	struct gaps_counts counts = { 0, 0, 0 };
	const uint32_t stride = t->stack->width;
	int has_cells = 0;
	load_depths(&tile, t->stack);
	for (uint32_t y = y0; y < y1; y++)
		for (uint32_t x = x0; x < x1; x++)
			t->weight[(size_t)y * stride + x] = GAPS_WHOLE;
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++)
		if (t->stack->levels >> k & 1)
			has_cells |= t->opaque_cells ? cover_opaque(t, &tile, k) : cover_level(t, &tile, k);
	for (uint32_t y = 0; y < tile.height; y++)
		counts.n_pinholes += guard_row(t, &tile, y, t->weight + (size_t)(y0 + y) * stride + x0);

	memset(marks, 0, GAPS_WIDTH / GAPS_BRICK);
	for (uint32_t brick = 0; (has_cells || counts.n_pinholes) && brick < GAPS_WIDTH / GAPS_BRICK; brick++) {
		const uint32_t first = brick * GAPS_BRICK, end = first + GAPS_BRICK < tile.width ? first + GAPS_BRICK : tile.width;
		uint32_t is_marked = 0;
		for (uint32_t y = 0; y < tile.height; y++) {
			const uint16_t *weight = t->weight + (size_t)(y0 + y) * stride + x0;
			const float *z = &tile.z[y + 1][TILE_LEFT];
			for (uint32_t x = first; x < end; x++) {
				const uint32_t is_partial = weight[x] < GAPS_WHOLE;
				is_marked |= is_partial;
				counts.n_partial += is_partial & (z[x] < INFINITY);
			}
		}
		marks[brick] = (uint8_t)is_marked;
		counts.n_marked += is_marked;
	}
	return counts;
}

/* Finding gaps as [G] 4.6 does: by cells of the depth buffers, bilinear or as opaque squares. */
#include "gaps_tile.h"

#define MAX_CELLS (GAPS_WIDTH / 2 + 2)

/* Depths beyond which the cells of a row cover pixels, repeated for each pixel: `own`, by the cells; `either`, by the
 * cells or the four cells of the next finer level in each. */
struct limits {
	float own[MAX_SPREAD + 2 * SPREAD_RUN], either[MAX_SPREAD + 2 * SPREAD_RUN];
	uint32_t i, j, n; /* cells from (i, j), which counts from the guard band's corner */
	int32_t is_empty, has_either;
};

static void find_limits(struct limits *to, const struct gaps_target *t, int k, uint32_t i, uint32_t j, uint32_t n)
{
	const float *cell = t->stack->level[k].z + (size_t)j * t->stack->level[k].width + i;
	const float scale = t->scale[k], offset = t->offset[k];
	float once[MAX_CELLS + SPREAD_RUN];
	int32_t has_any = 0;

	for (uint32_t c = 0; c < n; c++) {
		once[c] = cell[c] * scale + offset;
		has_any |= cell[c] < INFINITY;
	}
	to->i = i;
	to->j = j;
	to->n = n;
	to->is_empty = !has_any;
	to->has_either = 0;
	if (has_any)
		spread(to->own, once, n, k);
	for (uint32_t x = has_any ? n << k : 0; x < GAPS_WIDTH + (2u << k); x++)
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
	float children[2 * MAX_CELLS], once[MAX_CELLS + SPREAD_RUN];
	if (to->has_either)
		return;
	to->has_either = 1;
	children[0] = children[2 * n - 1] = INFINITY;
	const float *cell = stack->level[k].z + (size_t)to->j * stack->level[k].width + to->i;
	for (uint32_t c = 0; c < n; c++)
		once[c] = cell[c] * t->scale[k] + t->offset[k];
	for (uint32_t v = to->j ? 2 * to->j - 1 : 0; v <= 2 * to->j && v < height; v++) {
		const float *fine = stack->level[k - 1].z + (size_t)v * width + u0;

		for (uint32_t c = 0; c < n_children; c++)
			children[before + c] = fine[c] * scale + offset;
		for (uint32_t c = 0; c < n; c++) {
			const float a = children[2 * c], b = children[2 * c + 1], two = a < b ? a : b;

			once[c] = two < once[c] ? two : once[c];
		}
	}
	spread(to->either, once, n, k);
	for (uint32_t x = n << k; x < GAPS_WIDTH + (2u << k); x++)
		to->either[x] = INFINITY;
}

/* A level, as a row of pixels sees it. */
struct gaps_level {
	struct limits limits[2], *upper, *lower;
	int k;
	float left[GAPS_WIDTH], right[GAPS_WIDTH]; /* shares of the cells on either side, half pixels; sum 2^(k+1) */
};

static void begin_level(struct gaps_level *level, int k)
{
	level->k = k;
	level->upper = &level->limits[0];
	level->lower = &level->limits[1];
	for (uint32_t x = 0; x < GAPS_WIDTH; x++) {
		const int32_t right = (int32_t)((2 * x + 1 + (1u << k)) & ((2u << k) - 1));

		level->right[x] = (float)right;
		level->left[x] = (float)((2 << k) - right);
	}
}

/* Bilinear coverage of a row of pixels; `upper` and `lower` begin with the left neighbours of the first pixel. Exact:
 * shares are whole numbers, and their products multiples of a power of two that fit a float. */
static inline void cover_row(int32_t *cover, const float *z, const float *upper, const float *lower,
                             const struct gaps_level *level, int32_t fy)
{
	const int k = level->k;
	const uint32_t step = 1u << k;
	const float unit = (float)GAPS_WHOLE / (float)(4 << 2 * k), below = (float)fy * unit,
				above = (float)((2 << k) - fy) * unit;

	for (uint32_t x = 0; x < GAPS_WIDTH; x++) {
		const float left = level->left[x], right = level->right[x], depth = z[x];
		const float high = psr_where(upper[x] < depth, left) + psr_where(upper[x + step] < depth, right);
		const float low = psr_where(lower[x] < depth, left) + psr_where(lower[x + step] < depth, right);

		cover[x] = (int32_t)(high * above + low * below);
	}
}

/* Lowers the weights of row y by a level's coverage; returns 0 if the level has no cells there.
 *
 * Where a surface passes from blocks of one level to blocks of the next within a pixel's neighbourhood, neither level
 * covers it whole ([G] 9.1.2). Where the coarser one covers a part of a pixel, coverage is by the coarser cells that
 * either level fills: not the sum, which would count a surface twice where blocks of both levels hold it. */
static int cover_level(int32_t *weight, struct gaps_level *level, const struct gaps_target *t,
                       const struct gaps_tile *tile, uint32_t y)
{
	const int k = level->k;
	const int has_finer = k > 1 && (t->stack->levels >> (k - 1) & 1);
	const uint32_t half = 1u << (k - 1), i = tile->x0 >> k, n_cells = ((tile->width - 1 + half) >> k) + 2;
	const uint32_t from_top = 2 * (tile->y0 + y) + 1 + (1u << k); /* a cell further down, to stay above 0 */
	const uint32_t j = from_top >> (k + 1);
	const int32_t fy = (int32_t)(from_top & ((2u << k) - 1));
	const float *z = gaps_row(tile, (int32_t)y);

	_Alignas(64) int32_t cover[GAPS_WIDTH], either[GAPS_WIDTH];
	if (y == 0)
		find_limits(level->lower, t, k, i, j, n_cells);
	if (y == 0 || fy == 1) {
		struct limits *was = level->upper;

		level->upper = level->lower;
		level->lower = was;
		find_limits(level->lower, t, k, i, j + 1, n_cells);
	}
	struct limits *upper = level->upper, *lower = level->lower;
	if (upper->is_empty && lower->is_empty)
		return 0;
	cover_row(cover, z, upper->own + half, lower->own + half, level, fy);
	if (has_finer) {
		find_either(upper, t, k);
		find_either(lower, t, k);
		cover_row(either, z, upper->either + half, lower->either + half, level, fy);
		for (uint32_t x = 0; x < GAPS_WIDTH; x++)
			cover[x] = cover[x] > 0 && cover[x] < GAPS_WHOLE ? either[x] : cover[x];
	}
	for (uint32_t x = 0; x < GAPS_WIDTH; x++) {
		const int32_t left = GAPS_WHOLE - cover[x];

		weight[x] = left < weight[x] ? left : weight[x];
	}
	return 1;
}

/* As cover_level, by opaque squares. */
static int cover_opaque(int32_t *weight, const struct gaps_target *t, const struct gaps_tile *tile, int k, uint32_t y)
{
	const struct psr_zstack *stack = t->stack;
	const float *cell =
		stack->level[k].z + (size_t)(((tile->y0 + y) >> k) + 1) * stack->level[k].width + (tile->x0 >> k) + 1;
	const float *z = gaps_row(tile, (int32_t)y);
	int has_cells = 0;

	for (uint32_t x = 0; x < tile->width; x++) {
		has_cells |= cell[x >> k] < INFINITY;
		weight[x] = cell[x >> k] * t->scale[k] + t->offset[k] < z[x] ? 0 : weight[x];
	}
	return has_cells;
}

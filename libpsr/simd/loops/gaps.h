/* Finding gaps ([G] 4.6): coverage of pixels by cells, and the guard against pinholes. */
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "simd/gaps.h"

#define GAPS_STRIDE (GAPS_WIDTH + 32) /* a column of neighbors on each side, and aligned rows */
#define GAPS_LEFT 16
#define MAX_CELLS (GAPS_WIDTH / 2 + 2)
#define MAX_SPREAD (GAPS_WIDTH + 2 * (1 << PSR_MAX_DEPTH_LEVEL))
#define SPREAD_RUN 16 /* values repeated together: arrays have room for one run more */

/* Depths of a piece of the picture and of the pixels around it, +inf outside of the picture. Loops cover all GAPS_WIDTH
 * columns. */
struct gaps_tile {
	_Alignas(64) float z[GAPS_BRICK + 2][GAPS_STRIDE];
	int32_t has_samples[GAPS_BRICK + 2]; /* by row */
	uint32_t x0, y0, width, height;
};

static inline float depth_of(uint64_t word)
{
	return psr_float_from_bits((uint32_t)(word >> 32));
}

static void load_depths(struct gaps_tile *tile, const struct psr_zstack *stack)
{
	for (uint32_t i = 0; i < tile->height + 2; i++) {
		float *z = &tile->z[i][GAPS_LEFT];
		int32_t has_samples = 0;
		const int is_inside = tile->y0 + i >= 1 && tile->y0 + i <= stack->height;
		const uint64_t *word = psr_zstack_row(stack, is_inside ? tile->y0 + i - 1 : 0) + tile->x0;
		const uint32_t n = is_inside ? tile->width : 0;

		for (uint32_t x = 0; x < n; x++)
			z[x] = depth_of(word[x]);
		for (uint32_t x = n; x <= GAPS_WIDTH; x++)
			z[x] = INFINITY;
		z[-1] = is_inside && tile->x0 ? depth_of(*(word - 1)) : INFINITY;
		if (is_inside && tile->x0 + n < stack->width)
			z[n] = depth_of(word[n]);
		for (uint32_t x = 0; x < GAPS_WIDTH; x++)
			has_samples |= z[x] < INFINITY;
		tile->has_samples[i] = has_samples | (z[-1] < INFINITY) | (z[GAPS_WIDTH] < INFINITY);
	}
}

/* Depths beyond which the cells of a row cover pixels, repeated for each pixel: `own`, by the cells; `either`, by the
 * cells or the four cells of the next finer level in each. */
struct limits {
	float own[MAX_SPREAD + 2 * SPREAD_RUN], either[MAX_SPREAD + 2 * SPREAD_RUN];
	uint32_t i, j, n; /* cells from (i, j), which counts from the guard band's corner */
	int32_t is_empty, has_either;
};

static inline void repeat(float *to, const float *from, uint32_t n)
{
	for (uint32_t first = 0; first < n; first += SPREAD_RUN)
		for (uint32_t i = first; i < first + SPREAD_RUN; i++)
			to[2 * i] = to[2 * i + 1] = from[i];
}

/* Repeats each of n values 2^k times. */
static void spread(float *to, const float *from, uint32_t n, int k)
{
	float some[2][MAX_SPREAD / 2 + 2 * SPREAD_RUN];

	for (; k > 1; k--, n *= 2) {
		float *twice = some[k & 1];

		repeat(twice, from, n);
		from = twice;
	}
	repeat(to, from, n);
}

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
	const float *z = &tile->z[y + 1][GAPS_LEFT];

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
	const float *z = &tile->z[y + 1][GAPS_LEFT];
	int has_cells = 0;

	for (uint32_t x = 0; x < tile->width; x++) {
		has_cells |= cell[x >> k] < INFINITY;
		weight[x] = cell[x >> k] * t->scale[k] + t->offset[k] < z[x] ? 0 : weight[x];
	}
	return has_cells;
}

/* Samples of level 0 miss a pixel only by rounding, and then a single one. The guard closes pixels behind at least
 * seven of their eight neighbours, if those are one surface: within level ALIKE's threshold of each other, since a
 * crevice may be deep; within a coarser level's where the pixel is empty, since an opening through a model is seldom
 * one pixel wide. */
#define ALIKE 1
#define ALIKE_BEFORE_NOTHING 4
#define GUARD_RUN 32

static uint32_t guard_run(int32_t *weight, const struct gaps_target *t, const float *above, const float *own,
                          const float *below)
{
	const float scale = t->scale[1], offset = t->offset[1];
	const float alike = t->scale[ALIKE], alike_offset = t->offset[ALIKE];
	const float nothing = t->scale[ALIKE_BEFORE_NOTHING], nothing_offset = t->offset[ALIKE_BEFORE_NOTHING];
	int32_t n_pinholes = 0;

	for (int x = 0; x < GUARD_RUN; x++) {
		const float z[8] = { above[x - 1], above[x],     above[x + 1], own[x - 1],
			                 own[x + 1],   below[x - 1], below[x],     below[x + 1] };
		float nearest = INFINITY, farthest = 0;
		int32_t n_before = 0;

		for (int i = 0; i < 8; i++) {
			const int32_t is_before = z[i] * scale + offset < own[x];
			const float seen = psr_where(is_before, z[i]);

			n_before += is_before;
			nearest = z[i] < nearest ? z[i] : nearest;
			farthest = seen > farthest ? seen : farthest;
		}
		const float limit = nearest * alike + alike_offset, limit_before_nothing = nearest * nothing + nothing_offset;
		const int32_t is_alike = farthest <= psr_choose(own[x] < INFINITY, limit, limit_before_nothing);
		const int32_t is_pinhole = (weight[x] > 0) & (n_before >= 7) & is_alike;
		weight[x] = is_pinhole ? 0 : weight[x];
		n_pinholes += is_pinhole;
	}
	return (uint32_t)n_pinholes;
}

/* A quick test, since most runs have none: left or right, and above or below, a neighbour lies before a pinhole. Pixels
 * that cells cover whole have no weight to lose. */
static inline int32_t may_have_pinholes(const int32_t *weight, const struct gaps_target *t, const float *above,
                                        const float *own, const float *below)
{
	const float scale = t->scale[1], offset = t->offset[1];
	int32_t is_near = 0;

	for (int x = 0; x < GUARD_RUN; x++) {
		const float side = own[x - 1] < own[x + 1] ? own[x - 1] : own[x + 1],
					line = above[x] < below[x] ? above[x] : below[x];
		const float later = side < line ? line : side;

		is_near |= (later * scale + offset < own[x]) & (weight[x] > 0);
	}
	return is_near;
}

static uint32_t guard_row(int32_t *weight, const struct gaps_target *t, const struct gaps_tile *tile, uint32_t y)
{
	uint32_t n_pinholes = 0;

	if (!(tile->has_samples[y] | tile->has_samples[y + 2]))
		return 0;
	for (uint32_t x = 0; x < tile->width; x += GUARD_RUN) {
		const float *above = &tile->z[y][GAPS_LEFT + x], *own = above + GAPS_STRIDE, *below = own + GAPS_STRIDE;

		if (may_have_pinholes(weight + x, t, above, own, below))
			n_pinholes += guard_run(weight + x, t, above, own, below);
	}
	return n_pinholes;
}

static struct gaps_counts gaps(const struct gaps_target *t, uint32_t x0, uint32_t x1, uint32_t y0, uint32_t y1,
                               uint8_t *marks)
{
	struct gaps_tile tile = { .x0 = x0, .y0 = y0, .width = x1 - x0, .height = y1 - y0 };
	struct gaps_level level[PSR_MAX_DEPTH_LEVEL + 1];
	struct gaps_counts counts = { 0, 0, 0 };

	_Alignas(64) int32_t is_marked[GAPS_WIDTH] = { 0 }, n_partial[GAPS_WIDTH] = { 0 };
	load_depths(&tile, t->stack);
	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL && !t->opaque_cells; k++)
		if (t->stack->levels >> k & 1)
			begin_level(&level[k], k);
	for (uint32_t y = 0; y < tile.height; y++) {
		uint16_t *to = t->weight + (size_t)(y0 + y) * t->stack->width + x0;
		const float *z = &tile.z[y + 1][GAPS_LEFT];

		_Alignas(64) int32_t weight[GAPS_WIDTH];
		int is_less = 0;
		for (uint32_t x = 0; x < GAPS_WIDTH; x++)
			weight[x] = GAPS_WHOLE;
		for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++)
			if (t->stack->levels >> k & 1)
				is_less |= t->opaque_cells ? cover_opaque(weight, t, &tile, k, y)
				                           : cover_level(weight, &level[k], t, &tile, y);
		const uint32_t n_pinholes = guard_row(weight, t, &tile, y);
		counts.n_pinholes += n_pinholes;
		for (uint32_t x = 0; x < tile.width; x++)
			to[x] = (uint16_t)weight[x];
		if (!is_less && !n_pinholes)
			continue;
		for (uint32_t x = 0; x < tile.width; x++) {
			const int32_t is_partial = weight[x] < GAPS_WHOLE;

			is_marked[x] |= is_partial;
			n_partial[x] += is_partial & (z[x] < INFINITY);
		}
	}
	for (uint32_t brick = 0; brick < GAPS_WIDTH / GAPS_BRICK; brick++) {
		int32_t is_any = 0, n = 0;

		for (uint32_t x = brick * GAPS_BRICK; x < (brick + 1) * GAPS_BRICK; x++) {
			is_any |= is_marked[x];
			n += n_partial[x];
		}
		marks[brick] = (uint8_t)is_any;
		counts.n_marked += (uint32_t)is_any;
		counts.n_partial += (uint32_t)n;
	}
	return counts;
}

/* Finding gaps by closing depths, as morphology closes shapes: each pixel takes the least depth in a square around it,
 * then the greatest of these in a square around it. On a plane, however steep, the second step takes back what the
 * first one took, so that a surface does not cover itself. Gaps close where every square holds a sample, and an edge
 * stays where its samples are. */
#include "gaps_tile.h"

/* Samples of level k are at most 2^k pixels apart, so that a square of 3 pixels on their surface holds one of level 1,
 * and a square of 5 one of level 2. Where samples of level 2 happen to be nearer to each other, squares of 3 hold one,
 * too, and close with the lower threshold; so they act near both levels. Else a surface of level 2 would let through
 * what is near behind it, or not, by whether blocks of level 1 are drawn there, which nobody sees. */
#define CLOSED_LEVELS 2

_Static_assert(2 * CLOSED_LEVELS <= GAPS_MARGIN, "two squares reach so far");

/* Finds the nearest of the 3x3 cells of level k around each pixel of row y: +inf where no sample of the level is near.
 * Returns whether any is finite. */
static int find_near(float *near, const struct gaps_target *t, const struct gaps_tile *tile, int k, uint32_t y)
{
	/* Not 32 bits: sums of indices that may wrap keep compilers from vectors. */
	const size_t stride = t->stack->level[k].width, n = ((tile->width - 1) >> k) + 1;
	const float *cell = t->stack->level[k].z + ((tile->y0 + y) >> k) * stride + (tile->x0 >> k);
	float least[GAPS_WIDTH / 2 + 2], once[GAPS_WIDTH / 2 + SPREAD_RUN];
	int32_t has_any = 0;

	for (size_t i = 0; i < n + 2; i++) {
		const float above = cell[i], own = cell[i + stride], below = cell[i + 2 * stride];
		const float two = above < own ? above : own;

		least[i] = two < below ? two : below;
	}
	for (size_t i = 0; i < n; i++) {
		const float two = least[i] < least[i + 1] ? least[i] : least[i + 1];

		once[i] = two < least[i + 2] ? two : least[i + 2];
		has_any |= once[i] < INFINITY;
	}
	if (has_any)
		spread(near, once, (uint32_t)n, k);
	return has_any;
}

/* The same for level k and coarser ones. */
static int find_near_from(float *near, const struct gaps_target *t, const struct gaps_tile *tile, int k, uint32_t y)
{
	float own[GAPS_WIDTH + 2 * SPREAD_RUN];
	int has_any = 0;

	for (uint32_t x = 0; x < GAPS_WIDTH; x++)
		near[x] = INFINITY;
	for (; k <= CLOSED_LEVELS; k++) {
		if (!(t->stack->levels >> k & 1) || !find_near(own, t, tile, k, y))
			continue;
		for (uint32_t x = 0; x < GAPS_WIDTH; x++)
			near[x] = own[x] < near[x] ? own[x] : near[x];
		has_any = 1;
	}
	return has_any;
}

/* Whether a sample of level k is near any pixel of the piece. */
static int is_near_any(const struct gaps_target *t, const struct gaps_tile *tile, int k)
{
	const size_t stride = t->stack->level[k].width, n = ((tile->width - 1) >> k) + 3;
	const uint32_t first = tile->y0 >> k, end = ((tile->y0 + tile->height - 1) >> k) + 3;
	float least = INFINITY;

	for (uint32_t j = first; j < end; j++) {
		const float *cell = t->stack->level[k].z + j * stride + (tile->x0 >> k);

		for (size_t i = 0; i < n; i++)
			least = cell[i] < least ? cell[i] : least;
	}
	return least < INFINITY;
}

/* The coarsest level to close that has samples near the piece, or 0. */
static int closed_level(const struct gaps_target *t, const struct gaps_tile *tile)
{
	int k = CLOSED_LEVELS;

	while (k > 0 && !(t->stack->levels >> k & 1 && is_near_any(t, tile, k)))
		k--;
	return k;
}

/* Of a row of the piece with its margin, the pixels that are in the picture: begin <= x < end. */
struct close_span {
	int32_t begin, end;
};

static struct close_span span_of(const struct gaps_target *t, const struct gaps_tile *tile, int32_t y)
{
	const int64_t v = (int64_t)tile->y0 + y, left = (int64_t)tile->x0, right = (int64_t)t->stack->width - left;

	if (v < 0 || v >= (int64_t)t->stack->height)
		return (struct close_span){ 0, 0 };
	return (struct close_span){ left < GAPS_MARGIN ? (int32_t)-left : -GAPS_MARGIN,
		                        right < GAPS_WIDTH + GAPS_MARGIN ? (int32_t)right : GAPS_WIDTH + GAPS_MARGIN };
}

/* Beyond the picture the guard band tells what is there, of level k and coarser ones. */
static float depth_beyond(const struct gaps_target *t, const struct gaps_tile *tile, int k, int32_t x, int32_t y)
{
	float least = INFINITY;

	for (; k <= CLOSED_LEVELS; k++) {
		const int64_t i = (((int64_t)tile->x0 + x) >> k) + 1, j = (((int64_t)tile->y0 + y) >> k) + 1;
		const int64_t width = t->stack->level[k].width, height = t->stack->level[k].height;

		if (!(t->stack->levels >> k & 1) || i < 0 || j < 0 || i >= width || j >= height)
			continue;
		const float z = t->stack->level[k].z[j * width + i];
		least = z < least ? z : least;
	}
	return least;
}

/* Returns the depths of a row with its margin, in `copy` where some lie beyond the picture. */
static const float *depths_of(const struct gaps_target *t, const struct gaps_tile *tile, int k, int32_t y,
                              float copy[GAPS_STRIDE])
{
	const struct close_span in = span_of(t, tile, y);
	const float *row = gaps_row(tile, y);

	if (in.begin == -GAPS_MARGIN && in.end == GAPS_WIDTH + GAPS_MARGIN)
		return row;
	memcpy(copy, row - GAPS_LEFT, GAPS_STRIDE * sizeof *copy);
	for (int32_t x = -GAPS_MARGIN; x < in.begin; x++)
		copy[GAPS_LEFT + x] = depth_beyond(t, tile, k, x, y);
	for (int32_t x = in.end; x < GAPS_WIDTH + GAPS_MARGIN; x++)
		copy[GAPS_LEFT + x] = depth_beyond(t, tile, k, x, y);
	return copy + GAPS_LEFT;
}

static inline void least_beside(float *to, const float *from, int32_t begin, int32_t end, int reach)
{
	for (int32_t x = begin; x < end; x++) {
		float least = from[x];

		for (int u = 1; u <= reach; u++) {
			const float side = from[x - u] < from[x + u] ? from[x - u] : from[x + u];

			least = side < least ? side : least;
		}
		to[x] = least;
	}
}

static inline void greatest_beside(float *to, const float *from, int32_t begin, int32_t end, int reach)
{
	for (int32_t x = begin; x < end; x++) {
		float greatest = from[x];

		for (int u = 1; u <= reach; u++) {
			const float side = from[x - u] > from[x + u] ? from[x - u] : from[x + u];

			greatest = side > greatest ? side : greatest;
		}
		to[x] = greatest;
	}
}

/* The last 2 reach + 1 rows, in any order. */
struct close_rows {
	_Alignas(64) float row[2 * CLOSED_LEVELS + 1][GAPS_STRIDE];
};

static inline void least_of_rows(float *to, const struct close_rows *rows, int32_t begin, int32_t end, int reach)
{
	for (int32_t x = begin; x < end; x++) {
		float least = rows->row[0][GAPS_LEFT + x];

		for (int r = 1; r <= 2 * reach; r++) {
			const float other = rows->row[r][GAPS_LEFT + x];

			least = other < least ? other : least;
		}
		to[x] = least;
	}
}

static inline void greatest_of_rows(float *to, const struct close_rows *rows, int32_t begin, int32_t end, int reach)
{
	for (int32_t x = begin; x < end; x++) {
		float greatest = rows->row[0][GAPS_LEFT + x];

		for (int r = 1; r <= 2 * reach; r++) {
			const float other = rows->row[r][GAPS_LEFT + x];

			greatest = other > greatest ? other : greatest;
		}
		to[x] = greatest;
	}
}

/* Where nothing is known beyond the picture, nothing opens its border. */
static void forget_beyond(float *least, const struct gaps_target *t, const struct gaps_tile *tile, int reach, int32_t y)
{
	const struct close_span in = span_of(t, tile, y);

	for (int32_t x = -reach; x < in.begin; x++)
		least[x] = least[x] < INFINITY ? least[x] : 0;
	for (int32_t x = in.end; x < GAPS_WIDTH + reach; x++)
		least[x] = least[x] < INFINITY ? least[x] : 0;
}

/* Lowers the limits of the piece's pixels by level k, with squares of 2 reach + 1 pixels. */
static inline __attribute__((always_inline)) void close_level(float (*limit)[GAPS_WIDTH], const struct gaps_target *t,
                                                              const struct gaps_tile *tile, int k, int reach)
{
	const int32_t n_rows = 2 * reach + 1, margin = 2 * reach, height = (int32_t)tile->height;
	const float scale = t->scale[k - 1], offset = t->offset[k - 1];
	struct close_rows lesser, greater;
	float near[GAPS_WIDTH + 2 * SPREAD_RUN];
	int has_near = 0;

	for (int32_t y = -margin; y < height + margin; y++) {
		_Alignas(64) float copy[GAPS_STRIDE], least[GAPS_STRIDE], greatest[GAPS_WIDTH];
		const int32_t at = (y + margin) % n_rows, around = y - reach, own = y - 2 * reach;

		least_beside(lesser.row[at] + GAPS_LEFT, depths_of(t, tile, k, y, copy), -reach, GAPS_WIDTH + reach, reach);
		if (around < -reach)
			continue;
		least_of_rows(least + GAPS_LEFT, &lesser, -reach, GAPS_WIDTH + reach, reach);
		forget_beyond(least + GAPS_LEFT, t, tile, reach, around);
		greatest_beside(greater.row[at] + GAPS_LEFT, least + GAPS_LEFT, 0, GAPS_WIDTH, reach);
		if (own < 0)
			continue;
		if (own % (1 << k) == 0)
			has_near = find_near_from(near, t, tile, k, (uint32_t)own);
		if (!has_near)
			continue;
		greatest_of_rows(greatest, &greater, 0, GAPS_WIDTH, reach);
		for (uint32_t x = 0; x < tile->width; x++) {
			const float own_limit = psr_choose(near[x] < INFINITY, greatest[x] * scale + offset, INFINITY);

			limit[own][x] = own_limit < limit[own][x] ? own_limit : limit[own][x];
		}
	}
}

/* Finds the depths beyond which a piece's pixels lie behind a surface of levels up to `coarsest`. */
static void close_piece(float (*limit)[GAPS_WIDTH], const struct gaps_target *t, const struct gaps_tile *tile,
                        int coarsest)
{
	for (uint32_t y = 0; y < GAPS_BRICK; y++)
		for (uint32_t x = 0; x < GAPS_WIDTH; x++)
			limit[y][x] = INFINITY;
	close_level(limit, t, tile, 1, 1);
	if (coarsest == 2)
		close_level(limit, t, tile, 2, 2);
}

/* Takes the weight of a row's pixels beyond their limits. Returns whether there are any. */
static int cover_closed(int32_t *weight, const float *limit, const float *z)
{
	int32_t is_any = 0;

	for (uint32_t x = 0; x < GAPS_WIDTH; x++) {
		const int32_t is_gap = limit[x] < z[x];

		weight[x] = is_gap ? 0 : weight[x];
		is_any |= is_gap;
	}
	return is_any;
}

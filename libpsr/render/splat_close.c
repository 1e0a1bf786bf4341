/* Closes holes between discs. */
#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "base/direction.h"
#include "base/vec.h"
#include "block.h"
#include "splat.h"

/* Cells to look at on each side of a pixel's own: a gap in a full row of cells is narrower than two of them. */
#define GAP 1
/* Pixels to look at on each side of an empty one between magnified samples: a window's margin has as many. */
#define MOST_ACROSS 64
/* Sine of the angle below which a surface is seen steeply from the side. Measured. */
#define STEEP 0.2f
#define CELLS_AROUND (HOLES_CELLS + 2 * GAP)

/* Eight directions: each, then its opposite. */
static const int8_t way[8][2] = {
	{ -1, 0 }, { 1, 0 }, { 0, -1 }, { 0, 1 }, { -1, -1 }, { 1, 1 }, { 1, -1 }, { -1, 1 },
};

static float depth_at(const struct psr_zstack *stack, int64_t x, int64_t y)
{
	if (x < 0 || y < 0 || x >= (int64_t)stack->width || y >= (int64_t)stack->height)
		return INFINITY;
	return psr_float_from_bits((uint32_t)(psr_zstack_row(stack, (uint32_t)y)[x] >> 32));
}

/* Returns how many pixels away, at most `reach`, something is nearer than z by more than level 1's threshold, or 0. */
static inline int steps_to(const struct splat_picture *s, uint32_t x, uint32_t y, float z, const int8_t *step,
                           int reach)
{
	const float scale = s->plan->gap_scale[1], offset = s->plan->gap_offset[1];
	int64_t u = x, v = y;

	for (int i = 1; i <= reach; i++) {
		u += step[0];
		v += step[1];
		if (depth_at(s->stack, u, v) * scale + offset < z)
			return i;
	}
	return 0;
}

/* The sample that a pixel shows. */
struct shown {
	const struct plan_instance *in;
	uint32_t block, sample;
};

static struct shown find_shown(const struct splat_picture *s, int64_t x, int64_t y)
{
	const uint32_t id = (uint32_t)psr_zstack_row(s->stack, (uint32_t)y)[x], slot = id / PSR_BLOCK_SAMPLES;
	const struct plan_instance *in = &s->plan->instance[plan_find_instance(s->plan, slot)];

	return (struct shown){ in, slot - in->first_slot, id % PSR_BLOCK_SAMPLES };
}

/* Finds the normal of the sample that a pixel shows, in camera space. */
static void find_normal(float n[3], const struct splat_picture *s, int64_t x, int64_t y)
{
	const struct shown shown = find_shown(s, x, y);
	const struct psr_blocks *b = shown.in->cull.blocks;
	const struct psr_cubes *cubes = shown.in->cull.cubes;
	const struct psr_points *points = shown.in->cull.points;
	const uint64_t attr = cubes != NULL    ? psr_cubes_sample(cubes, shown.block, shown.sample)
	                      : points != NULL ? psr_points_sample(points, shown.block, shown.sample)
	                                       : block_attr(b, shown.block, shown.sample);
	const float *inner = psr_direction_table()[PSR_ATTR_NORMAL(attr)];

	for (int a = 0; a < 3; a++)
		n[a] = (float)(shown.in->turn[a][0] * (double)inner[0] + shown.in->turn[a][1] * (double)inner[1]
		               + shown.in->turn[a][2] * (double)inner[2]);
}

/* Whether one surface, nearer than the pixel, is within `reach` pixels of it in all eight directions. */
static int is_enclosed(const struct splat_picture *s, uint32_t x, uint32_t y, int reach)
{
	const float z = depth_at(s->stack, x, y);
	float nearest = INFINITY, farthest = 0;

	for (int w = 0; w < 8; w++) {
		const int steps = steps_to(s, x, y, z, way[w], reach);
		const int64_t u = (int64_t)x + steps * way[w][0], v = (int64_t)y + steps * way[w][1];

		if (!steps)
			return 0;
		const float other = depth_at(s->stack, u, v);
		nearest = other < nearest ? other : nearest;
		farthest = other > farthest ? other : farthest;
	}
	return farthest <= nearest * s->plan->gap_scale[4] + s->plan->gap_offset[4];
}

/* Whether the pixel is empty and between samples in two opposite directions, at most `reach` pixels away. */
static int is_crossed(const struct splat_picture *s, uint32_t x, uint32_t y, int reach)
{
	if (depth_at(s->stack, x, y) < INFINITY)
		return 0;
	for (int w = 0; w < 8; w += 2)
		if (steps_to(s, x, y, INFINITY, way[w], reach) && steps_to(s, x, y, INFINITY, way[w + 1], reach))
			return 1;
	return 0;
}

/* Whether one surface may continue from pixel a to pixel b: their depths differ by at most the level's threshold, and
 * the angle between their normals is less than 90 degrees. Two surfaces that end at a gap turn away from each other. */
static int is_continued(const struct splat_picture *s, int level, const int64_t a[2], const int64_t b[2])
{
	const float z[2] = { depth_at(s->stack, a[0], a[1]), depth_at(s->stack, b[0], b[1]) };
	const float nearer = z[0] < z[1] ? z[0] : z[1], farther = z[0] < z[1] ? z[1] : z[0];
	float n[2][3];

	if (farther > nearer * s->plan->gap_scale[level] + s->plan->gap_offset[level])
		return 0;
	find_normal(n[0], s, a[0], a[1]);
	find_normal(n[1], s, b[0], b[1]);
	return v3f_dot(n[0], n[1]) > 0;
}

/* Whether the pixel is in a gap as narrow as a crack between samples. A cell of the level is one to two samples wide. A
 * crack is at most half a cell wide where one surface continues across it, five eighths if it is so narrow in every
 * direction, and three sixteenths, or a pixel, anywhere. Measured: with three cells in any case, a chair whose samples
 * are half a pixel apart loses 6 dB, since the gaps between its spindles close. */
static int is_narrow(const struct splat_picture *s, uint32_t x, uint32_t y, int level)
{
	const float z = depth_at(s->stack, x, y);
	const int cell = 1 << level, least = cell < 16 ? 1 : cell * 3 / 16;
	int n_narrow = 0;

	for (int w = 0; w < 8; w += 2) {
		const int before = steps_to(s, x, y, z, way[w], cell);
		const int after = before ? steps_to(s, x, y, z, way[w + 1], cell) : 0;
		const int halves = (before + after - 1) * (w < 4 ? 2 : 3); /* half pixels: a diagonal's steps are longer */
		const int64_t a[2] = { (int64_t)x + before * way[w][0], (int64_t)y + before * way[w][1] };
		const int64_t b[2] = { (int64_t)x + after * way[w + 1][0], (int64_t)y + after * way[w + 1][1] };

		if (!after || 4 * halves > 5 * cell)
			continue;
		if (halves <= 2 * least || (halves <= cell && is_continued(s, level, a, b)) || ++n_narrow == 4)
			return 1;
	}
	return 0;
}

static int is_inside(const struct splat_picture *s, uint32_t x, uint32_t y)
{
	const struct inside *inside = s->inside;

	if (inside == NULL)
		return 0;
	const uint32_t u = (inside->left + x) >> inside->pass, v = (inside->top + y) >> inside->pass;
	return inside->is_inside[(size_t)v * inside->width + u];
}

static int is_offcut(const struct splat_picture *s, uint32_t x, uint32_t y)
{
	return s->offcuts.bits != NULL && s->offcuts.bits[(size_t)y * s->offcuts.stride + x / 8] >> x % 8 & 1;
}

/* Whether a pixel's surface is seen so much from the side that the object's outline is near. */
static int is_steep(const struct splat_picture *s, const int64_t at[2])
{
	float n[3];

	find_normal(n, s, at[0], at[1]);
	return __builtin_fabsf(n[2]) < STEEP;
}

/* Whether an offcut's pixel lies in a seam, where another block continues the surface: it is between two places of the
 * surface, at most a cell apart, along two lines. Along one line so is a notch of an edge that samples draw as zigzag.
 * One line is enough at a steep place, where the surface goes on out of sight, and of an empty pixel well inside of the
 * object. */
static int is_seam(const struct splat_picture *s, uint32_t x, uint32_t y, int level)
{
	const float z = depth_at(s->stack, x, y);
	const int cell = 1 << level, is_solid = !(z < INFINITY) && is_inside(s, x, y);
	int n_left = is_solid ? 1 : 2; /* lines to find */

	for (int w = 0; w < 8 && n_left > 0; w += 2) {
		const int before = steps_to(s, x, y, z, way[w], cell);
		const int after = before ? steps_to(s, x, y, z, way[w + 1], cell) : 0;
		const int halves = (before + after - 1) * (w < 4 ? 2 : 3);
		const int64_t a[2] = { (int64_t)x + before * way[w][0], (int64_t)y + before * way[w][1] };
		const int64_t b[2] = { (int64_t)x + after * way[w + 1][0], (int64_t)y + after * way[w + 1][1] };

		if (after && halves <= 2 * cell && (is_solid || is_continued(s, level, a, b)))
			n_left -= 1 + (is_steep(s, a) || is_steep(s, b));
	}
	return n_left <= 0;
}

/* Finds the nearest z' of n cells from (i, j) on, of their level's samples and of finer levels'. (0, 0) is the guard
 * band's corner; cells beyond the guard band are empty. */
static void find_nearest(float *nearest, const struct psr_zstack *stack, int k, int64_t i, int64_t j, uint32_t n)
{
	const int64_t width = stack->level[k].width, height = stack->level[k].height;

	for (uint32_t c = 0; c < n; c++)
		nearest[c] = INFINITY;
	if (j < 0 || j >= height)
		return;
	for (uint32_t c = 0; c < n; c++)
		if (i + c >= 0 && i + c < width)
			nearest[c] = stack->level[k].z[j * width + i + c];
	for (int f = k - 1; f > 0; f--) {
		const int64_t fine_width = stack->level[f].width, fine_height = stack->level[f].height;
		const int64_t x = (i - 1) * (1 << (k - f)) + 1, y = (j - 1) * (1 << (k - f)) + 1;

		if (!(stack->levels >> f & 1))
			continue;
		for (int64_t v = y < 0 ? 0 : y; v < y + (1 << (k - f)) && v < fine_height; v++)
			for (int64_t u = x < 0 ? 0 : x; u < x + ((int64_t)n << (k - f)) && u < fine_width; u++) {
				float *to = &nearest[(u - x) >> (k - f)];
				const float z = stack->level[f].z[v * fine_width + u];

				*to = z < *to ? z : *to;
			}
	}
}

/* Finds which of n cells from (i, j) on have samples of their own level in them or beside them. */
static void find_own(uint8_t *is_near, const struct psr_zstack *stack, int k, uint32_t i, uint32_t j, uint32_t n)
{
	const uint32_t width = stack->level[k].width;

	memset(is_near, 0, n);
	for (uint32_t v = j - 1; v <= j + 1; v++) {
		const float *z = stack->level[k].z + (size_t)v * width + i;

		for (uint32_t c = 0; c < n; c++)
			is_near[c] |= (z[(int32_t)c - 1] < INFINITY) | (z[c] < INFINITY) | (z[c + 1] < INFINITY);
	}
}

/* Fills in n cells from (i, j) on, which lie inside the guard band. */
static void find_cells(struct hole_cells *to, const struct splat_picture *s, int k, uint32_t i, uint32_t j, uint32_t n)
{
	float nearest[CELLS_AROUND], farthest[CELLS_AROUND];
	const uint32_t n_around = n + 2 * GAP;

	find_own(to->is_near, s->stack, k, i, j, n);
	to->has_any = 0;
	for (uint32_t c = 0; c < n; c++)
		to->has_any |= to->is_near[c];
	if (!to->has_any)
		return;
	memset(farthest, 0, sizeof farthest);
	for (int v = -GAP; v <= GAP; v++) {
		find_nearest(nearest, s->stack, k, (int64_t)i - GAP, (int64_t)j + v, n_around);
		for (uint32_t c = 0; c < n_around; c++)
			farthest[c] = nearest[c] > farthest[c] ? nearest[c] : farthest[c];
	}
	for (uint32_t c = 0; c < n; c++) {
		float all = farthest[c];

		for (uint32_t u = 1; u <= 2 * GAP; u++)
			all = farthest[c + u] > all ? farthest[c + u] : all;
		to->limit[c] = all * s->plan->gap_scale[k] + s->plan->gap_offset[k];
	}
}

/* Whether a pixel well inside the plain frame's object lies in a crack. */
static int is_crack(const struct splat_picture *s, int is_covered, int level, uint32_t x, uint32_t y)
{
	const int is_magnified = level > (int)s->inside->pass + 1; /* cells are wider than two plain pixels */

	if (is_magnified)
		return is_covered || is_crossed(s, x, y, 1 << level < MOST_ACROSS ? 1 << level : MOST_ACROSS);
	return is_covered && is_narrow(s, x, y, level);
}

static uint32_t close_row(const struct splat_picture *s, const struct hole_cells *cells, uint32_t x0, uint32_t y,
                          uint32_t n, const struct gaps_map *map)
{
	const uint32_t width = s->stack->width, bricks_x = (width + BRICK - 1) / BRICK;
	uint16_t *weight = map->weight + (size_t)y * width + x0;
	uint8_t *bricks = map->bricks + (size_t)(y / BRICK) * bricks_x;
	struct hole_row holes;
	uint32_t n_closed = 0;
	uint32_t levels = 0;

	for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++)
		levels |= (s->stack->levels >> k & 1 && cells[k].has_any ? 1u : 0) << k;
	if (levels == 0)
		return 0;
	s->simd->holes(&holes, cells, levels, psr_zstack_row(s->stack, y), width, x0, n, s->plan->gap_scale[1],
	               s->plan->gap_offset[1]);
	for (uint32_t c = 0; c < n; c++) {
		const uint32_t x = x0 + c;
		const int level = holes.level[c], reach = 1 << level < HOLES_REACH ? 1 << level : HOLES_REACH;

		if (weight[c] && level
		    && ((is_inside(s, x, y) && is_crack(s, holes.is_covered[c], level, x, y))
		        || (holes.is_between[c] && is_enclosed(s, x, y, reach))
		        || (is_offcut(s, x, y) && is_seam(s, x, y, level)))) {
			weight[c] = 0;
			bricks[x / BRICK] = 1;
			n_closed++;
		}
	}
	return n_closed;
}

_Static_assert(TILE_WIDTH % (1 << PSR_MAX_DEPTH_LEVEL) == 0, "a tile's row has whole cells");

uint32_t splat_close(const struct splat_picture *s, uint32_t y0, uint32_t y1, const struct gaps_map *map)
{
	const struct psr_zstack *stack = s->stack;
	struct hole_cells cells[PSR_MAX_DEPTH_LEVEL + 1];
	uint32_t n_closed = 0;

	for (uint32_t x = 0; x < stack->width; x += TILE_WIDTH) {
		const uint32_t n = stack->width - x < TILE_WIDTH ? stack->width - x : TILE_WIDTH;

		for (uint32_t y = y0; y < y1 && !plan_is_cancelled(s->plan); y++) {
			for (int k = 1; k <= PSR_MAX_DEPTH_LEVEL; k++)
				if (stack->levels >> k & 1 && (y == y0 || y % (1u << k) == 0))
					find_cells(&cells[k], s, k, (x >> k) + 1, (y >> k) + 1, ((n - 1) >> k) + 1);
			n_closed += close_row(s, cells, x, y, n, map);
		}
	}
	return n_closed;
}

#include <math.h>
#include <string.h>
#include "base/maths.h"
#include "base/vec.h"
#include "psr/direction.h"
#include "render/block.h"
#include "simd/block.h"

/* Steps of the lattice: no point of an equilateral one is further than 1/sqrt(3) from a sample. */
#define RADIUS 0.6f
/* Of the tangent plane against the projection's. Projections own what they see at less than 50 degrees, and normals of
 * steeper places are mostly those of a texture or of something smaller than the disc; steps would stick out.
 * Measured. */
#define MOST_SLOPE 0.7f
/* Of a disc whose sample has no neighbours on either side, along that line: what it lies on is narrower than a step. */
#define NARROW 0.5f
/* A disc's rim counts as so many steps further away, so that of discs of one surface the one whose sample is nearest
 * shows. Measured. */
#define RIM_DEPTH 1.0f

struct splat_target {
	const struct plan *plan;
	uint64_t *word;
	uint32_t stride;
	int32_t x0, y0, x1, y1;
};

/* An ellipse of the picture: its centre, two conjugate radii, and how depth rises along these and to the rim. */
struct splat {
	float at[3], radius[2][3], rim, most;
	uint32_t id;
};

static inline void lower(const struct splat_target *t, int32_t x, int32_t y, float z, uint32_t id)
{
	const uint64_t word = (uint64_t)psr_bits_from_float(z) << 32 | id;
	uint64_t *at = &t->word[(size_t)(y - t->y0) * t->stride + (size_t)(x - t->x0)];
	*at = word < *at ? word : *at;
}

/* NaN gives high. */
static inline int32_t within(float x, int32_t low, int32_t high)
{
	return x <= (float)low ? low : x < (float)high ? (int32_t)x : high;
}

/* Pixels whose centres are in the ellipse, and the one that its centre is in. Returns whether that is of the tile. */
static int draw_splat(const struct splat_target *t, const struct splat *s)
{
	const float u = s->at[0], v = s->at[1], *a = s->radius[0], *b = s->radius[1];
	const float extent_x = __builtin_fabsf(a[0]) + __builtin_fabsf(b[0]),
				extent_y = __builtin_fabsf(a[1]) + __builtin_fabsf(b[1]);
	const float area = a[0] * b[1] - a[1] * b[0];
	if (extent_x <= s->most && extent_y <= s->most && area != 0) {
		const float p_x = b[1] / area, p_y = -b[0] / area, q_x = -a[1] / area, q_y = a[0] / area;
		const int32_t x0 = within(u - extent_x, t->x0, t->x1), x1 = within(u + extent_x + 1, t->x0, t->x1);
		const int32_t y0 = within(v - extent_y, t->y0, t->y1), y1 = within(v + extent_y + 1, t->y0, t->y1);
		for (int32_t y = y0; y < y1; y++)
			for (int32_t x = x0; x < x1; x++) {
				const float dx = (float)x + 0.5f - u, dy = (float)y + 0.5f - v;
				const float p = dx * p_x + dy * p_y, q = dx * q_x + dy * q_y, square = p * p + q * q;
				const float z = (s->at[2] + (p * a[2] + q * b[2])) + square * s->rim;
				if (square <= 1 && z > t->plan->near_z)
					lower(t, x, y, z, s->id);
			}
	}
	if (!(u >= (float)t->x0 && u < (float)t->x1 && v >= (float)t->y0 && v < (float)t->y1))
		return 0;
	lower(t, (int32_t)u, (int32_t)v, s->at[2], s->id);
	return 1;
}

/* 0 if there is surely no sample; outside of the block there may be. */
static inline int may_have(uint64_t mask, int row, int col)
{
	return ((row | col) & ~7) != 0 || (mask >> (8 * row + col) & 1);
}

/* How much of the radius along the rows, and across them, is covered: in odd rows samples are half a step to the
 * right. */
static void find_neighbors(float share[2], uint64_t mask, uint32_t sample)
{
	const int r = (int)(sample >> 3), c = (int)(sample & 7), left = c - 1 + (r & 1);
	const int beside = may_have(mask, r, c - 1) | may_have(mask, r, c + 1);
	const int across = may_have(mask, r - 1, left) | may_have(mask, r - 1, left + 1) | may_have(mask, r + 1, left) |
	                   may_have(mask, r + 1, left + 1);
	share[0] = beside ? 1 : NARROW;
	share[1] = across ? 1 : NARROW;
}

/* How z of the projection rises along its x and y, on the plane of a normal. */
static void find_slope(float slope[2], const float n[3], const struct psr_projection *projection)
{
	const float nz = v3f_dot(n, projection->axis[2]);
	slope[0] = -v3f_dot(n, projection->axis[0]) / nz;
	slope[1] = -v3f_dot(n, projection->axis[1]) / nz;
	const float length = __builtin_sqrtf(slope[0] * slope[0] + slope[1] * slope[1]);
	if (!(length <= MOST_SLOPE)) {
		const int is_vertical = !(length < 0x1p60f);
		slope[0] = is_vertical ? 0 : slope[0] * (MOST_SLOPE / length);
		slope[1] = is_vertical ? 0 : slope[1] * (MOST_SLOPE / length);
	}
}

static uint64_t draw_block(const struct splat_target *t, const struct bin_entry *entry)
{
	const struct warp_instance *in = &t->plan->warp[entry->instance];
	const struct psr_projection *projection =
		&in->blocks->projection[in->blocks->block_projection[entry->slot - in->first_slot]];
	const float (*normals)[3] = psr_direction_table();
	const int perspective = t->plan->perspective;
	struct warp_block b;
	uint64_t n_inside = 0;
	warp_block_make(&b, in, entry->slot);
	const float scale = (float)b.scale, step = projection->spacing * scale;
	/* Radii in the projection's plane, along x and y, and along z for a slope of 1. */
	float radius[2][3], along[3];
	for (int a = 0; a < 3; a++) {
		radius[0][a] = RADIUS * scale * (float)b.lattice->step[a];
		radius[1][a] = RADIUS * scale * (float)b.lattice->down[a] / 0.866025404f;
		along[a] = RADIUS * step * (float)b.lattice->along[a];
	}
	struct splat s = { .rim = RIM_DEPTH * step * t->plan->instance[entry->instance].cull.scale,
		               .most = (float)(2 << entry->level) };
	for (uint64_t left = b.mask; left; left &= left - 1, b.depth++, b.attr++) {
		const uint32_t sample = (uint32_t)__builtin_ctzll(left), r = sample >> 3, c = sample & 7;
		const float *n = normals[PSR_ATTR_NORMAL(*b.attr)], depth = (float)*b.depth;
		float p[3], d[3], slope[2], share[2];
		for (int a = 0; a < 3; a++)
			p[a] = ((float)(b.origin[a] + b.scale * b.lattice->row[a][r]) + scale * b.lattice->col[a][c]) +
			       depth * b.unit[a];
		if (!(p[2] > t->plan->near_z))
			continue;
		const float inverse = perspective ? 1 / p[2] : 1;
		v3f_set(s.at, p[0] * inverse, p[1] * inverse, p[2]);
		for (int k = 0; k < 3; k++)
			d[k] = (s.at[0] * in->du[k] + s.at[1] * in->dv[k]) + in->d0[k];
		if (entry->is_mixed && faces_away(-v3f_dot(n, d), d))
			continue;
		find_slope(slope, n, projection);
		find_neighbors(share, b.mask, sample);
		for (int i = 0; i < 2; i++) {
			float h[3];
			for (int a = 0; a < 3; a++)
				h[a] = share[i] * (radius[i][a] + slope[i] * along[a]);
			s.radius[i][0] = perspective ? (h[0] - s.at[0] * h[2]) * inverse : h[0];
			s.radius[i][1] = perspective ? (h[1] - s.at[1] * h[2]) * inverse : h[1];
			s.radius[i][2] = h[2];
		}
		s.id = b.id + sample;
		n_inside += (uint64_t)draw_splat(t, &s);
	}
	return n_inside;
}

struct warp_counts splat_tile(const struct simd *simd, const struct plan *plan, const struct bins *bins,
                              struct psr_zstack *stack, uint32_t tile, uint32_t clean)
{
	const uint32_t tx = tile % plan->tiles_x, ty = tile / plan->tiles_x;
	struct warp_target target = { .stride = stack->width + stack->gap };
	struct warp_counts counts = { 0, 0, 0 };
	target.x0 = (int32_t)(tx * TILE_WIDTH);
	target.y0 = (int32_t)(ty * TILE_HEIGHT);
	target.x1 = tx + 1 == plan->tiles_x ? (int32_t)plan->width : target.x0 + TILE_WIDTH;
	target.y1 = ty + 1 == plan->tiles_y ? (int32_t)plan->height : target.y0 + TILE_HEIGHT;
	target.clean = clean;
	target.word = psr_zstack_row(stack, (uint32_t)target.y0) + target.x0;
	simd->warp_clear(&target, 0);
	const struct splat_target t = { plan, target.word, target.stride, target.x0, target.y0, target.x1, target.y1 };
	for (uint32_t e = bins->tile_begin[tile]; e < bins->tile_begin[tile + 1]; e++)
		counts.n_inside += draw_block(&t, &bins->entry[e]);
	return counts;
}

/* ---- holes between discs ---- */

#define REACH 8 /* pixels, a power of two */

static float depth_at(const struct psr_zstack *stack, int64_t x, int64_t y)
{
	if (x < 0 || y < 0 || x >= (int64_t)stack->width || y >= (int64_t)stack->height)
		return INFINITY;
	return psr_float_from_bits((uint32_t)(psr_zstack_row(stack, (uint32_t)y)[x] >> 32));
}

/* Whether holes beside a pixel's sample are meant. */
static int is_sheer(const struct plan *plan, const struct psr_zstack *stack, int64_t x, int64_t y)
{
	const uint32_t slot = (uint32_t)psr_zstack_row(stack, (uint32_t)y)[x] / PSR_BLOCK_SAMPLES;
	const struct plan_instance *in = &plan->instance[plan_find_instance(plan, slot)];
	return (psr_blocks_traits(in->cull.blocks, slot - in->first_slot) & PSR_BLOCK_SHEER) != 0;
}

/* Whether what is before the pixel meets it in all eight directions, and is one surface. */
static int is_enclosed(const struct plan *plan, const struct psr_zstack *stack, uint32_t x, uint32_t y)
{
	static const int8_t way[8][2] = {
		{ -1, 0 }, { 1, 0 }, { 0, -1 }, { 0, 1 }, { -1, -1 }, { 1, 1 }, { 1, -1 }, { -1, 1 },
	};
	const float z = depth_at(stack, x, y);
	float nearest = INFINITY, farthest = 0;
	for (int w = 0; w < 8; w++) {
		int is_met = 0, is_open = 0;
		for (int i = 1; i <= REACH && !is_met; i++) {
			const float other = depth_at(stack, (int64_t)x + i * way[w][0], (int64_t)y + i * way[w][1]);
			is_met = other * plan->gap_scale[1] + plan->gap_offset[1] < z;
			nearest = is_met && other < nearest ? other : nearest;
			farthest = is_met && other > farthest ? other : farthest;
			is_open = is_met && plan->has_sheer &&
			          is_sheer(plan, stack, (int64_t)x + i * way[w][0], (int64_t)y + i * way[w][1]);
		}
		if (!is_met || is_open)
			return 0;
	}
	return farthest <= nearest * plan->gap_scale[4] + plan->gap_offset[4];
}

/* Of n pixels from x on: whether what is before them meets them on the left and on the right. */
static void find_between(uint8_t *is_between, const struct plan *plan, const struct psr_zstack *stack, uint32_t x,
                         uint32_t y, uint32_t n)
{
	float z[TILE_WIDTH + 2 * REACH], nearest[TILE_WIDTH + 2 * REACH]; /* of a pixel and the next ones, REACH in all */
	const uint32_t first = x ? 0 : REACH, end = stack->width - x < n + REACH ? stack->width - x + REACH : n + 2 * REACH;
	const uint64_t *word = psr_zstack_row(stack, y) + x;
	int has_any = 0;
	for (uint32_t i = 0; i < REACH; i++)
		nearest[i] = nearest[n + REACH + i] = z[i] = z[n + REACH + i] = INFINITY;
	for (uint32_t i = first; i < end; i++) {
		const uint32_t bits = (uint32_t)(word[(int32_t)i - REACH] >> 32);
		nearest[i] = z[i] = psr_float_from_bits(bits);
		has_any |= bits < (uint32_t)(PSR_WORD_EMPTY >> 32);
	}
	if (!has_any) {
		memset(is_between, 0, n);
		return;
	}
	for (uint32_t step = 1, left = n + 2 * REACH; step < REACH; step *= 2) {
		left -= step;
		for (uint32_t i = 0; i < left; i++)
			nearest[i] = nearest[i] < nearest[i + step] ? nearest[i] : nearest[i + step];
	}
	for (uint32_t i = 0; i < n; i++) {
		const float before = nearest[i], behind = nearest[i + REACH + 1], farther = before > behind ? before : behind;
		is_between[i] = farther * plan->gap_scale[1] + plan->gap_offset[1] < z[i + REACH];
	}
}

uint32_t splat_close(const struct plan *plan, const struct psr_zstack *stack, uint32_t y0, uint32_t y1,
                     uint16_t *weight, uint8_t *bricks)
{
	const uint32_t bricks_x = (stack->width + BRICK - 1) / BRICK;
	uint8_t is_between[TILE_WIDTH];
	uint32_t n_closed = 0;
	for (uint32_t y = y0; y < y1; y++)
		for (uint32_t x = 0; x < stack->width; x++) {
			const uint32_t n = stack->width - x < TILE_WIDTH ? stack->width - x : TILE_WIDTH;
			if (x % TILE_WIDTH == 0)
				find_between(is_between, plan, stack, x, y, n);
			if (is_between[x % TILE_WIDTH] && weight[(size_t)y * stack->width + x] && is_enclosed(plan, stack, x, y)) {
				weight[(size_t)y * stack->width + x] = 0;
				bricks[y / BRICK * bricks_x + x / BRICK] = 1;
				n_closed++;
			}
		}
	return n_closed;
}

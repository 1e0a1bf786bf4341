/* Blocks against the frustum ([G] 6.1), and the whole cull. */
#include <string.h>
#include "base/maths.h"
#include "cull_cones.h"
#include "simd/tile.h"

/* Bounds the projection of c - r or c + r by the scales of the two ends of z. */
static inline float edge_of(float at, float if_negative, float if_positive)
{
	return at * psr_choose(at < 0, if_negative, if_positive);
}

static inline int32_t pixel_within(float pixel, float most)
{
	const float low = psr_where(pixel > 0, pixel);

	return (int32_t)psr_choose(low < most, low, most);
}

static inline int32_t region_of(int32_t pixel, float from, float scale)
{
	const float region = ((float)pixel + from) * scale, most = SCREEN_SIDE - 1, low = psr_where(region > 0, region);

	return (int32_t)psr_choose(low < most, low, most);
}

static void widen(struct widened *restrict to, const struct psr_blocks *b, uint32_t first, uint32_t n)
{
	const int16_t *x = b->sphere_x + first, *y = b->sphere_y + first, *z = b->sphere_z + first;
	const uint16_t *r = b->sphere_r + first;
	const uint8_t *flags = b->flags + first;

	for (uint32_t i = 0; i < n; i++) {
		to->x[i] = (float)x[i] * (1.0f / 16384);
		to->y[i] = (float)y[i] * (1.0f / 16384);
		to->z[i] = (float)z[i] * (1.0f / 16384);
		to->r[i] = (float)r[i] * (1.0f / 32768);
	}
	for (uint32_t i = 0; i < n; i++)
		to->flags[i] = flags[i];
}

_Static_assert(CUBES_PLACE_BITS == 18, "as widen_cubes() takes places apart");

static void widen_cubes(struct widened *restrict to, const struct psr_cubes *cubes, uint32_t first, uint32_t n)
{
	const struct psr_cube_level *level = psr_cubes_level(cubes, first);
	const double edge = level->edge, low[3] = { level->tree->low[0], level->tree->low[1], level->tree->low[2] };
	const uint32_t most = (1u << CUBES_PLACE_BITS) - 1;
	const uint8_t *flags = cubes->groups.flags + first;
	uint32_t place[CULL_BATCH][2];

	for (uint32_t i = 0; i < n; i++)
		memcpy(place[i], cubes->cube[first + i].place, sizeof place[i]);
	for (uint32_t i = 0; i < n; i++) {
		const uint32_t x = place[i][0] & most, y = (place[i][0] >> 18 | place[i][1] << 14) & most;
		const uint32_t z = place[i][1] >> 4 & most;

		to->x[i] = (float)(low[0] + (double)(int32_t)(4 * x + 2) * edge);
		to->y[i] = (float)(low[1] + (double)(int32_t)(4 * y + 2) * edge);
		to->z[i] = (float)(low[2] + (double)(int32_t)(4 * z + 2) * edge);
		to->r[i] = (float)(CUBES_RADIUS * edge);
	}
	for (uint32_t i = 0; i < n; i++)
		to->flags[i] = flags[i];
}

/* From half of a block's step of depth, 2^-15. */
static void scale_errors(struct cull_batch *out, const struct psr_cubes *cubes, uint32_t first, uint32_t n)
{
	const float scale = (float)(psr_cubes_level(cubes, first)->edge * (CUBES_DIAGONAL * 0x1p14));

	for (uint32_t i = 0; i < n; i++)
		out->depth_error[i] *= scale;
}

static void cull_by_frustum(struct cull_batch *restrict out, const struct cull_view *view,
                            const struct widened *restrict b, uint32_t n)
{
	const struct cull_view v = *view;
	const float half_width = v.center_x, half_height = v.center_y;
	const float most_x = v.width - 1, most_y = v.height - 1;
	const int is_perspective = v.perspective;

	for (uint32_t i = 0; i < n; i++) {
		const float x = b->x[i], y = b->y[i], z = b->z[i], r = b->r[i] * v.scale;
		const int32_t flags = b->flags[i];
		const float cx = ((v.center_m[0][0] * x + v.center_m[0][1] * y) + v.center_m[0][2] * z) + v.center_m[0][3];
		const float cy = ((v.center_m[1][0] * x + v.center_m[1][1] * y) + v.center_m[1][2] * z) + v.center_m[1][3];
		const float cz = ((v.center_m[2][0] * x + v.center_m[2][1] * y) + v.center_m[2][2] * z) + v.center_m[2][3];
		const float stretch = cull_stretch(&v, cx, cy, cz, r, cz - r);

		const float spacing = v.spacing * psr_float_from_bits((uint32_t)(127 + (flags & PSR_BLOCK_LEVEL)) << 23);
		const float pixels = stretch * spacing * CULL_LESS; /* may be NaN */
		const int32_t level = cull_level(pixels);
		const int32_t used = level < PSR_MAX_DEPTH_LEVEL ? level : PSR_MAX_DEPTH_LEVEL;

		/* Two pixels beyond the guard band's cell cover rounding. */
		const float band = psr_float_from_bits((uint32_t)(127 + used) << 23) + 2;
		const float grown = r * 1.0001f, guard = psr_choose((v.reach != 0) & (pixels > band), pixels, band);
		const float front1 = cz - grown, z0 = psr_choose(front1 > v.near_z, front1, v.near_z), z1 = cz + grown;
		const float near_scale = v.focal * psr_choose(is_perspective, 1 / z0, 1);
		const float far_scale = v.focal * psr_choose(is_perspective, 1 / z1, 1);
		const float left = edge_of(cx - grown, near_scale, far_scale) + half_width;
		const float right = edge_of(cx + grown, far_scale, near_scale) + half_width;
		const float top = edge_of(cy - grown, near_scale, far_scale) + half_height;
		const float bottom = edge_of(cy + grown, far_scale, near_scale) + half_height;
		const float x0 = left - guard, x1 = right + guard, y0 = top - guard, y1 = bottom + guard;
		out->is_left[i] = (z1 > v.near_z) & (x1 >= 0) & (y1 >= 0) & (x0 < v.width) & (y0 < v.height);
		out->is_mixed[i] = !(flags & PSR_BLOCK_TWO_SIDED) & !v.both_sides;
		out->level[i] = level;
		out->apart[i] = stretch * spacing;
		const int32_t px0 = pixel_within(x0, most_x), px1 = pixel_within(x1, most_x);
		const int32_t py0 = pixel_within(y0, most_y), py1 = pixel_within(y1, most_y);
		out->x0[i] = px0;
		out->x1[i] = px1;
		out->y0[i] = py0;
		out->y1[i] = py1;
		const float reach = psr_choose(v.with_splats, guard, 2);
		out->tile_x0[i] = pixel_within(left - reach, most_x) / TILE_WIDTH;
		out->tile_x1[i] = pixel_within(right + reach, most_x) / TILE_WIDTH;
		out->tile_y0[i] = pixel_within(top - reach, most_y) / TILE_HEIGHT;
		out->tile_y1[i] = pixel_within(bottom + reach, most_y) / TILE_HEIGHT;
		const int32_t range_x = screen_range(region_of(px0, v.region_from[0], v.region_scale[0]),
		                                     region_of(px1, v.region_from[0], v.region_scale[0]));
		const int32_t range_y = screen_range(region_of(py0, v.region_from[1], v.region_scale[1]),
		                                     region_of(py1, v.region_from[1], v.region_scale[1]));
		out->range[i] = range_x * SCREEN_RANGES + range_y;
		out->near[i] = front1 * (1 - 0x1p-16f);
		const uint32_t shift = 14u + ((uint32_t)(flags & PSR_BLOCK_DEPTH) >> 3);
		out->depth_error[i] = stretch * v.scale * psr_float_from_bits((126u - shift) << 23);
	}
}

static inline int32_t least(int32_t a, int32_t b)
{
	return a < b ? a : b;
}

static inline int32_t greatest(int32_t a, int32_t b)
{
	return a > b ? a : b;
}

/* Integers that are in the order of floats. */
static inline int32_t order_of(int32_t bits)
{
	return bits ^ (bits >> 31 & INT32_MAX);
}

/* n: whole vectors. */
static void sum_masks(struct cull_sum *restrict sum, const struct cull_batch *restrict b, uint32_t n)
{
	sum->left = sum->mixed = 0;
	for (uint32_t i = 0; i < n; i += LANES) {
		uint32_t left = 0, mixed = 0;

		for (uint32_t k = 0; k < LANES; k++) {
			left |= (uint32_t)b->is_left[i + k] << k;
			mixed |= (uint32_t)(b->is_left[i + k] & b->is_mixed[i + k]) << k;
		}
		sum->left |= (uint64_t)left << i;
		sum->mixed |= (uint64_t)mixed << i;
	}
}

static void sum_up(struct cull_sum *restrict sum, const struct cull_batch *restrict b, uint32_t n)
{
	int32_t x0 = INT32_MAX, x1 = 0, y0 = INT32_MAX, y1 = 0, near = INT32_MAX, apart = 0, depth_error = 0;
	int32_t tiles0 = INT32_MAX, tiles1 = 0, level0 = INT32_MAX, level1 = 0;

	for (uint32_t i = 0; i < n; i++) {
		const int32_t out = b->is_left[i] - 1, most = out & INT32_MAX; /* all ones: not left */
		const int32_t tiles = cull_tiles(b, i);

		x0 = least(x0, b->x0[i] | most);
		x1 = greatest(x1, b->x1[i] & ~out);
		y0 = least(y0, b->y0[i] | most);
		y1 = greatest(y1, b->y1[i] & ~out);
		tiles0 = least(tiles0, tiles | most);
		tiles1 = greatest(tiles1, tiles & ~out);
		level0 = least(level0, b->level[i] | most);
		level1 = greatest(level1, b->level[i] & ~out);
		near = least(near, (order_of((int32_t)psr_bits_from_float(b->near[i])) & ~out) | most);
		apart = greatest(apart, (int32_t)psr_bits_from_float(b->apart[i]) & ~out);
		depth_error = greatest(depth_error, (int32_t)psr_bits_from_float(b->depth_error[i]) & ~out);
	}
	sum->x0 = x0;
	sum->x1 = x1;
	sum->y0 = y0;
	sum->y1 = y1;
	sum->tiles[0] = tiles0;
	sum->tiles[1] = tiles1;
	sum->level[0] = level0;
	sum->level[1] = level1;
	sum->near = psr_float_from_bits((uint32_t)order_of(near));
	sum->apart = psr_float_from_bits((uint32_t)apart);
	sum->depth_error = psr_float_from_bits((uint32_t)depth_error);
}

static void cull(struct cull_batch *out, const struct cull_view *view, uint32_t first, uint32_t n)
{
	const uint32_t whole = (n + LANES - 1) / LANES * LANES;
	struct widened blocks;

	memset(&blocks, 0, sizeof blocks);
	if (view->cubes)
		widen_cubes(&blocks, view->cubes, first, n);
	else
		widen(&blocks, view->blocks, first, n);
	cull_by_frustum(out, view, &blocks, whole);
	if (view->cubes)
		scale_errors(out, view->cubes, first, n);
	if (view->points)
		for (uint32_t i = 0; i < n; i++)
			out->depth_error[i] *= view->points->set->height * 0x1p15f;
	if (cull_asks_cones(view)) {
		widen_cones(&blocks, view->blocks, first, n);
		cull_by_cones(out, view, &blocks, whole);
	}
	if (view->cubes) {
		for (uint32_t i = n; i < whole; i++)
			out->is_left[i] = 0;
		sum_masks(&out->sum, out, whole);
		sum_up(&out->sum, out, whole);
	}
}

static void cull_cones(struct cull_batch *out, const struct cull_view *view, uint32_t first, uint32_t n)
{
	const uint32_t whole = (n + LANES - 1) / LANES * LANES;
	struct widened cubes;

	memset(&cubes, 0, sizeof cubes);
	widen_cubes(&cubes, view->cubes, first, n);
	for (uint32_t i = 0; i < whole; i++) {
		out->is_left[i] = i < n;
		out->is_mixed[i] = !(cubes.flags[i] & PSR_BLOCK_TWO_SIDED) & !view->both_sides;
	}
	widen_cones(&cubes, view->blocks, first, n);
	cull_by_cones(out, view, &cubes, whole);
	sum_masks(&out->sum, out, whole);
}

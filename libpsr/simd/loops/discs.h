/* Discs of samples ([B] 3): a block's in the plane of each, and their pixels. */
#include <math.h>
#include <string.h>
#include "base/direction.h"
#include "base/maths.h"
#include "simd/block.h"
#include "simd/discs.h"

/* The greatest slope of a tangent plane in its projection, where a sample lacks neighbours. Projections own surfaces
 * that they see at less than 50 degrees; steeper normals mostly belong to a texture or to detail smaller than the disc.
 * Measured. */
#define MOST_SLOPE 0.7f
/* The greatest slope of a plane that neighbours confirm. */
#define MOST_STEEP 3.0f
/* Share of the radius along a line without neighbours on either side: the surface is narrower than a step there. */
#define NARROW 0.5f

#define HALF 0.5f
#define HIGH 0.866025404f /* of a row, in steps */
#define AROUND 9          /* lanes to the furthest neighbour */

/* A block's samples by place in the lattice; 0 where there is none. */
struct disc_lattice {
	float depth[AROUND + DISCS + AROUND];
	float normal[3][DISCS];
	/* Whether the sample has neighbours on both sides along each of the lattice's three lines; and whether it may have
	 * one along its row, or across the rows, in this block or in the next. */
	int32_t has_both[3][DISCS], beside[DISCS], beyond[DISCS];
	float slope[2][DISCS];
};

static inline void discs_spread(int32_t *to, uint64_t bits)
{
	const uint32_t half[2] = { (uint32_t)bits, (uint32_t)(bits >> 32) };

	for (uint32_t k = 0; k < 2; k++)
		for (uint32_t i = 0; i < DISCS / 2; i++)
			to[DISCS / 2 * k + i] = (int32_t)(half[k] >> i & 1);
}

/* Odd rows are half a step to the right: there the neighbours in other rows are a column further right. */
static inline void discs_find_neighbours(struct disc_lattice *l, uint64_t mask)
{
	const uint64_t even = 0x00ff00ff00ff00ff, odd = ~even;
	const uint64_t not_first = 0xfefefefefefefefe, not_last = 0x7f7f7f7f7f7f7f7f; /* columns */
	const uint64_t next[3] = { mask >> 1 & not_last, (mask >> 8 & even) | (mask >> 9 & not_last & odd),
		                       (mask >> 7 & not_first & even) | (mask >> 8 & odd) };
	const uint64_t last[3] = { mask << 1 & not_first, (mask << 9 & not_first & even) | (mask << 8 & odd),
		                       (mask << 8 & even) | (mask << 7 & not_last & odd) };
	const uint64_t sides = ~not_first | ~not_last;
	const uint64_t ends = 0xff000000000000ff | (~not_first & even) | (~not_last & odd);

	for (int i = 0; i < 3; i++)
		discs_spread(l->has_both[i], next[i] & last[i]);
	discs_spread(l->beside, next[0] | last[0] | sides);
	discs_spread(l->beyond, next[1] | next[2] | last[1] | last[2] | ends);
}

static inline void discs_load(struct disc_lattice *l, const struct warp_block *b)
{
	const float(*normals)[3] = psr_direction_table();
	uint32_t k = 0;

	memset(l->depth, 0, sizeof l->depth);
	memset(l->normal, 0, sizeof l->normal);
	for (uint64_t left = b->mask; left; left &= left - 1, k++) {
		const uint32_t lane = (uint32_t)__builtin_ctzll(left);
		const float *n = normals[PSR_ATTR_NORMAL(b->attr[k])];

		l->depth[AROUND + lane] = (float)b->depth[k];
		for (int c = 0; c < 3; c++)
			l->normal[c][lane] = n[c];
	}
	discs_find_neighbours(l, b->mask);
}

/* Slope along a line of the lattice: the normal's, clamped between the slopes to the neighbours on both sides. `safe`
 * unless the sample has both. */
static inline float disc_slope(int has_both, float next, float back, float normal, float safe)
{
	const float low = psr_choose(next < back, next, back), high = psr_choose(next < back, back, next);
	const float within = psr_choose(normal > low, psr_choose(normal < high, normal, high), low);

	return psr_choose(has_both, within, safe);
}

/* A component of a slope of this length, made no steeper than `most`; 0 of a vertical one. */
static inline float disc_limit(float slope, float length, float most)
{
	return psr_choose(length <= most, slope, psr_where(length < 0x1p60f, slope * (most / length)));
}

/* Finds the slopes of the discs' planes. A plane is the normal's, clamped along each of the lattice's three lines by the
 * depths on both sides: the normal may come from a map, or a rounded corner. rise: a step of depth, in steps of the
 * lattice. */
static inline void discs_find_slopes(struct disc_lattice *l, const struct psr_projection *projection, float rise)
{
	const float ax = projection->axis[0][0], ay = projection->axis[0][1], az = projection->axis[0][2];
	const float bx = projection->axis[1][0], by = projection->axis[1][1], bz = projection->axis[1][2];
	const float cx = projection->axis[2][0], cy = projection->axis[2][1], cz = projection->axis[2][2];
	const float *depth = l->depth + AROUND;

	for (int32_t i = 0; i < DISCS; i++) {
		const int is_odd = i >> 3 & 1;
		const float nx = l->normal[0][i], ny = l->normal[1][i], nz = l->normal[2][i], own = depth[i];
		const float along = (nx * cx + ny * cy) + nz * cz;
		const float x = -((nx * ax + ny * ay) + nz * az) / along, y = -((nx * bx + ny * by) + nz * bz) / along;
		const float steep = __builtin_sqrtf(x * x + y * y);
		const float safe_x = disc_limit(x, steep, MOST_SLOPE), safe_y = disc_limit(y, steep, MOST_SLOPE);
		const float next1 = psr_choose(is_odd, depth[i + 9], depth[i + 8]);
		const float next2 = psr_choose(is_odd, depth[i + 8], depth[i + 7]);
		const float last1 = psr_choose(is_odd, depth[i - 8], depth[i - 9]);
		const float last2 = psr_choose(is_odd, depth[i - 7], depth[i - 8]);
		const float slope0 = disc_slope(l->has_both[0][i], (depth[i + 1] - own) * rise, -((depth[i - 1] - own) * rise),
		                                x, safe_x);
		const float slope1 = disc_slope(l->has_both[1][i], (next1 - own) * rise, -((last1 - own) * rise),
		                                x * HALF + y * HIGH, safe_x * HALF + safe_y * HIGH);
		const float slope2 = disc_slope(l->has_both[2][i], (next2 - own) * rise, -((last2 - own) * rise),
		                                y * HIGH - x * HALF, safe_y * HIGH - safe_x * HALF);
		const float plane_x = (2 * slope0 + slope1 - slope2) / 3, plane_y = (slope1 + slope2) / (2 * HIGH);
		const float length = __builtin_sqrtf(plane_x * plane_x + plane_y * plane_y);

		l->slope[0][i] = disc_limit(plane_x, length, MOST_STEEP);
		l->slope[1][i] = disc_limit(plane_y, length, MOST_STEEP);
	}
}

static inline void discs_find_shares(struct discs *d, const struct disc_lattice *l)
{
	for (uint32_t i = 0; i < DISCS; i++) {
		d->share[0][i] = psr_choose(l->beside[i], 1, NARROW);
		d->share[1][i] = psr_choose(l->beyond[i], 1, NARROW);
	}
}

static void discs_of_block(struct discs *d, const struct warp_target *t, const struct bin_entry *entry)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	const struct psr_projection *projection =
		&in->blocks->projection[in->blocks->block_projection[entry->slot - in->first_slot]];
	const int perspective = t->perspective, is_mixed = entry->is_mixed;
	const float near_z = t->near_z;
	struct disc_lattice l;
	struct warp_block b;
	struct warp_terms terms;
	float radius[2][3], along[3], inverse[DISCS];
	int32_t is_seen[DISCS];

	warp_block_make(&b, in, entry->slot);
	warp_terms_make(&terms, &b);
	discs_load(&l, &b);
	discs_find_slopes(&l, projection, b.rise / (projection->spacing * (float)b.scale));
	discs_find_shares(d, &l);
	/* Radii in the projection's plane, along x and y, and along z for a slope of 1. */
	const float scale = (float)b.scale, step = projection->spacing * scale;
	for (int a = 0; a < 3; a++) {
		radius[0][a] = DISC_RADIUS * scale * (float)b.lattice->step[a];
		radius[1][a] = DISC_RADIUS * scale * (float)b.lattice->down[a] / HIGH;
		along[a] = DISC_RADIUS * step * (float)b.lattice->along[a];
	}
	for (uint32_t r = 0; r < 8; r++)
		for (uint32_t c = 0; c < 8; c++) {
			const uint32_t i = 8 * r + c;
			const float depth = l.depth[AROUND + i];

			for (int a = 0; a < 3; a++)
				d->at[a][i] = (terms.row[a][r] + terms.col[a][c]) + depth * b.unit[a];
		}
	for (uint32_t i = 0; i < DISCS; i++) {
		const float z = d->at[2][i], shrink = psr_choose(perspective, 1 / z, 1);
		const float u = d->at[0][i] * shrink, v = d->at[1][i] * shrink;
		const float dx = (u * in->du[0] + v * in->dv[0]) + in->d0[0], dy = (u * in->du[1] + v * in->dv[1]) + in->d0[1],
					dz = (u * in->du[2] + v * in->dv[2]) + in->d0[2];
		const float g = -((l.normal[0][i] * dx + l.normal[1][i] * dy) + l.normal[2][i] * dz);
		const int faces_away = (g < 0) & (g * g > BACK_SINE * BACK_SINE * (dx * dx + dy * dy + dz * dz));

		d->at[0][i] = u;
		d->at[1][i] = v;
		inverse[i] = shrink;
		is_seen[i] = (z > near_z) & !(is_mixed & faces_away);
	}
	for (int k = 0; k < 2; k++)
		for (uint32_t i = 0; i < DISCS; i++) {
			const float share = d->share[k][i], slope = l.slope[k][i], u = d->at[0][i], v = d->at[1][i];
			const float x = share * (radius[k][0] + slope * along[0]), y = share * (radius[k][1] + slope * along[1]),
						rise = share * (radius[k][2] + slope * along[2]);

			d->radius[k][0][i] = psr_choose(perspective, (x - u * rise) * inverse[i], x);
			d->radius[k][1][i] = psr_choose(perspective, (y - v * rise) * inverse[i], y);
			d->radius[k][2][i] = rise;
		}
	d->id = b.id;
	d->mask = 0;
	for (uint64_t left = b.mask; left; left &= left - 1) {
		const uint32_t i = (uint32_t)__builtin_ctzll(left);

		d->mask |= (uint64_t)(uint32_t)is_seen[i] << i;
	}
}

/* NaN gives high. */
static inline int32_t discs_within(float x, float low, float high)
{
	return (int32_t)psr_choose(x <= low, low, psr_choose(x < high, x, high));
}

static void discs_place(struct discs *d, const struct warp_target *t)
{
	const float left = (float)t->x0, right = (float)t->x1, top = (float)t->y0, bottom = (float)t->y1, most = d->most;
	float shrink[DISCS];

	for (uint32_t i = 0; i < DISCS; i++) {
		const float wide = __builtin_fabsf(d->radius[0][0][i]) + __builtin_fabsf(d->radius[1][0][i]);
		const float high = __builtin_fabsf(d->radius[0][1][i]) + __builtin_fabsf(d->radius[1][1][i]);
		const float extent = psr_choose(wide > high, wide, high);

		shrink[i] = psr_choose(extent > most, most / extent, 1);
	}
	for (int k = 0; k < 2; k++)
		for (int a = 0; a < 3; a++)
			for (uint32_t i = 0; i < DISCS; i++)
				d->radius[k][a][i] *= shrink[i];
	for (uint32_t i = 0; i < DISCS; i++) {
		const float u = d->at[0][i], v = d->at[1][i];
		const float ax = d->radius[0][0][i], ay = d->radius[0][1][i], bx = d->radius[1][0][i], by = d->radius[1][1][i];
		const float area = ax * by - ay * bx;
		const float wide = __builtin_fabsf(ax) + __builtin_fabsf(bx), high = __builtin_fabsf(ay) + __builtin_fabsf(by);
		const float end = psr_choose((area < 0) | (area > 0), right, left); /* of lines nothing is seen */

		d->across[0][0][i] = by / area;
		d->across[0][1][i] = -bx / area;
		d->across[1][0][i] = -ay / area;
		d->across[1][1][i] = ax / area;
		d->x0[i] = discs_within(u - wide, left, right);
		d->x1[i] = discs_within(u + wide + 1, left, end);
		d->y0[i] = discs_within(v - high, top, bottom);
		d->y1[i] = discs_within(v + high + 1, top, bottom);
	}
}

/* A disc of which pixels are asked. */
struct disc_one {
	float u, v, z, rise[2], across[2][2], rim, near_z;
	int32_t x0, x1;
	uint32_t id;
};

/* Draws the pixels of a window of the tile that are in columns x0..x1-1. */
static inline __attribute__((always_inline)) void disc_draw_window(uint64_t *word, uint32_t stride,
                                                                   const struct disc_one *d, int32_t left, int32_t top,
                                                                   uint32_t columns, uint32_t rows, uint32_t n_rows)
{
	_Alignas(64) uint32_t z_bits[16], id[16];

	for (uint32_t i = 0; i < columns * rows; i++) {
		const int32_t x = left + (int32_t)(i % columns), y = top + (int32_t)(i / columns);
		const float dx = (float)x + 0.5f - d->u, dy = (float)y + 0.5f - d->v;
		const float p = dx * d->across[0][0] + dy * d->across[0][1], q = dx * d->across[1][0] + dy * d->across[1][1];
		const float square = p * p + q * q;
		const float z = (d->z + (p * d->rise[0] + q * d->rise[1])) + square * d->rim;
		const int is_in = (square <= 1) & (z > d->near_z) & (x >= d->x0) & (x < d->x1);

		z_bits[i] = psr_bits_from_float(psr_choose(is_in, z, INFINITY));
		id[i] = d->id | (0u - (uint32_t)!is_in);
	}
	for (uint32_t r = 0; r < n_rows; r++, word += stride)
		for (uint32_t c = 0; c < columns; c++) {
			const int64_t own = (int64_t)word[c], other = (int64_t)z_bits[columns * r + c] << 32 | id[columns * r + c];

			word[c] = (uint64_t)(other < own ? other : own);
		}
}

static inline __attribute__((always_inline)) void disc_draw(const struct warp_target *t, const struct disc_one *d,
                                                            int32_t y0, int32_t y1, int32_t columns, int32_t rows)
{
	for (int32_t y = y0; y < y1; y += rows) {
		const uint32_t n_rows = (uint32_t)(y1 - y < rows ? y1 - y : rows);
		uint64_t *row = t->word + (size_t)(y - t->y0) * t->stride;

		for (int32_t x = d->x0; x < d->x1; x += columns) {
			const int32_t left = x < t->x1 - columns ? x : t->x1 - columns;

			disc_draw_window(row + (left - t->x0), t->stride, d, left, y, (uint32_t)columns, (uint32_t)rows, n_rows);
		}
	}
}

static void discs_draw(const struct warp_target *t, const struct discs *d, uint64_t mask)
{
	const int32_t width = t->x1 - t->x0;

	for (uint64_t left = mask; left; left &= left - 1) {
		const uint32_t i = (uint32_t)__builtin_ctzll(left);
		const int32_t x0 = d->x0[i], x1 = d->x1[i], y0 = d->y0[i], y1 = d->y1[i];

		if (x0 >= x1 || y0 >= y1)
			continue;
		const struct disc_one one = {
			d->at[0][i], d->at[1][i], d->at[2][i], { d->radius[0][2][i], d->radius[1][2][i] },
			{ { d->across[0][0][i], d->across[0][1][i] }, { d->across[1][0][i], d->across[1][1][i] } },
			d->rim, t->near_z, x0, x1, d->id + i,
		};
		if (width < 4)
			disc_draw(t, &one, y0, y1, 1, 1);
		else if (x1 - x0 <= 4 || width < 8)
			disc_draw(t, &one, y0, y1, 4, 4);
		else
			disc_draw(t, &one, y0, y1, 8, 2);
	}
}

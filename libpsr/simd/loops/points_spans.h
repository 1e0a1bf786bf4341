/* Where a wide point can be in strips of rows: a rectangle that stands askew fills a third of its bounds. */
#ifndef PSR_SIMD_LOOPS_POINTS_SPANS_H
#define PSR_SIMD_LOOPS_POINTS_SPANS_H

#include "points_place.h"

#define SPANS_ROWS 4   /* of a strip, which is drawn in pieces as wide as high */
#define SPANS_LEAST 10 /* pieces of a point's bounds: of fewer, spans cost what they save */
#ifndef SPANS_LANES
#define SPANS_LANES POINTS_VECTOR /* strips are told in multiples of so many: most points have at most eight */
#endif
#define SPANS_ROOM (TILE_HEIGHT / SPANS_ROWS + POINTS_VECTOR)

/* Pixels x0[s] .. x1[s] - 1 of strip s, from the top of a point's bounds on. */
struct points_spans {
	int32_t x0[SPANS_ROOM], x1[SPANS_ROOM];
};

static inline uint32_t points_strips(int32_t rows)
{
	return (uint32_t)(rows + SPANS_ROWS - 1) / SPANS_ROWS;
}

/* The quadric is in a box over its rectangle; corner j is at its greatest u, v and w by bits 0, 1 and 2. Returns 0 if a
 * corner is not before the eye. */
static inline int place_corners(float x[8], float y[8], const struct points_batch *b, uint32_t i,
                                const struct warp_target *t)
{
	const struct warp_points *points = b->in->points;
	const float a = b->p.lambda[0][i], c = b->p.lambda[1][i], eu = b->extent[0][i], ev = b->extent[1][i];
	const float rise_u = 0.5f * a * eu * eu, rise_v = 0.5f * c * ev * ev;
	const float end[3][2] = { { -eu, eu }, { -ev, ev },
		                      { psr_where(a < 0, rise_u) + psr_where(c < 0, rise_v),
		                        psr_where(a > 0, rise_u) + psr_where(c > 0, rise_v) } };
	float middle[3], axis[3][3], z[8];
	int is_before = 1;

	for (int k = 0; k < 3; k++) {
		const float m[3] = { (float)points->axis[k][0], (float)points->axis[k][1], (float)points->axis[k][2] };

		middle[k] = b->origin[k][i] + points_dot(m[0], m[1], m[2], b->p.at[0][i], b->p.at[1][i], b->p.at[2][i]);
		for (int j = 0; j < 3; j++)
			axis[k][j] = points_dot(m[0], m[1], m[2], b->p.axis[j][0][i], b->p.axis[j][1][i], b->p.axis[j][2][i]);
	}
	for (int j = 0; j < 8; j++) {
		const float u = end[0][j & 1], v = end[1][j >> 1 & 1], w = end[2][j >> 2];

		x[j] = middle[0] + points_dot(axis[0][0], axis[0][1], axis[0][2], u, v, w);
		y[j] = middle[1] + points_dot(axis[1][0], axis[1][1], axis[1][2], u, v, w);
		z[j] = middle[2] + points_dot(axis[2][0], axis[2][1], axis[2][2], u, v, w);
	}
	for (int j = 0; j < 8; j++) {
		const float scale = t->perspective ? 1 / z[j] : 1;

		is_before &= !t->perspective | (z[j] > t->near_z);
		x[j] = x[j] * scale + points->center[0];
		y[j] = y[j] * scale + points->center[1];
	}
	return is_before;
}

/* Widens strips by an edge of the box, where it is within POINTS_ROUNDING of the lines of their pixels' centres. */
static inline void widen_strips(float *restrict least, float *restrict most, uint32_t n, float y0, const float from[2],
                                const float to[2])
{
	const float *high = from[1] < to[1] ? from : to, *low = from[1] < to[1] ? to : from;
	const float x = high[0], y = high[1], end = low[1], across = low[0] - x, down = end - y;
	const float inverse = down > 1e-20f ? 1 / down : 1e20f;

	for (uint32_t s = 0; s < n; s++) {
		const float above = y0 + (float)(int32_t)(s * SPANS_ROWS) - POINTS_ROUNDING;
		const float below = above + (SPANS_ROWS - 1 + 2 * POINTS_ROUNDING);
		const int is_met = (below >= y) & (above <= end);
		const float first = (above - y) * inverse, last = (below - y) * inverse;
		const float t0 = psr_choose(first > 0, first, 0), t1 = psr_choose(last < 1, last, 1);
		const float xa = x + t0 * across, xb = x + t1 * across;
		const float left = psr_choose(xa < xb, xa, xb), right = psr_choose(xa < xb, xb, xa);

		least[s] = psr_choose(is_met & (left < least[s]), left, least[s]);
		most[s] = psr_choose(is_met & (right > most[s]), right, most[s]);
	}
}

/* Whether spans may be worth their cost. */
static inline int has_spans(const struct points_batch *b, uint32_t i)
{
	return points_strips(b->y1[i] - b->y0[i]) * points_strips(b->x1[i] - b->x0[i]) >= SPANS_LEAST;
}

/* Returns 0 where the bounds are all that is known. */
static inline int find_spans(struct points_spans *spans, const struct points_batch *b, uint32_t i,
                             const struct warp_target *t)
{
	static const uint8_t edge[12][2] = { { 0, 1 }, { 2, 3 }, { 4, 5 }, { 6, 7 }, { 0, 2 }, { 1, 3 },
		                                 { 4, 6 }, { 5, 7 }, { 0, 4 }, { 1, 5 }, { 2, 6 }, { 3, 7 } };
	const int32_t x0 = b->x0[i], x1 = b->x1[i];
	const uint32_t n = (points_strips(b->y1[i] - b->y0[i]) + SPANS_LANES - 1) / SPANS_LANES * SPANS_LANES;
	float x[8], y[8], least[SPANS_ROOM], most[SPANS_ROOM];

	if (!place_corners(x, y, b, i, t))
		return 0;
	for (uint32_t s = 0; s < n; s++) {
		least[s] = (float)x1;
		most[s] = (float)x0;
	}
	for (int e = 0; e < 12; e++) {
		const int from = edge[e][0], to = edge[e][1];

		widen_strips(least, most, n, (float)b->y0[i] + 0.5f, (const float[2]){ x[from], y[from] },
		             (const float[2]){ x[to], y[to] });
	}
	for (uint32_t s = 0; s < n; s++) {
		spans->x0[s] = points_pixel(least[s] - POINTS_ROUNDING, x0, x1);
		spans->x1[s] = points_pixel(most[s] + POINTS_ROUNDING, x0, x1);
	}
	return 1;
}

#endif

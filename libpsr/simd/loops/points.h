/* Differential points ([K] 5): each is drawn as the quadric of its curvatures over its rectangle, a ray a pixel. */
#ifndef PSR_SIMD_LOOPS_POINTS_H
#define PSR_SIMD_LOOPS_POINTS_H

#include "points_spans.h"

#define POINTS_NONE 0x7fffffffu /* bits of a depth beyond that of empty words */

/* From the back a point's normal and v, and so its curvatures, are turned. */
static inline void turn_point(struct points_batch *b, uint32_t i)
{
	for (int k = 1; k < 3; k++) {
		b->from[k][i] = -b->from[k][i];
		b->sight[k][i] = -b->sight[k][i];
		b->right[k][i] = -b->right[k][i];
		b->down[k][i] = -b->down[k][i];
	}
	b->p.lambda[0][i] = -b->p.lambda[0][i];
	b->p.lambda[1][i] = -b->p.lambda[1][i];
}

/* Pixels that are met together: lanes in rows of some columns. Columns count from `first` within POINTS_VECTOR of them,
 * so that shapes make no difference to places. */
struct points_shape {
	int32_t columns, lanes;
};

/* Meets lines of sight with the quadric, a u^2 + c v^2 = 2 w: at place s along one, square s^2 - 2 linear s = rest.
 * Where the quadric's normal faces the eye, the derivative along the line is below 0, which tells one root of two. Where
 * there is none, s is no number, and nothing is hit. x: of the centre of column 0, from the point. */
static inline __attribute__((always_inline)) void meet_quadric(uint32_t *bits, const struct warp_target *t,
                                                               const struct points_batch *b, uint32_t of, float x,
                                                               int32_t first, int32_t y, struct points_shape shape)
{
	const float y0 = (float)y + 0.5f, py = b->y[of], a = b->p.lambda[0][of], c = b->p.lambda[1][of];
	const float through = t->perspective ? 1.0f : 0.0f, scale = b->scale[of], z0 = b->z[of], near = t->near_z;
	const float eu = b->extent[0][of], ev = b->extent[1][of];
	const float from[3] = { b->from[0][of], b->from[1][of], b->from[2][of] };
	const float sight[3] = { b->sight[0][of], b->sight[1][of], b->sight[2][of] };
	const float right[3] = { b->right[0][of], b->right[1][of], b->right[2][of] };
	const float down[3] = { b->down[0][of], b->down[1][of], b->down[2][of] };

	for (int32_t i = 0; i < shape.lanes; i++) {
		const float dx = x + (float)(first + i % shape.columns), dy = (y0 + (float)(i / shape.columns)) - py;
		const float su = dx * right[0] + dy * down[0], sv = dx * right[1] + dy * down[1];
		const float sn = dx * right[2] + dy * down[2];
		const float qu = from[0] + scale * su, qv = from[1] + scale * sv, qn2 = 2 * from[2] + 2 * scale * sn;
		const float du = sight[0] + through * su, dv = sight[1] + through * sv, dn = sight[2] + through * sn;
		const float au = a * du, cv = c * dv;
		const float square = au * du + cv * dv, linear = dn - (au * qu + cv * qv);
		const float rest = qn2 - (a * (qu * qu) + c * (qv * qv));
		const float root = __builtin_sqrtf(linear * linear + square * rest);
		const int is_falling = linear <= 0;
		const float above = psr_choose(is_falling, rest, root + linear);
		const float below = psr_choose(is_falling, root - linear, square);
		const float s = above / below, z = z0 + s;
		const float u = qu + s * du, v = qv + s * dv;
		const int is_hit = (__builtin_fabsf(u) <= eu) & (__builtin_fabsf(v) <= ev) & (z > near);
		const uint32_t mask = 0u - (uint32_t)is_hit;

		bits[i] = (psr_bits_from_float(z) & mask) | (POINTS_NONE & ~mask);
	}
}

/* Draws a shape, the upper left pixel of which is (x, y), of pixels left of x1 and above y1. */
static inline __attribute__((always_inline)) void draw_shape(const struct warp_target *t, const struct points_batch *b,
                                                             uint32_t of, int32_t x, int32_t y,
                                                             struct points_shape shape)
{
	const int32_t first = (x - b->x0[of]) % POINTS_VECTOR, across = b->x1[of] - x, down = b->y1[of] - y;
	const int32_t n = across < shape.columns ? across : shape.columns, most = shape.lanes / shape.columns;
	const int32_t rows = down < most ? down : most;
	uint64_t *row = t->word + (size_t)(y - t->y0) * t->stride + (x - t->x0);
	const uint32_t id = b->id[of];
	uint32_t bits[POINTS_VECTOR];

	meet_quadric(bits, t, b, of, (float)(x - first) + 0.5f - b->x[of], first, y, shape);
	for (int32_t r = 0; r < rows; r++, row += t->stride)
		for (int32_t i = 0; i < n; i++) {
			const uint64_t word = (uint64_t)bits[r * shape.columns + i] << 32 | id;

			row[i] = word < row[i] ? word : row[i];
		}
}

/* Draws a point of a batch, over x0..x1, y0..y1; spans: NULL, or of its strips. */
typedef void points_draw_fn(const struct warp_target *t, const struct points_batch *b, uint32_t i,
                            const struct points_spans *spans);

/* Draws the points of POINTS_FRONT_OF_FEW, of at most POINTS_FEW pixels each. Others are lost. */
typedef void points_few_fn(const struct warp_target *t, struct points_batch *b);
#define POINTS_FEW 4

static inline void draw_spans(const struct warp_target *t, const struct points_batch *b, uint32_t i,
                              const struct points_spans *spans)
{
	for (int32_t y = b->y0[i]; y < b->y1[i]; y += 2) {
		const int32_t s = (y - b->y0[i]) / SPANS_ROWS, x0 = b->x0[i] + (spans->x0[s] - b->x0[i]) / 4 * 4;

		for (int32_t x = x0; x < spans->x1[s]; x += 4)
			draw_shape(t, b, i, x, y, (struct points_shape){ 4, 8 });
	}
}

static inline void draw_point(const struct warp_target *t, const struct points_batch *b, uint32_t i,
                              const struct points_spans *spans)
{
	const int32_t width = b->x1[i] - b->x0[i];

	if (spans != NULL)
		draw_spans(t, b, i, spans);
	else if (width <= 4)
		for (int32_t y = b->y0[i]; y < b->y1[i]; y += 2)
			draw_shape(t, b, i, b->x0[i], y, (struct points_shape){ 4, 8 });
	else
		for (int32_t y = b->y0[i]; y < b->y1[i]; y++)
			for (int32_t x = b->x0[i]; x < b->x1[i]; x += 8)
				draw_shape(t, b, i, x, y, (struct points_shape){ 8, 8 });
}

/* few: NULL, or draws points that have few pixels. */
static inline __attribute__((always_inline)) uint64_t draw_batch(const struct warp_target *t, struct points_batch *b,
                                                                 points_draw_fn *draw, points_few_fn *few)
{
	uint32_t shown[POINTS_ROOM], n_shown = 0, n_inside;
	struct points_spans spans;

	points_unpack(&b->p, b->in->points);
	find_extents(b);
	make_rays(b, t);
	n_inside = sort_points(b, t, few != NULL ? POINTS_FEW : 0);
	for (uint32_t i = 0; i < b->p.n; i++) {
		shown[n_shown] = i;
		n_shown += (b->sides[i] & (POINTS_FRONT | POINTS_BACK)) != 0;
	}
	for (uint32_t k = 0; k < n_shown; k++) {
		const uint32_t i = shown[k];
		const struct points_spans *found = has_spans(b, i) && find_spans(&spans, b, i, t) ? &spans : NULL;

		if (b->sides[i] & POINTS_FRONT)
			draw(t, b, i, found);
		if (b->sides[i] & POINTS_BACK) {
			turn_point(b, i);
			draw(t, b, i, found);
		}
	}
	if (few != NULL)
		few(t, b);
	b->p.n = 0;
	return n_inside;
}

static inline __attribute__((always_inline)) uint64_t warp_points_by(points_draw_fn *draw, points_few_fn *few,
                                                                     const struct warp_target *t,
                                                                     const struct bin_entry *entry, uint32_t n)
{
	struct points_batch batch;
	uint64_t n_inside = 0;

	batch.p.n = 0;
	for (uint32_t e = 0; e < n; e++) {
		const struct warp_instance *in = &t->instance[entry[e].instance];

		if (batch.p.n > POINTS_FULL || (batch.p.n > 0 && in != batch.in))
			n_inside += draw_batch(t, &batch, draw, few);
		batch.in = in;
		list_group(&batch, &entry[e]);
	}
	return batch.p.n ? n_inside + draw_batch(t, &batch, draw, few) : n_inside;
}

static inline uint64_t warp_points(const struct warp_target *t, const struct bin_entry *entry, uint32_t n)
{
	return warp_points_by(draw_point, NULL, t, entry, n);
}

#endif

/* Differential points ([K] 5): each is drawn as the quadric of its curvatures over its rectangle, a ray a pixel. */
#ifndef PSR_SIMD_LOOPS_POINTS_H
#define PSR_SIMD_LOOPS_POINTS_H

#include "points_spans.h"

#define POINTS_NONE 0x7fffffffu /* bits of a depth beyond that of empty words */

/* A point that is drawn, from one of its sides: from the back its normal and v, and so its curvatures, are turned. */
struct points_one {
	float x, y, z, scale, from[3], sight[3], right[3], down[3], a, b, extent[2], near, through;
	uint32_t id;
	int32_t x0, x1, y0, y1;
};

static inline void pick_point(struct points_one *to, const struct points_batch *b, uint32_t i)
{
	to->x = b->x[i];
	to->y = b->y[i];
	to->z = b->z[i];
	to->scale = b->scale[i];
	for (int k = 0; k < 3; k++) {
		to->from[k] = b->from[k][i];
		to->sight[k] = b->sight[k][i];
		to->right[k] = b->right[k][i];
		to->down[k] = b->down[k][i];
	}
	to->a = b->p.lambda[0][i];
	to->b = b->p.lambda[1][i];
	to->extent[0] = b->extent[0][i];
	to->extent[1] = b->extent[1][i];
	to->id = b->id[i];
	to->x0 = b->x0[i];
	to->x1 = b->x1[i];
	to->y0 = b->y0[i];
	to->y1 = b->y1[i];
}

static inline void turn_point(struct points_one *p)
{
	for (int k = 1; k < 3; k++) {
		p->from[k] = -p->from[k];
		p->sight[k] = -p->sight[k];
		p->right[k] = -p->right[k];
		p->down[k] = -p->down[k];
	}
	p->a = -p->a;
	p->b = -p->b;
}

/* Pixels that are met together: lanes in rows of some columns. Columns count from `first` within POINTS_VECTOR of them,
 * so that shapes make no difference to places. */
struct points_shape {
	int32_t columns, lanes;
};

/* Meets lines of sight with the quadric, w = (a u^2 + b v^2) / 2: where its normal faces the eye, the derivative of the
 * equation along the line is below 0, which tells one root of two. x: of the centre of column 0, from the point. */
static inline __attribute__((always_inline)) void meet_quadric(uint32_t *bits, const struct points_one *p, float x,
                                                               int32_t first, int32_t y, struct points_shape shape)
{
	const float y0 = (float)y + 0.5f, py = p->y, a = p->a, b = p->b, through = p->through, scale = p->scale;
	const float z0 = p->z, near = p->near, eu = p->extent[0], ev = p->extent[1];

	for (int32_t i = 0; i < shape.lanes; i++) {
		const float dx = x + (float)(first + i % shape.columns), dy = (y0 + (float)(i / shape.columns)) - py;
		const float su = dx * p->right[0] + dy * p->down[0], sv = dx * p->right[1] + dy * p->down[1];
		const float sn = dx * p->right[2] + dy * p->down[2];
		const float qu = p->from[0] + scale * su, qv = p->from[1] + scale * sv, qn = p->from[2] + scale * sn;
		const float du = p->sight[0] + through * su, dv = p->sight[1] + through * sv, dn = p->sight[2] + through * sn;
		const float au = a * du, bv = b * dv;
		const float square = -0.5f * (au * du + bv * dv), linear = dn - (au * qu + bv * qv);
		const float rest = qn - 0.5f * (a * (qu * qu) + b * (qv * qv));
		const float inside = linear * linear - 4 * (square * rest);
		const float root = __builtin_sqrtf(psr_where(inside > 0, inside));
		const int is_falling = linear <= 0;
		const float above = psr_choose(is_falling, 2 * rest, -linear - root);
		const float below = psr_choose(is_falling, root - linear, 2 * square);
		const float s = above / below, z = z0 + s;
		const float u = qu + s * du, v = qv + s * dv;
		const int is_hit = (inside >= 0) & (__builtin_fabsf(u) <= eu) & (__builtin_fabsf(v) <= ev) & (z > near);
		const uint32_t mask = 0u - (uint32_t)is_hit;

		bits[i] = (psr_bits_from_float(z) & mask) | (POINTS_NONE & ~mask);
	}
}

/* Draws a shape, the upper left pixel of which is (x, y), of pixels left of x1 and above y1. */
static inline __attribute__((always_inline)) void draw_shape(const struct warp_target *t, const struct points_one *p,
                                                             int32_t x, int32_t y, struct points_shape shape)
{
	const int32_t first = (x - p->x0) % POINTS_VECTOR, across = p->x1 - x, down = p->y1 - y;
	const int32_t n = across < shape.columns ? across : shape.columns, most = shape.lanes / shape.columns;
	const int32_t rows = down < most ? down : most;
	uint64_t *row = t->word + (size_t)(y - t->y0) * t->stride + (x - t->x0);
	uint32_t bits[POINTS_VECTOR];

	meet_quadric(bits, p, (float)(x - first) + 0.5f - p->x, first, y, shape);
	for (int32_t r = 0; r < rows; r++, row += t->stride)
		for (int32_t i = 0; i < n; i++) {
			const uint64_t word = (uint64_t)bits[r * shape.columns + i] << 32 | p->id;

			row[i] = word < row[i] ? word : row[i];
		}
}

/* Draws a point, over x0..x1, y0..y1; spans: NULL, or of its strips. */
typedef void points_draw_fn(const struct warp_target *t, const struct points_one *p, const struct points_spans *spans);

static inline void draw_spans(const struct warp_target *t, const struct points_one *p, const struct points_spans *spans)
{
	for (int32_t y = p->y0; y < p->y1; y += 2) {
		const int32_t s = (y - p->y0) / SPANS_ROWS, x0 = p->x0 + (spans->x0[s] - p->x0) / 4 * 4;

		for (int32_t x = x0; x < spans->x1[s]; x += 4)
			draw_shape(t, p, x, y, (struct points_shape){ 4, 8 });
	}
}

static inline void draw_point(const struct warp_target *t, const struct points_one *p, const struct points_spans *spans)
{
	const int32_t width = p->x1 - p->x0;

	if (spans != NULL)
		draw_spans(t, p, spans);
	else if (width <= 4)
		for (int32_t y = p->y0; y < p->y1; y += 2)
			draw_shape(t, p, p->x0, y, (struct points_shape){ 4, 8 });
	else
		for (int32_t y = p->y0; y < p->y1; y++)
			for (int32_t x = p->x0; x < p->x1; x += 8)
				draw_shape(t, p, x, y, (struct points_shape){ 8, 8 });
}

static inline __attribute__((always_inline)) uint64_t draw_batch(const struct warp_target *t, struct points_batch *b,
                                                                 points_draw_fn *draw)
{
	struct points_one one = { .near = t->near_z, .through = t->perspective ? 1.0f : 0.0f };
	uint32_t shown[POINTS_ROOM], n_shown = 0, n_inside;
	struct points_spans spans;

	points_unpack(&b->p, b->in->points);
	find_extents(b);
	make_rays(b, t);
	n_inside = sort_points(b, t);
	for (uint32_t i = 0; i < b->p.n; i++) {
		shown[n_shown] = i;
		n_shown += b->sides[i] != 0;
	}
	for (uint32_t k = 0; k < n_shown; k++) {
		const uint32_t i = shown[k];
		const struct points_spans *found = find_spans(&spans, b, i, t) ? &spans : NULL;

		pick_point(&one, b, i);
		if (b->sides[i] & POINTS_FRONT)
			draw(t, &one, found);
		if (b->sides[i] & POINTS_BACK) {
			turn_point(&one);
			draw(t, &one, found);
		}
	}
	b->p.n = 0;
	return n_inside;
}

static inline __attribute__((always_inline)) uint64_t warp_points_by(points_draw_fn *draw, const struct warp_target *t,
                                                                     const struct bin_entry *entry, uint32_t n)
{
	struct points_batch batch;
	uint64_t n_inside = 0;

	batch.p.n = 0;
	for (uint32_t e = 0; e < n; e++) {
		const struct warp_instance *in = &t->instance[entry[e].instance];

		if (batch.p.n > POINTS_FULL || (batch.p.n > 0 && in != batch.in))
			n_inside += draw_batch(t, &batch, draw);
		batch.in = in;
		list_group(&batch, &entry[e]);
	}
	return batch.p.n ? n_inside + draw_batch(t, &batch, draw) : n_inside;
}

static inline uint64_t warp_points(const struct warp_target *t, const struct bin_entry *entry, uint32_t n)
{
	return warp_points_by(draw_point, t, entry, n);
}

#endif

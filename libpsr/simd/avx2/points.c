/* Differential points: squares of 4x4 pixels, and pairs of rows of 8: two vectors at a time. */
#include <immintrin.h>
#include "simd/kernels.h"
#define SPANS_LANES 8
#include "simd/loops/points.h"

#define INLINE static inline __attribute__((always_inline))

/* Lanes of a vector are eight pixels of a row, or four of each of two, in the order that makes words of them by
 * unpacking. */
INLINE __m256i column_of_lane(int columns)
{
	return columns == 4 ? _mm256_setr_epi32(0, 1, 0, 1, 2, 3, 2, 3) : _mm256_setr_epi32(0, 1, 4, 5, 2, 3, 6, 7);
}

INLINE __m256i row_of_lane(int columns)
{
	return columns == 4 ? _mm256_setr_epi32(0, 0, 1, 1, 0, 0, 1, 1) : _mm256_setzero_si256();
}

INLINE __m256 all(float value)
{
	return _mm256_set1_ps(value);
}

INLINE __m256i all_int(int32_t value)
{
	return _mm256_set1_epi32(value);
}

/* Lines of sight of a point. */
struct rays {
	float x;
	__m256 y, z, scale, from[3], sight[3], right[3], down[3], a, c, extent[2], near, scale2;
};

INLINE struct rays rays_of(const struct warp_target *t, const struct points_batch *b, uint32_t i)
{
	struct rays r;

	r.x = b->x[i];
	r.y = all(b->y[i]);
	r.z = all(b->z[i]);
	r.scale = all(b->scale[i]);
	r.scale2 = all(2 * b->scale[i]);
	for (int k = 0; k < 3; k++) {
		r.from[k] = all((k == 2 ? 2 : 1) * b->from[k][i]);
		r.sight[k] = all(b->sight[k][i]);
		r.right[k] = all(b->right[k][i]);
		r.down[k] = all(b->down[k][i]);
	}
	r.a = all(b->p.lambda[0][i]);
	r.c = all(b->p.lambda[1][i]);
	r.extent[0] = all(b->extent[0][i]);
	r.extent[1] = all(b->extent[1][i]);
	r.near = all(t->near_z);
	return r;
}

/* What pixels add to a line of sight along one axis of the picture. */
struct parts {
	__m256 u, v, n;
};

INLINE struct parts parts_of(__m256 by, const __m256 axis[3])
{
	return (struct parts){ by * axis[0], by * axis[1], by * axis[2] };
}

/* first: x - x0, within POINTS_VECTOR. */
INLINE struct parts across_of(const struct rays *p, int32_t x, int32_t first, int columns)
{
	const __m256 column = _mm256_cvtepi32_ps(_mm256_add_epi32(column_of_lane(columns), all_int(first)));

	return parts_of(all((float)(x - first) + 0.5f - p->x) + column, p->right);
}

INLINE struct parts down_of(const struct rays *p, int32_t y, int columns)
{
	return parts_of((all((float)y + 0.5f) + _mm256_cvtepi32_ps(row_of_lane(columns))) - p->y, p->down);
}

INLINE __m256 through(__m256 s, int perspective)
{
	return perspective ? s : _mm256_mul_ps(s, _mm256_setzero_ps());
}

/* A vector's equations: at place s along a line, square s^2 - 2 linear s = rest; q and d of u and v lead there. */
struct equations {
	__m256 qu, qv, du, dv, square, linear, rest, inside;
};

INLINE struct equations equations_of(const struct rays *p, struct parts dx, struct parts dy, int perspective)
{
	const __m256 a = p->a, c = p->c, su = dx.u + dy.u, sv = dx.v + dy.v, sn = dx.n + dy.n;
	const __m256 qu = p->from[0] + p->scale * su, qv = p->from[1] + p->scale * sv, qn2 = p->from[2] + p->scale2 * sn;
	const __m256 du = p->sight[0] + through(su, perspective), dv = p->sight[1] + through(sv, perspective);
	const __m256 dn = p->sight[2] + through(sn, perspective), au = a * du, cv = c * dv;
	const __m256 square = au * du + cv * dv, linear = dn - (au * qu + cv * qv);
	const __m256 rest = qn2 - (a * (qu * qu) + c * (qv * qv)), inside = linear * linear + square * rest;

	return (struct equations){ qu, qv, du, dv, square, linear, rest, inside };
}

INLINE __m256 solve(const struct equations *e, __m256 root)
{
	const __m256 is_falling = _mm256_cmp_ps(e->linear, _mm256_setzero_ps(), _CMP_LE_OQ);
	const __m256 above = _mm256_blendv_ps(root + e->linear, e->rest, is_falling);
	const __m256 below = _mm256_blendv_ps(e->square, root - e->linear, is_falling);

	return above / below;
}

/* Returns bits of z', and POINTS_NONE where nothing is hit or `outside` is set. */
INLINE __m256i place(const struct rays *p, const struct equations *e, __m256 s, __m256i outside)
{
	const __m256 sign = all(-0.0f), z = p->z + s;
	const __m256 u = _mm256_andnot_ps(sign, e->qu + s * e->du), v = _mm256_andnot_ps(sign, e->qv + s * e->dv);
	const __m256 beside = _mm256_or_ps(_mm256_cmp_ps(u, p->extent[0], _CMP_NLE_UQ),
	                                   _mm256_cmp_ps(v, p->extent[1], _CMP_NLE_UQ));
	const __m256 before = _mm256_or_ps(_mm256_cmp_ps(z, p->near, _CMP_NGT_UQ), _mm256_castsi256_ps(outside));
	const __m256i miss = _mm256_castps_si256(_mm256_or_ps(beside, before));

	return _mm256_blendv_epi8(_mm256_castps_si256(z), all_int(POINTS_NONE), miss);
}

/* Has compilers keep the order, so that the processor finds work of one vector while the other one waits. */
INLINE void in_order(__m256 *value, __m256 *other)
{
	__asm__("" : "+x"(*value), "+x"(*other));
}

/* As meet_quadric() of loops/points.h, of two vectors. */
INLINE void meet(__m256i bits[2], const struct rays *p, const struct parts dx[2], const struct parts dy[2],
                 const __m256i outside[2], int perspective)
{
	const struct equations e = equations_of(p, dx[0], dy[0], perspective);
	const struct equations f = equations_of(p, dx[1], dy[1], perspective);
	__m256 r0 = e.inside, r1 = f.inside;

	in_order(&r0, &r1);
	r0 = _mm256_sqrt_ps(r0);
	r1 = _mm256_sqrt_ps(r1);
	in_order(&r0, &r1);
	__m256 s0 = solve(&e, r0), s1 = solve(&f, r1);
	in_order(&s0, &s1);
	bits[0] = place(p, &e, s0, outside[0]);
	bits[1] = place(p, &f, s1, outside[1]);
}

INLINE void lower_four(uint64_t *row, __m256i word)
{
	const __m256i old = _mm256_loadu_si256((const __m256i *)row);

	_mm256_storeu_si256((__m256i *)row, _mm256_blendv_epi8(old, word, _mm256_cmpgt_epi64(old, word)));
}

/* Of a vector that reaches beyond the tile. */
static inline void lower_some(uint64_t *at, uint32_t stride, __m256i bits, uint32_t id, int columns)
{
	_Alignas(32) uint32_t z[8], x[8], y[8];

	_mm256_store_si256((__m256i *)z, bits);
	_mm256_store_si256((__m256i *)x, column_of_lane(columns));
	_mm256_store_si256((__m256i *)y, row_of_lane(columns));
	for (int i = 0; i < 8; i++) {
		uint64_t *to = at + (size_t)y[i] * stride + x[i];
		const uint64_t word = (uint64_t)z[i] << 32 | id;

		if (z[i] != POINTS_NONE)
			*to = word < *to ? word : *to;
	}
}

/* What is drawn of a point. */
struct drawing {
	struct rays rays;
	__m256i id;
	int32_t x1, y1, tile_x1, tile_y1;
	uint32_t stride;
	uintptr_t origin; /* the word of pixel (0, 0), wherever that is */
};

INLINE struct drawing drawing_of(const struct warp_target *t, const struct points_batch *b, uint32_t i)
{
	const uintptr_t before = ((uintptr_t)t->y0 * t->stride + (uintptr_t)t->x0) * sizeof *t->word;

	return (struct drawing){ rays_of(t, b, i), all_int((int32_t)b->id[i]), b->x1[i], b->y1[i], t->x1, t->y1,
		                     t->stride, (uintptr_t)t->word - before };
}

INLINE void lower(const struct drawing *d, int32_t x, int32_t y, __m256i bits, int columns)
{
	uint64_t *at = (uint64_t *)(d->origin + ((uintptr_t)y * d->stride + (uintptr_t)x) * sizeof *at);

	if ((x + columns > d->tile_x1) | (y + 8 / columns > d->tile_y1)) {
		lower_some(at, d->stride, bits, (uint32_t)_mm256_extract_epi32(d->id, 0), columns);
		return;
	}
	lower_four(at, _mm256_unpacklo_epi32(d->id, bits));
	lower_four(columns == 4 ? at + d->stride : at + 4, _mm256_unpackhi_epi32(d->id, bits));
}

/* Four rows, of two vectors. */
struct four_rows {
	struct parts down[2];
	__m256i below[2]; /* the point's bounds */
};

INLINE struct four_rows four_rows_of(const struct drawing *d, int32_t y)
{
	const __m256i row = row_of_lane(4);

	return (struct four_rows){ { down_of(&d->rays, y, 4), down_of(&d->rays, y + 2, 4) },
		                       { _mm256_cmpgt_epi32(row, all_int(d->y1 - y - 1)),
		                         _mm256_cmpgt_epi32(row, all_int(d->y1 - y - 3)) } };
}

INLINE void draw_square(const struct drawing *d, const struct four_rows *rows, struct parts across, int32_t x,
                        int32_t y, int perspective)
{
	const __m256i beside = _mm256_cmpgt_epi32(column_of_lane(4), all_int(d->x1 - x - 1));
	const __m256i outside[2] = { _mm256_or_si256(beside, rows->below[0]), _mm256_or_si256(beside, rows->below[1]) };
	__m256i bits[2];

	meet(bits, &d->rays, (const struct parts[2]){ across, across }, rows->down, outside, perspective);
	lower(d, x, y, bits[0], 4);
	if (y + 2 < d->y1)
		lower(d, x, y + 2, bits[1], 4);
}

INLINE void draw_narrow(const struct drawing *d, int32_t x, int32_t y0, int perspective)
{
	const struct parts across = across_of(&d->rays, x, 0, 4);

	for (int32_t y = y0; y < d->y1; y += 4) {
		const struct four_rows rows = four_rows_of(d, y);

		draw_square(d, &rows, across, x, y, perspective);
	}
}

/* Pairs of rows of eight. */
INLINE void draw_rows(const struct drawing *d, int32_t x0, int32_t y0, int perspective)
{
	for (int32_t x = x0; x < d->x1; x += 8) {
		const struct parts across = across_of(&d->rays, x, (x - x0) % POINTS_VECTOR, 8);
		const __m256i beside = _mm256_cmpgt_epi32(column_of_lane(8), all_int(d->x1 - x - 1));

		for (int32_t y = y0; y < d->y1; y += 2) {
			const struct parts down[2] = { down_of(&d->rays, y, 8), down_of(&d->rays, y + 1, 8) };
			__m256i bits[2];

			meet(bits, &d->rays, (const struct parts[2]){ across, across }, down, (const __m256i[2]){ beside, beside },
			     perspective);
			lower(d, x, y, bits[0], 8);
			if (y + 1 < d->y1)
				lower(d, x, y + 1, bits[1], 8);
		}
	}
}

INLINE void draw_squares(const struct drawing *d, int32_t x0, int32_t y0, const struct points_spans *spans,
                         int perspective)
{
	for (int32_t y = y0, s = 0; y < d->y1; y += SPANS_ROWS, s++) {
		const struct four_rows rows = four_rows_of(d, y);
		const int32_t begin = spans != NULL ? x0 + (spans->x0[s] - x0) / 4 * 4 : x0;
		const int32_t end = spans != NULL ? spans->x1[s] : d->x1;

		for (int32_t x = begin; x < end; x += 4)
			draw_square(d, &rows, across_of(&d->rays, x, (x - x0) % POINTS_VECTOR, 4), x, y, perspective);
	}
}

INLINE void draw_by(const struct warp_target *t, const struct points_batch *b, uint32_t i,
                    const struct points_spans *spans, int perspective)
{
	const struct drawing d = drawing_of(t, b, i);
	const int32_t x0 = b->x0[i], y0 = b->y0[i], width = d.x1 - x0, height = d.y1 - y0;

	if (spans == NULL && width <= 4)
		draw_narrow(&d, x0, y0, perspective);
	else if (spans == NULL && (width + 7) / 8 * ((height + 1) / 2) <= (width + 3) / 4 * ((height + 3) / 4))
		draw_rows(&d, x0, y0, perspective);
	else
		draw_squares(&d, x0, y0, spans, perspective);
}

static void draw_point_avx2(const struct warp_target *t, const struct points_batch *b, uint32_t i,
                            const struct points_spans *spans)
{
	if (t->perspective)
		draw_by(t, b, i, spans, 1);
	else
		draw_by(t, b, i, spans, 0);
}

uint64_t warp_points_avx2(const struct warp_target *t, const struct bin_entry *entry, uint32_t n)
{
	return warp_points_by(draw_point_avx2, NULL, t, entry, n);
}

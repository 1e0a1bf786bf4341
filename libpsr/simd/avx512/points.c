/* Differential points: what compilers' vectors are poor at, words of which some are lowered. Small points take a vector
 * of 4x4 or 8x2 pixels. */
#include <immintrin.h>
#include "simd/kernels.h"
#include "simd/loops/points.h"

/* What lanes of a shape add to its first pixel. */
struct steps {
	__m512 x, y;
};

static inline struct steps steps_of(int columns)
{
	const __m512i lane = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
	const __m512i x = _mm512_and_si512(lane, _mm512_set1_epi32(columns - 1));
	const __m512i y = _mm512_srli_epi32(lane, columns == 4 ? 2 : columns == 8 ? 3 : 4);

	return (struct steps){ _mm512_cvtepi32_ps(x), _mm512_cvtepi32_ps(y) };
}

static inline __m512 all(float value)
{
	return _mm512_set1_ps(value);
}

/* As meet_quadric() of loops/points.h: sets z', returns which lanes hit. x: of the centre of column 0. */
static inline __mmask16 meet(__m512 *z_out, const struct points_one *p, float x, int32_t y, struct steps steps)
{
	const __m512 zero = _mm512_setzero_ps(), half = all(0.5f), two = all(2), a = all(p->a), b = all(p->b);
	const __m512 scale = all(p->scale), through = all(p->through);
	const __m512 dx = all(x) + steps.x, dy = (all((float)y + 0.5f) + steps.y) - all(p->y);
	const __m512 su = dx * all(p->right[0]) + dy * all(p->down[0]), sv = dx * all(p->right[1]) + dy * all(p->down[1]);
	const __m512 sn = dx * all(p->right[2]) + dy * all(p->down[2]);
	const __m512 qu = all(p->from[0]) + scale * su, qv = all(p->from[1]) + scale * sv;
	const __m512 qn = all(p->from[2]) + scale * sn;
	const __m512 du = all(p->sight[0]) + through * su, dv = all(p->sight[1]) + through * sv;
	const __m512 dn = all(p->sight[2]) + through * sn, au = a * du, bv = b * dv;
	const __m512 square = -half * (au * du + bv * dv), linear = dn - (au * qu + bv * qv);
	const __m512 rest = qn - half * (a * (qu * qu) + b * (qv * qv));
	const __m512 inside = linear * linear - all(4) * (square * rest);
	const __m512 root = _mm512_sqrt_ps(_mm512_max_ps(inside, zero)); /* 0 for NaN */
	const __mmask16 is_falling = _mm512_cmp_ps_mask(linear, zero, _CMP_LE_OQ);
	const __m512 above = _mm512_mask_blend_ps(is_falling, -linear - root, two * rest);
	const __m512 below = _mm512_mask_blend_ps(is_falling, two * square, root - linear);
	const __m512 s = above / below, z = all(p->z) + s;
	__mmask16 k = _mm512_cmp_ps_mask(inside, zero, _CMP_GE_OQ);

	k = _mm512_mask_cmp_ps_mask(k, _mm512_abs_ps(qu + s * du), all(p->extent[0]), _CMP_LE_OQ);
	k = _mm512_mask_cmp_ps_mask(k, _mm512_abs_ps(qv + s * dv), all(p->extent[1]), _CMP_LE_OQ);
	*z_out = z;
	return _mm512_mask_cmp_ps_mask(k, z, all(p->near), _CMP_GT_OQ);
}

/* The lowest n bits of a mask, all for n of 16 or more. */
static inline uint32_t lowest(uint32_t mask, int32_t n)
{
	return _bzhi_u32(mask, n < 16 ? (uint32_t)n : 16);
}

/* The words of half of a vector; beyond all others where nothing hits. */
static inline __m512i words_of(__m256i z, uint32_t k, __m512i id)
{
	const __m512i depth = _mm512_slli_epi64(_mm512_cvtepu32_epi64(z), 32);

	return _mm512_mask_or_epi64(_mm512_set1_epi64(-1), (__mmask8)k, depth, id);
}

static inline void lower_eight(uint64_t *row, __m512i word)
{
	_mm512_storeu_si512(row, _mm512_min_epu64(_mm512_loadu_si512(row), word));
}

static inline void lower_four(uint64_t *row, __m256i word)
{
	_mm256_storeu_si256((__m256i *)row, _mm256_min_epu64(_mm256_loadu_si256((const __m256i *)row), word));
}

/* Where the vector reaches beyond the tile. */
static inline void lower_some(uint64_t *row, uint32_t stride, uint32_t k, __m512i bits, uint32_t id, int columns)
{
	_Alignas(64) uint32_t z[16];

	_mm512_store_si512(z, bits);
	for (; k; k &= k - 1) {
		const uint32_t i = (uint32_t)__builtin_ctz(k), column = i % (uint32_t)columns;
		uint64_t *at = row + (size_t)(i / (uint32_t)columns) * stride + column;
		const uint64_t word = (uint64_t)z[i] << 32 | id;

		*at = word < *at ? word : *at;
	}
}

/* Draws rows of 4, 8 or 16 pixels, the upper left of which is (x, y). Stores without masks are forwarded to the loads
 * of the next point there; so columns beyond the point's bounds get their own words again. from: of the centre of
 * column 0 from the point, see meet_quadric(). */
static inline __attribute__((always_inline)) void draw_vector(const struct warp_target *t, const struct points_one *p,
                                                              int32_t x, int32_t y, float from, struct steps steps,
                                                              int columns)
{
	const __m512i id = _mm512_set1_epi64(p->id);
	uint64_t *row = t->word + (ptrdiff_t)(y - t->y0) * t->stride + (x - t->x0);
	const uint32_t stride = t->stride;
	const int32_t n = p->x1 - x, rows = p->y1 - y;
	uint32_t k = columns == 4 ? lowest(15, n) * 0x1111 : columns == 8 ? lowest(255, n) * 0x101 : lowest(0xffff, n);
	__m512 z;

	k = lowest(k, rows * columns) & meet(&z, p, from, y, steps);
	const __m512i bits = _mm512_castps_si512(z);
	if (x + columns > t->x1 || y + 16 / columns > t->y1) {
		lower_some(row, stride, k, bits, p->id, columns);
		return;
	}
	const __m512i upper = words_of(_mm512_castsi512_si256(bits), k, id);
	const __m512i lower = words_of(_mm512_extracti64x4_epi64(bits, 1), k >> 8, id);
	if (columns == 4) {
		lower_four(row, _mm512_castsi512_si256(upper));
		lower_four(row + stride, _mm512_extracti64x4_epi64(upper, 1));
		lower_four(row + (size_t)2 * stride, _mm512_castsi512_si256(lower));
		lower_four(row + (size_t)3 * stride, _mm512_extracti64x4_epi64(lower, 1));
	} else {
		lower_eight(row, upper);
		lower_eight(columns == 8 ? row + stride : row + 8, lower);
	}
}

static inline __attribute__((always_inline)) void draw_rows(const struct warp_target *t, const struct points_one *p,
                                                            int columns)
{
	const struct steps steps = steps_of(columns);

	for (int32_t y = p->y0; y < p->y1; y += 16 / columns)
		for (int32_t x = p->x0; x < p->x1; x += columns)
			draw_vector(t, p, x, y, (float)x + 0.5f - p->x, steps, columns);
}

static inline void draw_spans_avx512(const struct warp_target *t, const struct points_one *p,
                                     const struct points_spans *spans)
{
	const struct steps steps = steps_of(4);

	for (int32_t y = p->y0, s = 0; y < p->y1; y += 4, s++) {
		const int32_t x0 = p->x0 + (spans->x0[s] - p->x0) / 4 * 4;

		for (int32_t x = x0; x < spans->x1[s]; x += 4) {
			const int32_t first = (x - p->x0) % 16;
			const struct steps from = { steps.x + all((float)first), steps.y };

			draw_vector(t, p, x, y, (float)(x - first) + 0.5f - p->x, from, 4);
		}
	}
}

static inline void draw_point_avx512(const struct warp_target *t, const struct points_one *p,
                                     const struct points_spans *spans)
{
	const int32_t width = p->x1 - p->x0;

	if (spans != NULL)
		draw_spans_avx512(t, p, spans);
	else if (width <= 4)
		draw_rows(t, p, 4);
	else if (width <= 8)
		draw_rows(t, p, 8);
	else
		draw_rows(t, p, 16);
}

uint64_t warp_points_avx512(const struct warp_target *t, const struct bin_entry *entry, uint32_t n)
{
	return warp_points_by(draw_point_avx512, t, entry, n);
}

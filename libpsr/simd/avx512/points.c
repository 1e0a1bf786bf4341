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

/* Lines of sight of a point, or of one a lane. */
struct rays {
	__m512 x, y, z, scale, from[3], sight[3], right[3], down[3], a, c, extent[2], near, through;
};

static inline __m512 each(const float *value)
{
	return _mm512_set1_ps(*value);
}

static inline __m512 sixteen(const float *value)
{
	return _mm512_loadu_ps(value);
}

/* load: of point i, or of it and those that follow. */
static inline __attribute__((always_inline)) struct rays rays_of(const struct warp_target *t,
                                                                 const struct points_batch *b, uint32_t i,
                                                                 __m512 (*load)(const float *))
{
	struct rays r;

	r.x = load(&b->x[i]);
	r.y = load(&b->y[i]);
	r.z = load(&b->z[i]);
	r.scale = load(&b->scale[i]);
	for (int k = 0; k < 3; k++) {
		r.from[k] = load(&b->from[k][i]);
		r.sight[k] = load(&b->sight[k][i]);
		r.right[k] = load(&b->right[k][i]);
		r.down[k] = load(&b->down[k][i]);
	}
	r.a = load(&b->p.lambda[0][i]);
	r.c = load(&b->p.lambda[1][i]);
	r.extent[0] = load(&b->extent[0][i]);
	r.extent[1] = load(&b->extent[1][i]);
	r.near = all(t->near_z);
	r.through = all(t->perspective ? 1.0f : 0.0f);
	return r;
}

/* As meet_quadric() of loops/points.h: sets z', returns which lanes hit. */
static inline __mmask16 meet(__m512 *z_out, const struct rays *p, __m512 dx, __m512 dy)
{
	const __m512 zero = _mm512_setzero_ps(), two = all(2), a = p->a, c = p->c;
	const __m512 su = dx * p->right[0] + dy * p->down[0], sv = dx * p->right[1] + dy * p->down[1];
	const __m512 sn = dx * p->right[2] + dy * p->down[2];
	const __m512 qu = p->from[0] + p->scale * su, qv = p->from[1] + p->scale * sv;
	const __m512 qn2 = two * p->from[2] + two * p->scale * sn;
	const __m512 du = p->sight[0] + p->through * su, dv = p->sight[1] + p->through * sv;
	const __m512 dn = p->sight[2] + p->through * sn, au = a * du, cv = c * dv;
	const __m512 square = au * du + cv * dv, linear = dn - (au * qu + cv * qv);
	const __m512 rest = qn2 - (a * (qu * qu) + c * (qv * qv));
	const __m512 root = _mm512_sqrt_ps(linear * linear + square * rest);
	const __mmask16 is_falling = _mm512_cmp_ps_mask(linear, zero, _CMP_LE_OQ);
	const __m512 above = _mm512_mask_blend_ps(is_falling, root + linear, rest);
	const __m512 below = _mm512_mask_blend_ps(is_falling, square, root - linear);
	const __m512 s = above / below, z = p->z + s;
	__mmask16 k = _mm512_cmp_ps_mask(_mm512_abs_ps(qu + s * du), p->extent[0], _CMP_LE_OQ);

	k = _mm512_mask_cmp_ps_mask(k, _mm512_abs_ps(qv + s * dv), p->extent[1], _CMP_LE_OQ);
	*z_out = z;
	return _mm512_mask_cmp_ps_mask(k, z, p->near, _CMP_GT_OQ);
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
 * of the next point there; so columns beyond the point's bounds get their own words again. first: x - x0 within 16. */
static inline __attribute__((always_inline)) void draw_vector(const struct warp_target *t, const struct points_batch *b,
                                                              uint32_t i, const struct rays *rays, int32_t x, int32_t y,
                                                              int32_t first, struct steps steps, int columns)
{
	const uint32_t stride = t->stride, point = b->id[i];
	const __m512i id = _mm512_set1_epi64(point);
	const __m512 across = all((float)(x - first) + 0.5f - b->x[i]), down = all((float)y + 0.5f) + steps.y;
	uint64_t *row = t->word + (ptrdiff_t)(y - t->y0) * t->stride + (x - t->x0);
	const int32_t n = b->x1[i] - x, rows = b->y1[i] - y;
	uint32_t k = columns == 4 ? lowest(15, n) * 0x1111 : columns == 8 ? lowest(255, n) * 0x101 : lowest(0xffff, n);
	__m512 z;

	k = lowest(k, rows * columns) & meet(&z, rays, across + (steps.x + all((float)first)), down - rays->y);
	const __m512i bits = _mm512_castps_si512(z);
	if (x + columns > t->x1 || y + 16 / columns > t->y1) {
		lower_some(row, stride, k, bits, point, columns);
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

/* Rows of 16 count columns from each vector, others are one vector wide. */
static inline __attribute__((always_inline)) void draw_rows(const struct warp_target *t, const struct points_batch *b,
                                                            uint32_t i, int columns)
{
	const struct steps steps = steps_of(columns);
	const struct rays rays = rays_of(t, b, i, each);

	for (int32_t y = b->y0[i]; y < b->y1[i]; y += 16 / columns)
		for (int32_t x = b->x0[i]; x < b->x1[i]; x += columns)
			draw_vector(t, b, i, &rays, x, y, 0, steps, columns);
}

static inline void draw_spans_avx512(const struct warp_target *t, const struct points_batch *b, uint32_t i,
                                     const struct points_spans *spans)
{
	const struct steps steps = steps_of(4);
	const struct rays rays = rays_of(t, b, i, each);

	for (int32_t y = b->y0[i], s = 0; y < b->y1[i]; y += 4, s++) {
		const int32_t x0 = b->x0[i] + (spans->x0[s] - b->x0[i]) / 4 * 4;

		for (int32_t x = x0; x < spans->x1[s]; x += 4)
			draw_vector(t, b, i, &rays, x, y, (x - b->x0[i]) % 16, steps, 4);
	}
}

static inline void draw_point_avx512(const struct warp_target *t, const struct points_batch *b, uint32_t i,
                                     const struct points_spans *spans)
{
	const int32_t width = b->x1[i] - b->x0[i];

	if (spans != NULL)
		draw_spans_avx512(t, b, i, spans);
	else if (width <= 4)
		draw_rows(t, b, i, 4);
	else if (width <= 8)
		draw_rows(t, b, i, 8);
	else
		draw_rows(t, b, i, 16);
}

/* Moves the values of some lanes to the front. */
static inline void gather_lanes(void *values, const __mmask16 *is_some, uint32_t lanes)
{
	uint32_t *from = values, *to = values;

	for (uint32_t i = 0; i < lanes; i += 16) {
		const __mmask16 k = is_some[i / 16];

		_mm512_storeu_si512(to, _mm512_maskz_compress_epi32(k, _mm512_loadu_si512(from + i)));
		to += __builtin_popcount(k);
	}
}

/* Returns how many points have few pixels, which are first then. */
static inline uint32_t gather_few(struct points_batch *b)
{
	const uint32_t lanes = points_lanes(b->p.n);
	float *const values[] = { b->x, b->y, b->z, b->scale, b->p.lambda[0], b->p.lambda[1], b->extent[0], b->extent[1] };
	__mmask16 is_few[POINTS_ROOM / 16];
	uint32_t n = 0;

	for (uint32_t i = 0; i < lanes; i += 16) {
		const __m512i sides = _mm512_loadu_si512(b->sides + i);

		is_few[i / 16] = _mm512_cmpeq_epi32_mask(sides, _mm512_set1_epi32(POINTS_FRONT_OF_FEW));
		n += (uint32_t)__builtin_popcount(is_few[i / 16]);
	}
	if (n == 0)
		return 0;
	for (uint32_t k = 0; k < sizeof values / sizeof *values; k++)
		gather_lanes(values[k], is_few, lanes);
	for (int k = 0; k < 3; k++) {
		gather_lanes(b->from[k], is_few, lanes);
		gather_lanes(b->sight[k], is_few, lanes);
		gather_lanes(b->right[k], is_few, lanes);
		gather_lanes(b->down[k], is_few, lanes);
	}
	gather_lanes(b->x0, is_few, lanes);
	gather_lanes(b->y0, is_few, lanes);
	gather_lanes(b->x1, is_few, lanes);
	gather_lanes(b->y1, is_few, lanes);
	gather_lanes(b->id, is_few, lanes);
	return n;
}

/* A point a lane, one pixel each at a time. */
static void draw_few(const struct warp_target *t, struct points_batch *b)
{
	const uint32_t n = gather_few(b);

	for (uint32_t i = 0; i < n; i += 16) {
		const struct rays rays = rays_of(t, b, i, sixteen);
		const __m512i x0 = _mm512_loadu_si512(b->x0 + i), y0 = _mm512_loadu_si512(b->y0 + i);
		const __m512i width = _mm512_sub_epi32(_mm512_loadu_si512(b->x1 + i), x0);
		const __m512i height = _mm512_sub_epi32(_mm512_loadu_si512(b->y1 + i), y0);
		const __m512i n_pixels = _mm512_mullo_epi32(width, height);
		const __mmask16 is_some = (__mmask16)lowest(0xffff, (int32_t)(n - i));
		const __m512 across = _mm512_cvtepi32_ps(x0) + all(0.5f) - rays.x, top = _mm512_cvtepi32_ps(y0) + all(0.5f);
		__m512i column = _mm512_setzero_si512(), row = column;

		for (int j = 0; j < POINTS_FEW; j++) {
			const __m512i pixel = _mm512_set1_epi32(j);
			const __mmask16 has = _mm512_mask_cmpgt_epi32_mask(is_some, n_pixels, pixel);
			_Alignas(64) uint32_t bits[16], x[16], y[16];
			__m512 z;

			if (!has)
				break;
			uint32_t k = has & meet(&z, &rays, across + _mm512_cvtepi32_ps(column),
			                        (top + _mm512_cvtepi32_ps(row)) - rays.y);
			_mm512_store_ps((float *)bits, z);
			_mm512_store_si512(x, _mm512_add_epi32(x0, column));
			_mm512_store_si512(y, _mm512_add_epi32(y0, row));
			for (; k; k &= k - 1) {
				const uint32_t lane = (uint32_t)__builtin_ctz(k);
				uint64_t *at = t->word + (size_t)(y[lane] - (uint32_t)t->y0) * t->stride + (x[lane] - (uint32_t)t->x0);
				const uint64_t word = (uint64_t)bits[lane] << 32 | b->id[i + lane];

				*at = word < *at ? word : *at;
			}
			column = _mm512_add_epi32(column, _mm512_set1_epi32(1));
			const __mmask16 is_next = _mm512_cmpge_epi32_mask(column, width);
			row = _mm512_mask_add_epi32(row, is_next, row, _mm512_set1_epi32(1));
			column = _mm512_mask_mov_epi32(column, is_next, _mm512_setzero_si512());
		}
	}
}

uint64_t warp_points_avx512(const struct warp_target *t, const struct bin_entry *entry, uint32_t n)
{
	return warp_points_by(draw_point_avx512, draw_few, t, entry, n);
}

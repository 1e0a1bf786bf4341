/* What the warps of blocks and of leaves share. */
#ifndef PSR_SIMD_AVX512_WARP_PARTS_H
#define PSR_SIMD_AVX512_WARP_PARTS_H

#include <immintrin.h>
#include "simd/kernels.h"
#include "simd/veil_list.h"

/* Values that do not fit, and NaN, become INT32_MIN, outside of every picture. */
static inline __m512i floor_int(__m512 u)
{
	return _mm512_cvt_roundps_epi32(u, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
}

static inline __m512 sight_axis(const struct warp_instance *in, int k, __m512 u, __m512 v)
{
	const __m512 across = _mm512_mul_ps(u, _mm512_set1_ps(in->du[k])),
				 down = _mm512_mul_ps(v, _mm512_set1_ps(in->dv[k]));

	return _mm512_add_ps(_mm512_add_ps(across, down), _mm512_set1_ps(in->d0[k]));
}

static inline __m512 dot(const __m512 a[3], const __m512 b[3])
{
	return _mm512_add_ps(_mm512_add_ps(_mm512_mul_ps(a[0], b[0]), _mm512_mul_ps(a[1], b[1])),
	                     _mm512_mul_ps(a[2], b[2]));
}

static inline __m512i tens_of(const struct warp_target *t, __m512i normal)
{
	return _mm512_i32gather_epi32(normal, t->direction, 4);
}

/* Components of normals of psr_direction_tens(), 511 times as long. */
static inline void components_of(__m512 n[3], __m512i tens)
{
	for (int i = 0; i < 3; i++)
		n[i] = _mm512_cvtepi32_ps(_mm512_srai_epi32(_mm512_slli_epi32(tens, (unsigned)(22 - 10 * i)), 22));
}

/* The lanes of k whose samples face away. */
static inline __mmask16 faces_away(const struct warp_instance *in, __mmask16 k, const __m512 n[3], __m512 u, __m512 v)
{
	__m512 d[3];

	for (int i = 0; i < 3; i++)
		d[i] = sight_axis(in, i, u, v);
	const __m512 g = dot(n, d), limit = _mm512_mul_ps(_mm512_set1_ps(BACK_SINE * BACK_SINE * 511 * 511), dot(d, d));
	k = _mm512_mask_cmp_ps_mask(k, g, _mm512_setzero_ps(), _CMP_GT_OQ);
	return _mm512_mask_cmp_ps_mask(k, _mm512_mul_ps(g, g), limit, _CMP_GT_OQ);
}

/* The lanes of k with first <= a < end. */
static inline __mmask16 within(__mmask16 k, __m512i a, int32_t first, int32_t end)
{
	const __m512i from = _mm512_sub_epi32(a, _mm512_set1_epi32(first));

	return _mm512_mask_cmplt_epu32_mask(k, from, _mm512_set1_epi32(end - first));
}

static inline void list_cells(struct cells *list, const struct warp_target *t, __mmask16 k, __m512i u, __m512i v,
                              __m512 z)
{
	const struct warp_cells *cells = &t->cells[list->level];
	const __m512i one = _mm512_set1_epi32(1), by = _mm512_set1_epi32((int)list->level);
	const __m512i x = _mm512_add_epi32(_mm512_srav_epi32(u, by), one),
				  y = _mm512_add_epi32(_mm512_srav_epi32(v, by), one);
	const __m512i at = _mm512_add_epi32(_mm512_mullo_epi32(y, _mm512_set1_epi32((int)cells->stride)), x);

	k = within(within(k, u, cells->x0, cells->x1), v, cells->y0, cells->y1);
	_mm512_storeu_si512(list->at + list->n, _mm512_maskz_compress_epi32(k, at));
	_mm512_storeu_si512(list->z + list->n, _mm512_maskz_compress_epi32(k, _mm512_castps_si512(z)));
	list->n += (uint32_t)__builtin_popcount(k);
}

/* Samples under way: their places, ids, depths and veils. */
struct warped {
	__m512i at, id, z, veil;
};

/* Lists the words of the lanes of k from element n on; returns the end of the list. A block that is not mixed most
 * often lists all samples, which then need no compression. */
static inline uint32_t list_words(struct words *list, uint32_t n, struct veils *veils, int is_mixed, __mmask16 k,
                                  struct warped s)
{
	const __m512i low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
	const __m512i high = _mm512_setr_epi32(8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);

	if (is_mixed | (k & (k + 1))) {
		s.at = _mm512_maskz_compress_epi32(k, s.at);
		s.id = _mm512_maskz_compress_epi32(k, s.id);
		s.z = _mm512_maskz_compress_epi32(k, s.z);
		s.veil = _mm512_maskz_compress_epi32(k, s.veil);
	}
	if (veils != NULL)
		_mm512_storeu_si512(veils->veil + n, s.veil);
	_mm512_storeu_si512(list->at + n, s.at);
	_mm512_storeu_si512(list->word + n, _mm512_permutex2var_epi32(s.id, low, s.z));
	_mm512_storeu_si512(list->word + n + 8, _mm512_permutex2var_epi32(s.id, high, s.z));
	return n + (uint32_t)__builtin_popcount(k);
}

/* Lists the lanes of a mask, in order. */
static inline void list_lanes(uint8_t lane[64], uint64_t mask)
{
	static const uint8_t ordinals[64] = {
		0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21,
		22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39, 40, 41, 42, 43,
		44, 45, 46, 47, 48, 49, 50, 51, 52, 53, 54, 55, 56, 57, 58, 59, 60, 61, 62, 63,
	};

	_mm512_storeu_si512(lane, _mm512_maskz_compress_epi8(mask, _mm512_loadu_si512(ordinals)));
}

#endif

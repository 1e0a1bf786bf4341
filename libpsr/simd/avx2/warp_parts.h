/* What the warps of blocks and of leaves share. */
#ifndef PSR_SIMD_AVX2_WARP_PARTS_H
#define PSR_SIMD_AVX2_WARP_PARTS_H

#include <immintrin.h>
#include <string.h>
#include "simd/kernels.h"
#include "simd/veil_list.h"
#include "lanes.h"

/* Values that do not fit, and NaN, become INT32_MIN, outside of every picture. */
static inline __m256i floor_int(__m256 u)
{
	return _mm256_cvttps_epi32(_mm256_floor_ps(u));
}

static inline __m256 sight_axis(const struct warp_instance *in, int k, __m256 u, __m256 v)
{
	const __m256 across = _mm256_mul_ps(u, _mm256_set1_ps(in->du[k])),
				 down = _mm256_mul_ps(v, _mm256_set1_ps(in->dv[k]));

	return _mm256_add_ps(_mm256_add_ps(across, down), _mm256_set1_ps(in->d0[k]));
}

static inline __m256 dot(const __m256 a[3], const __m256 b[3])
{
	return _mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(a[0], b[0]), _mm256_mul_ps(a[1], b[1])),
	                     _mm256_mul_ps(a[2], b[2]));
}

static inline __m256i tens_of(const struct warp_target *t, __m256i normal)
{
	return _mm256_i32gather_epi32((const int *)t->direction, normal, 4);
}

/* Components of normals of psr_direction_tens(), 511 times as long. */
static inline void components_of(__m256 n[3], __m256i tens)
{
	for (int i = 0; i < 3; i++)
		n[i] = _mm256_cvtepi32_ps(_mm256_srai_epi32(_mm256_slli_epi32(tens, 22 - 10 * i), 22));
}

/* A mask has all bits of a lane set, or none. */
static inline __m256i faces_away(const struct warp_instance *in, const __m256 n[3], __m256 u, __m256 v)
{
	__m256 d[3];

	for (int i = 0; i < 3; i++)
		d[i] = sight_axis(in, i, u, v);
	const __m256 g = dot(n, d), limit = _mm256_mul_ps(_mm256_set1_ps(BACK_SINE * BACK_SINE * 511 * 511), dot(d, d));
	const __m256 behind = _mm256_cmp_ps(g, _mm256_setzero_ps(), _CMP_GT_OQ);
	return _mm256_castps_si256(_mm256_and_ps(behind, _mm256_cmp_ps(_mm256_mul_ps(g, g), limit, _CMP_GT_OQ)));
}

/* Lanes with first <= a < end. */
static inline __m256i within(__m256i a, int32_t first, int32_t end)
{
	return _mm256_andnot_si256(_mm256_cmpgt_epi32(_mm256_set1_epi32(first), a),
	                           _mm256_cmpgt_epi32(_mm256_set1_epi32(end), a));
}

static inline uint32_t bits_of(__m256i k)
{
	return (uint32_t)_mm256_movemask_ps(_mm256_castsi256_ps(k));
}

static inline void store(void *to, __m256i value)
{
	_mm256_storeu_si256(to, value);
}

static inline void list_cells(struct cells *list, const struct warp_target *t, __m256i k, __m256i u, __m256i v,
                              __m256 z)
{
	const struct warp_cells *cells = &t->cells[list->level];
	const __m256i one = _mm256_set1_epi32(1), by = _mm256_set1_epi32((int)list->level);

	k = _mm256_and_si256(k, _mm256_and_si256(within(u, cells->x0, cells->x1), within(v, cells->y0, cells->y1)));
	const __m256i x = _mm256_add_epi32(_mm256_srav_epi32(u, by), one),
				  y = _mm256_add_epi32(_mm256_srav_epi32(v, by), one);
	const __m256i at = _mm256_add_epi32(_mm256_mullo_epi32(y, _mm256_set1_epi32((int)cells->stride)), x);
	const uint32_t bits = bits_of(k);
	const __m256i front = front_of(bits);
	store(list->at + list->n, _mm256_permutevar8x32_epi32(at, front));
	store(list->z + list->n, _mm256_permutevar8x32_epi32(_mm256_castps_si256(z), front));
	list->n += (uint32_t)__builtin_popcount(bits);
}

/* Samples under way: their places, ids, depths and veils. */
struct warped {
	__m256i at, id, z, veil;
};

static inline void list_words(struct words *list, struct veils *veils, __m256i k, const struct warped *s)
{
	const uint32_t bits = bits_of(k);
	const __m256i front = front_of(bits), own = _mm256_permutevar8x32_epi32(s->id, front);
	const __m256i depth = _mm256_permutevar8x32_epi32(s->z, front);
	const __m256i low = _mm256_unpacklo_epi32(own, depth), high = _mm256_unpackhi_epi32(own, depth);

	store(list->at + list->n, _mm256_permutevar8x32_epi32(s->at, front));
	if (veils != NULL)
		store(veils->veil + list->n, _mm256_permutevar8x32_epi32(s->veil, front));
	store(list->word + list->n, _mm256_permute2x128_si256(low, high, 0x20));
	store(list->word + list->n + 4, _mm256_permute2x128_si256(low, high, 0x31));
	list->n += (uint32_t)__builtin_popcount(bits);
}

/* Lists the indices of the bits of a mask, in order; later elements are undefined. */
static inline void list_samples(uint8_t sample[64 + 8], uint64_t mask)
{
	uint32_t n = 0;

	for (uint64_t row = 0; row < 8; row++) {
		const uint64_t bits = mask >> 8 * row & 0xff;
		const uint64_t numbers = front_lanes((uint32_t)bits) + row * UINT64_C(0x0808080808080808);

		memcpy(sample + n, &numbers, sizeof numbers);
		n += (uint32_t)__builtin_popcountll(bits);
	}
}

#endif

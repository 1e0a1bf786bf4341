/* What the warp of leaves as points and as splats share: places by two terms, as [B] (1), and offsets. */
#ifndef PSR_SIMD_AVX512_LEAF_PARTS_H
#define PSR_SIMD_AVX512_LEAF_PARTS_H

#include "simd/cube.h"
#include "warp_parts.h"

/* Terms of an axis: of a cube's octants, given its middle's, and of leaves. */
static inline __m512 rows_at(double middle, const double row[8])
{
	return _mm512_castps256_ps512(_mm512_cvtpd_ps(_mm512_add_pd(_mm512_set1_pd(middle), _mm512_loadu_pd(row))));
}

static inline __m512 cols_of(const struct warp_octants *octants, int a)
{
	return _mm512_broadcast_f32x8(_mm256_loadu_ps(octants->col[a]));
}

/* Of `leaf` the low three bits count. */
static inline __m512 axis_of(__m512 rows, __m512 columns, __m512i octant, __m512i leaf)
{
	return _mm512_add_ps(_mm512_permutexvar_ps(octant, rows), _mm512_permutexvar_ps(leaf, columns));
}

static inline __m512 offset_axis(const struct warp_octants *octants, int a, const __m512 n[3], __m512 offset)
{
	const float *along = octants->along[a];
	const __m512 x = _mm512_mul_ps(n[0], _mm512_set1_ps(along[0])), y = _mm512_mul_ps(n[1], _mm512_set1_ps(along[1]));
	const __m512 z = _mm512_mul_ps(n[2], _mm512_set1_ps(along[2]));

	return _mm512_mul_ps(_mm512_add_ps(_mm512_add_ps(x, y), z), offset);
}

/* The offsets of the lanes of k. */
static inline __m512 offsets_of(const uint8_t *offset, __mmask16 k)
{
	const __m512i step = _mm512_cvtepu8_epi32(_mm_maskz_loadu_epi8(k, offset));

	return _mm512_cvtepi32_ps(_mm512_sub_epi32(_mm512_add_epi32(step, step), _mm512_set1_epi32(WARP_OFFSET_MIDDLE)));
}

#endif

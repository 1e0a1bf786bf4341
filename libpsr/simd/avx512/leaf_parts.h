/* What the warp of leaves as points and as splats share: places by two terms, as [B] (1), and offsets. */
#ifndef PSR_SIMD_AVX512_LEAF_PARTS_H
#define PSR_SIMD_AVX512_LEAF_PARTS_H

#include "simd/cube.h"
#include "warp_parts.h"

static inline __m512 rows_of(const struct warp_cube *cube, int a)
{
	const __m512d at = _mm512_add_pd(_mm512_set1_pd(cube->origin[a]), _mm512_loadu_pd(cube->octants->row[a]));

	return _mm512_castps256_ps512(_mm512_cvtpd_ps(at));
}

static inline __m512 axis_of(__m512 rows, const float *columns, __m512i octant, __m512i leaf)
{
	const __m512 cols = _mm512_castps256_ps512(_mm256_loadu_ps(columns));

	return _mm512_add_ps(_mm512_permutexvar_ps(octant, rows), _mm512_permutexvar_ps(leaf, cols));
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

/* What the warp of leaves as points and as splats share: places by two terms, as [B] (1), and offsets. */
#ifndef PSR_SIMD_AVX2_LEAF_PARTS_H
#define PSR_SIMD_AVX2_LEAF_PARTS_H

#include "simd/cube.h"
#include "warp_parts.h"

/* Terms of an axis: of a cube's octants, given its middle's, and of leaves. */
static inline __m256 rows_at(double middle, const double row[8])
{
	const __m256d at = _mm256_set1_pd(middle);

	return _mm256_set_m128(_mm256_cvtpd_ps(_mm256_add_pd(at, _mm256_loadu_pd(row + 4))),
	                       _mm256_cvtpd_ps(_mm256_add_pd(at, _mm256_loadu_pd(row))));
}

static inline __m256 cols_of(const struct warp_octants *octants, int a)
{
	return _mm256_loadu_ps(octants->col[a]);
}

/* Of `leaf` the low three bits count. */
static inline __m256 axis_of(__m256 rows, __m256 columns, __m256i octant, __m256i leaf)
{
	return _mm256_add_ps(_mm256_permutevar8x32_ps(rows, octant), _mm256_permutevar8x32_ps(columns, leaf));
}

static inline __m256 offset_axis(const struct warp_octants *octants, int a, const __m256 n[3], __m256 offset)
{
	const float *along = octants->along[a];
	const __m256 x = _mm256_mul_ps(n[0], _mm256_set1_ps(along[0])), y = _mm256_mul_ps(n[1], _mm256_set1_ps(along[1]));
	const __m256 z = _mm256_mul_ps(n[2], _mm256_set1_ps(along[2]));

	return _mm256_mul_ps(_mm256_add_ps(_mm256_add_ps(x, y), z), offset);
}

/* Normals of the next 8 leaves, and steps of their offsets; zeros where fewer, n_ahead, are left in the tree. */
static inline __m128i normals_of(const uint16_t *normal, uint64_t n_ahead)
{
	uint16_t some[8] = { 0 };

	if (n_ahead < 8)
		normal = memcpy(some, normal, n_ahead * sizeof *some);
	return _mm_loadu_si128((const __m128i *)normal);
}

static inline __m128i steps_of(const uint8_t *offset, uint64_t n_ahead)
{
	uint8_t some[8] = { 0 };

	if (n_ahead < 8)
		offset = memcpy(some, offset, n_ahead);
	return _mm_loadl_epi64((const __m128i *)offset);
}

static inline __m256 offsets_of(__m128i steps)
{
	const __m256i step = _mm256_cvtepu8_epi32(steps);

	return _mm256_cvtepi32_ps(_mm256_sub_epi32(_mm256_add_epi32(step, step), _mm256_set1_epi32(WARP_OFFSET_MIDDLE)));
}

#endif

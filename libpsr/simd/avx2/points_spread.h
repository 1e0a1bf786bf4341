/* Eight pixels have at most eight runs, which follow each other: a permutation. */
#ifndef PSR_SIMD_AVX2_POINTS_SPREAD_H
#define PSR_SIMD_AVX2_POINTS_SPREAD_H

#include <immintrin.h>
#include <stdint.h>

static inline void points_spread_avx2(float *to, const float *from, const uint32_t *run, uint32_t first, uint32_t end)
{
	for (uint32_t i = first; i < end; i += 8) {
		const __m256i of = _mm256_loadu_si256((const __m256i *)(run + i));
		const __m256i at = _mm256_sub_epi32(of, _mm256_set1_epi32((int)run[i]));

		_mm256_storeu_ps(to + i, _mm256_permutevar8x32_ps(_mm256_loadu_ps(from + run[i]), at));
	}
}

#define POINTS_SPREAD points_spread_avx2

#endif

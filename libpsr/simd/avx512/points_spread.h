/* Sixteen pixels have at most sixteen runs, which follow each other: a permutation. */
#ifndef PSR_SIMD_AVX512_POINTS_SPREAD_H
#define PSR_SIMD_AVX512_POINTS_SPREAD_H

#include <immintrin.h>
#include <stdint.h>

static inline void points_spread_avx512(float *to, const float *from, const uint32_t *run, uint32_t first, uint32_t end)
{
	for (uint32_t i = first; i < end; i += 16) {
		const __m512i at = _mm512_sub_epi32(_mm512_loadu_si512(run + i), _mm512_set1_epi32((int)run[i]));

		_mm512_storeu_ps(to + i, _mm512_permutexvar_ps(at, _mm512_loadu_ps(from + run[i])));
	}
}

#define POINTS_SPREAD points_spread_avx512

#endif

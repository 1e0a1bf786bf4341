/* Eight pixels have at most eight runs, which follow each other: a permutation. */
#ifndef PSR_SIMD_AVX2_POINTS_SPREAD_H
#define PSR_SIMD_AVX2_POINTS_SPREAD_H

#include "lanes.h"

static inline __attribute__((always_inline)) void points_spread_avx2(float *const *to, const float *const *from,
                                                                     const uint32_t *run, uint32_t first, uint32_t end)
{
	for (uint32_t i = first; i < end; i += 8) {
		const uint32_t begin = run[i];
		const __m256i of = _mm256_loadu_si256((const __m256i *)(run + i));
		const __m256i at = _mm256_sub_epi32(of, _mm256_set1_epi32((int)begin));

#pragma GCC unroll 14
		for (int k = 0; k < 14; k++)
			_mm256_storeu_ps(to[k] + i, _mm256_permutevar8x32_ps(_mm256_loadu_ps(from[k] + begin), at));
	}
}

/* Eight pixels at a time begin as many runs as they have ids that differ from the one before. */
static inline uint32_t points_find_runs_avx2(uint32_t *run, uint32_t *id_of_run, const uint32_t *id, uint32_t first,
                                             uint32_t end)
{
	const __m256i one_back = _mm256_setr_epi32(7, 0, 1, 2, 3, 4, 5, 6);
	__m256i last = _mm256_set1_epi32((int)id[first]);
	uint32_t n = 0;

	id_of_run[0] = id[first];
	for (uint32_t i = first; i < end; i += 8) {
		const __m256i now = _mm256_loadu_si256((const __m256i *)(id + i));
		const __m256i turned = _mm256_permutevar8x32_epi32(now, one_back);
		const __m256i is_same = _mm256_cmpeq_epi32(now, _mm256_blend_epi32(turned, last, 1));
		const uint32_t differs = ~(uint32_t)_mm256_movemask_ps(_mm256_castsi256_ps(is_same)) & 0xff;
		const uint32_t begins = _bzhi_u32(differs, end - i < 8 ? end - i : 8);
		/* Each byte is the sum of the bits up to its own. */
		const uint64_t sums = _pdep_u64(begins, UINT64_C(0x0101010101010101)) * UINT64_C(0x0101010101010101);
		const __m256i runs = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((long long)sums));

		_mm256_storeu_si256((__m256i *)(run + i), _mm256_add_epi32(runs, _mm256_set1_epi32((int)n)));
		_mm256_storeu_si256((__m256i *)(id_of_run + n + 1), _mm256_permutevar8x32_epi32(now, front_of(begins)));
		n += (uint32_t)__builtin_popcount(begins);
		last = turned;
	}
	return n;
}

#define POINTS_SPREAD points_spread_avx2
#define POINTS_FIND_RUNS points_find_runs_avx2

#endif

/* Sixteen pixels have at most sixteen runs, which follow each other: a permutation. */
#ifndef PSR_SIMD_AVX512_POINTS_SPREAD_H
#define PSR_SIMD_AVX512_POINTS_SPREAD_H

#include <immintrin.h>
#include <stddef.h>
#include <stdint.h>

static inline __attribute__((always_inline)) void points_spread_avx512(float *const *to, const float *const *from,
                                                                       const uint32_t *run, uint32_t first,
                                                                       uint32_t end)
{
	for (uint32_t i = first; i < end; i += 16) {
		const uint32_t begin = run[i];
		const __m512i at = _mm512_sub_epi32(_mm512_loadu_si512(run + i), _mm512_set1_epi32((int)begin));

#pragma GCC unroll 14
		for (int k = 0; k < 14; k++)
			_mm512_storeu_ps(to[k] + i, _mm512_permutexvar_ps(at, _mm512_loadu_ps(from[k] + begin)));
	}
}

/* How many of the lanes up to each one are set. */
static inline __m512i points_count_lanes(__mmask16 k)
{
	__m512i sum = _mm512_maskz_set1_epi32(k, 1);
	const __m512i zero = _mm512_setzero_si512();

	sum = _mm512_add_epi32(sum, _mm512_alignr_epi32(sum, zero, 15));
	sum = _mm512_add_epi32(sum, _mm512_alignr_epi32(sum, zero, 14));
	sum = _mm512_add_epi32(sum, _mm512_alignr_epi32(sum, zero, 12));
	return _mm512_add_epi32(sum, _mm512_alignr_epi32(sum, zero, 8));
}

/* Sixteen pixels at a time begin as many runs as they have ids that differ from the one before. */
static inline uint32_t points_find_runs_avx512(uint32_t *run, uint32_t *id_of_run, const uint32_t *id, uint32_t first,
                                               uint32_t end)
{
	uint32_t n = 0;

	id_of_run[0] = id[first];
	for (uint32_t i = first; i < end; i += 16) {
		const __mmask16 is_some = (__mmask16)(end - i < 16 ? (1u << (end - i)) - 1 : 0xffff);
		const __mmask16 has_before = (__mmask16)(i > first ? is_some : is_some & 0xfffe);
		const __m512i now = _mm512_maskz_loadu_epi32(is_some, id + i);
		const __m512i before = _mm512_maskz_loadu_epi32(has_before, (const int *)id + (ptrdiff_t)i - 1);
		const __mmask16 begins = _mm512_mask_cmpneq_epi32_mask(has_before, now, before);
		__m512i at = _mm512_set1_epi32((int)n);

		if (begins) {
			at = _mm512_add_epi32(at, points_count_lanes(begins));
			_mm512_storeu_si512(id_of_run + n + 1, _mm512_maskz_compress_epi32(begins, now));
			n += (uint32_t)__builtin_popcount(begins);
		}
		_mm512_storeu_si512(run + i, at);
	}
	return n;
}

#define POINTS_SPREAD points_spread_avx512
#define POINTS_FIND_RUNS points_find_runs_avx512

#endif

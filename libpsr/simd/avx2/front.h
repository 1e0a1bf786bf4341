/* The order that brings the lanes of a mask to the front. */
#ifndef PSR_SIMD_AVX2_FRONT_H
#define PSR_SIMD_AVX2_FRONT_H

#include <immintrin.h>
#include <stdint.h>

/* The numbers of the bits of a mask of eight, a byte each, then zeros. */
static inline uint64_t front_lanes(uint32_t bits)
{
	return _pext_u64(UINT64_C(0x0706050403020100), _pdep_u64(bits, UINT64_C(0x0101010101010101)) * 0xff);
}

static inline __m256i front_of(uint32_t bits)
{
	return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((long long)front_lanes(bits)));
}

#endif

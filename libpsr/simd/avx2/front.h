/* Lanes of a mask of eight, brought to the front and back. */
#ifndef PSR_SIMD_AVX2_FRONT_H
#define PSR_SIMD_AVX2_FRONT_H

#include <immintrin.h>
#include <stdint.h>

/* A byte of ones for each bit. */
static inline uint64_t bytes_of(uint32_t bits)
{
	return _pdep_u64(bits, UINT64_C(0x0101010101010101)) * 0xff;
}

/* The numbers of the bits, a byte each, then zeros. */
static inline uint64_t front_lanes(uint32_t bits)
{
	return _pext_u64(UINT64_C(0x0706050403020100), bytes_of(bits));
}

/* The order that brings the lanes of the mask to the front. */

static inline __m256i front_of(uint32_t bits)
{
	return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((long long)front_lanes(bits)));
}

/* The order that brings them back; 0 elsewhere. */
static inline __m256i back_of(uint32_t bits)
{
	const uint64_t lanes = _pdep_u64(UINT64_C(0x0706050403020100), bytes_of(bits));

	return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((long long)lanes));
}

/* All bits of a lane set, or none. */
static inline __m256i lanes_of(uint32_t bits)
{
	return _mm256_cvtepi8_epi32(_mm_cvtsi64_si128((long long)bytes_of(bits)));
}

#endif

/* Lanes of eight: of masks, brought to the front and back, and of words. */
#ifndef PSR_SIMD_AVX2_LANES_H
#define PSR_SIMD_AVX2_LANES_H

#include <immintrin.h>
#include <stddef.h>
#include <stdint.h>
#include "simd/zstack.h"

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

/* Eight words of a picture, in two halves. */
struct eight_words {
	__m256i a, b;
};

static inline struct eight_words load_eight(const uint64_t *word)
{
	return (struct eight_words){ _mm256_loadu_si256((const __m256i *)word),
		                         _mm256_loadu_si256((const __m256i *)(word + 4)) };
}

/* The last words of a row, fewer than eight, and their weights, or 1 each if `weight` is NULL; then empty ones. */
struct last_words {
	uint64_t word[8];
	uint16_t weight[8];
};

static inline struct last_words last_of(const uint64_t *word, const uint16_t *weight, uint32_t n)
{
	struct last_words last;

	for (uint32_t i = 0; i < 8; i++) {
		last.word[i] = i < n ? word[i] : PSR_WORD_EMPTY;
		last.weight[i] = i < n && weight != NULL ? weight[i] : 1;
	}
	return last;
}

/* The low 32 bits of eight lanes of 64. */
static inline __m256i low_of(struct eight_words w)
{
	const __m256 low = _mm256_shuffle_ps(_mm256_castsi256_ps(w.a), _mm256_castsi256_ps(w.b), _MM_SHUFFLE(2, 0, 2, 0));

	return _mm256_permute4x64_epi64(_mm256_castps_si256(low), _MM_SHUFFLE(3, 1, 2, 0));
}

/* All bits of a lane set where a word is empty. */
static inline struct eight_words empty_of(struct eight_words w)
{
	const __m256i empty = _mm256_set1_epi64x((long long)PSR_WORD_EMPTY);

	return (struct eight_words){ _mm256_cmpeq_epi64(w.a, empty), _mm256_cmpeq_epi64(w.b, empty) };
}

#endif

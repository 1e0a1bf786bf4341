#include <string.h>
#include "simd/gaps.h"
#include "simd/kernels.h"
#include "lanes.h"

static inline void place_eight(uint8_t *to, const uint64_t *word, const uint16_t *weight)
{
	const struct eight_words words = load_eight(word);
	const __m256i weights = _mm256_cvtepu16_epi32(_mm_loadu_si128((const __m128i *)weight));
	const __m256i is_light = _mm256_cmpgt_epi32(_mm256_set1_epi32(GAPS_WHOLE / 2), weights);
	const __m256i none = _mm256_or_si256(is_light, low_of(empty_of(words)));
	const __m256i own = _mm256_and_si256(low_of(words), _mm256_set1_epi32(PSR_PLACE_NONE - 1));
	const __m256i place = _mm256_blendv_epi8(own, _mm256_set1_epi32(PSR_PLACE_NONE), none);
	const __m128i half = _mm_packus_epi32(_mm256_castsi256_si128(place), _mm256_extracti128_si256(place, 1));

	_mm_storel_epi64((__m128i *)to, _mm_packus_epi16(half, half));
}

void smooth_places_avx2(uint8_t *place, const uint64_t *word, const uint16_t *weight, uint32_t n)
{
	uint32_t x = 0;

	for (; x + 8 <= n; x += 8)
		place_eight(place + x, word + x, weight + x);
	if (x < n) {
		const struct last_words last = last_of(word + x, weight + x, n - x);
		uint8_t some[8];

		place_eight(some, last.word, last.weight);
		memcpy(place + x, some, n - x);
	}
}

#include <immintrin.h>
#include <string.h>
#include "base/srgb.h"
#include "simd/kernels.h"
#include "simd/loops/strip_parts.h"
#include "front.h"

#define AHEAD (2 * STRIP) /* words: prefetch the strip after the next */

/* Lists those of eight pixels from p->x0 + first on that have a sample, and returns their mask. */
static inline uint32_t list_eight(struct strip_pixels *p, uint32_t n, const uint64_t *word, const uint16_t *weight,
                                  uint32_t first, unsigned place_bits)
{
	const __m256i empty = _mm256_set1_epi64x((long long)PSR_WORD_EMPTY);
	const __m256i a = _mm256_loadu_si256((const __m256i *)word), b = _mm256_loadu_si256((const __m256i *)(word + 4));
	const __m256d is_empty[2] = { _mm256_castsi256_pd(_mm256_cmpeq_epi64(a, empty)),
		                          _mm256_castsi256_pd(_mm256_cmpeq_epi64(b, empty)) };
	uint32_t none = (uint32_t)_mm256_movemask_pd(is_empty[0]) | (uint32_t)_mm256_movemask_pd(is_empty[1]) << 4;

	if (weight != NULL) {
		const __m128i zero = _mm_setzero_si128();
		const __m128i is_zero = _mm_cmpeq_epi16(_mm_loadu_si128((const __m128i *)weight), zero);

		none |= (uint32_t)_mm_movemask_epi8(_mm_packs_epi16(is_zero, zero));
	}
	const uint32_t k = none ^ 0xff;
	const __m128i front = _mm_cvtsi64_si128((long long)front_lanes(k));
	const __m256 low = _mm256_shuffle_ps(_mm256_castsi256_ps(a), _mm256_castsi256_ps(b), _MM_SHUFFLE(2, 0, 2, 0));
	const __m256i in_order = _mm256_permute4x64_epi64(_mm256_castps_si256(low), _MM_SHUFFLE(3, 1, 2, 0));
	const __m256i id = _mm256_srl_epi32(in_order, _mm_cvtsi32_si128((int)place_bits));

	_mm256_storeu_si256((__m256i *)(p->id + n), _mm256_permutevar8x32_epi32(id, _mm256_cvtepu8_epi32(front)));
	_mm_storeu_si128((__m128i *)(p->x + n), _mm_add_epi16(_mm_cvtepu8_epi16(front), _mm_set1_epi16((short)first)));
	return k;
}

void strip_list_avx2(struct strip_pixels *p, const uint64_t *word, const uint16_t *weight, uint32_t n_pixels,
                     unsigned place_bits)
{
	uint32_t n = 0, first = 0;

	memset(p->has_sample, 0, sizeof p->has_sample);
	for (; first + 8 <= n_pixels; first += 8) {
		_mm_prefetch((const char *)(word + first + AHEAD), _MM_HINT_T0);
		const uint32_t k = list_eight(p, n, word + first, weight != NULL ? weight + first : NULL, first, place_bits);

		p->has_sample[first / 32] |= k << first % 32;
		n += (uint32_t)__builtin_popcount(k);
	}
	if (first < n_pixels) {
		uint64_t rest[8];
		uint16_t rest_weight[8];

		for (uint32_t i = 0; i < 8; i++) {
			const int is_there = first + i < n_pixels;

			rest[i] = is_there ? word[first + i] : PSR_WORD_EMPTY;
			rest_weight[i] = is_there && weight != NULL ? weight[first + i] : 1;
		}
		const uint32_t k = list_eight(p, n, rest, rest_weight, first, place_bits);

		p->has_sample[first / 32] |= k << first % 32;
		n += (uint32_t)__builtin_popcount(k);
	}
	p->n = n;
	p->word = word;
}

#include <immintrin.h>
#include "simd/kernels.h"

void strip_list_avx512(struct strip *strip, const uint64_t *word, const uint16_t *weight, uint32_t n_pixels)
{
	const __m512i empty = _mm512_set1_epi64((long long)PSR_WORD_EMPTY);
	__m512i x = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
	uint32_t n = 0;
	for (uint32_t first = 0; first < n_pixels; first += 16) {
		const uint32_t left = n_pixels - first < 16 ? n_pixels - first : 16;
		__mmask16 k = (__mmask16)_bzhi_u32(0xffff, left);
		const __m512i low = _mm512_maskz_loadu_epi64((__mmask8)k, word + first);
		const __m512i high = _mm512_maskz_loadu_epi64((__mmask8)(k >> 8), word + first + 8);
		const __mmask16 covered = (__mmask16)(_mm512_cmpneq_epi64_mask(low, empty) | _mm512_cmpneq_epi64_mask(high, empty) << 8);
		if (weight)
			k = _mm256_mask_test_epi16_mask(k, _mm256_maskz_loadu_epi16(k, weight + first), _mm256_set1_epi16(-1));
		k &= covered;
		const __m512i id = _mm512_inserti64x4(_mm512_castsi256_si512(_mm512_cvtepi64_epi32(low)), _mm512_cvtepi64_epi32(high), 1);
		_mm512_storeu_si512(strip->id + n, _mm512_maskz_compress_epi32(k, id));
		_mm256_storeu_si256((__m256i *)(strip->x + n), _mm512_cvtepi32_epi16(_mm512_maskz_compress_epi32(k, x)));
		n += (uint32_t)__builtin_popcount(k);
		x = _mm512_add_epi32(x, _mm512_set1_epi32(16));
	}
	strip->n = n;
}

#include <immintrin.h>
#include "psr/direction.h"
#include "simd/instance.h"
#include "simd/kernels.h"

/* The n lowest bits, of which there are `most`, below 64. */
static inline uint64_t lowest(uint32_t n, uint32_t most)
{
	return (UINT64_C(1) << (n < most ? n : most)) - 1;
}

void strip_list_avx512(struct strip_pixels *p, const uint64_t *word, const uint16_t *weight, uint32_t n_pixels)
{
	const __m512i empty = _mm512_set1_epi64((long long)PSR_WORD_EMPTY);
	__m512i x = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
	uint16_t *covered = (uint16_t *)p->covered;
	uint32_t n = 0;
	_mm256_storeu_si256((__m256i *)p->covered, _mm256_setzero_si256());
	for (uint32_t first = 0; first < n_pixels; first += 16) {
		__mmask16 k = (__mmask16)lowest(n_pixels - first, 16);
		const __m512i low = _mm512_maskz_loadu_epi64((__mmask8)k, word + first);
		const __m512i high = _mm512_maskz_loadu_epi64((__mmask8)(k >> 8), word + first + 8);
		const __mmask16 has_word = (__mmask16)(_mm512_cmpneq_epi64_mask(low, empty) | _mm512_cmpneq_epi64_mask(high, empty) << 8);
		if (weight)
			k = _mm256_mask_test_epi16_mask(k, _mm256_maskz_loadu_epi16(k, weight + first), _mm256_set1_epi16(-1));
		k &= has_word;
		const __m512i id = _mm512_inserti64x4(_mm512_castsi256_si512(_mm512_cvtepi64_epi32(low)), _mm512_cvtepi64_epi32(high), 1);
		_mm512_storeu_si512(p->id + n, _mm512_maskz_compress_epi32(k, id));
		_mm256_storeu_si256((__m256i *)(p->x + n), _mm512_cvtepi32_epi16(_mm512_maskz_compress_epi32(k, x)));
		covered[first / 16] = k;
		n += (uint32_t)__builtin_popcount(k);
		x = _mm512_add_epi32(x, _mm512_set1_epi32(16));
	}
	p->n = n;
}

/* ---- find ---- */

/* Elements of arrays of bytes or of 16 bits, by the aligned words that they are in: no page is touched that has none of them. */
static inline __m256i gather_u16(__mmask8 k, const uint16_t *from, __m256i index)
{
	const uintptr_t odd = (uintptr_t)from / sizeof *from % 2;
	const __m256i at = _mm256_add_epi32(index, _mm256_set1_epi32((int)odd));
	const __m256i word = _mm256_mmask_i32gather_epi32(_mm256_setzero_si256(), k, _mm256_srli_epi32(at, 1), from - odd, 4);
	const __m256i shift = _mm256_slli_epi32(_mm256_and_si256(at, _mm256_set1_epi32(1)), 4);
	return _mm256_and_si256(_mm256_srlv_epi32(word, shift), _mm256_set1_epi32(0xffff));
}

static inline __m256i gather_u8(__mmask8 k, const uint8_t *from, __m256i index)
{
	const uintptr_t odd = (uintptr_t)from % 4;
	const __m256i at = _mm256_add_epi32(index, _mm256_set1_epi32((int)odd));
	const __m256i word = _mm256_mmask_i32gather_epi32(_mm256_setzero_si256(), k, _mm256_srli_epi32(at, 2), from - odd, 4);
	const __m256i shift = _mm256_slli_epi32(_mm256_and_si256(at, _mm256_set1_epi32(3)), 3);
	return _mm256_srlv_epi32(word, shift);
}

/* Indices of the attributes of samples i .. i + 7, of those in k. */
static inline __m512i find_attributes(const struct psr_blocks *b, __mmask8 k, __m256i block, __m256i sample)
{
	_Static_assert(PSR_RUN_BLOCKS == 1 << 10 && sizeof *b->run == 8, "indices into runs");
	const __m256i run = _mm256_mmask_i32gather_epi32(_mm256_setzero_si256(), k, _mm256_srli_epi32(block, 10), &b->run->attr_first, 8);
	const __m256i first = _mm256_add_epi32(run, gather_u16(k, b->attr_offset, block));
	const __m512i mask = _mm512_mask_i32gather_epi64(_mm512_setzero_si512(), k, block, b->mask, 8);
	const __m512i below = _mm512_andnot_si512(_mm512_sllv_epi64(_mm512_set1_epi64(-1), _mm512_cvtepu32_epi64(sample)), mask);
	return _mm512_add_epi64(_mm512_cvtepu32_epi64(first), _mm512_popcnt_epi64(below));
}

void strip_find_avx512(struct strip_pixels *p, const struct strip_view *view)
{
	for (uint32_t first = 0, end; first < p->n; first = end) {
		const struct warp_instance *in = instance_run(&end, p, view, first);
		const struct psr_blocks *b = in->blocks;
		for (uint32_t i = first; i < end; i += 8) {
			const __mmask8 k = (__mmask8)lowest(end - i, 8);
			const __m256i id = _mm256_loadu_si256((const __m256i *)(p->id + i));
			const __m256i block = _mm256_sub_epi32(_mm256_srli_epi32(id, 6), _mm256_set1_epi32((int)in->first_slot));
			const __m512i index = find_attributes(b, k, block, _mm256_and_si256(id, _mm256_set1_epi32(PSR_BLOCK_SAMPLES - 1)));
			const __m512i at = _mm512_add_epi64(_mm512_set1_epi64((long long)(uintptr_t)b->attr), _mm512_slli_epi64(index, 3));
			__m256i flags = _mm256_setzero_si256();
			_mm512_mask_storeu_epi64(p->at + i, k, at);
			if (view->needs & STRIP_TWO_SIDED)
				flags = _mm256_and_si256(gather_u8(k, b->flags, block), _mm256_set1_epi32(PSR_BLOCK_TWO_SIDED));
			_mm256_mask_cvtepi32_storeu_epi8(p->two_sided + i, k, flags);
			for (uint32_t j = i; j < i + 8 && j < end; j++)
				_mm_prefetch((const char *)p->at[j], _MM_HINT_T0);
		}
	}
}

/* ---- write ---- */

/* The 16 first elements of an array that lanes are for, 8 bits for 16 each. */
static inline __m512i codes_of(const uint8_t *srgb, __mmask16 lanes, const uint16_t *light)
{
	const __m512i index = _mm512_cvtepu16_epi32(_mm256_maskz_loadu_epi16(lanes, light));
	const __m512i word = _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), lanes, index, srgb, 1);
	return _mm512_and_si512(word, _mm512_set1_epi32(0xff));
}

/* Sample i on are those of the pixels in k. */
static inline __m512i pixels_of(const struct strip *strip, const uint8_t *srgb, uint32_t i, __mmask16 k, __m512i empty)
{
	const __mmask16 lanes = (__mmask16)lowest((uint32_t)__builtin_popcount(k), 16);
	const __m512i r = codes_of(srgb, lanes, strip->r + i), g = codes_of(srgb, lanes, strip->g + i);
	const __m512i b = codes_of(srgb, lanes, strip->b + i);
	const __m512i rgb = _mm512_or_si512(_mm512_or_si512(r, _mm512_slli_epi32(g, 8)), _mm512_slli_epi32(b, 16));
	return _mm512_mask_expand_epi32(empty, k, rgb);
}

static inline void write_linear(uint16_t *to, const uint16_t *from, __mmask32 k, uint16_t background, uint32_t n)
{
	const __mmask32 lanes = (__mmask32)lowest((uint32_t)__builtin_popcount(k), 32);
	const __m512i light = _mm512_maskz_loadu_epi16(lanes, from), empty = _mm512_set1_epi16((short)background);
	_mm512_mask_storeu_epi16(to, (__mmask32)lowest(n, 32), _mm512_mask_expand_epi16(empty, k, light));
}

static const uint8_t first_three[64] = {
	0,  1,  2,  4,  5,  6,  8,  9,  10, 12, 13, 14, 16, 17, 18, 20, 21, 22, 24, 25, 26, 28, 29, 30,
	32, 33, 34, 36, 37, 38, 40, 41, 42, 44, 45, 46, 48, 49, 50, 52, 53, 54, 56, 57, 58, 60, 61, 62,
};

void strip_write_avx512(const struct strip *strip, const struct strip_target *target, uint32_t n)
{
	const size_t first = (size_t)strip->pixels->y * target->width + strip->pixels->x0;
	const uint16_t *dark = target->background;
	const uint8_t *srgb = target->srgb;
	const __m512i pack = _mm512_loadu_si512(first_three);
	const __m512i empty = _mm512_set1_epi32(srgb[dark[0]] | srgb[dark[1]] << 8 | srgb[dark[2]] << 16);
	for (uint32_t x = 0, i = 0; x < n; x += STRIP_BRICK) {
		const uint32_t k = strip->pixels->covered[x / 32], left = n - x;
		if (target->wants && target->wants[x / STRIP_BRICK]) {
			write_linear(target->r + first + x, strip->r + i, k, dark[0], left);
			write_linear(target->g + first + x, strip->g + i, k, dark[1], left);
			write_linear(target->b + first + x, strip->b + i, k, dark[2], left);
		}
		for (uint32_t half = 0; half < 2 && 16 * half < left && target->rgb; half++) {
			const __mmask16 own = (__mmask16)(k >> 16 * half);
			const __m512i pixel = own ? pixels_of(strip, srgb, i, own, empty) : empty;
			_mm512_mask_storeu_epi8(target->rgb + 3 * (first + x + 16 * half), lowest(3 * (left - 16 * half), 48),
			                        _mm512_permutexvar_epi8(pack, pixel));
			i += (uint32_t)__builtin_popcount(own);
		}
		if (!target->rgb)
			i += (uint32_t)__builtin_popcount(k);
	}
}

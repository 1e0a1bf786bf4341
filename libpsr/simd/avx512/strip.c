#include <immintrin.h>
#include <string.h>
#include "base/srgb.h"
#include "simd/kernels.h"
#include "simd/loops/strip_parts.h"

/* The lowest min(n, most) bits; most < 64. */
static inline uint64_t lowest(uint32_t n, uint32_t most)
{
	return (UINT64_C(1) << (n < most ? n : most)) - 1;
}

#define AHEAD (2 * STRIP) /* words: prefetch the strip after the next */

void strip_list_avx512(struct strip_pixels *p, const uint64_t *word, const uint16_t *weight, uint32_t n_pixels,
                       unsigned place_bits)
{
	const __m512i empty = _mm512_set1_epi64((long long)PSR_WORD_EMPTY);
	const __m128i by = _mm_cvtsi32_si128((int)place_bits);
	__m512i x = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
	uint16_t *has_sample = (uint16_t *)p->has_sample;
	uint32_t n = 0;

	memset(p->has_sample, 0, sizeof p->has_sample);
	for (uint32_t first = 0; first < n_pixels; first += 16) {
		__mmask16 k = (__mmask16)lowest(n_pixels - first, 16);

		_mm_prefetch((const char *)(word + first + AHEAD), _MM_HINT_T0);
		_mm_prefetch((const char *)(word + first + AHEAD + 8), _MM_HINT_T0);
		const __m512i low = _mm512_maskz_loadu_epi64((__mmask8)k, word + first);
		const __m512i high = _mm512_maskz_loadu_epi64((__mmask8)(k >> 8), word + first + 8);
		const __mmask8 has_low = _mm512_cmpneq_epi64_mask(low, empty), has_high = _mm512_cmpneq_epi64_mask(high, empty);
		if (weight)
			k = _mm256_mask_test_epi16_mask(k, _mm256_maskz_loadu_epi16(k, weight + first), _mm256_set1_epi16(-1));
		k &= (__mmask16)(has_low | has_high << 8);
		const __m512i low_id = _mm512_castsi256_si512(_mm512_cvtepi64_epi32(low));
		const __m512i id = _mm512_srl_epi32(_mm512_inserti64x4(low_id, _mm512_cvtepi64_epi32(high), 1), by);
		_mm512_storeu_si512(p->id + n, _mm512_maskz_compress_epi32(k, id));
		_mm256_storeu_si256((__m256i *)(p->x + n), _mm512_cvtepi32_epi16(_mm512_maskz_compress_epi32(k, x)));
		has_sample[first / 16] = k;
		n += (uint32_t)__builtin_popcount(k);
		x = _mm512_add_epi32(x, _mm512_set1_epi32(16));
	}
	p->n = n;
	p->word = word;
}

/* ---- read ---- */

static void fill_floats(float *to, uint32_t n, float value)
{
	for (uint32_t i = 0; i < n; i += 16)
		_mm512_storeu_ps(to + i, _mm512_set1_ps(value));
}

void strip_read_avx512(struct strip *strip, const struct strip_view *view)
{
	uint64_t all, common;

	read_attributes(&all, &common, strip, view);
	const uint32_t base = PSR_ATTR_BASE(all);
	if (base != PSR_ATTR_BASE(common)) {
		read_base(strip, 0);
	} else {
		fill_floats(strip->dr, strip->n, psr_srgb_to_linear[base & 0xff]);
		fill_floats(strip->dg, strip->n, psr_srgb_to_linear[base >> 8 & 0xff]);
		fill_floats(strip->db, strip->n, psr_srgb_to_linear[base >> 16]);
	}
}

/* ---- write ---- */

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

/* Sixteen pixels at a time: expands samples to the covered pixels, and drops each fourth byte. Scalar look-ups are
 * faster than gathers. */
static void write_rgb(uint8_t *to, const struct strip *strip, const struct strip_target *target, uint32_t n)
{
	const uint16_t *dark = target->background;
	const __m512i pack = _mm512_loadu_si512(first_three);
	const __m512i empty = _mm512_set1_epi32((int)pixel_of(target->srgb, dark[0], dark[1], dark[2]));
	uint32_t pixel[STRIP + 16], n_written = 0;

	for (uint32_t i = 0; i < strip->pixels->n; i++)
		pixel[i] = pixel_of(target->srgb, strip->r[i], strip->g[i], strip->b[i]);
	for (uint32_t x = 0; x < n; x += 16) {
		const __mmask16 k = (__mmask16)(strip->pixels->has_sample[x / 32] >> x % 32);
		const __m512i row = _mm512_mask_expand_epi32(empty, k, _mm512_loadu_si512(pixel + n_written));

		_mm512_mask_storeu_epi8(to + 3 * x, lowest(3 * (n - x), 48), _mm512_permutexvar_epi8(pack, row));
		n_written += (uint32_t)__builtin_popcount(k);
	}
}

void strip_write_avx512(const struct strip *strip, const struct strip_target *target, uint32_t n)
{
	const struct strip_pixels *p = strip->pixels;
	const size_t first = (size_t)p->y * target->width + p->x0;
	const uint16_t *dark = target->background;

	if (target->rgb)
		write_rgb(target->rgb + 3 * first, strip, target, n);
	for (uint32_t x = 0, i = 0; target->wants && x < n; x += STRIP_BRICK) {
		const uint32_t k = p->has_sample[x / 32];

		if (target->wants[x / STRIP_BRICK]) {
			write_linear(target->r + first + x, strip->r + i, k, dark[0], n - x);
			write_linear(target->g + first + x, strip->g + i, k, dark[1], n - x);
			write_linear(target->b + first + x, strip->b + i, k, dark[2], n - x);
		}
		i += (uint32_t)__builtin_popcount(k);
	}
}

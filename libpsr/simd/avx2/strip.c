#include <immintrin.h>
#include <string.h>
#include "base/srgb.h"
#include "simd/kernels.h"
#include "simd/loops/strip_write.h"
#include "lanes.h"

#define AHEAD (2 * STRIP) /* words: prefetch the strip after the next */

/* Lists those of eight pixels from p->x0 + first on that have a sample, behind n others. Returns how many there are
 * then. */
static inline uint32_t list_eight(struct strip_pixels *p, uint32_t n, const uint64_t *word, const uint16_t *weight,
                                  uint32_t first, unsigned place_bits)
{
	const struct eight_words words = load_eight(word), is_empty = empty_of(words);
	uint32_t none = (uint32_t)_mm256_movemask_pd(_mm256_castsi256_pd(is_empty.a))
	                | (uint32_t)_mm256_movemask_pd(_mm256_castsi256_pd(is_empty.b)) << 4;

	if (weight != NULL) {
		const __m128i zero = _mm_setzero_si128();
		const __m128i is_zero = _mm_cmpeq_epi16(_mm_loadu_si128((const __m128i *)weight), zero);

		none |= (uint32_t)_mm_movemask_epi8(_mm_packs_epi16(is_zero, zero));
	}
	const uint32_t k = none ^ 0xff;
	const __m128i front = _mm_cvtsi64_si128((long long)front_lanes(k));
	const __m256i id = _mm256_srl_epi32(low_of(words), _mm_cvtsi32_si128((int)place_bits));

	_mm256_storeu_si256((__m256i *)(p->id + n), _mm256_permutevar8x32_epi32(id, _mm256_cvtepu8_epi32(front)));
	_mm_storeu_si128((__m128i *)(p->x + n), _mm_add_epi16(_mm_cvtepu8_epi16(front), _mm_set1_epi16((short)first)));
	p->has_sample[first / 32] |= k << first % 32;
	return n + (uint32_t)__builtin_popcount(k);
}

void strip_list_avx2(struct strip_pixels *p, const uint64_t *word, const uint16_t *weight, uint32_t n_pixels,
                     unsigned place_bits)
{
	uint32_t n = 0, first = 0;

	memset(p->has_sample, 0, sizeof p->has_sample);
	for (; first + 8 <= n_pixels; first += 8) {
		_mm_prefetch((const char *)(word + first + AHEAD), _MM_HINT_T0);
		n = list_eight(p, n, word + first, weight != NULL ? weight + first : NULL, first, place_bits);
	}
	if (first < n_pixels) {
		const struct last_words last = last_of(word + first, weight != NULL ? weight + first : NULL, n_pixels - first);

		n = list_eight(p, n, last.word, last.weight, first, place_bits);
	}
	p->n = n;
	p->word = word;
}

/* Eight pixels without their fourth bytes. */
static inline void store_eight(uint8_t *to, __m256i pixels)
{
	const __m256i first_three = _mm256_setr_epi8(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, -1, -1, -1, -1, 0, 1, 2, 4, 5, 6,
	                                             8, 9, 10, 12, 13, 14, -1, -1, -1, -1);
	const __m256i halves = _mm256_shuffle_epi8(pixels, first_three);
	const __m256i bytes = _mm256_permutevar8x32_epi32(halves, _mm256_setr_epi32(0, 1, 2, 4, 5, 6, 3, 7));

	_mm_storeu_si128((__m128i *)to, _mm256_castsi256_si128(bytes));
	_mm_storel_epi64((__m128i *)(to + 16), _mm256_extracti128_si256(bytes, 1));
}

/* 32 pixels of the background. */
struct background {
	uint8_t rgb[4 * 24 + 8];
};

static inline struct background background_of(__m256i empty)
{
	struct background b;

	for (int i = 0; i < 4; i++)
		store_eight(b.rgb + (size_t)24 * i, empty);
	return b;
}

/* Scalar look-ups are faster than gathers. */
static void write_rgb(uint8_t *to, const struct strip *strip, const struct strip_target *target, uint32_t n)
{
	const struct strip_pixels *p = strip->pixels;
	const uint16_t *dark = target->background;
	const __m256i empty = _mm256_set1_epi32((int)pixel_of(target->srgb, dark[0], dark[1], dark[2]));
	const struct background none = background_of(empty);
	uint32_t pixel[STRIP + 8], n_written = 0;

	for (uint32_t i = 0; i < p->n; i++)
		pixel[i] = pixel_of(target->srgb, strip->r[i], strip->g[i], strip->b[i]);
	for (uint32_t x = 0; x < n; x += 8) {
		const uint32_t k = p->has_sample[x / 32] >> x % 32 & 0xff;

		if (x % 32 == 0 && p->has_sample[x / 32] == 0 && n - x >= 32) {
			memcpy(to + 3 * x, none.rgb, 96);
			x += 24;
			continue;
		}
		const __m256i samples = _mm256_loadu_si256((const __m256i *)(pixel + n_written));
		const __m256i apart = _mm256_permutevar8x32_epi32(samples, back_of(k));
		const __m256i pixels = _mm256_blendv_epi8(empty, apart, lanes_of(k));
		uint8_t rest[24];

		store_eight(n - x < 8 ? rest : to + 3 * x, pixels);
		if (n - x < 8)
			memcpy(to + 3 * x, rest, 3 * (size_t)(n - x));
		n_written += (uint32_t)__builtin_popcount(k);
	}
}

void strip_write_avx2(const struct strip *strip, const struct strip_target *target, uint32_t n)
{
	const struct strip_pixels *p = strip->pixels;

	if (target->rgb != NULL)
		write_rgb(target->rgb + 3 * ((size_t)p->y * target->width + p->x0), strip, target, n);
	if (target->wants != NULL)
		write_linear(strip, target, n);
}

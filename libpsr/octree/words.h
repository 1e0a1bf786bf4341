/* Eight numbers of 16 bits, held at the ends of these: what codes_mixed.c adds and mixes. x86-64 has instructions for
 * them that the compiler does not find; plain C gives the same, which a test compares. */
#ifndef PSR_OCTREE_WORDS_H
#define PSR_OCTREE_WORDS_H

#include <stdint.h>
#ifdef __SSE2__ /* as every x86-64 has */
#include <emmintrin.h>
#endif

typedef int16_t words __attribute__((vector_size(16)));

static inline int16_t word_held(int32_t x)
{
	return (int16_t)(x < INT16_MIN ? INT16_MIN : x > INT16_MAX ? INT16_MAX : x);
}

static inline words words_add_c(words a, words b)
{
	for (int i = 0; i < 8; i++)
		a[i] = word_held(a[i] + b[i]);
	return a;
}

/* The sum of products; of logits within -2048..2047 it is below 2^30. */
static inline int32_t words_weigh_c(words logit, words weight)
{
	int32_t x = 0;

	for (int i = 0; i < 8; i++)
		x += logit[i] * weight[i];
	return x;
}

/* Two such sums / 2^13, each held within -2047..2047. */
static inline void words_weigh_both_c(int32_t x[2], words logit0, words weight0, words logit1, words weight1)
{
	x[0] = words_weigh_c(logit0, weight0) >> 13;
	x[1] = words_weigh_c(logit1, weight1) >> 13;
	for (int i = 0; i < 2; i++)
		x[i] = x[i] < -2047 ? -2047 : x[i] > 2047 ? 2047 : x[i];
}

/* weight + (logit / 2^12 * step) / 2, each rounded down but for the last, which is rounded. Logits as above. */
static inline words words_learn_c(words weight, words logit, int16_t step)
{
	for (int i = 0; i < 8; i++)
		weight[i] = word_held(weight[i] + (((logit[i] * 16 * step >> 16) + 1) >> 1));
	return weight;
}

#ifdef __SSE2__
static inline words words_add(words a, words b)
{
	return (words)_mm_adds_epi16((__m128i)a, (__m128i)b);
}

static inline int32_t words_weigh(words logit, words weight)
{
	const __m128i x = _mm_madd_epi16((__m128i)logit, (__m128i)weight);
	const __m128i y = _mm_add_epi32(x, _mm_shuffle_epi32(x, 0x4e)); /* halves, then quarters, change places */

	return _mm_cvtsi128_si32(_mm_add_epi32(y, _mm_shuffle_epi32(y, 0xb1)));
}

static inline void words_weigh_both(int32_t x[2], words logit0, words weight0, words logit1, words weight1)
{
	const __m128i a = _mm_madd_epi16((__m128i)logit0, (__m128i)weight0);
	const __m128i b = _mm_madd_epi16((__m128i)logit1, (__m128i)weight1);
	const __m128i halves = _mm_add_epi32(_mm_unpacklo_epi32(a, b), _mm_unpackhi_epi32(a, b));
	const __m128i sums = _mm_srai_epi32(_mm_add_epi32(halves, _mm_shuffle_epi32(halves, 0x4e)), 13);
	const __m128i held = _mm_max_epi16(_mm_min_epi16(_mm_packs_epi32(sums, sums), _mm_set1_epi16(2047)),
	                                   _mm_set1_epi16(-2047));
	const int32_t both = _mm_cvtsi128_si32(held);

	x[0] = (int16_t)both;
	x[1] = both >> 16;
}

static inline words words_learn(words weight, words logit, int16_t step)
{
	const __m128i x = _mm_mulhi_epi16(_mm_slli_epi16((__m128i)logit, 4), _mm_set1_epi16(step));

	return words_add(weight, (words)_mm_srai_epi16(_mm_add_epi16(x, _mm_set1_epi16(1)), 1));
}
#else
#define words_add words_add_c
#define words_weigh words_weigh_c
#define words_weigh_both words_weigh_both_c
#define words_learn words_learn_c
#endif

#endif

#include <immintrin.h>
#include <math.h>
#include <string.h>
#include "simd/kernels.h"

/* Both halves of each 32-bit lane. */
static inline __m256i twice(__m256i v)
{
	return _mm256_or_si256(v, _mm256_slli_epi32(v, 16));
}

/* Weights of the four pixels around each place, whose sum is 2^(2 bits). */
struct weights {
	__m256i left, right; /* in both halves */
	__m256i down;        /* the upper pixels' in the lower half, the lower ones' in the upper */
	__m256i round;
	__m128i shift;
};

static inline __m256i across(__m256i a, __m256i b, const struct weights *w)
{
	return _mm256_add_epi16(_mm256_mullo_epi16(a, w->left), _mm256_mullo_epi16(b, w->right));
}

static inline __m256i down(__m256i pair, const struct weights *w)
{
	return _mm256_srl_epi32(_mm256_add_epi32(_mm256_madd_epi16(pair, w->down), w->round), w->shift);
}

/* Sums of a row are at most 255 * 2^7, so they fit 16 bits with a sign. */
static inline __m256i blend(const __m256i t[4], const struct weights *w)
{
	const __m256i byte = _mm256_set1_epi32(0xff), bytes = _mm256_set1_epi32(0xff00ff);
	const __m256i high = _mm256_set1_epi32((int)0xffff0000);
	const __m256i top = across(_mm256_and_si256(t[0], bytes), _mm256_and_si256(t[1], bytes), w);
	const __m256i bottom = across(_mm256_and_si256(t[2], bytes), _mm256_and_si256(t[3], bytes), w);
	const __m256i top_green = across(_mm256_and_si256(_mm256_srli_epi32(t[0], 8), byte),
	                                 _mm256_and_si256(_mm256_srli_epi32(t[1], 8), byte), w);
	const __m256i bottom_green = across(_mm256_and_si256(_mm256_srli_epi32(t[2], 8), byte),
	                                    _mm256_and_si256(_mm256_srli_epi32(t[3], 8), byte), w);
	const __m256i red = down(_mm256_blend_epi16(top, _mm256_slli_epi32(bottom, 16), 0xaa), w);
	const __m256i green = down(_mm256_or_si256(top_green, _mm256_slli_epi32(bottom_green, 16)), w);
	const __m256i blue = down(_mm256_or_si256(_mm256_srli_epi32(top, 16), _mm256_and_si256(bottom, high)), w);

	return _mm256_or_si256(_mm256_or_si256(red, _mm256_slli_epi32(green, 8)), _mm256_slli_epi32(blue, 16));
}

/* Elements column + row * stride of whole pixels. */
static inline __m256i element(__m256i x, __m256i y, __m128i bits, __m256i stride)
{
	return _mm256_add_epi32(_mm256_mullo_epi32(_mm256_srl_epi32(y, bits), stride), _mm256_srl_epi32(x, bits));
}

/* Two texels at each of two places. */
static inline __m128i two_pairs(const uint32_t *a, const uint32_t *b)
{
	const __m128d low = _mm_castsi128_pd(_mm_loadl_epi64((const __m128i *)a));

	return _mm_castpd_si128(_mm_loadh_pd(low, (const double *)(const void *)b));
}

/* The texels at eight places, and those to the right of them. Gathers take longer. */
static inline void load_pairs(__m256i t[2], const uint32_t *texel, const uint32_t at[8])
{
	const __m256 a = _mm256_castsi256_ps(_mm256_set_m128i(two_pairs(texel + at[4], texel + at[5]),
	                                                      two_pairs(texel + at[0], texel + at[1])));
	const __m256 b = _mm256_castsi256_ps(_mm256_set_m128i(two_pairs(texel + at[6], texel + at[7]),
	                                                      two_pairs(texel + at[2], texel + at[3])));

	t[0] = _mm256_castps_si256(_mm256_shuffle_ps(a, b, 0x88));
	t[1] = _mm256_castps_si256(_mm256_shuffle_ps(a, b, 0xdd));
}

static inline __m256i look_eight(const struct reproject_source *source, __m256i place, __m256i covered, unsigned n_bits)
{
	const __m256i zero = _mm256_setzero_si256(), one = _mm256_set1_epi32(1 << n_bits);
	const __m256i half = _mm256_set1_epi32(1 << (n_bits - 1)), part = _mm256_set1_epi32((1 << n_bits) - 1);
	const __m256i stride = _mm256_set1_epi32((int)source->stride);
	const __m128i bits = _mm_cvtsi32_si128((int)n_bits);
	const __m256i x = _mm256_and_si256(place, _mm256_set1_epi32(0xffff)), y = _mm256_srli_epi32(place, 16);
	const __m256i left = _mm256_max_epi32(_mm256_sub_epi32(x, half), zero);
	const __m256i top = _mm256_max_epi32(_mm256_sub_epi32(y, half), zero);
	__m256i at = _mm256_and_si256(element(left, top, bits, stride), covered), t[4], whole;
	uint32_t index[8];
	struct weights w;

	_mm256_storeu_si256((__m256i *)index, at);
	load_pairs(t, source->texel, index);
	load_pairs(t + 2, source->texel + source->stride, index);
	whole = _mm256_and_si256(_mm256_cmpgt_epi32(t[0], _mm256_set1_epi32(0xffffff)), covered);
	if (_mm256_testc_si256(whole, covered) == 0) {
		at = _mm256_and_si256(_mm256_blendv_epi8(element(x, y, bits, stride), at, whole), covered);
		_mm256_storeu_si256((__m256i *)index, at);
		load_pairs(t, source->texel, index);
		load_pairs(t + 2, source->texel + source->stride, index);
	}
	const __m256i wx = _mm256_and_si256(_mm256_and_si256(left, part), whole);
	const __m256i wy = _mm256_and_si256(_mm256_and_si256(top, part), whole);

	w.left = twice(_mm256_sub_epi32(one, wx));
	w.right = twice(wx);
	w.down = _mm256_or_si256(_mm256_sub_epi32(one, wy), _mm256_slli_epi32(wy, 16));
	w.round = _mm256_set1_epi32(1 << (2 * n_bits - 1));
	w.shift = _mm_cvtsi32_si128(2 * (int)n_bits);
	return blend(t, &w);
}

void reproject_look_avx2(uint8_t *rgb, const struct reproject_source *source, const struct reproject_tile *tile,
                         uint32_t first, uint32_t n, const uint8_t background[3])
{
	const __m256i pack =
		_mm256_broadcastsi128_si256(_mm_setr_epi8(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, -1, -1, -1, -1));
	const __m256i empty = _mm256_set1_epi32(background[0] | background[1] << 8 | background[2] << 16);

	for (uint32_t i = 0; i < n; i += 8) {
		const __m256 key = _mm256_loadu_ps(tile->key + first + i);
		const __m256i covered = _mm256_castps_si256(_mm256_cmp_ps(key, _mm256_set1_ps(REPROJECT_EMPTY), _CMP_GT_OQ));
		const __m256i place = _mm256_loadu_si256((const __m256i *)(tile->at + first + i));
		__m256i color = empty;
		uint8_t tail[32];
		uint8_t *to = n - i < 10 ? tail : rgb + 3 * (size_t)i;

		if (_mm256_movemask_epi8(covered) != 0)
			color = _mm256_blendv_epi8(empty, look_eight(source, place, covered, tile->bits), covered);
		color = _mm256_shuffle_epi8(color, pack);
		_mm_storeu_si128((__m128i *)to, _mm256_castsi256_si128(color));
		_mm_storeu_si128((__m128i *)(to + 12), _mm256_extracti128_si256(color, 1)); /* 4 bytes of the next 8 pixels */
		if (to == tail)
			memcpy(rgb + 3 * (size_t)i, tail, 3 * (size_t)(n - i < 8 ? n - i : 8));
	}
}

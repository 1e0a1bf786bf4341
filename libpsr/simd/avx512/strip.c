#include <immintrin.h>
#include "base/srgb.h"
#include "psr/direction.h"
#include "simd/strip_parts.h"
#include "simd/kernels.h"

/* The n lowest bits, of which there are `most`, below 64. */
static inline uint64_t lowest(uint32_t n, uint32_t most)
{
	return (UINT64_C(1) << (n < most ? n : most)) - 1;
}

#define AHEAD (2 * STRIP) /* words: those of the strip after the next */

void strip_list_avx512(struct strip_pixels *p, const uint64_t *word, const uint16_t *weight, uint32_t n_pixels)
{
	const __m512i empty = _mm512_set1_epi64((long long)PSR_WORD_EMPTY);
	__m512i x = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
	uint16_t *covered = (uint16_t *)p->covered;
	uint32_t n = 0;
	_mm256_storeu_si256((__m256i *)p->covered, _mm256_setzero_si256());
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
		const __m512i id = _mm512_inserti64x4(low_id, _mm512_cvtepi64_epi32(high), 1);
		_mm512_storeu_si512(p->id + n, _mm512_maskz_compress_epi32(k, id));
		_mm256_storeu_si256((__m256i *)(p->x + n), _mm512_cvtepi32_epi16(_mm512_maskz_compress_epi32(k, x)));
		covered[first / 16] = k;
		n += (uint32_t)__builtin_popcount(k);
		x = _mm512_add_epi32(x, _mm512_set1_epi32(16));
	}
	p->n = n;
}

/* ---- find ---- */

static CONSTANT_FLAGS __m256i gather_u32(__mmask8 k, const void *from, __m256i index, const int scale)
{
	return _mm256_mmask_i32gather_epi32(_mm256_setzero_si256(), k, index, from, scale);
}

/* Elements of arrays of bytes or of 16 bits, by the aligned words that they are in: no page is touched that has none of them. */
static inline __m256i gather_u16(__mmask8 k, const uint16_t *from, __m256i index)
{
	const uintptr_t odd = (uintptr_t)from / sizeof *from % 2;
	const __m256i at = _mm256_add_epi32(index, _mm256_set1_epi32((int)odd));
	const __m256i word = gather_u32(k, from - odd, _mm256_srli_epi32(at, 1), 4);
	const __m256i shift = _mm256_slli_epi32(_mm256_and_si256(at, _mm256_set1_epi32(1)), 4);
	return _mm256_and_si256(_mm256_srlv_epi32(word, shift), _mm256_set1_epi32(0xffff));
}

static inline __m256i gather_u8(__mmask8 k, const uint8_t *from, __m256i index)
{
	const uintptr_t odd = (uintptr_t)from % 4;
	const __m256i at = _mm256_add_epi32(index, _mm256_set1_epi32((int)odd));
	const __m256i word = gather_u32(k, from - odd, _mm256_srli_epi32(at, 2), 4);
	const __m256i shift = _mm256_slli_epi32(_mm256_and_si256(at, _mm256_set1_epi32(3)), 3);
	return _mm256_srlv_epi32(word, shift);
}

/* Indices of the attributes of samples i .. i + 7, of those in k. */
static inline __m512i find_attributes(const struct psr_blocks *b, __mmask8 k, __m256i block, __m256i sample)
{
	_Static_assert(PSR_RUN_BLOCKS == 1 << 10 && sizeof *b->run == 8, "indices into runs");
	const __m256i run = gather_u32(k, &b->run->attr_first, _mm256_srli_epi32(block, 10), 8);
	const __m256i first = _mm256_add_epi32(run, gather_u16(k, b->attr_offset, block));
	const __m512i mask = _mm512_mask_i32gather_epi64(_mm512_setzero_si512(), k, block, b->mask, 8);
	const __m512i from = _mm512_sllv_epi64(_mm512_set1_epi64(-1), _mm512_cvtepu32_epi64(sample));
	return _mm512_add_epi64(_mm512_cvtepu32_epi64(first), _mm512_popcnt_epi64(_mm512_andnot_si512(from, mask)));
}

void strip_find_avx512(struct strip_pixels *p, const struct strip_view *view)
{
	const __m256i in_block = _mm256_set1_epi32(PSR_BLOCK_SAMPLES - 1);
	for (uint32_t first = 0, end; first < p->n; first = end) {
		const struct warp_instance *in = instance_run(&end, p, view, first, p->n);
		const struct psr_blocks *b = in->blocks;
		const __m256i first_slot = _mm256_set1_epi32((int)in->first_slot);
		const __m512i attributes = _mm512_set1_epi64((long long)(uintptr_t)b->attr);
		for (uint32_t i = first; i < end; i += 8) {
			const __mmask8 k = (__mmask8)lowest(end - i, 8);
			const __m256i id = _mm256_loadu_si256((const __m256i *)(p->id + i));
			const __m256i block = _mm256_sub_epi32(_mm256_srli_epi32(id, 6), first_slot);
			const __m512i index = find_attributes(b, k, block, _mm256_and_si256(id, in_block));
			const __m512i at = _mm512_add_epi64(attributes, _mm512_slli_epi64(index, 3));
			__m256i flags = _mm256_setzero_si256();
			_mm512_mask_storeu_epi64(p->at + i, k, at);
			if (view->needs & STRIP_TWO_SIDED)
				flags = _mm256_and_si256(gather_u8(k, b->flags, block), _mm256_set1_epi32(PSR_BLOCK_TWO_SIDED));
			_mm256_mask_cvtepi32_storeu_epi8(p->two_sided + i, k, flags);
			for (uint32_t j = i; j < i + 8 && j < end; j++)
				_mm_prefetch((const char *)p->at[j], _MM_HINT_T0);
		}
	}
	repeat_last(p);
}

/* ---- read ---- */

/* Attributes and normals; *all, *common: or-ed and and-ed. */
static void read_attributes(uint64_t *all, uint64_t *common, struct strip *strip, const struct strip_view *view)
{
	__m512i some = _mm512_setzero_si512(), each = _mm512_set1_epi64(-1);
	for (uint32_t i = 0; i < strip->n; i += 8) {
		const __m512i attr = _mm512_i64gather_epi64(_mm512_loadu_si512(strip->pixels->at + i), NULL, 1);
		const __m256i normal = _mm256_and_si256(_mm512_cvtepi64_epi32(attr), _mm256_set1_epi32(PSR_DIRECTIONS - 1));
		_mm512_storeu_si512(strip->attr + i, attr);
		_mm512_storeu_si512(strip->normal_word + i, _mm512_i32gather_epi64(normal, view->direction_word, 8));
		some = _mm512_or_si512(some, attr);
		each = _mm512_and_si512(each, attr);
	}
	*all = (uint64_t)_mm512_reduce_or_epi64(some);
	*common = (uint64_t)_mm512_reduce_and_epi64(each);
}

static void fill_floats(float *to, uint32_t n, float value)
{
	for (uint32_t i = 0; i < n; i += 16)
		_mm512_storeu_ps(to + i, _mm512_set1_ps(value));
}

static inline __m512 linear_of(__m512i word, int shift)
{
	const __m512i code = _mm512_and_si512(_mm512_srli_epi32(word, (unsigned)shift), _mm512_set1_epi32(0xff));
	return _mm512_i32gather_ps(code, psr_srgb_to_linear, 4);
}

/* The half of each of 16 attributes that the permutation names. */
static inline __m512i halves_of(const uint64_t *attr, __m512i which)
{
	return _mm512_permutex2var_epi32(_mm512_loadu_si512(attr), which, _mm512_loadu_si512(attr + 8));
}

static void read_diffuse(struct strip *strip)
{
	const __m512i lower = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
	const __m512i upper = _mm512_add_epi32(lower, _mm512_set1_epi32(1));
	for (uint32_t i = 0; i < strip->n; i += 16) {
		const __m512i low = halves_of(strip->attr + i, lower), high = halves_of(strip->attr + i, upper);
		_mm512_storeu_ps(strip->dr + i, linear_of(low, 16));
		_mm512_storeu_ps(strip->dg + i, linear_of(low, 24));
		_mm512_storeu_ps(strip->db + i, linear_of(high, 0));
	}
}

/* Tables of 32 and 64 floats, in registers. */
static inline __m512 look_up_5(const __m512 table[2], __m512i index)
{
	return _mm512_permutex2var_ps(table[0], index, table[1]);
}

static inline __m512 look_up_6(const __m512 table[4], __m512i index)
{
	const __mmask16 is_upper = _mm512_test_epi32_mask(index, _mm512_set1_epi32(32));
	return _mm512_mask_blend_ps(is_upper, look_up_5(table, index), look_up_5(table + 2, index));
}

static void read_specular(struct strip *strip)
{
	const __m512i upper = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
	const __m512 five[2] = { _mm512_loadu_ps(psr_srgb5_to_linear), _mm512_loadu_ps(psr_srgb5_to_linear + 16) };
	const __m512 six[4] = { _mm512_loadu_ps(psr_srgb6_to_linear), _mm512_loadu_ps(psr_srgb6_to_linear + 16),
		                    _mm512_loadu_ps(psr_srgb6_to_linear + 32), _mm512_loadu_ps(psr_srgb6_to_linear + 48) };
	const __m512 root = _mm512_loadu_ps(exponent_root);
	for (uint32_t i = 0; i < strip->n; i += 16) {
		const __m512i high = halves_of(strip->attr + i, upper); /* blue, then specular, then the exponent, 8, 16 and 8 bits */
		const __m512i power = _mm512_slli_epi32(_mm512_srli_epi32(high, 28), 23);
		const __m512 exponent = _mm512_permutexvar_ps(_mm512_srli_epi32(high, 24), root);
		_mm512_storeu_ps(strip->sr + i, look_up_5(five, _mm512_srli_epi32(high, 8)));
		_mm512_storeu_ps(strip->sg + i, look_up_6(six, _mm512_srli_epi32(high, 13)));
		_mm512_storeu_ps(strip->sb + i, look_up_5(five, _mm512_srli_epi32(high, 19)));
		_mm512_storeu_ps(strip->exponent + i, _mm512_castsi512_ps(_mm512_add_epi32(_mm512_castps_si512(exponent), power)));
	}
}

void strip_read_avx512(struct strip *strip, const struct strip_view *view)
{
	uint64_t all, common;
	strip->n = strip_whole(strip->pixels->n);
	read_attributes(&all, &common, strip, view);
	strip->is_specular = strip_wants_highlights(view, all);
	const uint32_t diffuse = PSR_ATTR_DIFFUSE(all);
	if (diffuse != PSR_ATTR_DIFFUSE(common)) {
		read_diffuse(strip);
	} else {
		fill_floats(strip->dr, strip->n, psr_srgb_to_linear[diffuse & 0xff]);
		fill_floats(strip->dg, strip->n, psr_srgb_to_linear[diffuse >> 8 & 0xff]);
		fill_floats(strip->db, strip->n, psr_srgb_to_linear[diffuse >> 16]);
	}
	if (strip->is_specular)
		read_specular(strip);
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

#include "warp_parts.h"

static inline __m512 rows_of(const struct warp_block *b, int a)
{
	const __m512d row = _mm512_loadu_pd(b->lattice->row[a]);
	const __m512d at = _mm512_add_pd(_mm512_set1_pd(b->origin[a]), _mm512_mul_pd(_mm512_set1_pd(b->scale), row));
	return _mm512_castps256_ps512(_mm512_cvtpd_ps(at));
}

static inline __m512 columns_of(const struct warp_block *b, int a)
{
	const __m256 col = _mm256_loadu_ps(b->lattice->col[a]);

	return _mm512_castps256_ps512(_mm256_mul_ps(_mm256_set1_ps((float)b->scale), col));
}

static inline __m512 axis_of(__m512 rows, __m512 columns, __m512i r, __m512i c, __m512 depth, float unit)
{
	const __m512 place = _mm512_add_ps(_mm512_permutexvar_ps(r, rows), _mm512_permutexvar_ps(c, columns));

	return _mm512_add_ps(place, _mm512_mul_ps(depth, _mm512_set1_ps(unit)));
}

static inline __m512i normals_of(const uint64_t *attr, __mmask16 k)
{
	const __m256i low = _mm512_cvtepi64_epi32(_mm512_maskz_loadu_epi64((__mmask8)k, attr));
	const __m256i high = _mm512_cvtepi64_epi32(_mm512_maskz_loadu_epi64((__mmask8)(k >> 8), attr + 8));

	return _mm512_and_si512(_mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1), _mm512_set1_epi32(0x7fff));
}

/* Where in their pixels samples are that lie in the picture. */
static inline __m512i quarters_of(__m512 u, __m512 v, __m512i pixel_u, __m512i pixel_v)
{
	const __m512 four = _mm512_set1_ps(4);
	const __m512 right = _mm512_sub_ps(u, _mm512_cvtepi32_ps(pixel_u));
	const __m512 down = _mm512_sub_ps(v, _mm512_cvtepi32_ps(pixel_v));

	return _mm512_or_si512(_mm512_cvttps_epi32(_mm512_mul_ps(right, four)),
	                       _mm512_slli_epi32(_mm512_cvttps_epi32(_mm512_mul_ps(down, four)), 2));
}

/* The veils of the lanes of k: first .. first + 15 of a block. */
static inline __m512i veils_of(const struct veils *veils, int first, __mmask16 k)
{
	const __m512i opacity = _mm512_cvtepu8_epi32(_mm_maskz_loadu_epi8(k, veils->opacity + first));
	const __m512 bits = _mm512_i32gather_ps(opacity, veils->bits, 4);

	return _mm512_cvttps_epi32(_mm512_mul_ps(bits, _mm512_set1_ps(veils->area)));
}

static inline __attribute__((always_inline)) void list_block(struct words *words, struct cells *cells,
                                                             struct veils *veils, const struct warp_target *t,
                                                             const struct bin_entry *entry,
                                                             const struct warp_block *block)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	const int level = entry->level, is_mixed = entry->is_mixed, perspective = t->perspective;
	const __m512i x0 = _mm512_set1_epi32(t->x0), width = _mm512_set1_epi32(t->x1 - t->x0);
	const __m512i y0 = _mm512_set1_epi32(t->y0), height = _mm512_set1_epi32(t->y1 - t->y0);
	const __m512i stride = _mm512_set1_epi32((int)t->stride);
	const __m512 near_z = _mm512_set1_ps(t->near_z);
	uint32_t n_words = words->n;

	_Alignas(64) uint8_t sample[64];

	const int n = __builtin_popcountll(block->mask);
	const __m512i id = _mm512_set1_epi32((int)block->id);
	list_lanes(sample, block->mask);
	const __m512 row_x = rows_of(block, 0), row_y = rows_of(block, 1), row_z = rows_of(block, 2);
	const __m512 col_x = columns_of(block, 0), col_y = columns_of(block, 1), col_z = columns_of(block, 2);

	for (int i = 0; i < n; i += 16) {
		const __m512i s = _mm512_cvtepu8_epi32(_mm_load_si128((const __m128i *)(sample + i)));
		const __m512i r = _mm512_srli_epi32(s, 3), c = _mm512_and_si512(s, _mm512_set1_epi32(7));
		const __m256i raw = _mm256_loadu_si256((const __m256i *)(block->depth + i));
		const __m512 depth = _mm512_cvtepi32_ps(_mm512_cvtepu16_epi32(raw));
		const __m512 x1 = axis_of(row_x, col_x, r, c, depth, block->unit[0]);
		const __m512 y1 = axis_of(row_y, col_y, r, c, depth, block->unit[1]);
		const __m512 z1 = axis_of(row_z, col_z, r, c, depth, block->unit[2]);
		const __m512 one = _mm512_set1_ps(1), inverse = perspective ? _mm512_div_ps(one, z1) : one;
		const __m512 u = _mm512_mul_ps(x1, inverse), v = _mm512_mul_ps(y1, inverse);
		const __m512 half = _mm512_set1_ps(veils != NULL ? veils->half : 0);
		const __m512i pixel_u = floor_int(_mm512_sub_ps(u, half)), pixel_v = floor_int(_mm512_sub_ps(v, half));

		__mmask16 k = (__mmask16)_bzhi_u32(0xffff, (uint32_t)(n - i));
		k = _mm512_mask_cmp_ps_mask(k, z1, near_z, _CMP_GT_OQ);
		if (is_mixed) {
			__m512 normal[3];

			components_of(normal, tens_of(t, normals_of(block->attr + i, k)));
			k &= (__mmask16)~faces_away(in, k, normal, u, v);
		}
		if (level)
			list_cells(cells, t, k, pixel_u, pixel_v, z1);
		const __m512i x = _mm512_sub_epi32(pixel_u, x0), y = _mm512_sub_epi32(pixel_v, y0);
		k = _mm512_mask_cmplt_epu32_mask(k, x, width);
		k = _mm512_mask_cmplt_epu32_mask(k, y, height);
		__m512i low = _mm512_add_epi32(s, id);
		if (t->place_bits)
			low = _mm512_or_si512(_mm512_slli_epi32(low, PSR_PLACE_BITS), quarters_of(u, v, pixel_u, pixel_v));
		const struct warped samples = { _mm512_add_epi32(_mm512_mullo_epi32(y, stride), x), low,
			                            _mm512_castps_si512(z1),
			                            veils != NULL ? veils_of(veils, i, k) : _mm512_setzero_si512() };
		n_words = list_words(words, n_words, veils, is_mixed, k, samples);
	}
	words->n = n_words;
}

uint64_t warp_avx512(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return warp_by(list_block, target, entry, n);
}

/* Adds a veil to n pixels of a row. */
static inline void hang_row(const struct veil_layer *layer, uint32_t at, int32_t n, uint64_t word, uint32_t veil)
{
	const __m256 z = _mm256_set1_ps(psr_float_from_bits((uint32_t)(word >> 32)));

	for (; n > 0; n -= 8, at += 8) {
		const __mmask8 in = (__mmask8)_bzhi_u32(0xff, n < 8 ? (uint32_t)n : 8);
		const __m256 before = _mm256_maskz_loadu_ps(in, layer->before + at);
		const __mmask8 k = _mm256_mask_cmp_ps_mask(in, z, before, _CMP_LT_OQ);
		const __m512i there = _mm512_maskz_loadu_epi64(k, layer->word + at);
		const __m256i sum = _mm256_add_epi32(_mm256_maskz_loadu_epi32(k, layer->veil + at), _mm256_set1_epi32((int)veil));

		_mm512_mask_storeu_epi64(layer->word + at, k, _mm512_min_epu64(there, _mm512_set1_epi64((long long)word)));
		_mm256_mask_storeu_epi32(layer->veil + at, k, _mm256_min_epu32(sum, _mm256_set1_epi32(VEIL_MOST)));
	}
}

static void hang_rows(const struct warp_target *t, const struct veil_layer *layer, const struct words *words,
                      const struct veils *veils)
{
	const int32_t side = veils->side, width = t->x1 - t->x0, height = t->y1 - t->y0;

	for (uint32_t i = 0; i < words->n; i++) {
		const int32_t x = square_x(words->at[i], side), y = square_y(words->at[i], side);
		const int32_t x0 = x > 0 ? x : 0, n = (x + side < width ? x + side : width) - x0;
		const int32_t y0 = y > 0 ? y : 0, y1 = y + side < height ? y + side : height;

		for (int32_t row = y0; row < y1; row++)
			hang_row(layer, (uint32_t)row * t->stride + (uint32_t)x0, n, words->word[i], veils->veil[i]);
	}
}

void veil_avx512(const struct warp_target *target, const struct veil_layer *layer, const struct veil_entry *entry,
                 uint32_t n)
{
	veil_by(list_block, hang_rows, target, layer, entry, n);
}

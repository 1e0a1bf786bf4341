/* EWA splats: what compilers' vectors are poor at. Cubes are listed by permutations, and masks drawn by rows. */
#include "simd/loops/ewa.h"
#include "leaf_parts.h"

static inline void list_leaves(struct ewa_leaves *l, const struct warp_target *t, const struct bin_entry *entry,
                               const struct warp_cube *cube)
{
	const struct warp_octants *octants = cube->octants;
	const __m512 edge = _mm512_set1_ps(ewa_edge_of(t, entry));
	const __m512i id = _mm512_set1_epi32((int)cube->id), kind = _mm512_set1_epi32(ewa_kind_of(t, entry));
	const uint32_t n = (uint32_t)__builtin_popcountll(cube->mask);
	_Alignas(64) uint8_t lane[64];
	__m512 rows[3], columns[3], normal[3];

	list_lanes(lane, cube->mask);
	for (int a = 0; a < 3; a++) {
		rows[a] = rows_at(cube->origin[a], octants->row[a]);
		columns[a] = cols_of(octants, a);
		normal[a] = _mm512_setzero_ps();
	}
	for (uint32_t i = 0, to = l->n; i < n; i += 16, to += 16) {
		const __m512i s = _mm512_cvtepu8_epi32(_mm_load_si128((const __m128i *)(lane + i)));
		const __m512i octant = _mm512_srli_epi32(s, 3), leaf = s;
		const __mmask16 valid = (__mmask16)_bzhi_u32(0xffff, n - i);
		__m512 offset = _mm512_setzero_ps();

		if (cube->normal != NULL)
			components_of(normal, tens_of(t, _mm512_cvtepu16_epi32(_mm256_maskz_loadu_epi16(valid, cube->normal + i))));
		if (cube->offset != NULL)
			offset = offsets_of(cube->offset + i, valid);
		for (int a = 0; a < 3; a++) {
			const __m512 middle = axis_of(rows[a], columns[a], octant, leaf);

			_mm512_storeu_ps(l->at[a] + to, _mm512_add_ps(middle, offset_axis(octants, a, normal, offset)));
			_mm512_storeu_ps(l->normal[a] + to, normal[a]);
		}
		_mm512_storeu_ps(l->edge + to, edge);
		_mm512_storeu_si512(l->id + to, _mm512_add_epi32(id, s));
		_mm512_storeu_si512(l->kind + to, kind);
	}
	l->n += n;
}

/* The columns of a mask, 16 lanes from its first one on, that are in the tile. */
static inline __mmask16 columns_of(const struct ewa_one *one, const struct ewa_part *part)
{
	const int32_t first = one->x - one->radius;
	const uint32_t before = _bzhi_u32(0xffff, (uint32_t)(part->x0 - first));

	return (__mmask16)(_bzhi_u32(0xffff, (uint32_t)(part->x1 - first)) & ~before);
}

/* What one->zx adds at each of these columns. */
static inline __m512 across_of(const struct ewa_one *one)
{
	const __m512i ordinals = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
	const __m512 dx = _mm512_cvtepi32_ps(_mm512_sub_epi32(ordinals, _mm512_set1_epi32(one->radius)));

	return _mm512_mul_ps(dx, _mm512_set1_ps(one->zx));
}

static inline __m512 depths_of(const struct ewa_one *one, __m512 across, int32_t dy)
{
	const __m512 down = _mm512_set1_ps((float)dy * one->zy);
	const __m512 z = _mm512_add_ps(_mm512_set1_ps(one->z), _mm512_add_ps(across, down));

	return _mm512_max_ps(z, _mm512_set1_ps(one->least));
}

static inline void lower_eight(uint64_t *row, __mmask8 k, __m256 z, __m512i id)
{
	const __m512i word = _mm512_or_si512(_mm512_slli_epi64(_mm512_cvtepu32_epi64(_mm256_castps_si256(z)), 32), id);

	_mm512_mask_storeu_epi64(row, k, _mm512_min_epu64(_mm512_maskz_loadu_epi64(k, row), word));
}

static inline void draw_words(const struct warp_target *t, const struct ewa_one *one, const struct ewa_part *part)
{
	const __mmask16 columns = columns_of(one, part);
	const __m128i core = _mm_set1_epi8((char)one->core);
	const __m512 across = across_of(one), near_z = _mm512_set1_ps(t->near_z);
	const __m512i id = _mm512_set1_epi64(one->id);
	uint64_t *row = t->word + (ptrdiff_t)(part->y0 - t->y0) * t->stride + (one->x - one->radius - t->x0);
	const uint8_t *weight = one->weight + (part->y0 - one->y + one->radius) * one->next;

	for (int32_t y = part->y0; y < part->y1; y++, row += t->stride, weight += one->next) {
		const __m512 z = depths_of(one, across, y - one->y);
		__mmask16 k = _mm_mask_cmpge_epu8_mask(columns, _mm_maskz_loadu_epi8(columns, weight), core);

		k = _mm512_mask_cmp_ps_mask(k, z, near_z, _CMP_GT_OQ);
		lower_eight(row, (__mmask8)k, _mm512_castps512_ps256(z), id);
		if (k >> 8)
			lower_eight(row + 8, (__mmask8)(k >> 8), _mm512_extractf32x8_ps(z, 1), id);
	}
}

/* z' of the words of the pixels of k. */
static inline __m512 words_of(const uint64_t *row, __mmask16 k)
{
	const __m512i upper = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
	const __m512i low = _mm512_maskz_loadu_epi64((__mmask8)k, row);
	const __m512i high = _mm512_maskz_loadu_epi64((__mmask8)(k >> 8), row + 8);

	return _mm512_castsi512_ps(_mm512_permutex2var_epi32(low, upper, high));
}

/* Adds a splat to two pixels, or to those of them whose bits are set. */
static inline void add_pair(uint32_t *to, uint32_t bits, __m512i own, __m512i weights)
{
	static const __mmask16 lanes[4] = { 0, 0xff, 0xff00, 0xffff };
	const __mmask16 some = lanes[bits & 3];

	_mm512_mask_storeu_epi32(to, some,
	                         _mm512_add_epi32(_mm512_maskz_loadu_epi32(some, to), _mm512_mullo_epi32(own, weights)));
}

static inline void draw_sums(const struct warp_target *t, const struct ewa_one *one, const struct ewa_part *part,
                             float same, const uint32_t value[EWA_LANES])
{
	const __mmask16 columns = columns_of(one, part);
	const __m512 across = across_of(one), behind = _mm512_set1_ps(same);
	const __m512i own = _mm512_broadcast_i64x4(_mm256_loadu_si256((const __m256i *)value)), two = _mm512_set1_epi32(2);
	const __m512i first = _mm512_setr_epi32(0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1);
	const ptrdiff_t left = one->x - one->radius - t->x0;
	const uint64_t *row = t->word + (ptrdiff_t)(part->y0 - t->y0) * t->stride + left;
	struct ewa_sum *sum = t->sum + (ptrdiff_t)(part->y0 - t->y0) * t->sum_stride + left;
	const uint8_t *weight = one->weight + (part->y0 - one->y + one->radius) * one->next;
	const int is_narrow = one->radius == 1;

	for (int32_t y = part->y0; y < part->y1; y++, row += t->stride, sum += t->sum_stride, weight += one->next) {
		const __m128i bytes = _mm_maskz_loadu_epi8(columns, weight);
		const __m512i weights = _mm512_cvtepu8_epi32(bytes);
		__mmask16 k = _mm_test_epi8_mask(bytes, bytes);
		__m512i pair = first;
		uint32_t *to = sum->lane;

		k = _mm512_mask_cmp_ps_mask(k, _mm512_sub_ps(depths_of(one, across, y - one->y), behind), words_of(row, k),
		                            _CMP_LE_OQ);
		if (is_narrow) { /* three pixels: a branch on each row's would cost more */
			add_pair(to, k, own, _mm512_permutexvar_epi32(first, weights));
			add_pair(to + 2 * EWA_LANES, k >> 2, own, _mm512_permutexvar_epi32(_mm512_add_epi32(first, two), weights));
			continue;
		}
		for (uint32_t rest = k; rest; rest >>= 2, pair = _mm512_add_epi32(pair, two), to += 2 * EWA_LANES)
			add_pair(to, rest, own, _mm512_permutexvar_epi32(pair, weights));
	}
}

static inline void list_masks(struct ewa_sorted *sorted, const struct ewa_leaves *l, uint32_t i, __m512i number)
{
	const __m512i has_mask = _mm512_loadu_si512(l->has_mask + i);
	const __mmask16 k = _mm512_test_epi32_mask(has_mask, has_mask);

	_mm512_storeu_si512(sorted->mask + sorted->n_masks, _mm512_maskz_compress_epi32(k, number));
	sorted->n_masks += (uint32_t)__builtin_popcount(k);
}

static inline uint32_t sort_words(struct words *words, struct ewa_sorted *sorted, const struct ewa_leaves *l,
                                  const struct warp_target *t)
{
	const __m512i none = _mm512_set1_epi32(-1);
	const __m512 near_z = _mm512_set1_ps(t->near_z);
	__m512i number = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
	uint32_t n_inside = 0;

	sorted->n_masks = 0;
	for (uint32_t i = 0; i < l->n; i += 16, number = _mm512_add_epi32(number, _mm512_set1_epi32(16))) {
		const __m512i pixel = _mm512_loadu_si512(l->pixel + i);
		const __m512 z = _mm512_loadu_ps(l->pixel_z + i);
		const __mmask16 is_one = _mm512_cmpneq_epi32_mask(pixel, none);
		const struct warped ones = { pixel, _mm512_loadu_si512(l->id + i), _mm512_castps_si512(z),
			                         _mm512_setzero_si512() };

		n_inside += (uint32_t)__builtin_popcount(is_one);
		words->n =
			list_words(words, words->n, NULL, 1, _mm512_mask_cmp_ps_mask(is_one, z, near_z, _CMP_GT_OQ), ones);
		list_masks(sorted, l, i, number);
	}
	return n_inside;
}

static inline void sort_sums(struct ewa_sorted *sorted, const struct ewa_leaves *l, const struct warp_target *t)
{
	const __m512i none = _mm512_set1_epi32(-1), x0 = _mm512_set1_epi32(t->x0), y0 = _mm512_set1_epi32(t->y0);
	const __m512i stride = _mm512_set1_epi32((int)t->sum_stride), byte = _mm512_set1_epi32(255);
	__m512i number = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
	uint32_t n = 0;

	sorted->n_masks = 0;
	for (uint32_t i = 0; i < l->n; i += 16, number = _mm512_add_epi32(number, _mm512_set1_epi32(16))) {
		const __m512i pixel = _mm512_loadu_si512(l->pixel + i), mask = _mm512_loadu_si512(l->mask + i);
		__mmask16 k = _mm512_cmpneq_epi32_mask(pixel, none);
		const __m512 own = _mm512_mask_i32gather_ps(_mm512_setzero_ps(), k, pixel, (const uint32_t *)t->word + 1, 8);
		const __m512 z = _mm512_sub_ps(_mm512_loadu_ps(l->pixel_z + i), _mm512_loadu_ps(l->same + i));

		k = _mm512_mask_cmp_ps_mask(k, z, own, _CMP_LE_OQ);
		const __m512i weight = _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), k, mask, ewa_weight, 1);
		const __m512i x = _mm512_sub_epi32(_mm512_loadu_si512(l->x + i), x0);
		const __m512i y = _mm512_sub_epi32(_mm512_loadu_si512(l->y + i), y0);

		_mm512_storeu_si512(sorted->sum + n,
		                    _mm512_maskz_compress_epi32(k, _mm512_add_epi32(_mm512_mullo_epi32(y, stride), x)));
		_mm512_storeu_si512(sorted->weight + n, _mm512_maskz_compress_epi32(k, _mm512_and_si512(weight, byte)));
		_mm512_storeu_si512(sorted->one + n, _mm512_maskz_compress_epi32(k, number));
		n += (uint32_t)__builtin_popcount(k);
		list_masks(sorted, l, i, number);
	}
	sorted->n_ones = n;
}

static const struct ewa_parts parts = { list_leaves, sort_words, sort_sums, draw_words, draw_sums };

uint64_t ewa_words_avx512(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return ewa_words_by(parts, target, entry, n);
}

uint64_t ewa_sums_avx512(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return ewa_sums_by(parts, target, entry, n);
}

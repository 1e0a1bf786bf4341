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

/* ---- masks ----
 *
 * A vector has 16 pixels: of one row, or eight each of two. Rows are parted alike for all splats, words by four and
 * sums by two, and stored whole: a load that overlaps the store before it, and is not of the same piece, has to wait.
 * Outside of the mask sums get a weight of 0. */

/* Where a mask's vectors are. */
struct rows {
	const uint8_t *weight;
	int32_t next; /* how far the next row of weights is */
	uint64_t *word;
	struct ewa_sum *sum;
	__m512 across, dy; /* of each lane: what its column adds to z', and pixels down from the middle */
	__mmask16 columns; /* of these those of the mask, or of its core */
	int32_t n;         /* rows */
};

/* Begins with the pixels from column `begin` of the tile on, 8 or 16 a row; `reach` to each side of the middle count. */
static inline __attribute__((always_inline)) void begin_rows(struct rows *rows, const struct warp_target *t,
                                                             const struct ewa_one *one, const struct ewa_part *part,
                                                             int32_t begin, int32_t reach, int per_row)
{
	const __m512i ordinals = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
	const __m512i column = per_row == 8 ? _mm512_and_si512(ordinals, _mm512_set1_epi32(7)) : ordinals;
	const int32_t first = begin - (one->x - t->x0), dy = part->y0 - one->y;
	const __m512i dx = _mm512_add_epi32(column, _mm512_set1_epi32(first));

	rows->weight = one->weight + (dy + one->radius) * one->next + (first + one->radius);
	rows->next = one->next;
	rows->word = t->word + (ptrdiff_t)(part->y0 - t->y0) * t->stride + begin;
	rows->columns = _mm512_cmple_epi32_mask(_mm512_abs_epi32(dx), _mm512_set1_epi32(reach));
	rows->across = _mm512_mul_ps(_mm512_cvtepi32_ps(dx), _mm512_set1_ps(one->zx));
	rows->dy = _mm512_add_ps(_mm512_set1_ps((float)dy),
	                         _mm512_cvtepi32_ps(_mm512_srli_epi32(ordinals, per_row == 8 ? 3 : 4)));
	rows->n = part->y1 - part->y0;
}

/* The weights of a vector: of its row, or of its n rows of eight. */
static inline __attribute__((always_inline)) __m128i weights_of(const struct rows *rows, int per_row, int n)
{
	if (per_row == 16)
		return _mm_loadu_si128((const __m128i *)rows->weight);
	const __m128i upper = _mm_loadl_epi64((const __m128i *)rows->weight);
	return n == 1 ? upper : _mm_unpacklo_epi64(upper, _mm_loadl_epi64((const __m128i *)(rows->weight + rows->next)));
}

static inline __m512 depths_of(const struct ewa_one *one, const struct rows *rows)
{
	const __m512 down = _mm512_mul_ps(rows->dy, _mm512_set1_ps(one->zy));
	const __m512 z = _mm512_add_ps(_mm512_set1_ps(one->z), _mm512_add_ps(rows->across, down));

	return _mm512_max_ps(z, _mm512_set1_ps(one->least));
}

static inline void next_rows(struct rows *rows, const struct warp_target *t, int n)
{
	rows->weight += n * rows->next;
	rows->word += (ptrdiff_t)n * t->stride;
	rows->dy = _mm512_add_ps(rows->dy, _mm512_set1_ps((float)n));
}

static inline void lower_four(uint64_t *word, __mmask8 k, __m128 z, __m256i id)
{
	const __m256i there = _mm256_loadu_si256((const __m256i *)word);
	const __m256i own = _mm256_or_si256(_mm256_slli_epi64(_mm256_cvtepu32_epi64(_mm_castps_si128(z)), 32), id);

	_mm256_storeu_si256((__m256i *)word, _mm256_mask_min_epu64(there, k, there, own));
}

/* Lowers the words of a row. */
static inline void lower_row(struct rows *rows, const struct warp_target *t, const struct ewa_one *one)
{
	const __m128i core = _mm_set1_epi8((char)one->core);
	const __m256i id = _mm256_set1_epi64x(one->id);
	const __m512 z = depths_of(one, rows);
	__mmask16 k = _mm_mask_cmpge_epu8_mask(rows->columns, weights_of(rows, 16, 1), core);

	k = _mm512_mask_cmp_ps_mask(k, z, _mm512_set1_ps(t->near_z), _CMP_GT_OQ);
	lower_four(rows->word, (__mmask8)(k & 15), _mm512_castps512_ps128(z), id);
	lower_four(rows->word + 4, (__mmask8)(k >> 4 & 15), _mm512_extractf32x4_ps(z, 1), id);
	lower_four(rows->word + 8, (__mmask8)(k >> 8 & 15), _mm512_extractf32x4_ps(z, 2), id);
	lower_four(rows->word + 12, (__mmask8)(k >> 12), _mm512_extractf32x4_ps(z, 3), id);
	next_rows(rows, t, 1);
}

static inline void draw_words(const struct warp_target *t, const struct ewa_one *one, const struct ewa_part *part)
{
	const int32_t begin = (one->x - t->x0 - one->core_radius) & ~3;
	struct rows rows;

	if (!ewa_has_columns(t, begin, 16)) {
		ewa_draw_words(t, one, part);
		return;
	}
	begin_rows(&rows, t, one, part, begin, one->core_radius, 16);
	for (; rows.n > 0; rows.n--)
		lower_row(&rows, t, one);
}

/* z' of a vector's words. */
static inline __attribute__((always_inline)) __m512 words_of(const struct rows *rows, const struct warp_target *t,
                                                             int per_row, int n)
{
	const __m512i upper = _mm512_setr_epi32(1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31);
	const uint64_t *next = per_row == 16 ? rows->word + 8 : rows->word + t->stride;
	const __m512i low = _mm512_maskz_loadu_epi64((__mmask8)rows->columns, rows->word);
	const __m512i high = n == 1 && per_row == 8 ? low : _mm512_maskz_loadu_epi64((__mmask8)(rows->columns >> 8), next);

	return _mm512_castsi512_ps(_mm512_permutex2var_epi32(low, upper, high));
}

/* Adds a splat to two pixels, of the weights of the lanes from `first` on. Products are of 16 bits: 255 by 511 or
 * EWA_COLOR_ONE. */
static inline void add_pair(struct ewa_sum *to, __m512i own, __m512i weights, int first)
{
	const __m512i pair = _mm512_setr_epi32(0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1);
	const __m512i both = _mm512_permutexvar_epi32(_mm512_add_epi32(pair, _mm512_set1_epi32(first)), weights);

	_mm512_storeu_si512(to, _mm512_add_epi32(_mm512_loadu_si512(to), _mm512_madd_epi16(own, both)));
}

/* Adds a splat to the pixels of a vector of n rows of so many pairs. */
static inline __attribute__((always_inline)) void add_rows(struct rows *rows, const struct warp_target *t,
                                                           const struct ewa_one *one, __m512 behind, __m512i own,
                                                           int n_pairs, int n)
{
	const int per_row = n_pairs > 4 ? 16 : 8;
	const __m512 z = _mm512_sub_ps(depths_of(one, rows), behind);
	const __mmask16 k = _mm512_mask_cmp_ps_mask(rows->columns, z, words_of(rows, t, per_row, n), _CMP_LE_OQ);
	const __m512i weights = _mm512_maskz_cvtepu8_epi32(k, weights_of(rows, per_row, n));

	for (int row = 0; k && row < n; row++)
		for (int p = 0; p < n_pairs; p++)
			add_pair(rows->sum + (size_t)row * t->sum_stride + 2 * p, own, weights, 8 * row + 2 * p);
	rows->sum += (size_t)n * t->sum_stride;
	next_rows(rows, t, n);
}

static inline __attribute__((always_inline)) void add_mask(const struct warp_target *t, const struct ewa_one *one,
                                                           const struct ewa_part *part, float same,
                                                           const uint32_t value[EWA_LANES], int radius)
{
	const int n_pairs = radius + 1, per_row = n_pairs > 4 ? 16 : 8, step = 16 / per_row;
	const int32_t begin = (one->x - t->x0 - radius) & ~1;
	const __m512i own = _mm512_broadcast_i64x4(_mm256_loadu_si256((const __m256i *)value));
	const __m512 behind = _mm512_set1_ps(same);
	struct rows rows;

	if (!ewa_has_columns(t, begin, 2 * n_pairs)) {
		ewa_draw_sums(t, one, part, same, value);
		return;
	}
	begin_rows(&rows, t, one, part, begin, radius, per_row);
	rows.sum = t->sum + (ptrdiff_t)(part->y0 - t->y0) * t->sum_stride + begin;
	for (; rows.n >= step; rows.n -= step)
		add_rows(&rows, t, one, behind, own, n_pairs, step);
	if (rows.n > 0)
		add_rows(&rows, t, one, behind, own, n_pairs, 1);
}

static inline void draw_sums(const struct warp_target *t, const struct ewa_one *one, const struct ewa_part *part,
                             float same, const uint32_t value[EWA_LANES])
{
	switch (one->radius) { /* each with loops of a constant length */
	case 1: add_mask(t, one, part, same, value, 1); break;
	case 2: add_mask(t, one, part, same, value, 2); break;
	case 3: add_mask(t, one, part, same, value, 3); break;
	case 4: add_mask(t, one, part, same, value, 4); break;
	case 6: add_mask(t, one, part, same, value, 6); break;
	case 7: add_mask(t, one, part, same, value, 7); break;
	default: ewa_draw_sums(t, one, part, same, value);
	}
}

/* ---- batches ---- */

static inline void list_masks(struct ewa_sorted *sorted, __mmask16 k, __m512i number)
{
	_mm512_storeu_si512(sorted->mask + sorted->n_masks, _mm512_maskz_compress_epi32(k, number));
	sorted->n_masks += (uint32_t)__builtin_popcount(k);
}

/* The lanes that have a bit. */
static inline __mmask16 load_mask(const int32_t *lanes, int bit)
{
	return _mm512_test_epi32_mask(_mm512_loadu_si512(lanes), _mm512_set1_epi32(bit));
}

/* Lists the words of the pixels of k, lowering those before them where there is no room. */
static inline void push_words(struct words *words, const struct warp_target *t, __mmask16 k, __m512i pixel, __m512i id,
                              __m512 z)
{
	const struct warped ones = { pixel, id, _mm512_castps_si512(z), _mm512_setzero_si512() };

	if (words->n > LIST - 16)
		lower_words(t->word, words);
	k = _mm512_mask_cmp_ps_mask(k, z, _mm512_set1_ps(t->near_z), _CMP_GT_OQ);
	words->n = list_words(words, words->n, NULL, 1, k, ones);
}

/* Lists the words of narrow cores of 16 leaves, from leaf i on: a pixel after the other, of all that have it. */
static inline void list_cores(struct words *words, const struct warp_target *t, const struct ewa_leaves *l, uint32_t i,
                              __m512i cores)
{
	const __m512i left = _mm512_sub_epi32(_mm512_loadu_si512(l->x + i), _mm512_set1_epi32(t->x0));
	const __m512i top = _mm512_sub_epi32(_mm512_loadu_si512(l->y + i), _mm512_set1_epi32(t->y0));
	const __m512i width = _mm512_set1_epi32(t->x1 - t->x0), height = _mm512_set1_epi32(t->y1 - t->y0);
	const __mmask16 is_flipped = load_mask(l->is_flipped + i, 1);
	const __m512i zero = _mm512_setzero_si512(), id = _mm512_loadu_si512(l->id + i);
	const __m512 middle = _mm512_loadu_ps(l->z + i), least = _mm512_loadu_ps(l->least + i);
	const __m512 zx = _mm512_loadu_ps(l->zx + i), zy = _mm512_loadu_ps(l->zy + i);

	for (uint32_t any = (uint32_t)_mm512_reduce_or_epi32(cores); any; any &= any - 1) {
		const uint32_t bit = (uint32_t)__builtin_ctz(any);
		const __m512i dx = _mm512_set1_epi32((int32_t)(bit % EWA_CORE_SIDE) - EWA_CORE_RADIUS);
		const __m512i down = _mm512_set1_epi32((int32_t)(bit / EWA_CORE_SIDE) - EWA_CORE_RADIUS);
		const __m512i dy = _mm512_mask_sub_epi32(down, is_flipped, zero, down);
		const __m512i x = _mm512_add_epi32(left, dx), y = _mm512_add_epi32(top, dy);
		const __m512 across = _mm512_mul_ps(_mm512_cvtepi32_ps(dx), zx);
		const __m512 slope = _mm512_add_ps(across, _mm512_mul_ps(_mm512_cvtepi32_ps(dy), zy));
		const __m512 z = _mm512_max_ps(_mm512_add_ps(middle, slope), least);
		__mmask16 k = _mm512_test_epi32_mask(cores, _mm512_set1_epi32(1 << bit));

		k = _mm512_mask_cmplt_epu32_mask(_mm512_mask_cmplt_epu32_mask(k, x, width), y, height);
		push_words(words, t, k, _mm512_add_epi32(_mm512_mullo_epi32(y, _mm512_set1_epi32((int)t->stride)), x), id, z);
	}
}

static inline uint32_t sort_words(struct words *words, struct ewa_sorted *sorted, const struct ewa_leaves *l,
                                  const struct warp_target *t)
{
	const __m512i none = _mm512_set1_epi32(-1), per_size = _mm512_set1_epi32(EWA_SHAPES * EWA_SECTORS);
	__m512i number = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
	uint32_t n_inside = 0;

	sorted->n_masks = 0;
	for (uint32_t i = 0; i < l->n; i += 16, number = _mm512_add_epi32(number, _mm512_set1_epi32(16))) {
		const __m512i pixel = _mm512_loadu_si512(l->pixel + i), size = _mm512_loadu_si512(l->size + i);
		const __mmask16 is_one = _mm512_cmpneq_epi32_mask(pixel, none), has_mask = load_mask(l->has_mask + i, 1);
		const __mmask16 is_narrow = _mm512_mask_cmple_epi32_mask(has_mask, size, _mm512_set1_epi32(EWA_NARROW));

		n_inside += (uint32_t)__builtin_popcount(is_one | load_mask(l->has_mask + i, 2));
		push_words(words, t, is_one, pixel, _mm512_loadu_si512(l->id + i), _mm512_loadu_ps(l->pixel_z + i));
		if (is_narrow) {
			const __m512i mask = _mm512_add_epi32(_mm512_mullo_epi32(size, per_size), _mm512_loadu_si512(l->mask + i));

			list_cores(words, t, l, i,
			           _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), is_narrow, mask, ewa_core_bits, 4));
		}
		list_masks(sorted, has_mask & (__mmask16)~is_narrow, number);
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
		list_masks(sorted, load_mask(l->has_mask + i, 1), number);
	}
	sorted->n_ones = n;
}

/* The weights and normals of four leaves are a transposed 4x4. */
static inline void put_normals(struct ewa_leaves *l)
{
	const __m512i weight = _mm512_set1_epi32(1);

	for (uint32_t i = 0; i < l->n; i += 16) {
		const __m512i x = _mm512_loadu_si512(l->turned[0] + i), y = _mm512_loadu_si512(l->turned[1] + i);
		const __m512i z = _mm512_loadu_si512(l->turned[2] + i);
		const __m512i low[2] = { _mm512_unpacklo_epi32(weight, x), _mm512_unpacklo_epi32(y, z) };
		const __m512i high[2] = { _mm512_unpackhi_epi32(weight, x), _mm512_unpackhi_epi32(y, z) };
		const __m512i fourth[4] = { _mm512_unpacklo_epi64(low[0], low[1]), _mm512_unpackhi_epi64(low[0], low[1]),
			                        _mm512_unpacklo_epi64(high[0], high[1]), _mm512_unpackhi_epi64(high[0], high[1]) };

		for (uint32_t k = 0; k < 4; k++) {
			_mm_store_si128((__m128i *)l->value[i + k], _mm512_castsi512_si128(fourth[k]));
			_mm_store_si128((__m128i *)l->value[i + 4 + k], _mm512_extracti32x4_epi32(fourth[k], 1));
			_mm_store_si128((__m128i *)l->value[i + 8 + k], _mm512_extracti32x4_epi32(fourth[k], 2));
			_mm_store_si128((__m128i *)l->value[i + 12 + k], _mm512_extracti32x4_epi32(fourth[k], 3));
		}
	}
}

static const struct ewa_parts parts = { list_leaves, sort_words, sort_sums, put_normals, draw_words, draw_sums };

uint64_t ewa_words_avx512(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return ewa_words_by(parts, target, entry, n);
}

uint64_t ewa_sums_avx512(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return ewa_sums_by(parts, target, entry, n);
}

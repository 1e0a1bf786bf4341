/* EWA splats: what compilers' vectors are poor at. Cubes are listed by permutations, and masks drawn by rows. */
#include "simd/loops/ewa.h"
#include "leaf_parts.h"

static inline void list_leaves(struct ewa_leaves *l, const struct warp_target *t, const struct bin_entry *entry,
                               const struct warp_cube *cube)
{
	const struct warp_octants *octants = cube->octants;
	const __m256 edge = _mm256_set1_ps(ewa_edge_of(t, entry));
	const __m256i id = _mm256_set1_epi32((int)cube->id), kind = _mm256_set1_epi32(ewa_kind_of(t, entry));
	const uint32_t n = (uint32_t)__builtin_popcountll(cube->mask);
	uint8_t lane[64 + 8];
	__m256 rows[3], columns[3], normal[3];

	list_samples(lane, cube->mask);
	for (int a = 0; a < 3; a++) {
		rows[a] = rows_at(cube->origin[a], octants->row[a]);
		columns[a] = cols_of(octants, a);
		normal[a] = _mm256_setzero_ps();
	}
	for (uint32_t i = 0, to = l->n; i < n; i += 8, to += 8) {
		const __m256i s = _mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)(lane + i)));
		const __m256i octant = _mm256_srli_epi32(s, 3), leaf = s;
		__m256 offset = _mm256_setzero_ps();

		if (cube->normal != NULL)
			components_of(normal, tens_of(t, _mm256_cvtepu16_epi32(normals_of(cube->normal + i, cube->n_ahead - i))));
		if (cube->offset != NULL)
			offset = offsets_of(steps_of(cube->offset + i, cube->n_ahead - i));
		for (int a = 0; a < 3; a++) {
			const __m256 middle = axis_of(rows[a], columns[a], octant, leaf);

			_mm256_storeu_ps(l->at[a] + to, _mm256_add_ps(middle, offset_axis(octants, a, normal, offset)));
			_mm256_storeu_ps(l->normal[a] + to, normal[a]);
		}
		_mm256_storeu_ps(l->edge + to, edge);
		_mm256_storeu_si256((__m256i *)(l->id + to), _mm256_add_epi32(id, s));
		_mm256_storeu_si256((__m256i *)(l->kind + to), kind);
	}
	l->n += n;
}

/* The depths of eight columns: at dx from the middle's, in a row at dy. */
static inline __m256 depths_of(const struct ewa_one *one, __m256i dx, int32_t dy)
{
	const __m256 across = _mm256_mul_ps(_mm256_cvtepi32_ps(dx), _mm256_set1_ps(one->zx));
	const __m256 z = _mm256_add_ps(_mm256_set1_ps(one->z), _mm256_add_ps(across, _mm256_set1_ps((float)dy * one->zy)));

	return _mm256_max_ps(z, _mm256_set1_ps(one->least));
}

static inline __m256i eight_weights(const uint8_t *weight)
{
	return _mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)weight));
}

/* Lowers four words: to z and id where all bits of a lane of k are set. */
static inline void lower_four(uint64_t *row, __m128i k, __m128i z, __m256i id)
{
	const __m256i sign = _mm256_set1_epi64x(INT64_MIN), there = _mm256_loadu_si256((const __m256i *)row);
	const __m256i own = _mm256_or_si256(_mm256_slli_epi64(_mm256_cvtepu32_epi64(z), 32), id);
	const __m256i is_nearer = _mm256_cmpgt_epi64(_mm256_xor_si256(there, sign), _mm256_xor_si256(own, sign));

	store(row, _mm256_blendv_epi8(there, own, _mm256_and_si256(is_nearer, _mm256_cvtepi32_epi64(k))));
}

/* Rows are parted alike for all splats: a load that overlaps the store before it, and is not of the same four words, has
 * to wait. */
static inline void draw_words(const struct warp_target *t, const struct ewa_one *one, const struct ewa_part *part)
{
	const int32_t middle = one->x - t->x0, begin = (middle - one->core_radius) & ~3, end = middle + one->core_radius + 1;
	const __m256i reach = _mm256_set1_epi32(one->core_radius + 1), core = _mm256_set1_epi32((int)one->core - 1);
	const __m256i id = _mm256_set1_epi64x(one->id);
	const __m256 near_z = _mm256_set1_ps(t->near_z);

	if (!ewa_has_columns(t, begin, (end - begin + 7) & ~7)) {
		ewa_draw_words(t, one, part);
		return;
	}
	for (int32_t x = begin; x < end; x += 8) {
		const __m256i dx = _mm256_add_epi32(_mm256_set1_epi32(x - middle), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
		const __m256i is_column = _mm256_cmpgt_epi32(reach, _mm256_abs_epi32(dx));
		const uint8_t *weight = one->weight + (part->y0 - one->y + one->radius) * one->next + (x - middle + one->radius);
		uint64_t *row = t->word + (size_t)(part->y0 - t->y0) * t->stride + (size_t)x;

		for (int32_t y = part->y0; y < part->y1; y++, row += t->stride, weight += one->next) {
			const __m256 z = depths_of(one, dx, y - one->y);
			const __m256i is_own = _mm256_and_si256(is_column, _mm256_cmpgt_epi32(eight_weights(weight), core));
			const __m256i k = _mm256_and_si256(is_own, _mm256_castps_si256(_mm256_cmp_ps(z, near_z, _CMP_GT_OQ)));
			const __m256i bits = _mm256_castps_si256(z);

			lower_four(row, _mm256_castsi256_si128(k), _mm256_castsi256_si128(bits), id);
			lower_four(row + 4, _mm256_extracti128_si256(k, 1), _mm256_extracti128_si256(bits, 1), id);
		}
	}
}

/* z' of eight words. */
static inline __m256 upper_of(const uint64_t *row)
{
	const __m256 a = _mm256_loadu_ps((const float *)row), b = _mm256_loadu_ps((const float *)(row + 4));
	const __m256i upper = _mm256_castps_si256(_mm256_shuffle_ps(a, b, _MM_SHUFFLE(3, 1, 3, 1)));

	return _mm256_castsi256_ps(_mm256_permute4x64_epi64(upper, _MM_SHUFFLE(3, 1, 2, 0)));
}

/* Adds a splat's next n columns, 8 at most. */
static inline __attribute__((always_inline)) void add_columns(const struct warp_target *t, const struct ewa_one *one,
                                                              const struct ewa_part *part, float same, __m256i value,
                                                              int32_t first, int32_t n)
{
	const __m256i dx = _mm256_add_epi32(_mm256_set1_epi32(first), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
	const ptrdiff_t x = one->x + first - t->x0;
	const uint8_t *weight = one->weight + (part->y0 - one->y + one->radius) * one->next + (first + one->radius);
	const uint64_t *row = t->word + (ptrdiff_t)(part->y0 - t->y0) * t->stride + x;
	struct ewa_sum *sum = t->sum + (ptrdiff_t)(part->y0 - t->y0) * t->sum_stride + x;
	_Alignas(32) int32_t weights[8];

	for (int32_t y = part->y0; y < part->y1; y++, row += t->stride, sum += t->sum_stride, weight += one->next) {
		const __m256 z = _mm256_sub_ps(depths_of(one, dx, y - one->y), _mm256_set1_ps(same));
		const __m256i is_same = _mm256_castps_si256(_mm256_cmp_ps(z, upper_of(row), _CMP_LE_OQ));

		store(weights, _mm256_and_si256(is_same, eight_weights(weight)));
		for (int32_t i = 0; i < n; i++) { /* products of 16 bits: 255 by 511 or EWA_COLOR_ONE */
			const __m256i more = _mm256_madd_epi16(value, _mm256_set1_epi32(weights[i]));

			store(sum[i].lane, _mm256_add_epi32(_mm256_load_si256((const __m256i *)sum[i].lane), more));
		}
	}
}

static inline void draw_sums(const struct warp_target *t, const struct ewa_one *one, const struct ewa_part *part,
                             float same, const uint32_t value[EWA_LANES])
{
	const int32_t radius = one->radius, side = 2 * radius + 1, first = one->x - radius - t->x0;
	const __m256i own = _mm256_loadu_si256((const __m256i *)value);

	if (!ewa_has_columns(t, first, (side + 7) & ~7))
		ewa_draw_sums(t, one, part, same, value);
	else if (radius == 1) /* most often */
		add_columns(t, one, part, same, own, -1, 3);
	else
		for (int32_t x = -radius; x <= radius; x += 8)
			add_columns(t, one, part, same, own, x, radius + 1 - x < 8 ? radius + 1 - x : 8);
}

/* All bits of a lane set that has a bit. */
static inline __m256i has_bit(__m256i lanes, int bit)
{
	const __m256i bits = _mm256_set1_epi32(bit);

	return _mm256_cmpeq_epi32(_mm256_and_si256(lanes, bits), bits);
}

static inline __m256i load(const void *from)
{
	return _mm256_loadu_si256(from);
}

/* Lists the words of the pixels of k, lowering those before them where there is no room. */
static inline void push_words(struct words *words, const struct warp_target *t, __m256i k, const struct warped *s)
{
	const __m256 is_far = _mm256_cmp_ps(_mm256_castsi256_ps(s->z), _mm256_set1_ps(t->near_z), _CMP_GT_OQ);

	if (words->n > LIST - 8)
		lower_words(t->word, words);
	list_words(words, NULL, _mm256_and_si256(k, _mm256_castps_si256(is_far)), s);
}

static inline uint32_t any_of(__m256i lanes)
{
	__m128i any = _mm_or_si128(_mm256_castsi256_si128(lanes), _mm256_extracti128_si256(lanes, 1));

	any = _mm_or_si128(any, _mm_shuffle_epi32(any, _MM_SHUFFLE(1, 0, 3, 2)));
	return (uint32_t)(_mm_cvtsi128_si32(any) | _mm_extract_epi32(any, 1));
}

/* Lists the words of narrow cores of 8 leaves, from leaf i on: a pixel after the other, of all that have it. */
static inline void list_cores(struct words *words, const struct warp_target *t, const struct ewa_leaves *l, uint32_t i,
                              __m256i cores)
{
	const __m256i left = load(l->x + i), top = load(l->y + i);
	const __m256i x0 = _mm256_set1_epi32(t->x0), y0 = _mm256_set1_epi32(t->y0);
	const __m256i down_or_up = _mm256_sub_epi32(_mm256_set1_epi32(1), _mm256_slli_epi32(load(l->is_flipped + i), 1));
	const __m256 middle = _mm256_loadu_ps(l->z + i), least = _mm256_loadu_ps(l->least + i);
	const __m256 zx = _mm256_loadu_ps(l->zx + i), zy = _mm256_loadu_ps(l->zy + i);
	struct warped s = { .id = load(l->id + i) };

	for (uint32_t any = any_of(cores); any; any &= any - 1) {
		const uint32_t bit = (uint32_t)__builtin_ctz(any);
		const __m256i dx = _mm256_set1_epi32((int32_t)(bit % EWA_CORE_SIDE) - EWA_CORE_RADIUS);
		const __m256i down = _mm256_set1_epi32((int32_t)(bit / EWA_CORE_SIDE) - EWA_CORE_RADIUS);
		const __m256i dy = _mm256_sign_epi32(down, down_or_up);
		const __m256i x = _mm256_add_epi32(left, dx), y = _mm256_add_epi32(top, dy);
		const __m256 across = _mm256_mul_ps(_mm256_cvtepi32_ps(dx), zx);
		const __m256 slope = _mm256_add_ps(across, _mm256_mul_ps(_mm256_cvtepi32_ps(dy), zy));
		const __m256i is_inside = _mm256_and_si256(within(x, t->x0, t->x1), within(y, t->y0, t->y1));
		const __m256i row = _mm256_mullo_epi32(_mm256_sub_epi32(y, y0), _mm256_set1_epi32((int)t->stride));

		s.z = _mm256_castps_si256(_mm256_max_ps(_mm256_add_ps(middle, slope), least));
		s.at = _mm256_add_epi32(row, _mm256_sub_epi32(x, x0));
		push_words(words, t, _mm256_and_si256(is_inside, has_bit(cores, 1 << bit)), &s);
	}
}

static inline uint32_t sort_words(struct words *words, struct ewa_sorted *sorted, const struct ewa_leaves *l,
                                  const struct warp_target *t)
{
	const __m256i none = _mm256_set1_epi32(-1), narrow = _mm256_set1_epi32(EWA_NARROW + 1);
	__m256i number = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
	uint32_t n_inside = 0;

	sorted->n_masks = 0;
	for (uint32_t i = 0; i < l->n; i += 8, number = _mm256_add_epi32(number, _mm256_set1_epi32(8))) {
		const __m256i pixel = load(l->pixel + i), size = load(l->size + i), mask = load(l->has_mask + i);
		const __m256i is_one = _mm256_xor_si256(_mm256_cmpeq_epi32(pixel, none), none), has_mask = has_bit(mask, 1);
		const __m256i is_narrow = _mm256_and_si256(has_mask, _mm256_cmpgt_epi32(narrow, size));
		const uint32_t others = bits_of(_mm256_andnot_si256(is_narrow, has_mask));
		const struct warped ones = { .at = pixel, .id = load(l->id + i), .z = load(l->pixel_z + i) };

		n_inside += (uint32_t)__builtin_popcount(bits_of(_mm256_or_si256(is_one, has_bit(mask, 2))));
		push_words(words, t, is_one, &ones);
		if (bits_of(is_narrow)) {
			const __m256i first = _mm256_mullo_epi32(size, _mm256_set1_epi32(EWA_SHAPES * EWA_SECTORS));

			list_cores(words, t, l, i,
			           _mm256_mask_i32gather_epi32(_mm256_setzero_si256(), (const int *)ewa_core_bits,
			                                       _mm256_add_epi32(first, load(l->mask + i)), is_narrow, 4));
		}
		store(sorted->mask + sorted->n_masks, _mm256_permutevar8x32_epi32(number, front_of(others)));
		sorted->n_masks += (uint32_t)__builtin_popcount(others);
	}
	return n_inside;
}

static const struct ewa_parts parts = { list_leaves,     sort_words, ewa_sort_sums,
	                                    ewa_put_normals, draw_words, draw_sums };

uint64_t ewa_words_avx2(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return ewa_words_by(parts, target, entry, n);
}

uint64_t ewa_sums_avx2(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return ewa_sums_by(parts, target, entry, n);
}

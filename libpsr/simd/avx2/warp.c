#include "warp_parts.h"

static inline __m256 rows_of(const struct warp_block *b, int a)
{
	__m128 part[2];

	for (int h = 0; h < 2; h++) {
		const __m256d row = _mm256_loadu_pd(b->lattice->row[a] + 4 * h);
		part[h] =
			_mm256_cvtpd_ps(_mm256_add_pd(_mm256_set1_pd(b->origin[a]), _mm256_mul_pd(_mm256_set1_pd(b->scale), row)));
	}
	return _mm256_set_m128(part[1], part[0]);
}

static inline __m256 columns_of(const struct warp_block *b, int a)
{
	return _mm256_mul_ps(_mm256_set1_ps((float)b->scale), _mm256_loadu_ps(b->lattice->col[a]));
}

static inline __m256 axis_of(__m256 rows, __m256 columns, __m256i r, __m256i c, __m256 depth, float unit)
{
	const __m256 place = _mm256_add_ps(_mm256_permutevar8x32_ps(rows, r), _mm256_permutevar8x32_ps(columns, c));

	return _mm256_add_ps(place, _mm256_mul_ps(depth, _mm256_set1_ps(unit)));
}

/* Reads the attributes of `valid` lanes alone. */
static inline __m256i normals_of(const uint64_t *attr, __m256i valid)
{
	const __m256i low_mask = _mm256_cvtepi32_epi64(_mm256_castsi256_si128(valid));
	const __m256i high_mask = _mm256_cvtepi32_epi64(_mm256_extracti128_si256(valid, 1));
	const __m256 low = _mm256_castsi256_ps(_mm256_maskload_epi64((const long long *)attr, low_mask));
	const __m256 high = _mm256_castsi256_ps(_mm256_maskload_epi64((const long long *)attr + 4, high_mask));
	const __m256i a = _mm256_permute4x64_epi64(_mm256_castps_si256(_mm256_shuffle_ps(low, high, 0x88)), 0xd8);

	return _mm256_and_si256(a, _mm256_set1_epi32(0x7fff));
}

/* Where in their pixels samples are that lie in the picture. */
static inline __m256i quarters_of(__m256 u, __m256 v, __m256i pixel_u, __m256i pixel_v)
{
	const __m256 four = _mm256_set1_ps(4);
	const __m256 right = _mm256_sub_ps(u, _mm256_cvtepi32_ps(pixel_u));
	const __m256 down = _mm256_sub_ps(v, _mm256_cvtepi32_ps(pixel_v));

	return _mm256_or_si256(_mm256_cvttps_epi32(_mm256_mul_ps(right, four)),
	                       _mm256_slli_epi32(_mm256_cvttps_epi32(_mm256_mul_ps(down, four)), 2));
}

/* The veils of a block's samples from `first` on. */
static inline __m256i veils_of(const struct veils *veils, uint32_t first)
{
	const uint64_t n_ahead = veils->n_ahead - first;
	uint64_t opacity = 0;

	if (n_ahead < 8)
		memcpy(&opacity, veils->opacity + first, n_ahead);
	else
		memcpy(&opacity, veils->opacity + first, sizeof opacity);
	const __m256i at = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((long long)opacity));
	return _mm256_cvttps_epi32(_mm256_mul_ps(_mm256_i32gather_ps(veils->bits, at, 4), _mm256_set1_ps(veils->area)));
}

static inline __attribute__((always_inline)) void list_block(struct words *words, struct cells *cells,
                                                             struct veils *veils, const struct warp_target *t,
                                                             const struct bin_entry *entry,
                                                             const struct warp_block *block)
{
	const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
	const struct warp_instance *in = &t->instance[entry->instance];
	uint8_t sample[64 + 8];

	const int n = __builtin_popcountll(block->mask), n_groups = (n + 7) / 8;
	list_samples(sample, block->mask);
	const __m256 row_x = rows_of(block, 0), row_y = rows_of(block, 1), row_z = rows_of(block, 2);
	const __m256 col_x = columns_of(block, 0), col_y = columns_of(block, 1), col_z = columns_of(block, 2);

	for (int g = 0; g < n_groups; g++) {
		const __m256i s = _mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)(sample + 8 * g)));
		const __m256i r = _mm256_srli_epi32(s, 3), c = s; /* the low three bits count */
		const __m256 depth =
			_mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(_mm_loadu_si128((const __m128i *)(block->depth + 8 * g))));
		const __m256 x1 = axis_of(row_x, col_x, r, c, depth, block->unit[0]);
		const __m256 y1 = axis_of(row_y, col_y, r, c, depth, block->unit[1]);
		const __m256 z1 = axis_of(row_z, col_z, r, c, depth, block->unit[2]);
		const __m256 one = _mm256_set1_ps(1), inverse = t->perspective ? _mm256_div_ps(one, z1) : one;
		const __m256 u = _mm256_mul_ps(x1, inverse), v = _mm256_mul_ps(y1, inverse);
		const __m256 half = _mm256_set1_ps(veils != NULL ? veils->half : 0);
		const __m256i pixel_u = floor_int(_mm256_sub_ps(u, half)), pixel_v = floor_int(_mm256_sub_ps(v, half));

		const __m256i valid = _mm256_cmpgt_epi32(_mm256_set1_epi32(n - 8 * g), lane);
		__m256i k =
			_mm256_and_si256(valid, _mm256_castps_si256(_mm256_cmp_ps(z1, _mm256_set1_ps(t->near_z), _CMP_GT_OQ)));
		if (entry->is_mixed) {
			__m256 normal[3];

			components_of(normal, tens_of(t, normals_of(block->attr + 8 * g, valid)));
			k = _mm256_andnot_si256(faces_away(in, normal, u, v), k);
		}
		if (entry->level)
			list_cells(cells, t, k, pixel_u, pixel_v, z1);
		k = _mm256_and_si256(k, _mm256_and_si256(within(pixel_u, t->x0, t->x1), within(pixel_v, t->y0, t->y1)));
		const __m256i x = _mm256_sub_epi32(pixel_u, _mm256_set1_epi32(t->x0));
		const __m256i y = _mm256_sub_epi32(pixel_v, _mm256_set1_epi32(t->y0));
		__m256i low = _mm256_add_epi32(s, _mm256_set1_epi32((int)block->id));
		if (t->place_bits)
			low = _mm256_or_si256(_mm256_slli_epi32(low, PSR_PLACE_BITS), quarters_of(u, v, pixel_u, pixel_v));
		const struct warped samples = {
			_mm256_add_epi32(_mm256_mullo_epi32(y, _mm256_set1_epi32((int)t->stride)), x), low, _mm256_castps_si256(z1),
			veils != NULL ? veils_of(veils, 8 * (uint32_t)g) : _mm256_setzero_si256()
		};
		list_words(words, veils, k, &samples);
	}
}

uint64_t warp_avx2(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return warp_by(list_block, target, entry, n);
}

void veil_avx2(const struct warp_target *target, const struct veil_layer *layer, const struct veil_entry *entry,
               uint32_t n)
{
	veil_by(list_block, hang_squares, target, layer, entry, n);
}

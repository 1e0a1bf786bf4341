#include <immintrin.h>
#include <string.h>
#include "simd/kernels.h"
#include "simd/veil_list.h"

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

/* Values that do not fit, and NaN, become INT32_MIN, outside of every picture. */
static inline __m256i floor_int(__m256 u)
{
	return _mm256_cvttps_epi32(_mm256_floor_ps(u));
}

static inline __m256 sight_axis(const struct warp_instance *in, int k, __m256 u, __m256 v)
{
	const __m256 across = _mm256_mul_ps(u, _mm256_set1_ps(in->du[k])),
				 down = _mm256_mul_ps(v, _mm256_set1_ps(in->dv[k]));

	return _mm256_add_ps(_mm256_add_ps(across, down), _mm256_set1_ps(in->d0[k]));
}

static inline __m256 dot(const __m256 a[3], const __m256 b[3])
{
	return _mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(a[0], b[0]), _mm256_mul_ps(a[1], b[1])),
	                     _mm256_mul_ps(a[2], b[2]));
}

/* A mask has all bits of a lane set, or none. Reads the attributes of `valid` lanes alone. */
static inline __m256i faces_away(const struct warp_target *t, const struct warp_instance *in, const uint64_t *attr,
                                 __m256i valid, __m256 u, __m256 v)
{
	const __m256i low_mask = _mm256_cvtepi32_epi64(_mm256_castsi256_si128(valid));
	const __m256i high_mask = _mm256_cvtepi32_epi64(_mm256_extracti128_si256(valid, 1));
	const __m256 low = _mm256_castsi256_ps(_mm256_maskload_epi64((const long long *)attr, low_mask));
	const __m256 high = _mm256_castsi256_ps(_mm256_maskload_epi64((const long long *)attr + 4, high_mask));
	const __m256i a = _mm256_permute4x64_epi64(_mm256_castps_si256(_mm256_shuffle_ps(low, high, 0x88)), 0xd8);
	const __m256i normal =
		_mm256_i32gather_epi32((const int *)t->direction, _mm256_and_si256(a, _mm256_set1_epi32(0x7fff)), 4);
	__m256 n[3], d[3];

	for (int i = 0; i < 3; i++) {
		n[i] = _mm256_cvtepi32_ps(_mm256_srai_epi32(_mm256_slli_epi32(normal, 22 - 10 * i), 22));
		d[i] = sight_axis(in, i, u, v);
	}
	const __m256 g = dot(n, d), limit = _mm256_mul_ps(_mm256_set1_ps(BACK_SINE * BACK_SINE * 511 * 511), dot(d, d));
	const __m256 behind = _mm256_cmp_ps(g, _mm256_setzero_ps(), _CMP_GT_OQ);
	return _mm256_castps_si256(_mm256_and_ps(behind, _mm256_cmp_ps(_mm256_mul_ps(g, g), limit, _CMP_GT_OQ)));
}

/* Lanes with first <= a < end. */
static inline __m256i within(__m256i a, int32_t first, int32_t end)
{
	return _mm256_andnot_si256(_mm256_cmpgt_epi32(_mm256_set1_epi32(first), a),
	                           _mm256_cmpgt_epi32(_mm256_set1_epi32(end), a));
}

static inline uint32_t bits_of(__m256i k)
{
	return (uint32_t)_mm256_movemask_ps(_mm256_castsi256_ps(k));
}

/* The order that brings the lanes of a mask to the front. */
static inline __m256i front_of(uint32_t bits)
{
	const uint64_t lanes =
		_pext_u64(UINT64_C(0x0706050403020100), _pdep_u64(bits, UINT64_C(0x0101010101010101)) * 0xff);

	return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((long long)lanes));
}

static inline void store(void *to, __m256i value)
{
	_mm256_storeu_si256(to, value);
}

static inline void list_cells(struct cells *list, const struct warp_target *t, __m256i k, __m256i u, __m256i v,
                              __m256 z)
{
	const struct warp_cells *cells = &t->cells[list->level];
	const __m256i one = _mm256_set1_epi32(1), by = _mm256_set1_epi32((int)list->level);

	k = _mm256_and_si256(k, _mm256_and_si256(within(u, cells->x0, cells->x1), within(v, cells->y0, cells->y1)));
	const __m256i x = _mm256_add_epi32(_mm256_srav_epi32(u, by), one),
				  y = _mm256_add_epi32(_mm256_srav_epi32(v, by), one);
	const __m256i at = _mm256_add_epi32(_mm256_mullo_epi32(y, _mm256_set1_epi32((int)cells->stride)), x);
	const uint32_t bits = bits_of(k);
	const __m256i front = front_of(bits);
	store(list->at + list->n, _mm256_permutevar8x32_epi32(at, front));
	store(list->z + list->n, _mm256_permutevar8x32_epi32(_mm256_castps_si256(z), front));
	list->n += (uint32_t)__builtin_popcount(bits);
}

/* Samples under way: their places, ids, depths and veils. */
struct warped {
	__m256i at, id, z, veil;
};

/* The veils of a block's next samples, n or 8. */
static inline __m256i veils_of(const struct veils *veils, int first, int n)
{
	uint64_t opacity = 0;

	if (n < 8)
		memcpy(&opacity, veils->opacity + first, (size_t)n);
	else
		memcpy(&opacity, veils->opacity + first, sizeof opacity);
	const __m256i at = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((long long)opacity));
	return _mm256_cvttps_epi32(_mm256_mul_ps(_mm256_i32gather_ps(veils->bits, at, 4), _mm256_set1_ps(veils->area)));
}

static inline void list_words(struct words *list, struct veils *veils, __m256i k, const struct warped *s)
{
	const uint32_t bits = bits_of(k);
	const __m256i front = front_of(bits), own = _mm256_permutevar8x32_epi32(s->id, front);
	const __m256i depth = _mm256_permutevar8x32_epi32(s->z, front);
	const __m256i low = _mm256_unpacklo_epi32(own, depth), high = _mm256_unpackhi_epi32(own, depth);

	store(list->at + list->n, _mm256_permutevar8x32_epi32(s->at, front));
	if (veils != NULL)
		store(veils->veil + list->n, _mm256_permutevar8x32_epi32(s->veil, front));
	store(list->word + list->n, _mm256_permute2x128_si256(low, high, 0x20));
	store(list->word + list->n + 4, _mm256_permute2x128_si256(low, high, 0x31));
	list->n += (uint32_t)__builtin_popcount(bits);
}

/* Lists the indices of the bits of a mask, in order; later elements are undefined. */
static inline void list_samples(uint8_t sample[64 + 8], uint64_t mask)
{
	uint32_t n = 0;

	for (uint64_t row = 0; row < 8; row++) {
		const uint64_t bits = mask >> 8 * row & 0xff;
		const uint64_t columns =
			_pext_u64(UINT64_C(0x0706050403020100), _pdep_u64(bits, UINT64_C(0x0101010101010101)) * 0xff);
		const uint64_t numbers = columns + row * UINT64_C(0x0808080808080808);

		memcpy(sample + n, &numbers, sizeof numbers);
		n += (uint32_t)__builtin_popcountll(bits);
	}
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
		if (entry->is_mixed)
			k = _mm256_andnot_si256(faces_away(t, in, block->attr + 8 * g, valid, u, v), k);
		if (entry->level)
			list_cells(cells, t, k, pixel_u, pixel_v, z1);
		k = _mm256_and_si256(k, _mm256_and_si256(within(pixel_u, t->x0, t->x1), within(pixel_v, t->y0, t->y1)));
		const __m256i x = _mm256_sub_epi32(pixel_u, _mm256_set1_epi32(t->x0));
		const __m256i y = _mm256_sub_epi32(pixel_v, _mm256_set1_epi32(t->y0));
		const struct warped samples = {
			_mm256_add_epi32(_mm256_mullo_epi32(y, _mm256_set1_epi32((int)t->stride)), x),
			_mm256_add_epi32(s, _mm256_set1_epi32((int)block->id)), _mm256_castps_si256(z1),
			veils != NULL ? veils_of(veils, 8 * g, n - 8 * g) : _mm256_setzero_si256()
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

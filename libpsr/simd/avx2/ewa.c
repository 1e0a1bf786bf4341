/* EWA splats: what compilers' vectors are poor at, listing cubes. */
#include "simd/loops/ewa.h"
#include "warp_parts.h"

static inline __m256 rows_of(const struct warp_cube *cube, int a)
{
	__m128 part[2];

	for (int h = 0; h < 2; h++)
		part[h] = _mm256_cvtpd_ps(
			_mm256_add_pd(_mm256_set1_pd(cube->origin[a]), _mm256_loadu_pd(cube->octants->row[a] + 4 * h)));
	return _mm256_set_m128(part[1], part[0]);
}

static inline __m256i normals_of(const uint16_t *normal, uint32_t n)
{
	uint16_t some[8] = { 0 };

	if (n < 8)
		memcpy(some, normal, n * sizeof *some);
	return _mm256_cvtepu16_epi32(_mm_loadu_si128((const __m128i *)(n < 8 ? some : normal)));
}

static inline __m256 offsets_of(const uint8_t *offset, uint32_t n)
{
	uint64_t some = 0;

	memcpy(&some, offset, n < 8 ? n : sizeof some);
	const __m256i step = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128((long long)some));
	return _mm256_cvtepi32_ps(_mm256_sub_epi32(_mm256_add_epi32(step, step), _mm256_set1_epi32(WARP_OFFSET_MIDDLE)));
}

static inline void list_leaves(struct ewa_leaves *l, const struct warp_target *t, const struct bin_entry *entry,
                               const struct warp_cube *cube)
{
	const struct warp_octants *octants = cube->octants;
	const __m256 edge = _mm256_set1_ps(ewa_edge_of(t, entry));
	const __m256i id = _mm256_set1_epi32((int)cube->id), kind = _mm256_set1_epi32(ewa_kind_of(t, entry));
	const uint32_t n = (uint32_t)__builtin_popcountll(cube->mask);
	uint8_t lane[64 + 8];
	__m256 rows[3], normal[3];

	list_samples(lane, cube->mask);
	for (int a = 0; a < 3; a++) {
		rows[a] = rows_of(cube, a);
		normal[a] = _mm256_setzero_ps();
	}
	for (uint32_t i = 0, to = l->n; i < n; i += 8, to += 8) {
		const __m256i s = _mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)(lane + i)));
		const __m256i octant = _mm256_srli_epi32(s, 3), leaf = s; /* the low three bits count */
		__m256 offset = _mm256_setzero_ps();

		if (cube->normal != NULL)
			components_of(normal, tens_of(t, normals_of(cube->normal + i, n - i)));
		if (cube->offset != NULL)
			offset = offsets_of(cube->offset + i, n - i);
		for (int a = 0; a < 3; a++) {
			const float *along = octants->along[a];
			const __m256 x = _mm256_mul_ps(_mm256_set1_ps(along[0]), normal[0]);
			const __m256 y = _mm256_mul_ps(_mm256_set1_ps(along[1]), normal[1]);
			const __m256 z = _mm256_mul_ps(_mm256_set1_ps(along[2]), normal[2]);
			const __m256 middle = _mm256_add_ps(_mm256_permutevar8x32_ps(rows[a], octant),
			                                    _mm256_permutevar8x32_ps(_mm256_loadu_ps(octants->col[a]), leaf));
			const __m256 by = _mm256_mul_ps(_mm256_add_ps(_mm256_add_ps(x, y), z), offset);

			_mm256_storeu_ps(l->at[a] + to, _mm256_add_ps(middle, by));
			_mm256_storeu_ps(l->normal[a] + to, normal[a]);
		}
		_mm256_storeu_ps(l->edge + to, edge);
		_mm256_storeu_si256((__m256i *)(l->id + to), _mm256_add_epi32(id, s));
		_mm256_storeu_si256((__m256i *)(l->kind + to), kind);
	}
	l->n += n;
}

static const struct ewa_parts parts = { list_leaves, ewa_draw_words, ewa_draw_sums };

uint64_t ewa_words_avx2(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return ewa_words_by(parts, target, entry, n);
}

uint64_t ewa_sums_avx2(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return ewa_sums_by(parts, target, entry, n);
}

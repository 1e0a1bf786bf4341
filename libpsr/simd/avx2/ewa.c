/* EWA splats: what compilers' vectors are poor at, listing cubes. */
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

static const struct ewa_parts parts = { list_leaves, ewa_sort_words, ewa_sort_sums, ewa_draw_words, ewa_draw_sums };

uint64_t ewa_words_avx2(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return ewa_words_by(parts, target, entry, n);
}

uint64_t ewa_sums_avx2(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return ewa_sums_by(parts, target, entry, n);
}

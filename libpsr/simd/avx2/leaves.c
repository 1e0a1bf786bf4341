/* The warp of leaves: two terms a place, as [B] (1), and where a leaf is wider than a pixel its offset. */
#include "simd/leaves_list.h"
#include "leaf_parts.h"

static inline __attribute__((always_inline)) void list_cube(struct words *words, struct cells *cells,
                                                            const struct warp_target *t, const struct bin_entry *entry,
                                                            const struct warp_cube *cube)
{
	const __m256i lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
	const struct warp_instance *in = &t->instance[entry->instance];
	const struct warp_octants *octants = cube->octants;
	const int with_offsets = entry->is_wide && cube->offset != NULL;
	const int n = __builtin_popcountll(cube->mask), n_groups = (n + 7) / 8;
	const __m256 row_x = rows_of(cube, 0), row_y = rows_of(cube, 1), row_z = rows_of(cube, 2);
	uint8_t lane[64 + 8];

	list_samples(lane, cube->mask);
	for (int g = 0; g < n_groups; g++) {
		const __m256i s = _mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)(lane + 8 * g)));
		const __m256i octant = _mm256_srli_epi32(s, 3), leaf = s; /* the low three bits count */
		__m256 x1 = axis_of(row_x, octants->col[0], octant, leaf), y1 = axis_of(row_y, octants->col[1], octant, leaf);
		__m256 z1 = axis_of(row_z, octants->col[2], octant, leaf), normal[3];

		if (with_offsets || entry->is_mixed)
			components_of(normal, tens_of(t, normals_of(cube->normal + 8 * g, cube->n_ahead - 8 * (unsigned)g)));
		if (with_offsets) {
			const __m256 offset = offsets_of(cube->offset + 8 * g, cube->n_ahead - 8 * (unsigned)g);

			x1 = _mm256_add_ps(x1, offset_axis(octants, 0, normal, offset));
			y1 = _mm256_add_ps(y1, offset_axis(octants, 1, normal, offset));
			z1 = _mm256_add_ps(z1, offset_axis(octants, 2, normal, offset));
		}
		const __m256 one = _mm256_set1_ps(1), inverse = t->perspective ? _mm256_div_ps(one, z1) : one;
		const __m256 u = _mm256_mul_ps(x1, inverse), v = _mm256_mul_ps(y1, inverse);
		const __m256i pixel_u = floor_int(u), pixel_v = floor_int(v);
		const __m256i valid = _mm256_cmpgt_epi32(_mm256_set1_epi32(n - 8 * g), lanes);
		__m256i k =
			_mm256_and_si256(valid, _mm256_castps_si256(_mm256_cmp_ps(z1, _mm256_set1_ps(t->near_z), _CMP_GT_OQ)));

		if (entry->is_mixed)
			k = _mm256_andnot_si256(faces_away(in, normal, u, v), k);
		if (entry->level)
			list_cells(cells, t, k, pixel_u, pixel_v, z1);
		k = _mm256_and_si256(k, _mm256_and_si256(within(pixel_u, t->x0, t->x1), within(pixel_v, t->y0, t->y1)));
		const __m256i x = _mm256_sub_epi32(pixel_u, _mm256_set1_epi32(t->x0));
		const __m256i y = _mm256_sub_epi32(pixel_v, _mm256_set1_epi32(t->y0));
		const struct warped samples = {
			_mm256_add_epi32(_mm256_mullo_epi32(y, _mm256_set1_epi32((int)t->stride)), x),
			_mm256_add_epi32(s, _mm256_set1_epi32((int)cube->id)), _mm256_castps_si256(z1), _mm256_setzero_si256()
		};
		list_words(words, NULL, k, &samples);
	}
}

uint64_t warp_leaves_avx2(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return leaves_by(list_cube, target, entry, n);
}

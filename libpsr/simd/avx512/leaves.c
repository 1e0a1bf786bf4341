/* The warp of leaves: two terms a place, as [B] (1), and where a leaf is wider than a pixel its offset. */
#include "simd/leaves_list.h"
#include "leaf_parts.h"

static inline __attribute__((always_inline)) void list_cube(struct words *words, struct cells *cells,
                                                            const struct warp_target *t, const struct bin_entry *entry,
                                                            const struct warp_cube *cube)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	const struct warp_octants *octants = cube->octants;
	const int level = entry->level, is_mixed = entry->is_mixed, perspective = t->perspective;
	const int with_offsets = entry->is_wide && cube->offset != NULL;
	const int n = __builtin_popcountll(cube->mask);
	const __m512i id = _mm512_set1_epi32((int)cube->id), stride = _mm512_set1_epi32((int)t->stride);
	const __m512 row_x = rows_of(cube, 0), row_y = rows_of(cube, 1), row_z = rows_of(cube, 2);
	_Alignas(64) uint8_t lane[64];
	uint32_t n_words = words->n;

	list_lanes(lane, cube->mask);
	for (int i = 0; i < n; i += 16) {
		const __m512i s = _mm512_cvtepu8_epi32(_mm_load_si128((const __m128i *)(lane + i)));
		const __m512i octant = _mm512_srli_epi32(s, 3), leaf = _mm512_and_si512(s, _mm512_set1_epi32(7));
		const __mmask16 valid = (__mmask16)_bzhi_u32(0xffff, (uint32_t)(n - i));
		__m512 x1 = axis_of(row_x, octants->col[0], octant, leaf), y1 = axis_of(row_y, octants->col[1], octant, leaf);
		__m512 z1 = axis_of(row_z, octants->col[2], octant, leaf), normal[3];

		if (with_offsets | is_mixed) {
			const __m512i index = _mm512_cvtepu16_epi32(_mm256_maskz_loadu_epi16(valid, cube->normal + i));

			components_of(normal, tens_of(t, index));
		}
		if (with_offsets) {
			const __m512 offset = offsets_of(cube->offset + i, valid);

			x1 = _mm512_add_ps(x1, offset_axis(octants, 0, normal, offset));
			y1 = _mm512_add_ps(y1, offset_axis(octants, 1, normal, offset));
			z1 = _mm512_add_ps(z1, offset_axis(octants, 2, normal, offset));
		}
		const __m512 one = _mm512_set1_ps(1), inverse = perspective ? _mm512_div_ps(one, z1) : one;
		const __m512 u = _mm512_mul_ps(x1, inverse), v = _mm512_mul_ps(y1, inverse);
		const __m512i pixel_u = floor_int(u), pixel_v = floor_int(v);
		__mmask16 k = _mm512_mask_cmp_ps_mask(valid, z1, _mm512_set1_ps(t->near_z), _CMP_GT_OQ);
		if (is_mixed)
			k &= (__mmask16)~faces_away(in, k, normal, u, v);
		if (level)
			list_cells(cells, t, k, pixel_u, pixel_v, z1);
		k = within(within(k, pixel_u, t->x0, t->x1), pixel_v, t->y0, t->y1);
		const __m512i x = _mm512_sub_epi32(pixel_u, _mm512_set1_epi32(t->x0));
		const __m512i y = _mm512_sub_epi32(pixel_v, _mm512_set1_epi32(t->y0));
		const struct warped samples = { _mm512_add_epi32(_mm512_mullo_epi32(y, stride), x), _mm512_add_epi32(s, id),
			                            _mm512_castps_si512(z1), _mm512_setzero_si512() };
		n_words = list_words(words, n_words, NULL, is_mixed, k, samples);
	}
	words->n = n_words;
}

uint64_t warp_leaves_avx512(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return leaves_by(list_cube, target, entry, n);
}

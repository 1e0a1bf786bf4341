/* The warp of leaves: two terms a place, as [B] (1), and where a leaf is wider than a pixel its offset. */
#include "simd/leaves_batch.h"
#include "leaf_parts.h"

#define LANES 16
#define MOST_SPARSE 5 /* leaves a cube, of a level */

/* ---- leaves to words ---- */

static inline __attribute__((always_inline)) void draw(struct leaves_lists *to, const struct leaves *l,
                                                       const struct warp_target *t, uint32_t i, uint32_t n)
{
	const __mmask16 valid = (__mmask16)_bzhi_u32(0xffff, n);
	const int is_mixed = l->is_mixed, perspective = t->perspective;
	__m512 x1 = _mm512_load_ps(l->at[0] + i), y1 = _mm512_load_ps(l->at[1] + i), z1 = _mm512_load_ps(l->at[2] + i);
	__m512 normal[3];

	if (l->with_offsets | is_mixed)
		components_of(normal, tens_of(t, _mm512_cvtepu16_epi32(_mm256_load_si256((const __m256i *)(l->normal + i)))));
	if (l->with_offsets) {
		const __m512 offset = offsets_of(l->offset + i, 0xffff);

		x1 = _mm512_add_ps(x1, offset_axis(l->octants, 0, normal, offset));
		y1 = _mm512_add_ps(y1, offset_axis(l->octants, 1, normal, offset));
		z1 = _mm512_add_ps(z1, offset_axis(l->octants, 2, normal, offset));
	}
	const __m512 one = _mm512_set1_ps(1), inverse = perspective ? _mm512_div_ps(one, z1) : one;
	const __m512 u = _mm512_mul_ps(x1, inverse), v = _mm512_mul_ps(y1, inverse);
	const __m512i pixel_u = floor_int(u), pixel_v = floor_int(v);
	__mmask16 k = _mm512_mask_cmp_ps_mask(valid, z1, _mm512_set1_ps(t->near_z), _CMP_GT_OQ);
	if (is_mixed)
		k &= (__mmask16)~faces_away(l->in, k, normal, u, v);
	if (l->level)
		list_cells(&to->cells, t, k, pixel_u, pixel_v, z1);
	k = within(within(k, pixel_u, t->x0, t->x1), pixel_v, t->y0, t->y1);
	const __m512i x = _mm512_sub_epi32(pixel_u, _mm512_set1_epi32(t->x0));
	const __m512i y = _mm512_sub_epi32(pixel_v, _mm512_set1_epi32(t->y0));
	const struct warped samples = {
		_mm512_add_epi32(_mm512_mullo_epi32(y, _mm512_set1_epi32((int)t->stride)), x),
		_mm512_load_si512(l->id + i), _mm512_castps_si512(z1), _mm512_setzero_si512(),
	};
	to->words.n = list_words(&to->words, to->words.n, NULL, is_mixed, k, samples);
}

/* ---- cubes to leaves ---- */

static inline void place(struct placed_cubes *placed, const struct warp_cubes *to, const struct run *run,
                         uint64_t cubes)
{
	const __m256i words = _mm256_set1_epi32(sizeof *run->cube / 4);
	const __m512i most = _mm512_set1_epi64((1 << CUBES_PLACE_BITS) - 1), two = _mm512_set1_epi64(2);
	const __m512d edge = _mm512_set1_pd(run->level->edge);
	const uint32_t n = (uint32_t)__builtin_popcountll(cubes);

	list_lanes(placed->number, cubes);
	for (uint32_t i = 0; i < n; i += 8) {
		const __m256i at = _mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)(placed->number + i)));
		const __m512i place = _mm512_i32gather_epi64(_mm256_mullo_epi32(at, words), run->cube->place, 4);
		__m512d c[3];

		for (int a = 0; a < 3; a++) {
			const __m512i own = _mm512_and_si512(_mm512_srli_epi64(place, (unsigned)(CUBES_PLACE_BITS * a)), most);
			const __m512d steps = _mm512_cvtepi64_pd(_mm512_add_epi64(_mm512_slli_epi64(own, 2), two));

			c[a] = _mm512_add_pd(_mm512_set1_pd(run->level->tree->low[a]), _mm512_mul_pd(steps, edge));
		}
		for (int a = 0; a < 3; a++) {
			const double *axis = to->axis[a];
			const __m512d x = _mm512_mul_pd(_mm512_set1_pd(axis[0]), c[0]);
			const __m512d y = _mm512_mul_pd(_mm512_set1_pd(axis[1]), c[1]);
			const __m512d z = _mm512_mul_pd(_mm512_set1_pd(axis[2]), c[2]);
			const __m512d sum = _mm512_add_pd(_mm512_add_pd(x, y), z);

			_mm512_store_pd(placed->middle[a] + i, _mm512_add_pd(_mm512_set1_pd(to->origin[a]), sum));
		}
	}
}

/* Puts normals, and offsets if they count, of the next n leaves of the tree, of LANES at most. */
static inline void list_looks(struct leaves *l, uint32_t to, const struct octree *tree, uint32_t leaf, uint32_t n)
{
	const __mmask16 valid = (__mmask16)_bzhi_u32(0xffff, n);

	_mm256_storeu_si256((__m256i *)(l->normal + to), _mm256_maskz_loadu_epi16(valid, tree->normal + leaf));
	if (l->with_offsets)
		_mm_storeu_si128((__m128i *)(l->offset + to), _mm_maskz_loadu_epi8(valid, tree->offset + leaf));
}

static inline void list_cube(struct leaves *l, const struct run *run, const struct placed_cubes *placed, uint32_t which)
{
	const struct octree *tree = run->level->tree;
	const struct cube_at at = cube_at(run, placed->number[which]);
	const uint64_t mask = warp_cube_mask(psr_cubes_children(tree, at.code), tree->code[at.code]);
	const uint32_t n = (uint32_t)__builtin_popcountll(mask), begin = l->n;
	const __m512i id = _mm512_set1_epi32((int)at.id);
	const int with_normals = l->is_mixed | l->with_offsets;
	_Alignas(64) uint8_t lane[64];
	__m512 row[3], col[3];

	for (int a = 0; a < 3; a++) {
		row[a] = rows_at(placed->middle[a][which], l->octants->row[a]);
		col[a] = cols_of(l->octants, a);
	}
	list_lanes(lane, mask);
	for (uint32_t k = 0; k < n; k += LANES) {
		const __m512i s = _mm512_cvtepu8_epi32(_mm_load_si128((const __m128i *)(lane + k)));
		const __m512i octant = _mm512_srli_epi32(s, 3);
		const uint32_t to = begin + k;

		for (int a = 0; a < 3; a++)
			_mm512_storeu_ps(l->at[a] + to, axis_of(row[a], col[a], octant, s));
		_mm512_storeu_si512(l->id + to, _mm512_add_epi32(id, s));
		if (with_normals)
			list_looks(l, to, tree, at.leaf + k, n - k);
	}
	l->n = begin + n;
}

/* ---- where cubes have few leaves, those of several fill a vector from the beginning ---- */

/* The leaves of some cubes: which lane of which cube. */
struct listed {
	uint8_t lane[CUBES * PSR_BLOCK_SAMPLES + 64], cube[CUBES * PSR_BLOCK_SAMPLES + 64];
	uint32_t n;
};

/* Lists n cubes' leaves, and puts what the tree has of them behind those of before. */
static inline void list_lanes_of(struct listed *listed, struct leaves *l, const struct run *run, const uint8_t *number,
                                 uint32_t n)
{
	const struct octree *tree = run->level->tree;
	const int with_normals = l->is_mixed | l->with_offsets;

	listed->n = 0;
	for (uint32_t i = 0; i < n; i++) {
		const struct cube_at at = cube_at(run, number[i]);
		const uint64_t mask = warp_cube_mask(psr_cubes_children(tree, at.code), tree->code[at.code]);
		const uint32_t n_leaves = (uint32_t)__builtin_popcountll(mask), to = l->n + listed->n;

		list_lanes(listed->lane + listed->n, mask);
		_mm512_storeu_si512(listed->cube + listed->n, _mm512_set1_epi8((char)i));
		for (uint32_t k = 0; with_normals && k < n_leaves; k += LANES)
			list_looks(l, to + k, tree, at.leaf + k, n_leaves - k);
		listed->n += n_leaves;
	}
}

/* Places of sixteen leaves of eight cubes on an axis; `cube` and `octant` are of the first and of the other eight. */
static inline __m512 places_on(const double middle[8], const double row[8], __m512 columns, const __m512i cube[2],
                               const __m512i octant[2], __m512i leaf)
{
	const __m512d of_cube = _mm512_loadu_pd(middle), of_octant = _mm512_loadu_pd(row);
	__m256 part[2];

	for (int h = 0; h < 2; h++)
		part[h] = _mm512_cvtpd_ps(_mm512_add_pd(_mm512_permutexvar_pd(cube[h], of_cube),
		                                        _mm512_permutexvar_pd(octant[h], of_octant)));
	return _mm512_add_ps(_mm512_insertf32x8(_mm512_castps256_ps512(part[0]), part[1], 1),
	                     _mm512_permutexvar_ps(leaf, columns));
}

static inline void list_sparse(struct leaves *l, const struct run *run, const struct placed_cubes *placed,
                               uint32_t first, uint32_t n)
{
	const __m512i number = _mm512_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)(placed->number + first)));
	const __m512i lanes = _mm512_mullo_epi32(number, _mm512_set1_epi32(PSR_BLOCK_SAMPLES));
	const __m512i ids = _mm512_add_epi32(lanes, _mm512_set1_epi32((int)run->id));
	struct listed listed;

	list_lanes_of(&listed, l, run, placed->number + first, n);
	for (uint32_t k = 0; k < listed.n; k += LANES) {
		const __m512i leaf = _mm512_cvtepu8_epi32(_mm_loadu_si128((const __m128i *)(listed.lane + k)));
		const __m512i which = _mm512_cvtepu8_epi32(_mm_loadu_si128((const __m128i *)(listed.cube + k)));
		const __m512i octants = _mm512_srli_epi32(leaf, 3);
		const __m512i cube[2] = { _mm512_cvtepu32_epi64(_mm512_castsi512_si256(which)),
			                      _mm512_cvtepu32_epi64(_mm512_extracti64x4_epi64(which, 1)) };
		const __m512i octant[2] = { _mm512_cvtepu32_epi64(_mm512_castsi512_si256(octants)),
			                        _mm512_cvtepu32_epi64(_mm512_extracti64x4_epi64(octants, 1)) };

		for (int a = 0; a < 3; a++)
			_mm512_storeu_ps(l->at[a] + l->n + k, places_on(placed->middle[a] + first, l->octants->row[a],
			                                                cols_of(l->octants, a), cube, octant, leaf));
		_mm512_storeu_si512(l->id + l->n + k, _mm512_add_epi32(_mm512_permutexvar_epi32(which, ids), leaf));
	}
	l->n += listed.n;
}

static inline void list(struct leaves *l, const struct run *run, const struct placed_cubes *placed, uint32_t first,
                        uint32_t n)
{
	if (run->level->tree->n_leaves < MOST_SPARSE * (uint64_t)run->level->n)
		list_sparse(l, run, placed, first, n);
	else
		for (uint32_t i = first; i < first + n; i++)
			list_cube(l, run, placed, i);
}

static const struct leaf_vectors vectors = { LANES, place, list, draw };

uint64_t warp_leaves_avx512(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return leaves_in(vectors, target, entry, n);
}

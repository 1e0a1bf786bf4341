/* The warp of leaves: two terms a place, as [B] (1), and where a leaf is wider than a pixel its offset. */
#include "simd/leaves_batch.h"
#include "leaf_parts.h"

#define LANES 8

/* ---- leaves to words ---- */

/* Normals in memory are looked up one by one, which is faster than to gather them. */
static inline __m256i tens_at(const struct warp_target *t, const uint16_t n[8])
{
	const int *d = (const int *)t->direction;

	return _mm256_setr_epi32(d[n[0]], d[n[1]], d[n[2]], d[n[3]], d[n[4]], d[n[5]], d[n[6]], d[n[7]]);
}

static inline __attribute__((always_inline)) void draw(struct leaves_lists *to, const struct leaves *l,
                                                       const struct warp_target *t, uint32_t i, uint32_t n)
{
	const __m256i lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
	__m256 x1 = _mm256_load_ps(l->at[0] + i), y1 = _mm256_load_ps(l->at[1] + i), z1 = _mm256_load_ps(l->at[2] + i);
	__m256 normal[3];

	if (l->with_offsets | l->is_mixed)
		components_of(normal, tens_at(t, l->normal + i));
	if (l->with_offsets) {
		const __m256 offset = offsets_of(_mm_loadl_epi64((const __m128i *)(l->offset + i)));

		x1 = _mm256_add_ps(x1, offset_axis(l->octants, 0, normal, offset));
		y1 = _mm256_add_ps(y1, offset_axis(l->octants, 1, normal, offset));
		z1 = _mm256_add_ps(z1, offset_axis(l->octants, 2, normal, offset));
	}
	const __m256 one = _mm256_set1_ps(1), inverse = t->perspective ? _mm256_div_ps(one, z1) : one;
	const __m256 u = _mm256_mul_ps(x1, inverse), v = _mm256_mul_ps(y1, inverse);
	const __m256i pixel_u = floor_int(u), pixel_v = floor_int(v);
	__m256i k = _mm256_castps_si256(_mm256_cmp_ps(z1, _mm256_set1_ps(t->near_z), _CMP_GT_OQ));

	if (n < LANES)
		k = _mm256_and_si256(k, _mm256_cmpgt_epi32(_mm256_set1_epi32((int)n), lanes));
	if (l->is_mixed)
		k = _mm256_andnot_si256(faces_away(l->in, normal, u, v), k);
	if (l->level)
		list_cells(&to->cells, t, k, pixel_u, pixel_v, z1);
	k = _mm256_and_si256(k, _mm256_and_si256(within(pixel_u, t->x0, t->x1), within(pixel_v, t->y0, t->y1)));
	const __m256i x = _mm256_sub_epi32(pixel_u, _mm256_set1_epi32(t->x0));
	const __m256i y = _mm256_sub_epi32(pixel_v, _mm256_set1_epi32(t->y0));
	const struct warped samples = {
		_mm256_add_epi32(_mm256_mullo_epi32(y, _mm256_set1_epi32((int)t->stride)), x),
		_mm256_load_si256((const __m256i *)(l->id + i)), _mm256_castps_si256(z1), _mm256_setzero_si256(),
	};
	list_words(&to->words, NULL, k, &samples);
}

/* ---- cubes to leaves ---- */

/* Doubles of integers below 2^52. */
static inline __m256d doubles_of(__m256i a)
{
	const __m256i exponent = _mm256_set1_epi64x(0x4330000000000000);

	return _mm256_sub_pd(_mm256_castsi256_pd(_mm256_or_si256(a, exponent)), _mm256_castsi256_pd(exponent));
}

static inline __m256i places_of(const struct psr_cube *cube, const uint8_t number[4])
{
	uint64_t place[4];

	for (int i = 0; i < 4; i++)
		memcpy(&place[i], cube[number[i]].place, sizeof place[i]);
	return _mm256_loadu_si256((const __m256i *)place);
}

static inline void place(struct placed_cubes *placed, const struct warp_cubes *to, const struct run *run, uint64_t cubes)
{
	const __m256i most = _mm256_set1_epi64x((1 << CUBES_PLACE_BITS) - 1), two = _mm256_set1_epi64x(2);
	const __m256d edge = _mm256_set1_pd(run->level->edge);
	const uint32_t n = (uint32_t)__builtin_popcountll(cubes);

	list_samples(placed->number, cubes);
	memset(placed->number + n, placed->number[0], 3); /* there are cubes to the end of four */
	for (uint32_t i = 0; i < n; i += 4) {
		const __m256i own = places_of(run->cube, placed->number + i);
		__m256d c[3];

		for (int a = 0; a < 3; a++) {
			const __m256i at = _mm256_and_si256(_mm256_srli_epi64(own, CUBES_PLACE_BITS * a), most);
			const __m256d steps = doubles_of(_mm256_add_epi64(_mm256_slli_epi64(at, 2), two));

			c[a] = _mm256_add_pd(_mm256_set1_pd(run->level->tree->low[a]), _mm256_mul_pd(steps, edge));
		}
		for (int a = 0; a < 3; a++) {
			const double *axis = to->axis[a];
			const __m256d x = _mm256_mul_pd(_mm256_set1_pd(axis[0]), c[0]);
			const __m256d y = _mm256_mul_pd(_mm256_set1_pd(axis[1]), c[1]);
			const __m256d z = _mm256_mul_pd(_mm256_set1_pd(axis[2]), c[2]);
			const __m256d sum = _mm256_add_pd(_mm256_add_pd(x, y), z);

			_mm256_store_pd(placed->middle[a] + i, _mm256_add_pd(_mm256_set1_pd(to->origin[a]), sum));
		}
	}
}

/* Octants of cubes that have leaves: which of the cubes' there are, eight a cube, and their codes. Of a cube's lists of
 * eight, what is behind its last octant gives way to the next cube's. */
struct octants {
	uint8_t at[CUBES * 8 + 8], code[CUBES * 8 + 8];
	uint32_t n;
};

/* What octants take from their cubes: the terms of their places and their first ids, and how far the cube's leaves in
 * the tree are ahead of those in the list. */
struct listed_cubes {
	_Alignas(32) float row[3][CUBES * 8];
	_Alignas(32) uint32_t id[CUBES * 8];
	int64_t ahead[CUBES];
};

static inline void list_octants(struct octants *o, struct listed_cubes *to, const struct leaves *l, const struct run *run,
                                const struct placed_cubes *placed, uint32_t first, uint32_t n)
{
	const struct octree *tree = run->level->tree;
	const __m256i ids = _mm256_setr_epi32(0, 8, 16, 24, 32, 40, 48, 56);
	uint32_t n_leaves = l->n;

	o->n = 0;
	for (uint32_t i = 0; i < n; i++) {
		const struct cube_at at = cube_at(run, placed->number[first + i]);
		const uint8_t code = tree->code[at.code];
		const uint64_t octants = front_lanes(code) + 8 * i * UINT64_C(0x0101010101010101);
		const uint64_t children = psr_cubes_children(tree, at.code);
		const uint32_t n_octants = (uint32_t)__builtin_popcount(code);

		memcpy(o->at + o->n, &octants, sizeof octants);
		memcpy(o->code + o->n, &children, sizeof children);
		o->n += n_octants;
		for (int a = 0; a < 3; a++)
			_mm256_store_ps(to->row[a] + 8 * i, rows_at(placed->middle[a][first + i], l->octants->row[a]));
		store(to->id + 8 * i, _mm256_add_epi32(_mm256_set1_epi32((int)at.id), ids));
		to->ahead[i] = (int64_t)at.leaf - n_leaves;
		n_leaves += (uint32_t)__builtin_popcountll(_bzhi_u64(children, 8 * n_octants));
	}
}

/* By octants, of which each knows its place but for its leaves'. */
static inline __attribute__((always_inline)) void list_by(struct leaves *l, const struct octants *octants,
                                                          const struct listed_cubes *cubes, const struct octree *tree,
                                                          int with_normals, int with_offsets)
{
	uint32_t to = l->n;
	__m256 col[3];

	for (int a = 0; a < 3; a++)
		col[a] = cols_of(l->octants, a);
	for (uint32_t i = 0; i < octants->n; i++) {
		const uint32_t at = octants->at[i], code = octants->code[i];
		const __m256i front = front_of(code);

		for (int a = 0; a < 3; a++) {
			const __m256 leaves = _mm256_add_ps(_mm256_set1_ps(cubes->row[a][at]), col[a]);

			_mm256_storeu_ps(l->at[a] + to, _mm256_permutevar8x32_ps(leaves, front));
		}
		store(l->id + to, _mm256_add_epi32(_mm256_set1_epi32((int)cubes->id[at]), front));
		if (with_normals) {
			const uint64_t leaf = (uint64_t)(cubes->ahead[at / 8] + to), n_ahead = tree->n_leaves - leaf;

			_mm_storeu_si128((__m128i *)(l->normal + to), normals_of(tree->normal + leaf, n_ahead));
			if (with_offsets)
				_mm_storel_epi64((__m128i *)(l->offset + to), steps_of(tree->offset + leaf, n_ahead));
		}
		to += (uint32_t)__builtin_popcount(code);
	}
	l->n = to;
}

static inline void list(struct leaves *l, const struct run *run, const struct placed_cubes *placed, uint32_t first,
                        uint32_t n)
{
	const struct octree *tree = run->level->tree;
	struct listed_cubes cubes;
	struct octants octants;

	list_octants(&octants, &cubes, l, run, placed, first, n);
	if (l->with_offsets)
		list_by(l, &octants, &cubes, tree, 1, 1);
	else if (l->is_mixed)
		list_by(l, &octants, &cubes, tree, 1, 0);
	else
		list_by(l, &octants, &cubes, tree, 0, 0);
}

static const struct leaf_vectors vectors = { LANES, place, list, draw };

uint64_t warp_leaves_avx2(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	return leaves_in(vectors, target, entry, n);
}

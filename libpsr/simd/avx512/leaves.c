/* The warp of leaves: two terms a place, as [B] (1), and where a leaf is wider than a pixel its offset. Cubes are placed
 * one by one, in vectors that their leaves do not fill; the steps after that have full ones, of leaves of several. */
#include "simd/leaves_list.h"
#include "leaf_parts.h"

#define BATCH 192 /* leaves: those of some twelve cubes, and what is known of them stays in L1 */
#define ROOM (BATCH + PSR_BLOCK_SAMPLES + 16)

/* Leaves of which all but their offsets is known of their places. */
struct leaves {
	_Alignas(64) float at[3][ROOM];
	_Alignas(64) uint32_t id[ROOM];
	_Alignas(64) uint16_t normal[ROOM];
	_Alignas(64) uint8_t offset[ROOM];
	uint32_t n;
	/* Of all of them. */
	const struct warp_instance *in;
	const struct warp_octants *octants;
	int level, is_mixed, with_offsets;
};

/* ---- leaves to words ---- */

static inline void draw_vector(struct leaves_lists *to, const struct leaves *l, const struct warp_target *t, uint32_t i,
                               __mmask16 valid)
{
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

/* Draws the first n leaves. */
static inline void draw_leaves(struct leaves_lists *to, const struct leaves *l, const struct warp_target *t, uint32_t n)
{
	for (uint32_t first = 0; first < n; first += PSR_BLOCK_SAMPLES) {
		const uint32_t end = n - first < PSR_BLOCK_SAMPLES ? n : first + PSR_BLOCK_SAMPLES;

		make_room(to, t, (uint32_t)l->level);
		for (uint32_t i = first; i < end; i += 16)
			draw_vector(to, l, t, i, (__mmask16)_bzhi_u32(0xffff, end - i));
	}
}

/* Draws whole vectors of leaves, and keeps the rest. */
static inline void draw_most(struct leaves_lists *to, struct leaves *l, const struct warp_target *t)
{
	const uint32_t whole = l->n & ~15u;

	draw_leaves(to, l, t, whole);
	for (int a = 0; a < 3; a++)
		_mm512_store_ps(l->at[a], _mm512_load_ps(l->at[a] + whole));
	_mm512_store_si512(l->id, _mm512_load_si512(l->id + whole));
	_mm256_store_si256((__m256i *)l->normal, _mm256_load_si256((const __m256i *)(l->normal + whole)));
	_mm_store_si128((__m128i *)l->offset, _mm_load_si128((const __m128i *)(l->offset + whole)));
	l->n -= whole;
}

/* ---- cubes to leaves ---- */

/* Cubes of a run, as leaves' places begin. */
struct run {
	const struct psr_cube_level *level;
	const struct psr_cube *cube; /* that of bit 0 */
	struct psr_cube_run from;
	uint32_t id;                 /* of its first leaf */
	__m512 col[3];
};

/* Computes the middles of n cubes, eight at a time. */
static inline void place_middles(double middle[3][CUBES_RUN], const struct warp_cubes *to, const struct run *run,
                                 const uint8_t number[CUBES_RUN], uint32_t n)
{
	const __m256i words = _mm256_set1_epi32(sizeof *run->cube / 4);
	const __m512i most = _mm512_set1_epi64((1 << CUBES_PLACE_BITS) - 1), two = _mm512_set1_epi64(2);
	const __m512d edge = _mm512_set1_pd(run->level->edge);

	for (uint32_t i = 0; i < n; i += 8) {
		const __m256i at = _mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i *)(number + i)));
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

			_mm512_store_pd(middle[a] + i, _mm512_add_pd(_mm512_set1_pd(to->origin[a]), sum));
		}
	}
}

static inline __m512 rows_at(double middle, const double row[8])
{
	return _mm512_castps256_ps512(_mm512_cvtpd_ps(_mm512_add_pd(_mm512_set1_pd(middle), _mm512_loadu_pd(row))));
}

/* Lists the leaves of cube `number` of a run. */
static inline void list_cube(struct leaves *l, const struct run *run, uint32_t number, const __m512 row[3])
{
	const struct octree *tree = run->level->tree;
	const uint32_t code = run->from.code + run->cube[number].code, leaf = run->from.leaf + run->cube[number].leaf;
	const uint64_t mask = warp_cube_mask(psr_cubes_children(tree, code), tree->code[code]);
	const uint32_t n = (uint32_t)__builtin_popcountll(mask), begin = l->n;
	const __m512i id = _mm512_set1_epi32((int)(run->id + number * PSR_BLOCK_SAMPLES));
	const int with_normals = l->is_mixed | l->with_offsets;
	_Alignas(64) uint8_t lane[64];

	list_lanes(lane, mask);
	for (uint32_t k = 0; k < n; k += 16) {
		const __m512i s = _mm512_cvtepu8_epi32(_mm_load_si128((const __m128i *)(lane + k)));
		const __m512i octant = _mm512_srli_epi32(s, 3);
		const uint32_t to = begin + k;

		for (int a = 0; a < 3; a++) /* of s the lower three bits count, since the upper half of col is the lower */
			_mm512_storeu_ps(l->at[a] + to, _mm512_add_ps(_mm512_permutexvar_ps(octant, row[a]),
			                                              _mm512_permutexvar_ps(s, run->col[a])));
		_mm512_storeu_si512(l->id + to, _mm512_add_epi32(id, s));
		if (!with_normals)
			continue;
		const __mmask16 valid = (__mmask16)_bzhi_u32(0xffff, n - k);
		_mm256_storeu_si256((__m256i *)(l->normal + to), _mm256_maskz_loadu_epi16(valid, tree->normal + leaf + k));
		if (l->with_offsets)
			_mm_storeu_si128((__m128i *)(l->offset + to), _mm_maskz_loadu_epi8(valid, tree->offset + leaf + k));
	}
	l->n = begin + n;
}

static inline void list_run(struct leaves_lists *to, struct leaves *l, const struct warp_target *t,
                            const struct bin_entry *entry, uint64_t cubes)
{
	const struct warp_instance *in = &t->instance[entry->instance];
	const struct psr_cubes *model = in->cubes->model;
	const uint32_t first = entry->slot - in->first_slot;
	struct run run = { .level = psr_cubes_level(model, first), .cube = &model->cube[first],
		               .id = entry->slot * PSR_BLOCK_SAMPLES };
	const struct warp_octants *octants = &in->cubes->level[run.level - model->level];
	const struct octree *tree = run.level->tree;
	const int with_offsets = entry->is_wide && tree->offset != NULL && tree->normal != NULL;
	const uint32_t n = (uint32_t)__builtin_popcountll(cubes);
	_Alignas(64) uint8_t number[CUBES_RUN];
	_Alignas(64) double middle[3][CUBES_RUN];

	if (octants != l->octants || entry->level != l->level || entry->is_mixed != l->is_mixed
	    || with_offsets != l->with_offsets) {
		draw_leaves(to, l, t, l->n);
		l->n = 0;
		l->in = in;
		l->octants = octants;
		l->level = entry->level;
		l->is_mixed = entry->is_mixed;
		l->with_offsets = with_offsets;
	}
	run.from = run.level->run[(first - run.level->first) / CUBES_RUN];
	for (int a = 0; a < 3; a++)
		run.col[a] = _mm512_broadcast_f32x8(_mm256_loadu_ps(octants->col[a]));
	list_lanes(number, cubes);
	place_middles(middle, in->cubes, &run, number, n);
	for (uint32_t i = 0; i < n; i++) {
		const __m512 row[3] = { rows_at(middle[0][i], octants->row[0]), rows_at(middle[1][i], octants->row[1]),
			                    rows_at(middle[2][i], octants->row[2]) };

		list_cube(l, &run, number[i], row);
		if (l->n > BATCH)
			draw_most(to, l, t);
	}
}

uint64_t warp_leaves_avx512(const struct warp_target *target, const struct bin_entry *entry, uint32_t n)
{
	struct leaves_lists lists;
	struct leaves leaves;

	leaves_begin(&lists);
	leaves.n = 0;
	leaves.octants = NULL;
	leaves.level = 0;
	for (uint32_t e = 0; e < n; e++) {
		fetch_next(target, entry, e, n);
		list_run(&lists, &leaves, target, &entry[e], target->cubes != NULL ? target->cubes[entry[e].hit] : 1);
	}
	draw_leaves(&lists, &leaves, target, leaves.n);
	return leaves_end(&lists, target);
}

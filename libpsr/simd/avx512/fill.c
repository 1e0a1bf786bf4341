/* Pull and push of rows ([G] 4.7), 16 coarser cells and their 32 children at a time; masks cut off the last ones. */
#include <immintrin.h>
#include <math.h>
#include "simd/kernels.h"

#define PARENTS 16

/* Bits 2i and 2i + 1 from bits i of two masks. */
static inline __mmask32 interleave(__mmask16 left, __mmask16 right)
{
	return _pdep_u32(left, 0x55555555) | _pdep_u32(right, 0xaaaaaaaa);
}

/* value * share / 256 for a share of 0..256 of 16-bit values. */
struct share {
	__m512i factor;
	__mmask32 all;
};

static inline struct share share_of(__m512i share)
{
	return (struct share){ _mm512_slli_epi16(share, 8), _mm512_cmpeq_epi16_mask(share, _mm512_set1_epi16(GAPS_WHOLE)) };
}

static inline __m512i part_of(__m512i value, struct share share)
{
	return _mm512_mask_mov_epi16(_mm512_mulhi_epu16(value, share.factor), share.all, value);
}

static inline __m512i load_children(__mmask32 k, const uint16_t *from)
{
	return _mm512_maskz_loadu_epi16(k, from);
}

static inline __m512i load_parents(__mmask16 k, const uint16_t *from)
{
	return _mm512_cvtepu16_epi32(_mm256_maskz_loadu_epi16(k, from));
}

/* ---- pull ---- */

struct pull_shares {
	__mmask16 k;               /* the cells, */
	__mmask32 kk;              /* and their children of one row */
	struct share upper, lower; /* from the picture */
	__mmask32 above, below;    /* from a level: all or nothing */
	__m512 divisor, inverse;
};

/* As pull_channel of loops/fill_pull.h; the remainder of a division is whole and below 2^24, an exact float. */
static inline void pull_channel(uint16_t *to, const uint16_t *upper, const uint16_t *lower,
                                const struct pull_shares *s, int is_picture)
{
	const __m512i low = _mm512_set1_epi32(0xffff);
	const __m512i above =
		is_picture ? part_of(load_children(s->kk, upper), s->upper) : load_children(s->above & s->kk, upper);
	const __m512i below =
		is_picture ? part_of(load_children(s->kk, lower), s->lower) : load_children(s->below & s->kk, lower);
	const __m512i left = _mm512_add_epi32(_mm512_and_si512(above, low), _mm512_and_si512(below, low));
	const __m512i right = _mm512_add_epi32(_mm512_srli_epi32(above, 16), _mm512_srli_epi32(below, 16));
	const __m512 sum = _mm512_cvtepi32_ps(_mm512_add_epi32(left, right));
	const __m512i quotient = _mm512_cvttps_epi32(_mm512_mul_ps(sum, s->inverse));
	const __m512 rest =
		_mm512_fnmadd_ps(_mm512_cvtepi32_ps(quotient), s->divisor, _mm512_mul_ps(sum, _mm512_set1_ps(256)));
	const __mmask16 is_more = _mm512_cmp_ps_mask(rest, s->divisor, _CMP_GE_OQ);
	const __m512i value = _mm512_mask_add_epi32(quotient, is_more, quotient, _mm512_set1_epi32(1));

	_mm256_mask_storeu_epi16(to, s->k, _mm512_cvtepi32_epi16(value));
}

uint16_t fill_pull_weights_avx512(const struct fill_row *to, const struct fill_row *upper, const struct fill_row *lower,
                                  uint32_t n, float scale, float offset)
{
	const __m512i even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
	const __m512i odd = _mm512_add_epi32(even, _mm512_set1_epi32(1)), low = _mm512_set1_epi32(0xffff);
	const __m512i whole = _mm512_set1_epi32(GAPS_WHOLE);
	const __m512 nothing = _mm512_set1_ps(INFINITY);
	__m512i least = whole;

	for (uint32_t x = 0; x < n; x += PARENTS) {
		const __mmask16 k = (__mmask16)_bzhi_u32(0xffff, n - x < PARENTS ? n - x : PARENTS);
		const __mmask32 kk = interleave(k, k);
		__m512 z[4], nearest = nothing, sum_z = _mm512_setzero_ps();
		__m512i w[4], sum = _mm512_setzero_si512();
		__m128i bits = _mm_setzero_si128();
		__mmask16 near[4];

		for (int i = 0; i < 2; i++) {
			const struct fill_row *row = i ? lower : upper;
			const __m512 a = _mm512_maskz_loadu_ps((__mmask16)kk, row->z + 2 * x);
			const __m512 b = _mm512_maskz_loadu_ps((__mmask16)(kk >> 16), row->z + 2 * x + 16);
			const __m512i weight = load_children(kk, row->weight + 2 * x);

			z[2 * i] = _mm512_permutex2var_ps(a, even, b);
			z[2 * i + 1] = _mm512_permutex2var_ps(a, odd, b);
			w[2 * i] = _mm512_and_si512(weight, low);
			w[2 * i + 1] = _mm512_srli_epi32(weight, 16);
		}
		for (int i = 0; i < 4; i++) {
			near[i] = _mm512_test_epi32_mask(w[i], w[i]);
			nearest = _mm512_mask_min_ps(nearest, near[i], z[i], nearest);
		}
		const __m512 limit = _mm512_add_ps(_mm512_mul_ps(nearest, _mm512_set1_ps(scale)), _mm512_set1_ps(offset));
		for (int i = 0; i < 4; i++) {
			near[i] = _mm512_mask_cmp_ps_mask(near[i], z[i], limit, _CMP_LE_OQ);
			sum_z = _mm512_mask_add_ps(sum_z, near[i], sum_z, _mm512_mul_ps(_mm512_cvtepi32_ps(w[i]), z[i]));
			sum = _mm512_mask_add_epi32(sum, near[i], sum, w[i]);
			bits = _mm_or_si128(bits, _mm_maskz_set1_epi8(near[i], (char)(1 << i)));
		}
		least = _mm512_mask_min_epi32(least, k, least, sum);
		const __m512 depth =
			_mm512_mask_div_ps(nothing, _mm512_test_epi32_mask(sum, sum), sum_z, _mm512_cvtepi32_ps(sum));
		_mm512_mask_storeu_ps(to->z + x, k, depth);
		_mm256_mask_storeu_epi16(to->weight + x, k, _mm512_cvtepi32_epi16(_mm512_min_epi32(sum, whole)));
		_mm_mask_storeu_epi8(to->near + x, k, bits);
	}
	return (uint16_t)_mm512_reduce_min_epi32(least);
}

static inline __attribute__((always_inline)) void pull_row(const struct fill_row *to, const struct fill_row *upper,
                                                           const struct fill_row *lower, uint32_t n, int is_picture)
{
	for (uint32_t x = 0; x < n; x += PARENTS) {
		const __mmask16 k = (__mmask16)_bzhi_u32(0xffff, n - x < PARENTS ? n - x : PARENTS);
		const __m128i bits = _mm_maskz_loadu_epi8(k, to->near + x);
		struct pull_shares s = { .k = k, .kk = interleave(k, k) };

		s.above = interleave(_mm_test_epi8_mask(bits, _mm_set1_epi8(1)), _mm_test_epi8_mask(bits, _mm_set1_epi8(2)));
		s.below = interleave(_mm_test_epi8_mask(bits, _mm_set1_epi8(4)), _mm_test_epi8_mask(bits, _mm_set1_epi8(8)));
		const __m512i above = load_children(s.above, upper->weight + 2 * x);
		const __m512i below = load_children(s.below, lower->weight + 2 * x);
		const __m512i sum = _mm512_madd_epi16(_mm512_add_epi16(above, below), _mm512_set1_epi16(1));
		s.upper = share_of(above);
		s.lower = share_of(below);
		s.divisor = _mm512_cvtepi32_ps(_mm512_max_epi32(sum, _mm512_set1_epi32(GAPS_WHOLE)));
		s.inverse = _mm512_div_ps(_mm512_set1_ps(256 - 0x1p-12f), s.divisor);
		pull_channel(to->r + x, upper->r + 2 * x, lower->r + 2 * x, &s, is_picture);
		pull_channel(to->g + x, upper->g + 2 * x, lower->g + 2 * x, &s, is_picture);
		pull_channel(to->b + x, upper->b + 2 * x, lower->b + 2 * x, &s, is_picture);
	}
}

void fill_pull_colors_avx512(const struct fill_row *to, const struct fill_row *upper, const struct fill_row *lower,
                             uint32_t n, int is_picture)
{
	if (is_picture)
		pull_row(to, upper, lower, n, 1);
	else
		pull_row(to, upper, lower, n, 0);
}

/* ---- push ---- */

/* Which parents give to the children on one side: the children's own, its neighbour to that side, and its neighbour
 * above or below. */
struct push_shares {
	__mmask16 own, side, beside;
	__m512 inverse, z;
};

static inline struct push_shares share_parents(__m512 own, __m512 side, __m512 beside, __m512 scale, __m512 offset)
{
	const __m512 one = _mm512_set1_ps(1);
	const __m512 inverses = _mm512_setr_ps(0.25f, 1, 0.5f, 1.0f / 3, 0.25f, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
	struct push_shares s;
	const __m512 nearest = _mm512_min_ps(beside, _mm512_min_ps(side, _mm512_min_ps(own, _mm512_set1_ps(INFINITY))));
	const __m512 limit = _mm512_add_ps(_mm512_mul_ps(nearest, scale), offset);

	s.own = _mm512_cmp_ps_mask(own, limit, _CMP_LE_OQ);
	s.side = _mm512_cmp_ps_mask(side, limit, _CMP_LE_OQ);
	s.beside = _mm512_cmp_ps_mask(beside, limit, _CMP_LE_OQ);
	__m512 n = _mm512_maskz_mov_ps(s.own, _mm512_set1_ps(2)), z = _mm512_maskz_add_ps(s.own, own, own);
	n = _mm512_mask_add_ps(n, s.side, n, one);
	z = _mm512_mask_add_ps(z, s.side, z, side);
	n = _mm512_mask_add_ps(n, s.beside, n, one);
	z = _mm512_mask_add_ps(z, s.beside, z, beside);
	s.inverse = _mm512_permutexvar_ps(_mm512_cvttps_epi32(n), inverses);
	s.z = _mm512_div_ps(z, n);
	return s;
}

static inline __m512i interpolate(const struct push_shares *s, __m512i own, __m512i side, __m512i beside)
{
	__m512i sum = _mm512_maskz_slli_epi32(s->own, own, 1);

	sum = _mm512_mask_add_epi32(sum, s->side, sum, side);
	sum = _mm512_mask_add_epi32(sum, s->beside, sum, beside);
	const __m512 value = _mm512_mul_ps(_mm512_cvtepi32_ps(sum), s->inverse);
	return _mm512_cvttps_epi32(_mm512_add_ps(value, _mm512_set1_ps(0.125f)));
}

/* Up to 32 cells that are being pushed. */
struct push {
	__mmask16 k;
	__mmask32 kk, turn;
	__m512i weight;
	struct push_shares left, right;
	struct share rest;
};

/* Marks the cells that are not whole and whose parents are; needs k and kk. */
static inline void find_turn(struct push *p, const uint16_t *weight, const uint16_t *own, const uint16_t *beside)
{
	const __m256i whole = _mm256_set1_epi16(GAPS_WHOLE);

	p->weight = _mm512_maskz_loadu_epi16(p->kk, weight);
	p->turn = _mm512_mask_cmplt_epu16_mask(p->kk, p->weight, _mm512_set1_epi16(GAPS_WHOLE));
	if (!p->turn)
		return;
	const __mmask16 both =
		_mm256_mask_cmpeq_epi16_mask(_mm256_cmpeq_epi16_mask(_mm256_maskz_loadu_epi16(p->k, own), whole),
	                                 _mm256_maskz_loadu_epi16(p->k, beside), whole);
	const __mmask16 left = _mm256_mask_cmpeq_epi16_mask(both, _mm256_maskz_loadu_epi16(p->k, own - 1), whole);
	const __mmask16 right = _mm256_mask_cmpeq_epi16_mask(both, _mm256_maskz_loadu_epi16(p->k, own + 1), whole);
	p->turn &= interleave(left, right);
}

static inline void find_shares(struct push *p, const float *own, const float *beside, float scale, float offset)
{
	const __m512 by = _mm512_set1_ps(scale), plus = _mm512_set1_ps(offset);
	const __m512 a = _mm512_maskz_loadu_ps(p->k, own), c = _mm512_maskz_loadu_ps(p->k, beside);

	p->left = share_parents(a, _mm512_maskz_loadu_ps(p->k, own - 1), c, by, plus);
	p->right = share_parents(a, _mm512_maskz_loadu_ps(p->k, own + 1), c, by, plus);
	p->rest = share_of(_mm512_sub_epi16(_mm512_set1_epi16(GAPS_WHOLE), p->weight));
}

/* The part of a channel that parents give to the cells whose turn it is. */
static inline __m512i push_channel(const struct push *p, const uint16_t *own, const uint16_t *beside)
{
	const __m512i a = load_parents(p->k, own), c = load_parents(p->k, beside);
	const __m512i left = interpolate(&p->left, a, load_parents(p->k, own - 1), c);
	const __m512i right = interpolate(&p->right, a, load_parents(p->k, own + 1), c);

	return _mm512_maskz_mov_epi16(p->turn, part_of(_mm512_or_si512(left, _mm512_slli_epi32(right, 16)), p->rest));
}

static inline void push_cells(const struct push *p, uint16_t *cell, const uint16_t *own, const uint16_t *beside)
{
	const __m512i value = _mm512_add_epi16(load_children(p->turn, cell), push_channel(p, own, beside));

	_mm512_mask_storeu_epi16(cell, p->turn, value);
}

static inline void push_depths(const struct push *p, float *to, __mmask32 k)
{
	const __m512i first = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
	const __m512i second = _mm512_add_epi32(first, _mm512_set1_epi32(8));

	_mm512_mask_storeu_ps(to, (__mmask16)k, _mm512_permutex2var_ps(p->left.z, first, p->right.z));
	_mm512_mask_storeu_ps(to + 16, (__mmask16)(k >> 16), _mm512_permutex2var_ps(p->left.z, second, p->right.z));
}

static inline void set_masks(struct push *p, uint32_t n)
{
	p->k = (__mmask16)_bzhi_u32(0xffff, n < PARENTS ? n : PARENTS);
	p->kk = interleave(p->k, p->k);
}

void fill_push_avx512(const struct fill_row *to, const struct fill_parents *parents)
{
	const struct fill_row *own = &parents->own, *beside = &parents->beside;
	const uint32_t n = parents->n;

	for (uint32_t x = 0; x < n; x += PARENTS) {
		struct push p;

		set_masks(&p, n - x);
		find_turn(&p, to->weight + 2 * x, own->weight + x, beside->weight + x);
		if (!p.turn)
			continue;
		find_shares(&p, own->z + x, beside->z + x, parents->scale, parents->offset);
		push_cells(&p, to->r + 2 * x, own->r + x, beside->r + x);
		push_cells(&p, to->g + 2 * x, own->g + x, beside->g + x);
		push_cells(&p, to->b + 2 * x, own->b + x, beside->b + x);
		push_depths(&p, to->z + 2 * x,
		            _mm512_mask_cmplt_epu16_mask(p.turn, p.weight, _mm512_set1_epi16(GAPS_WHOLE / 2)));
		_mm512_mask_storeu_epi16(to->weight + 2 * x, p.turn, _mm512_set1_epi16(GAPS_WHOLE));
	}
}

/* At most PARENTS pixels of the list, since few pixels of a row are filled. `own` and `side` are lanes of the row
 * loaded from own - 1 on, `beside` of its own row. */
struct listed {
	__m512i own, side, beside;
	struct push_shares shares;
	__m256i share, rest; /* of 2^16 */
	__mmask16 is_empty;  /* rest would be 2^16 */
};

static inline __m256i half_of(__m512i values, uint32_t first)
{
	return first ? _mm512_extracti64x4_epi64(values, 1) : _mm512_castsi512_si256(values);
}

/* Parents of the pixels from cell x on. own_k, k: their lanes in `own` - 1 and `beside` that exist. */
static inline struct listed find_listed(__m256i at, __m256i weight, const struct fill_parents *parents, uint32_t x,
                                        __mmask32 own_k, __mmask16 k)
{
	const float *own = parents->own.z + x, *beside = parents->beside.z + x;
	const __m512i one = _mm512_set1_epi32(1), column = _mm512_cvtepu16_epi32(at);
	const __m512i is_right = _mm512_and_si512(column, one);
	const __m512 first = _mm512_maskz_loadu_ps((__mmask16)own_k, own - 1);
	const __m512 last = _mm512_maskz_loadu_ps((__mmask16)(own_k >> 16), own + 15);
	struct listed l;

	l.beside = _mm512_srli_epi32(column, 1);
	l.own = _mm512_add_epi32(l.beside, one);
	l.side = _mm512_add_epi32(l.beside, _mm512_add_epi32(is_right, is_right));
	l.shares = share_parents(_mm512_permutex2var_ps(first, l.own, last), _mm512_permutex2var_ps(first, l.side, last),
	                         _mm512_permutexvar_ps(l.beside, _mm512_maskz_loadu_ps(k, beside)),
	                         _mm512_set1_ps(parents->scale), _mm512_set1_ps(parents->offset));
	l.share = _mm256_slli_epi16(weight, 8);
	l.rest = _mm256_sub_epi16(_mm256_setzero_si256(), l.share);
	l.is_empty = _mm256_testn_epi16_mask(weight, weight);
	return l;
}

static inline __m512i pick(__m512i parents, __m512i lane)
{
	return _mm512_maskz_permutexvar_epi16(0x55555555, lane, parents);
}

static inline void push_listed(uint16_t *to, const struct listed *l, __m256i was, __m512i own, __m512i beside)
{
	const __m256i value = _mm512_cvtepi32_epi16(
		interpolate(&l->shares, pick(own, l->own), pick(own, l->side), pick(beside, l->beside)));
	const __m256i part = _mm256_mask_mov_epi16(_mm256_mulhi_epu16(value, l->rest), l->is_empty, value);

	_mm256_storeu_si256((__m256i *)to, _mm256_add_epi16(_mm256_mulhi_epu16(was, l->share), part));
}

uint32_t fill_push_picture_avx512(struct fill_places *places, uint32_t *left, uint32_t bit, const struct fill_row *was,
                                  const struct fill_parents *parents)
{
	_Alignas(64) static const uint16_t column[32] = { 0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13, 14, 15,
		                                              16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31 };
	const struct fill_row *own = &parents->own, *beside = &parents->beside;
	const uint32_t n = parents->n;
	uint32_t to = 0, n_filled = 0;
	for (uint32_t x = 0; x < n; x += PARENTS, left++) {
		struct push p;

		if (!(*left & bit))
			continue;
		set_masks(&p, n - x);
		find_turn(&p, was->weight + 2 * x, own->weight + x, beside->weight + x);
		const __mmask32 partial = _mm512_mask_cmplt_epu16_mask(p.kk, p.weight, _mm512_set1_epi16(GAPS_WHOLE));
		*left &= ~(partial == p.turn ? bit : 0);
		if (!p.turn)
			continue;
		const uint32_t n_turn = (uint32_t)__builtin_popcount(p.turn);
		const __mmask32 own_k = _bzhi_u32(UINT32_MAX, (n - x < PARENTS ? n - x : PARENTS) + 2);
		const __m512i at = _mm512_maskz_compress_epi16(p.turn, _mm512_load_si512(column));
		const __m512i weight = _mm512_maskz_compress_epi16(p.turn, p.weight);
		const __m512i r = _mm512_maskz_compress_epi16(p.turn, load_children(p.turn, was->r + 2 * x));
		const __m512i g = _mm512_maskz_compress_epi16(p.turn, load_children(p.turn, was->g + 2 * x));
		const __m512i b = _mm512_maskz_compress_epi16(p.turn, load_children(p.turn, was->b + 2 * x));
		_mm512_storeu_si512(places->at + to, _mm512_add_epi16(at, _mm512_set1_epi16((short)(2 * x))));
		_mm512_storeu_si512(places->weight + to, weight);
		_mm512_mask_storeu_epi16(was->weight + 2 * x, p.turn, _mm512_set1_epi16(GAPS_WHOLE));
		for (uint32_t i = 0; i < n_turn; i += PARENTS) {
			const struct listed l = find_listed(half_of(at, i), half_of(weight, i), parents, x, own_k, p.k);
			const __mmask16 listed = (__mmask16)_bzhi_u32(0xffff, n_turn - i < PARENTS ? n_turn - i : PARENTS);

			n_filled += (uint32_t)__builtin_popcount(
				_mm512_mask_cmp_ps_mask(l.is_empty & listed, l.shares.z, _mm512_set1_ps(INFINITY), _CMP_LT_OQ));
			_mm512_storeu_ps(places->z + to + i, l.shares.z);
			push_listed(places->r + to + i, &l, half_of(r, i), load_children(own_k, own->r + x - 1),
			            load_children(p.k, beside->r + x));
			push_listed(places->g + to + i, &l, half_of(g, i), load_children(own_k, own->g + x - 1),
			            load_children(p.k, beside->g + x));
			push_listed(places->b + to + i, &l, half_of(b, i), load_children(own_k, own->b + x - 1),
			            load_children(p.k, beside->b + x));
		}
		to += n_turn;
	}
	places->n_filled = n_filled;
	return to;
}

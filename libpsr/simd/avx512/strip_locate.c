#include <immintrin.h>
#include "simd/kernels.h"
#include "simd/strip_parts.h"

/* The double sums are those of warp_block_make, all axes at once. */
static inline __m256d axes(const double v[3])
{
	return _mm256_maskz_loadu_pd(7, v);
}

/* Samples first .. end - 1, of one block. */
static inline void locate_in_block(struct strip *strip, const float *depth, const struct warp_instance *in, uint32_t first,
                                   uint32_t end)
{
	const struct strip_pixels *p = strip->pixels;
	const struct psr_blocks *b = in->blocks;
	const uint32_t block = p->id[first] / PSR_BLOCK_SAMPLES - in->first_slot;
	const struct warp_lattice *lattice = &in->lattice[b->block_projection[block]];
	const double scale = (double)(1u << psr_blocks_level(b, block));
	const __m256d x = _mm256_set1_pd(8 * scale * b->col[block]), y = _mm256_set1_pd(8 * scale * b->row[block]);
	float *const to[3] = { strip->px, strip->py, strip->pz };
	double origin[4];
	float bias, step, unit[4];
	psr_blocks_depth(b, block, &bias, &step);
	const __m256d along = axes(lattice->along);
	__m256d sum = _mm256_add_pd(axes(lattice->origin), _mm256_mul_pd(x, axes(lattice->step)));
	sum = _mm256_add_pd(sum, _mm256_mul_pd(y, axes(lattice->down)));
	sum = _mm256_add_pd(sum, _mm256_mul_pd(_mm256_set1_pd((double)bias), along));
	_mm256_storeu_pd(origin, sum);
	_mm_storeu_ps(unit, _mm_mul_ps(_mm256_cvtpd_ps(along), _mm_set1_ps(step)));

	const __m512d scales = _mm512_set1_pd(scale);
	const __m256 float_scales = _mm256_set1_ps((float)scale);
	const __m256i seven = _mm256_set1_epi32(7);
	for (uint32_t i = first; i < end; i += 8) {
		const __mmask8 k = (__mmask8)((1u << (end - i < 8 ? end - i : 8)) - 1);
		const __m256i id = _mm256_loadu_si256((const __m256i *)(p->id + i));
		const __m256i col = _mm256_and_si256(id, seven);
		const __m512i row = _mm512_cvtepu32_epi64(_mm256_and_si256(_mm256_srli_epi32(id, 3), seven));
		const __m256 deep = _mm256_loadu_ps(depth + i);
		for (int a = 0; a < 3; a++) {
			const __m512d down = _mm512_mul_pd(scales, _mm512_permutexvar_pd(row, _mm512_loadu_pd(lattice->row[a])));
			const __m256 at = _mm512_cvtpd_ps(_mm512_add_pd(_mm512_set1_pd(origin[a]), down));
			const __m256 across = _mm256_mul_ps(float_scales, _mm256_permutevar8x32_ps(_mm256_loadu_ps(lattice->col[a]), col));
			const __m256 rise = _mm256_mul_ps(deep, _mm256_set1_ps(unit[a]));
			_mm256_mask_storeu_ps(to[a] + i, k, _mm256_add_ps(_mm256_add_ps(at, across), rise));
		}
	}
}

/* Lists the samples of `i` .. end - 1 whose block is another than that of the one before, the first too, and `end`. Returns how
 * many blocks follow each other. Runs are short, and a loop over each to find its end would be mispredicted every time. */
static uint32_t list_runs(uint32_t *first, const uint32_t *id, uint32_t i, uint32_t end)
{
	const __m512i block = _mm512_set1_epi32(~(PSR_BLOCK_SAMPLES - 1));
	__m512i at = _mm512_add_epi32(_mm512_setr_epi32(1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16), _mm512_set1_epi32((int)i));
	uint32_t n = 1;
	first[0] = i;
	for (; i + 1 < end; i += 16) {
		const uint32_t left = end - i - 1;
		const __mmask16 k = (__mmask16)((1u << (left < 16 ? left : 16)) - 1);
		const __m512i other = _mm512_xor_si512(_mm512_maskz_loadu_epi32(k, id + i), _mm512_maskz_loadu_epi32(k, id + i + 1));
		const __mmask16 is_first = _mm512_test_epi32_mask(other, block);
		_mm512_storeu_si512(first + n, _mm512_maskz_compress_epi32(is_first, at));
		n += (uint32_t)__builtin_popcount(is_first);
		at = _mm512_add_epi32(at, _mm512_set1_epi32(16));
	}
	first[n] = end;
	return n;
}

void strip_locate_avx512(struct strip *strip, const struct strip_view *view)
{
	const struct strip_pixels *p = strip->pixels;
	for (uint32_t i = 0, end; i < strip->n; i = end) {
		const struct warp_instance *in = instance_run(&end, p, view, i, strip->n);
		const uint16_t *steps = in->blocks->depth;
		const uint64_t *attr = in->blocks->attr;
		uint32_t first[STRIP + 16];
		float depth[STRIP + 8];
		const uint32_t n_runs = list_runs(first, p->id, i, end);
		for (uint32_t j = i; j < end; j++)
			depth[j] = (float)steps[p->at[j] - attr];
		for (uint32_t r = 0; r < n_runs; r++)
			locate_in_block(strip, depth, in, first[r], first[r + 1]);
	}
	bring_back(strip, view);
}

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "psr/error.h"
#include "sample/levels/draft.h"
#include "meshes.h"

#define SPACING 0.0078125f /* so that depths in steps are exact */
#define MOST_BLOCKS 4096
#define MOST_SAMPLES (64 * MOST_BLOCKS)

static const struct psr_projection projection[2] = { { { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }, SPACING },
	                                                 { { { -1, 0, 0 }, { 0, 1, 0 }, { 0, 0, -1 } }, SPACING } };

static void make_draft(struct draft *draft)
{
	*draft = (struct draft){ .n_levels = 2, .projection = projection, .ds = (double)SPACING,
		                     .block_capacity = MOST_BLOCKS, .sample_capacity = MOST_SAMPLES, .n_groups = 2 };
	draft->block = calloc(MOST_BLOCKS, sizeof *draft->block);
	draft->sample = calloc(MOST_SAMPLES, sizeof *draft->sample);
}

/* A block with all of `mask`, of which its group needs `part`, at a depth in steps. Samples are told apart by `surface`. */
static struct draft_block *add_block(struct draft *draft, uint64_t mask, uint64_t part, float steps)
{
	struct draft_block *block = &draft->block[draft->n_blocks++];

	*block = (struct draft_block){ .mask = mask, .part = part, .first = draft->n_samples };
	for (uint64_t left = mask; left != 0; left &= left - 1, draft->n_samples++)
		draft->sample[draft->n_samples] = (struct draft_sample){ steps * SPACING, draft->n_samples,
			                                                     draft->n_samples + 7u, PSR_OPAQUE };
	return block;
}

/* Of a block, the bit of the sample at a lattice point. */
static unsigned bit_of(const struct draft_block *block, int row, int col)
{
	assert_in_range(row - block->row, 0, 7);
	assert_in_range(col - block->col, 0, 7);
	return (unsigned)(8 * (row - block->row) + col - block->col);
}

static void blocks_of_one_place_become_one_and_keep_their_samples(void **state)
{
	struct draft draft;

	(void)state;
	make_draft(&draft);
	add_block(&draft, 0xff, 0x0f, 0);   /* samples 0 to 7 */
	add_block(&draft, 0xf0, 0xf0, 24);  /* 8 to 11: just as deep as it may be */
	assert_int_equal(draft_join(&draft), PSR_OK);
	assert_int_equal(draft.n_blocks, 1);
	assert_int_equal(draft.n_samples, 8);
	assert_true(draft.block[0].mask == draft.block[0].part);
	for (unsigned s = 0; s < 8; s++) {
		const struct draft_sample *sample = draft_sample(&draft, &draft.block[0], bit_of(&draft.block[0], 0, (int)s));

		assert_int_equal(sample->surface, s < 4 ? s : s + 4);
		assert_int_equal(sample->attr, sample->surface + 7);
		assert_true(sample->z == (s < 4 ? 0 : 24 * SPACING));
	}
	draft_fini(&draft);
}

/* Corners of two blocks of the grid, one row and two columns each, that meet. */
static void what_fits_one_window_becomes_one_block(void **state)
{
	struct draft draft;

	(void)state;
	for (int apart = 0; apart < 2; apart++) {
		make_draft(&draft);
		add_block(&draft, UINT64_C(0xc0) << 56, UINT64_C(0xc0) << 56, 0);
		add_block(&draft, 0x03, 0x03, 1)->col = (int16_t)(8 + 5 * apart);
		draft.block[1].row = 8;
		assert_int_equal(draft_join(&draft), PSR_OK);
		assert_int_equal(draft.n_blocks, 1 + apart);
		for (int i = 0; i < 4; i++) {
			const struct draft_block *block = &draft.block[apart ? i / 2 : 0];
			unsigned s = bit_of(block, 7 + i / 2, 6 + i + (i < 2 ? 0 : 5 * apart));

			assert_true(block->mask >> s & 1);
			assert_int_equal(draft_sample(&draft, block, s)->surface, i);
		}
		draft_fini(&draft);
	}
}

static void blocks_that_differ_in_anything_stay_apart(void **state)
{
	struct draft draft;

	(void)state;
	make_draft(&draft);
	add_block(&draft, 1, 1, 0);
	add_block(&draft, 2, 2, 24.5f); /* too deep */
	add_block(&draft, 1, 1, 1);     /* the same lattice point */
	add_block(&draft, 4, 4, 0)->level = 1;
	add_block(&draft, 8, 8, 0)->group = 1;
	add_block(&draft, 16, 16, 0)->projection = 1;
	add_block(&draft, 32, 32, 0)->col = 20;
	add_block(&draft, 64, 64, 0)->row = -20;
	add_block(&draft, 128, 128, 0)->two_sided = 1;
	assert_int_equal(draft_join(&draft), PSR_OK);
	/* The second is within 24 steps of the third, and goes with it. */
	assert_int_equal(draft.n_blocks, 8);
	assert_int_equal(draft.n_samples, 9);
	draft_fini(&draft);
}

/* A level's steps are its own: twice as long, and 24 of them reach twice as far. */
static void coarse_blocks_may_be_as_many_of_their_steps_deep(void **state)
{
	struct draft draft;

	(void)state;
	for (int is_deeper = 0; is_deeper < 2; is_deeper++) {
		make_draft(&draft);
		add_block(&draft, 1, 1, 0)->level = 1;
		add_block(&draft, 2, 2, 48 + (float)is_deeper)->level = 1;
		assert_int_equal(draft_join(&draft), PSR_OK);
		assert_int_equal(draft.n_blocks, 1 + is_deeper);
		draft_fini(&draft);
	}
}

static int compare_ids(const void *a, const void *b)
{
	uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;

	return x < y ? -1 : x > y;
}

static void no_sample_is_lost_or_doubled_whatever_is_joined(void **state)
{
	uint64_t seed = 17;
	uint32_t *id = calloc(MOST_SAMPLES, sizeof *id), *needed = calloc(MOST_SAMPLES, sizeof *needed), n = 0, n_needed = 0;
	struct lattice_point *place = calloc(MOST_SAMPLES, sizeof *place);
	struct draft draft;

	(void)state;
	make_draft(&draft);
	for (int i = 0; i < 3000; i++) {
		uint64_t mask = 0, part = 0;
		struct draft_block *block;

		for (int s = 0; s < 64; s++)
			mask |= (uint64_t)(meshes_random(&seed) < 0.2) << s;
		mask |= UINT64_C(1) << i % 64;
		for (int s = 0; s < 64; s++)
			part |= (uint64_t)(meshes_random(&seed) < 0.7) << s;
		part = (part & mask) != 0 ? part & mask : mask;
		block = add_block(&draft, mask, part, (float)(60 * meshes_random(&seed)));
		block->projection = i & 1;
		block->col = (int16_t)(20 * meshes_random(&seed) - 10);
		block->row = (int16_t)(2 * (int)(10 * meshes_random(&seed) - 5));
		for (uint64_t left = part; left != 0; left &= left - 1) {
			int s = __builtin_ctzll(left);
			uint32_t one = draft_sample(&draft, block, (unsigned)s)->surface;

			needed[n_needed++] = one;
			place[one] = (struct lattice_point){ block->row + s / 8, block->col + s % 8 };
		}
	}
	assert_int_equal(draft_join(&draft), PSR_OK);
	assert_in_range(draft.n_blocks, 100, 2000);
	assert_int_equal(draft.n_samples, n_needed);
	for (uint32_t b = 0; b < draft.n_blocks; b++) {
		float low = 1e30f, high = -1e30f;

		assert_true(draft.block[b].mask == draft.block[b].part);
		assert_int_equal(draft.block[b].row & 1, 0);
		for (uint64_t left = draft.block[b].mask; left != 0; left &= left - 1) {
			int s = __builtin_ctzll(left);
			const struct draft_sample *sample = draft_sample(&draft, &draft.block[b], (unsigned)s);

			assert_int_equal(draft.block[b].row + s / 8, place[sample->surface].row);
			assert_int_equal(draft.block[b].col + s % 8, place[sample->surface].col);
			id[n++] = sample->surface;
			low = sample->z < low ? sample->z : low;
			high = sample->z > high ? sample->z : high;
		}
		assert_true(high - low <= 24 * SPACING);
	}
	assert_int_equal(n, n_needed);
	qsort(id, n, sizeof *id, compare_ids);
	qsort(needed, n, sizeof *needed, compare_ids);
	assert_memory_equal(id, needed, n * sizeof *id);
	draft_fini(&draft);
	free(id);
	free(needed);
	free(place);
}

/* The reader takes the window whose middle is nearest to the sphere's center, that of the box of the samples. */
static void windows_lie_over_the_middles_of_their_samples(void **state)
{
	uint64_t seed = 23;
	struct draft draft;

	(void)state;
	make_draft(&draft);
	for (int i = 0; i < 3000; i++) {
		struct draft_block *block;
		int n_cols = 1 + (int)(8 * meshes_random(&seed)), n_rows = 1 + (int)(8 * meshes_random(&seed));
		uint64_t mask = 0;

		for (int s = 0; s < 64; s++)
			mask |= (uint64_t)(s % 8 < n_cols && s / 8 < n_rows && meshes_random(&seed) < 0.3) << s;
		block = add_block(&draft, mask | 1, mask | 1, 0);
		block->group = (uint32_t)i; /* joined with none */
		block->col = (int16_t)(80 * meshes_random(&seed) - 40);
	}
	assert_int_equal(draft_join(&draft), PSR_OK);
	assert_int_equal(draft.n_blocks, 3000);
	for (uint32_t b = 0; b < draft.n_blocks; b++) {
		double low[2] = { 1e9, 1e9 }, high[2] = { -1e9, -1e9 };

		for (uint64_t left = draft.block[b].mask; left != 0; left &= left - 1) {
			int s = __builtin_ctzll(left);
			double at[2] = { s % 8 + (s / 8 & 1) / 2.0, s / 8 };

			for (int k = 0; k < 2; k++) {
				low[k] = at[k] < low[k] ? at[k] : low[k];
				high[k] = at[k] > high[k] ? at[k] : high[k];
			}
		}
		assert_true(fabs((low[0] + high[0]) / 2 - 3.75) <= 0.5);
		assert_true(fabs((low[1] + high[1]) / 2 - 3.5) <= 1);
	}
	draft_fini(&draft);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(blocks_of_one_place_become_one_and_keep_their_samples),
		cmocka_unit_test(what_fits_one_window_becomes_one_block),
		cmocka_unit_test(blocks_that_differ_in_anything_stay_apart),
		cmocka_unit_test(coarse_blocks_may_be_as_many_of_their_steps_deep),
		cmocka_unit_test(no_sample_is_lost_or_doubled_whatever_is_joined),
		cmocka_unit_test(windows_lie_over_the_middles_of_their_samples),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

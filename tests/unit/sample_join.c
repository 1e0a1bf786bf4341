#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>
#include "psr/error.h"
#include "sample/draft.h"
#include "sample_meshes.h"

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
		draft->sample[draft->n_samples] = (struct draft_sample){ steps * SPACING, draft->n_samples, draft->n_samples + 7u };
	return block;
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
	assert_true(draft.block[0].mask == 0xff && draft.block[0].part == 0xff);
	for (unsigned s = 0; s < 8; s++) {
		const struct draft_sample *sample = draft_sample(&draft, &draft.block[0], s);

		assert_int_equal(sample->surface, s < 4 ? s : s + 4);
		assert_int_equal(sample->attr, sample->surface + 7);
		assert_true(sample->z == (s < 4 ? 0 : 24 * SPACING));
	}
	draft_fini(&draft);
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
	add_block(&draft, 32, 32, 0)->col = 1;
	add_block(&draft, 64, 64, 0)->row = -1;
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
		block->col = (int16_t)(5 * meshes_random(&seed));
		block->row = (int16_t)(5 * meshes_random(&seed));
		for (uint64_t left = part; left != 0; left &= left - 1)
			needed[n_needed++] = draft_sample(&draft, block, (unsigned)__builtin_ctzll(left))->surface;
	}
	assert_int_equal(draft_join(&draft), PSR_OK);
	assert_in_range(draft.n_blocks, 100, 2000);
	assert_int_equal(draft.n_samples, n_needed);
	for (uint32_t b = 0; b < draft.n_blocks; b++) {
		float low = 1e30f, high = -1e30f;

		assert_true(draft.block[b].mask == draft.block[b].part);
		for (uint64_t left = draft.block[b].mask; left != 0; left &= left - 1) {
			const struct draft_sample *sample = draft_sample(&draft, &draft.block[b], (unsigned)__builtin_ctzll(left));

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
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(blocks_of_one_place_become_one_and_keep_their_samples),
		cmocka_unit_test(blocks_that_differ_in_anything_stay_apart),
		cmocka_unit_test(coarse_blocks_may_be_as_many_of_their_steps_deep),
		cmocka_unit_test(no_sample_is_lost_or_doubled_whatever_is_joined),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

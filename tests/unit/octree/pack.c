#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
#include <string.h>
#include "octree/pack.h"
#include "leaves.h"
#include "tests/unit/lib/threads.h"

static struct octree *make(int levels, size_t n_random)
{
	struct leaves leaves = n_random > 0 ? leaves_at_random(levels, n_random) : leaves_of_sphere(levels);
	struct octree *tree = leaves_to_tree(&leaves, levels);

	assert_non_null(tree);
	free(leaves.path);
	return tree;
}

static const struct {
	int levels;
	size_t n;
} forms[] = { { 2, 5 }, { 6, 0 }, { 7, 0 }, { 12, 3000 }, { 20, 1000 }, { 20, 1 }, { 7, 1500000 } };

static void an_unpacked_tree_is_the_packed_one(void **state)
{
	(void)state;
	for (size_t f = 0; f < sizeof forms / sizeof *forms; f++)
		for (enum octree_packing packing = OCTREE_FAST; packing <= OCTREE_SMALL; packing++) {
			struct octree *tree = make(forms[f].levels, forms[f].n), *again;
			uint8_t *bytes;
			size_t n;

			assert_true(leaves_dress(tree, forms[f].n < OCTREE_CHUNK ? (unsigned)(f + packing) : 0));
			assert_int_equal(octree_pack(&bytes, &n, tree, packing, NULL, NULL), PSR_OK);
			assert_int_equal(octree_unpack(&again, bytes, n, tree->n_leaves, NULL, NULL), PSR_OK);
			assert_same(tree, again);
			assert_int_equal(octree_check(again, NULL, NULL), PSR_OK);
			free(bytes);
			octree_destroy(tree);
			octree_destroy(again);
		}
}

/* 1.1 million leaves of 2^21 are two chunks at least. */
static void threads_pack_the_same_bytes_and_unpack_the_same_tree(void **state)
{
	struct octree *tree = make(7, 1500000), *again;
	struct octree_shares shares;
	struct psr_pool *pool;
	uint8_t *bytes, *other;
	size_t n, n_other;

	(void)state;
	assert_true(tree->n_leaves > OCTREE_CHUNK);
	assert_true(leaves_dress(tree, 15));
	assert_int_equal(psr_pool_create(&pool, 3, NULL), PSR_OK);
	assert_int_equal(octree_pack(&bytes, &n, tree, OCTREE_FAST, NULL, NULL), PSR_OK);
	assert_int_equal(octree_pack(&other, &n_other, tree, OCTREE_FAST, pool, NULL), PSR_OK);
	assert_int_equal(n, n_other);
	assert_memory_equal(bytes, other, n);
	assert_int_equal(octree_unpack(&again, bytes, n, tree->n_leaves, &(struct octree_crew){ .pool = pool }, NULL),
	                 PSR_OK);
	assert_same(tree, again);
	octree_packed_shares(&shares, bytes, n);
	assert_int_equal(shares.codes + shares.stream[0] + shares.stream[1] + shares.stream[2] + shares.stream[3], n);
	/* Two bits of noise an offset; four a channel of colours. */
	assert_in_range(shares.stream[OCTREE_OFFSET_STREAM], tree->n_leaves / 4, tree->n_leaves / 3);
	assert_in_range(shares.stream[OCTREE_COLOR_STREAM], tree->n_leaves * 3 / 2, tree->n_leaves * 2);
	psr_pool_destroy(pool);
	free(bytes);
	free(other);
	octree_destroy(tree);
	octree_destroy(again);
}

/* A surface costs less than the best of [B] table 1, 0.9 bits a leaf, though this one is small. */
static void surfaces_pack_well(void **state)
{
	struct octree *tree = make(8, 0);
	uint8_t *bytes;
	size_t small, fast;

	(void)state;
	assert_int_equal(octree_pack(&bytes, &small, tree, OCTREE_SMALL, NULL, NULL), PSR_OK);
	free(bytes);
	assert_int_equal(octree_pack(&bytes, &fast, tree, OCTREE_FAST, NULL, NULL), PSR_OK);
	free(bytes);
	print_message("%zu leaves: %.2f bits packed, %.2f fast, %.2f in core\n", (size_t)tree->n_leaves,
	              8.0 * (double)small / (double)tree->n_leaves, 8.0 * (double)fast / (double)tree->n_leaves,
	              8.0 * (double)tree->n_codes / (double)tree->n_leaves);
	assert_true(small < fast && fast < tree->n_codes);
	assert_true(8 * small * 10 < 9 * tree->n_leaves);
	octree_destroy(tree);
}

/* Unpacks from an allocation of exactly n bytes. */
static int unpack(const uint8_t *bytes, size_t n, uint64_t max_leaves)
{
	uint8_t *exact = malloc(n > 0 ? n : 1);
	struct octree *tree = NULL;
	struct psr_error err = { 0, "" };
	int rc;

	assert_non_null(exact);
	memcpy(exact, bytes, n);
	rc = octree_unpack(&tree, exact, n, max_leaves, NULL, &err);
	assert_true((rc == PSR_OK) == (tree != NULL) && rc == err.code && (rc == PSR_OK) == (err.text[0] == '\0'));
	if (tree != NULL)
		assert_int_equal(octree_check(tree, NULL, NULL), PSR_OK);
	octree_destroy(tree);
	free(exact);
	return rc;
}

static void what_is_cut_short_or_longer_is_refused(void **state)
{
	(void)state;
	for (enum octree_packing packing = OCTREE_FAST; packing <= OCTREE_SMALL; packing++) {
		struct octree *tree = make(10, 100);
		uint8_t *bytes, *longer;
		size_t n;

		assert_true(leaves_dress(tree, packing == OCTREE_FAST ? 15 : 0));
		assert_int_equal(octree_pack(&bytes, &n, tree, packing, NULL, NULL), PSR_OK);
		for (size_t shorter = 0; shorter < n; shorter += shorter < 64 || shorter + 8 > n ? 1 : 7)
			assert_int_equal(unpack(bytes, shorter, UINT64_MAX), PSR_ERR_FORMAT);
		longer = calloc(1, n + 1);
		assert_non_null(longer);
		memcpy(longer, bytes, n);
		assert_int_equal(unpack(longer, n + 1, UINT64_MAX), PSR_ERR_FORMAT);
		assert_int_equal(unpack(bytes, n, tree->n_leaves - 1), PSR_ERR_LIMIT);
		assert_int_equal(unpack(bytes, n, tree->n_leaves), PSR_OK);
		free(longer);
		free(bytes);
		octree_destroy(tree);
	}
}

/* A coder's end could leave some of its last bits open. */
static void the_last_bytes_have_one_value(void **state)
{
	(void)state;
	for (enum octree_packing packing = OCTREE_FAST; packing <= OCTREE_SMALL; packing++) {
		struct octree *tree = make(6, 40);
		uint8_t *bytes;
		size_t n;

		assert_int_equal(octree_pack(&bytes, &n, tree, packing, NULL, NULL), PSR_OK);
		for (int bit = 0; bit < 32; bit++) {
			bytes[n - 1 - bit / 8] ^= (uint8_t)(1 << bit % 8);
			assert_int_equal(unpack(bytes, n, UINT64_MAX), PSR_ERR_FORMAT);
			bytes[n - 1 - bit / 8] ^= (uint8_t)(1 << bit % 8);
		}
		free(bytes);
		octree_destroy(tree);
	}
}

static void a_header_that_lies_is_refused(void **state)
{
	struct octree *tree = make(9, 200);
	uint8_t *bytes;
	size_t n;

	(void)state;
	assert_int_equal(octree_pack(&bytes, &n, tree, OCTREE_SMALL, NULL, NULL), PSR_OK);
	for (size_t i = 0; i < 24; i++)
		for (int bit = 0; bit < 8; bit++) {
			const uint8_t was = bytes[i];

			bytes[i] ^= (uint8_t)(1 << bit);
			/* Another way of packing decodes to other codes, which do not add up. */
			assert_int_equal(unpack(bytes, n, UINT64_MAX), PSR_ERR_FORMAT);
			bytes[i] = was;
		}
	free(bytes);
	octree_destroy(tree);
}

/* Those that small trees were packed by before the first release. */
static void older_ways_are_refused(void **state)
{
	struct octree *tree = make(9, 200), *again;
	struct psr_error err;
	uint8_t *bytes;
	size_t n;

	(void)state;
	assert_int_equal(octree_pack(&bytes, &n, tree, OCTREE_SMALL, NULL, NULL), PSR_OK);
	for (uint8_t way = 1; way < 4; way++) {
		bytes[1] = way;
		assert_int_equal(octree_unpack(&again, bytes, n, UINT64_MAX, NULL, &err), PSR_ERR_FORMAT);
		assert_non_null(strstr(err.text, (const char[]){ 'w', 'a', 'y', ' ', (char)('0' + way), '\0' }));
	}
	free(bytes);
	octree_destroy(tree);
}

/* The first byte of all may be 255, which elsewhere waits for a carry; so may some that follow. */
static void bits_of_a_small_chance_come_back_wherever_they_stand(void **state)
{
	(void)state;
	for (int n_ones = 0; n_ones < 40; n_ones++) {
		struct coder coder, again;

		coder_begin(&coder);
		for (int i = 0; i < 80; i++)
			coder_bit(&coder, 0, 32768, i >= n_ones && i % 7 == 0);
		coder_end(&coder);
		assert_false(coder.has_failed);
		coder_open(&again, coder.bytes, coder.n);
		for (int i = 0; i < 80; i++)
			assert_int_equal(coder_bit(&again, 1, 32768, 0), i >= n_ones && i % 7 == 0);
		assert_true(coder_is_at_end(&again));
		free(coder.bytes);
	}
}

static void a_tree_takes_only_its_own_bytes(void **state)
{
	struct octree *tree = make(9, 200), *other = make(9, 201), wrong;
	struct psr_error err;
	uint8_t *bytes;
	size_t n;

	(void)state;
	assert_true(leaves_dress(tree, 7) && leaves_dress(other, 7));
	assert_int_equal(octree_pack(&bytes, &n, tree, OCTREE_SMALL, NULL, NULL), PSR_OK);
	assert_int_equal(octree_unpack_into(other, bytes, n, NULL, &err), PSR_ERR_FORMAT);
	for (int i = 0; i < 5; i++) {
		wrong = *tree;
		wrong.levels -= i == 0;
		wrong.n_codes -= i == 1;
		wrong.n_skips -= i == 2;
		wrong.color = i == 3 ? NULL : wrong.color;
		wrong.n_leaves += i == 4;
		assert_int_equal(octree_unpack_into(&wrong, bytes, n, NULL, &err), PSR_ERR_FORMAT);
	}
	memset(tree->code, 0, tree->n_codes);
	memset(tree->normal, 0, tree->n_leaves * sizeof *tree->normal);
	assert_int_equal(octree_unpack_into(tree, bytes, n, NULL, NULL), PSR_OK);
	assert_int_equal(octree_check(tree, NULL, NULL), PSR_OK);
	octree_destroy(other);
	assert_int_equal(octree_unpack(&other, bytes, n, UINT64_MAX, NULL, NULL), PSR_OK);
	assert_same(tree, other);
	free(bytes);
	octree_destroy(tree);
	octree_destroy(other);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_unpacked_tree_is_the_packed_one),
		cmocka_unit_test(threads_pack_the_same_bytes_and_unpack_the_same_tree),
		cmocka_unit_test(surfaces_pack_well),
		cmocka_unit_test(what_is_cut_short_or_longer_is_refused),
		cmocka_unit_test(the_last_bytes_have_one_value),
		cmocka_unit_test(a_header_that_lies_is_refused),
		cmocka_unit_test(older_ways_are_refused),
		cmocka_unit_test(bits_of_a_small_chance_come_back_wherever_they_stand),
		cmocka_unit_test(a_tree_takes_only_its_own_bytes),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}

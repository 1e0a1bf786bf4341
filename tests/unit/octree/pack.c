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
} forms[] = { { 2, 5 }, { 6, 0 }, { 7, 0 }, { 12, 3000 }, { 20, 1000 }, { 20, 1 }, { CHUNKS_LEVELS, CHUNKS_LEAVES } };

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

static void threads_pack_the_same_bytes_and_unpack_the_same_tree(void **state)
{
	struct octree *tree = make(CHUNKS_LEVELS, CHUNKS_LEAVES), *again;
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
	assert_true(leaves_dress(tree, 15));
	assert_int_equal(octree_pack(&bytes, &n, tree, OCTREE_SMALL, NULL, NULL), PSR_OK);
	for (size_t i = 0; i < 24; i++)
		for (int bit = 0; bit < 8; bit++) {
			const uint8_t was = bytes[i];

			bytes[i] ^= (uint8_t)(1 << bit);
			/* Another way of packing decodes to other codes or attributes, which do not add up. */
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

/* make(3, 40), dressed in all streams, as ways 0 and 4 packed it, whose attributes were foretold in another way. */
static const uint8_t older_fast[] =
	"\x03\x00\x00\x0f\x01\x00\x00\x00\x01\x00\x00\x00\x00\x00\x00\x00\x03\x00\x00\x00\x00\x00\x00\x00\x27\x00"
	"\x00\x00\x00\x00\x00\x00\x25\x00\x00\x00\x00\x00\x00\x00\x3c\x01\x00\x00\x00\x00\x00\x00\x01\x00\x00\x00"
	"\x27\x00\x00\x00\x25\x00\x00\x00\x2a\x00\x00\x00\x3d\x00\x00\x00\x0d\x00\x00\x00\x65\x00\x00\x00\x13\x00"
	"\x00\x00\x00\x43\xf8\x79\x79\xba\x68\xd9\x3f\x35\xc0\x22\xfc\xc4\xda\x9b\x0d\x73\x33\xc0\xe6\x01\x33\xa5"
	"\xed\xd0\xe6\xf2\x1d\x20\x1a\x28\x15\x5b\xe6\x7f\x84\x06\x8d\x73\xc9\x70\xff\xf2\xff\xed\xf0\x3a\x9c\xf1"
	"\x9d\xf2\xb9\xe6\x7e\x64\x96\x9d\x0a\xda\x07\x59\x1d\x33\x02\xe6\xee\x30\x39\x82\x96\x02\xd0\x81\x82\xcd"
	"\x84\x8a\x3b\x50\x26\xca\xc2\x56\x3d\x0d\xb2\x12\xc8\xf4\xc1\xc1\xcc\x1c\xd4\x16\x92\x65\x87\x58\xde\xf7"
	"\x71\x2b\xe9\x15\x64\xcf\x01\xea\xe5\x1c\x26\x34\xde\x00\xff\x7e\x74\x6f\x16\x23\xd5\xb4\xa5\x55\x33\x66"
	"\xd3\x37\x51\x65\xf6\xda\xc1\xe9\x5d\xaa\xed\x85\x5a\xca\x24\x53\x60\x7c\xee\x85\x0f\xf4\xa7\x44\x24\x37"
	"\x98\x83\xe4\x87\x49\x1a\x62\x7b\x7b\x8b\xec\xec\x04\xd5\x14\x25\xfe\x4b\xfd\xc6\x6b\xa8\x3f\x4b\x98\x95"
	"\x9d\x9a\xa3\xbd\xe1\x3a\xc2\x4b\x15\xc6\xa2\x98\xeb\x9e\x4d\xc1\xa4\x55\x15\x9a\xcd\x19\x25\xbc\xfb\x09"
	"\x25\x25\xaf\x7a\x2a\xf3\xac\x78\xef\xd8\x00\x01\x34\x9c\x91\xc7\x32\x8c\xf9\xee\x3f\xeb\x7f\xdd\xa2\x54"
	"\xff\x8a\x00\x00";
static const uint8_t older_small[] =
	"\x03\x04\x00\x0f\x01\x00\x00\x00\x01\x00\x00\x00\x00\x00\x00\x00\x03\x00\x00\x00\x00\x00\x00\x00\x27\x00"
	"\x00\x00\x00\x00\x00\x00\x25\x00\x00\x00\x00\x00\x00\x00\x36\x01\x00\x00\x00\x00\x00\x00\x01\x00\x00\x00"
	"\x27\x00\x00\x00\x25\x00\x00\x00\x24\x00\x00\x00\x3d\x00\x00\x00\x0d\x00\x00\x00\x65\x00\x00\x00\x13\x00"
	"\x00\x00\x00\xd5\x1b\x9d\x4c\x2d\x3b\x4c\xb1\x41\x3a\xfe\x2f\x79\x51\xc3\xe6\x4e\x25\x72\xc4\x54\xe4\x67"
	"\x19\x02\xb2\xbb\x3d\x91\xfb\x62\xc0\x26\x51\x9f\xff\xf2\xff\xed\xf0\x3a\x9c\xf1\x9d\xf2\xb9\xe6\x7e\x64"
	"\x96\x9d\x0a\xda\x07\x59\x1d\x33\x02\xe6\xee\x30\x39\x82\x96\x02\xd0\x81\x82\xcd\x84\x8a\x3b\x50\x26\xca"
	"\xc2\x56\x3d\x0d\xb2\x12\xc8\xf4\xc1\xc1\xcc\x1c\xd4\x16\x92\x65\x87\x58\xde\xf7\x71\x2b\xe9\x15\x64\xcf"
	"\x01\xea\xe5\x1c\x26\x34\xde\x00\xff\x7e\x74\x6f\x16\x23\xd5\xb4\xa5\x55\x33\x66\xd3\x37\x51\x65\xf6\xda"
	"\xc1\xe9\x5d\xaa\xed\x85\x5a\xca\x24\x53\x60\x7c\xee\x85\x0f\xf4\xa7\x44\x24\x37\x98\x83\xe4\x87\x49\x1a"
	"\x62\x7b\x7b\x8b\xec\xec\x04\xd5\x14\x25\xfe\x4b\xfd\xc6\x6b\xa8\x3f\x4b\x98\x95\x9d\x9a\xa3\xbd\xe1\x3a"
	"\xc2\x4b\x15\xc6\xa2\x98\xeb\x9e\x4d\xc1\xa4\x55\x15\x9a\xcd\x19\x25\xbc\xfb\x09\x25\x25\xaf\x7a\x2a\xf3"
	"\xac\x78\xef\xd8\x00\x01\x34\x9c\x91\xc7\x32\x8c\xf9\xee\x3f\xeb\x7f\xdd\xa2\x54\xff\x8a\x00\x00";

static void older_attributes_are_read(void **state)
{
	/* Without the string's end. */
	static const struct {
		const uint8_t *bytes;
		size_t n;
	} older[] = { { older_fast, sizeof older_fast - 1 }, { older_small, sizeof older_small - 1 } };
	struct octree *tree = make(3, 40), *again;

	(void)state;
	assert_true(leaves_dress(tree, 15));
	for (int i = 0; i < 2; i++) {
		assert_int_equal(octree_unpack(&again, older[i].bytes, older[i].n, UINT64_MAX, NULL, NULL), PSR_OK);
		assert_same(tree, again);
		octree_destroy(again);
	}
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
		cmocka_unit_test(older_attributes_are_read),
		cmocka_unit_test(bits_of_a_small_chance_come_back_wherever_they_stand),
		cmocka_unit_test(a_tree_takes_only_its_own_bytes),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Octrees packed in steps: a beginning of the bytes is a coarser tree. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
#include <string.h>
#include "octree/pack.h"
#include "leaves.h"
#include "tests/unit/lib/threads.h"

struct packed {
	struct octree *tree;
	uint8_t *bytes;
	size_t n;
	struct octree_step step[OCTREE_MOST_STEPS];
	int n_steps;
};

static struct packed make(int levels, size_t n_random, unsigned streams, enum octree_packing packing)
{
	struct leaves leaves = n_random > 0 ? leaves_at_random(levels, n_random) : leaves_of_sphere(levels);
	struct packed p = { .tree = leaves_to_tree(&leaves, levels) };

	free(leaves.path);
	assert_true(p.tree != NULL && leaves_dress(p.tree, streams));
	assert_int_equal(octree_pack(&p.bytes, &p.n, p.tree, packing | OCTREE_STEPS, NULL, NULL), PSR_OK);
	p.n_steps = octree_packed_steps(p.step, p.bytes, p.n, NULL);
	assert_in_range(p.n_steps, 1, OCTREE_MOST_STEPS);
	return p;
}

static void unmake(struct packed *p)
{
	octree_destroy(p->tree);
	free(p->bytes);
}

/* Unpacks from an allocation of exactly n bytes. */
static int unpack(struct octree **tree, const uint8_t *bytes, size_t n)
{
	uint8_t *exact = malloc(n > 0 ? n : 1);
	struct psr_error err = { 0, "" };
	int rc;

	assert_non_null(exact);
	memcpy(exact, bytes, n);
	*tree = NULL;
	rc = octree_unpack(tree, exact, n, UINT64_MAX, NULL, &err);
	assert_true((rc == PSR_OK) == (*tree != NULL) && rc == err.code && (rc == PSR_OK) == (err.text[0] == '\0'));
	free(exact);
	return rc;
}

/* Unpacks each beginning that is a tree, and compares it with what the tree itself becomes. */
static void assert_beginnings(const struct packed *p)
{
	struct octree *coarser = NULL;

	for (int s = p->n_steps - 1; s >= 0; s--) {
		const struct octree *is = coarser != NULL ? coarser : p->tree;
		struct octree *begun;

		assert_int_equal(unpack(&begun, p->bytes, p->step[s].end), PSR_OK);
		assert_int_equal(begun->levels, p->step[s].depth);
		assert_same(begun, is);
		octree_destroy(begun);
		for (int i = 0; i < OCTREE_STEP_LEVELS && s > 0; i++) {
			struct octree *next = octree_coarser(coarser != NULL ? coarser : p->tree);

			octree_destroy(coarser);
			coarser = next;
		}
	}
	octree_destroy(coarser);
}

static void a_beginning_is_the_coarser_tree(void **state)
{
	(void)state;
	for (enum octree_packing packing = OCTREE_FAST; packing <= OCTREE_SMALL; packing++)
		for (unsigned streams = 0; streams < 16; streams++) {
			struct packed p = make(streams & 1 ? 7 : 6, streams & 1 ? 9000 : 0, streams, packing);

			/* Offsets along no normals have no means. */
			assert_int_equal(p.n_steps > 1, (streams & 3) != 2);
			assert_beginnings(&p);
			unmake(&p);
		}
}

static void a_small_tree_is_one_step(void **state)
{
	struct packed p = make(12, 3000, 7, OCTREE_SMALL);
	uint8_t *bytes;
	size_t n;

	(void)state;
	assert_int_equal(p.n_steps, 1);
	assert_int_equal(octree_pack(&bytes, &n, p.tree, OCTREE_SMALL, NULL, NULL), PSR_OK);
	assert_int_equal(n, p.n);
	assert_memory_equal(bytes, p.bytes, n);
	free(bytes);
	unmake(&p);
}

static void steps_of_several_chunks_are_the_same_with_threads(void **state)
{
	struct packed p = make(CHUNKS_LEVELS, CHUNKS_LEAVES, 1, OCTREE_FAST);
	struct psr_pool *pool;
	struct octree *begun;
	uint8_t *bytes;
	size_t n;

	(void)state;
	assert_true(p.tree->n_leaves > OCTREE_CHUNK && p.n_steps > 1);
	assert_beginnings(&p);
	assert_int_equal(psr_pool_create(&pool, 3, NULL), PSR_OK);
	assert_int_equal(octree_pack(&bytes, &n, p.tree, OCTREE_FAST | OCTREE_STEPS, pool, NULL), PSR_OK);
	assert_int_equal(n, p.n);
	assert_memory_equal(bytes, p.bytes, n);
	assert_int_equal(octree_unpack(&begun, bytes, n, UINT64_MAX, &(struct octree_crew){ .pool = pool }, NULL), PSR_OK);
	assert_same(begun, p.tree);
	octree_destroy(begun);
	free(bytes);
	psr_pool_destroy(pool);
	unmake(&p);
}

/* Of sixteen times the leaves each, coarser steps of a surface are some 1/15 of all values; the first ones have more
 * bits. Twice that is more than any of these. */
static void steps_cost_little(void **state)
{
	struct packed p = make(8, 0, 1, OCTREE_SMALL);
	struct octree_shares shares;
	uint8_t *bytes;
	size_t n;

	(void)state;
	assert_int_equal(octree_pack(&bytes, &n, p.tree, OCTREE_SMALL, NULL, NULL), PSR_OK);
	octree_packed_shares(&shares, p.bytes, p.n);
	assert_int_equal(shares.codes + shares.stream[0] + shares.stream[1] + shares.stream[2] + shares.coarser, p.n);
	print_message("%zu bytes in %d steps, %zu in one, %zu of coarser attributes\n", p.n, p.n_steps, n,
	              (size_t)shares.coarser);
	assert_true(shares.coarser > 0 && p.n < n + 2 * n / 15);
	free(bytes);
	unmake(&p);
}

static void bytes_that_end_within_a_step_are_refused(void **state)
{
	struct packed p = make(7, 5000, 7, OCTREE_FAST);

	(void)state;
	for (size_t n = 0; n < p.n; n++) {
		struct octree *tree;
		int is_end = 0, near = n < 256;

		for (int s = 0; s < p.n_steps; s++) {
			is_end |= p.step[s].end == n;
			near |= n + 9 > p.step[s].end && n < p.step[s].end + 300;
		}
		if (!near && n % 997 != 0)
			continue;
		assert_int_equal(unpack(&tree, p.bytes, n), is_end ? PSR_OK : PSR_ERR_FORMAT);
		octree_destroy(tree);
	}
	unmake(&p);
}

/* Bits of the header, the table of steps, the codes above the cut, the roots, and of the first chunk's entry. */
static void a_table_that_lies_is_refused(void **state)
{
	struct packed p = make(7, 5000, 5, OCTREE_FAST);

	(void)state;
	for (size_t i = 0; i < 16 + 32 * (size_t)p.n_steps + 4 + 20; i++)
		for (int bit = (int)(i % 3); bit < 8; bit += 3) {
			struct octree *tree;

			p.bytes[i] ^= (uint8_t)(1 << bit);
			assert_int_equal(unpack(&tree, p.bytes, p.n), PSR_ERR_FORMAT);
			/* The table of a step that is not there yet has only to be possible. */
			if (i < 16 + 32 || i >= 16 + 32 * (size_t)p.n_steps)
				assert_int_equal(unpack(&tree, p.bytes, p.step[0].end), PSR_ERR_FORMAT);
			p.bytes[i] ^= (uint8_t)(1 << bit);
		}
	unmake(&p);
}

static void a_damaged_step_is_refused_or_another_tree(void **state)
{
	struct packed p = make(7, 5000, 7, OCTREE_FAST);

	(void)state;
	for (size_t i = p.step[0].end - 400; i < p.step[0].end + 400; i += 3) {
		struct octree *tree;
		int rc;

		p.bytes[i] ^= 1 << i % 8;
		rc = unpack(&tree, p.bytes, p.n);
		assert_true(rc == PSR_ERR_FORMAT || octree_check(tree, NULL, NULL) == PSR_OK);
		octree_destroy(tree);
		p.bytes[i] ^= 1 << i % 8;
	}
	unmake(&p);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_beginning_is_the_coarser_tree),
		cmocka_unit_test(a_small_tree_is_one_step),
		cmocka_unit_test(steps_of_several_chunks_are_the_same_with_threads),
		cmocka_unit_test(steps_cost_little),
		cmocka_unit_test(bytes_that_end_within_a_step_are_refused),
		cmocka_unit_test(a_table_that_lies_is_refused),
		cmocka_unit_test(a_damaged_step_is_refused_or_another_tree),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Packed octrees. What is accepted is a tree that fits its own counts, and unpacks again from what it packs to, in one
 * step or in several, whose beginnings are trees, too. */
#include <stdlib.h>
#include <string.h>
#include "octree/pack.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n);

#define REQUIRE(x) ((x) ? (void)0 : abort())
#define MOST 200000

static void check_beginnings(const uint8_t *bytes, size_t n_bytes)
{
	struct octree_step step[OCTREE_MOST_STEPS];
	const int n = octree_packed_steps(step, bytes, n_bytes, NULL);

	REQUIRE(n > 0 && step[n - 1].end == n_bytes);
	for (int s = 0; s < n - 1; s++) {
		struct octree *tree;

		REQUIRE(octree_unpack(&tree, bytes, step[s].end, MOST, NULL, NULL) == PSR_OK);
		REQUIRE(tree->levels == step[s].depth && tree->n_leaves == step[s].n_leaves);
		REQUIRE(octree_check(tree, NULL, NULL) == PSR_OK);
		octree_destroy(tree);
	}
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t n)
{
	struct psr_error err = { 0, "" };
	struct octree *tree, *again;
	uint8_t *bytes;
	size_t n_bytes;
	int rc = octree_unpack(&tree, data, n, MOST, NULL, &err);

	REQUIRE(rc == err.code && (rc == PSR_OK) == (err.text[0] == '\0'));
	REQUIRE(rc == PSR_OK || rc == PSR_ERR_FORMAT || rc == PSR_ERR_LIMIT);
	if (rc != PSR_OK)
		return 0;
	REQUIRE(tree->n_leaves <= MOST && octree_check(tree, NULL, NULL) == PSR_OK);
	for (uint64_t i = 0; i < tree->n_leaves; i++)
		REQUIRE((tree->normal == NULL || tree->normal[i] < 32768) &&
		        (tree->offset == NULL || tree->offset[i] < OCTREE_OFFSETS));
	for (enum octree_packing packing = OCTREE_FAST; packing <= (OCTREE_SMALL | OCTREE_STEPS); packing++) {
		REQUIRE(octree_pack(&bytes, &n_bytes, tree, packing, NULL, NULL) == PSR_OK);
		REQUIRE(octree_unpack(&again, bytes, n_bytes, tree->n_leaves, NULL, NULL) == PSR_OK);
		REQUIRE(again->n_codes == tree->n_codes && memcmp(again->code, tree->code, tree->n_codes) == 0);
		REQUIRE(!again->normal == !tree->normal && !again->offset == !tree->offset && !again->color == !tree->color);
		REQUIRE(tree->normal == NULL || memcmp(again->normal, tree->normal, 2 * tree->n_leaves) == 0);
		REQUIRE(tree->offset == NULL || memcmp(again->offset, tree->offset, tree->n_leaves) == 0);
		REQUIRE(tree->color == NULL || memcmp(again->color, tree->color, 3 * tree->n_leaves) == 0);
		REQUIRE(!again->material == !tree->material);
		REQUIRE(tree->material == NULL || memcmp(again->material, tree->material, 3 * tree->n_leaves) == 0);
		octree_destroy(again);
		check_beginnings(bytes, n_bytes);
		free(bytes);
	}
	octree_destroy(tree);
	return 0;
}

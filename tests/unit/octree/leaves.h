/* Leaves of surfaces and of dust, for tests of octrees. */
#ifndef TESTS_UNIT_OCTREE_LEAVES_H
#define TESTS_UNIT_OCTREE_LEAVES_H

#include <stdlib.h>
#include "base/random.h"
#include "octree/pack.h"

/* Of twice as many places as a chunk has leaves, this many at random leave out 1 / e^0.75 = 47 %: more than one chunk. */
#define CHUNKS_LEVELS (OCTREE_CHUNK == 1u << 20 ? 7 : 6)
#define CHUNKS_LEAVES (OCTREE_CHUNK / 2 * 3)

struct leaves {
	uint64_t *path; /* in Morton order, each once */
	size_t n;
};

static inline int leaves_compare(const void *a, const void *b)
{
	const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;

	return x < y ? -1 : x > y;
}

static inline void leaves_sort(struct leaves *leaves)
{
	size_t n = 0;

	qsort(leaves->path, leaves->n, sizeof *leaves->path, leaves_compare);
	for (size_t i = 0; i < leaves->n; i++)
		if (n == 0 || leaves->path[i] != leaves->path[n - 1])
			leaves->path[n++] = leaves->path[i];
	leaves->n = n;
}

/* All leaves of a cube of this many levels whose middles are within half a diagonal of a sphere. */
static inline struct leaves leaves_of_sphere(int levels)
{
	const uint32_t side = 1u << levels;
	const double radius = 0.4 * side;
	struct leaves leaves = { malloc(((size_t)16 * side * side + 64) * sizeof *leaves.path), 0 };

	for (uint32_t x = 0; x < side && leaves.path != NULL; x++)
		for (uint32_t y = 0; y < side; y++)
			for (uint32_t z = 0; z < side; z++) {
				const double dx = x + 0.5 - side * 0.5, dy = y + 0.5 - side * 0.5, dz = z + 0.5 - side * 0.5;
				const double squared = dx * dx + dy * dy + dz * dz;

				if (squared > (radius - 0.7) * (radius - 0.7) && squared < (radius + 0.7) * (radius + 0.7))
					leaves.path[leaves.n++] = octree_path((const uint32_t[3]){ x, y, z });
			}
	leaves_sort(&leaves);
	return leaves;
}

static inline struct leaves leaves_at_random(int levels, size_t n)
{
	struct leaves leaves = { malloc(n * sizeof *leaves.path), n };
	uint64_t random = 1;

	for (size_t i = 0; i < n && leaves.path != NULL; i++)
		leaves.path[i] = random_next(&random) >> (64 - 3 * levels);
	leaves_sort(&leaves);
	return leaves;
}

static inline struct octree *leaves_to_tree(const struct leaves *leaves, int levels)
{
	struct octree_maker maker;
	struct octree *tree = NULL;
	int rc = octree_maker_init(&maker, levels, NULL);

	for (size_t i = 0; i < leaves->n && rc == PSR_OK; i++)
		rc = octree_maker_put(&maker, leaves->path[i], NULL);
	if (rc == PSR_OK)
		tree = octree_maker_take(&maker);
	octree_maker_fini(&maker);
	return tree;
}

/* Gives leaves attributes that are partly noise; streams: bit 0 normals, 1 offsets, 2 colours, 3 materials. Returns 0
 * without memory. */
static inline int leaves_dress(struct octree *tree, unsigned streams)
{
	const size_t n = tree->n_leaves;
	uint64_t random = 3;

	if (streams & 1)
		tree->normal = malloc(n * sizeof *tree->normal);
	if (streams & 2)
		tree->offset = malloc(n);
	if (streams & 4)
		tree->color = malloc(n * sizeof *tree->color);
	if (streams & 8)
		tree->material = malloc(n * sizeof *tree->material);
	for (size_t i = 0; i < n; i++) {
		const uint64_t r = random_next(&random);

		if (tree->normal != NULL)
			tree->normal[i] = (uint16_t)((i / 64 * 32 + (r & 31)) & 0x7fff);
		if (tree->offset != NULL)
			tree->offset[i] = (uint8_t)(r >> 8 & 3);
		for (int c = 0; c < 3 && tree->color != NULL; c++)
			tree->color[i][c] = (uint8_t)(i / 256 + (r >> (16 + 4 * c) & 15));
		if (tree->material != NULL) /* one for 512 leaves, but that one of eight is rougher */
			octree_put_material(tree->material[i], (uint32_t)(i / 512 * 0x123456 ^ (r >> 32 & 7 ? 0 : r >> 24 & 0x70000)));
	}
	return !tree->normal == !(streams & 1) && !tree->offset == !(streams & 2) && !tree->color == !(streams & 4)
	       && !tree->material == !(streams & 8);
}

/* After cmocka.h. */
static inline void assert_same(const struct octree *a, const struct octree *b)
{
	assert_int_equal(a->levels, b->levels);
	assert_int_equal(a->n_codes, b->n_codes);
	assert_int_equal(a->n_leaves, b->n_leaves);
	assert_int_equal(a->n_skips, b->n_skips);
	assert_memory_equal(a->code, b->code, a->n_codes);
	assert_memory_equal(a->skip, b->skip, a->n_skips * sizeof *a->skip);
	assert_true(!a->normal == !b->normal && !a->offset == !b->offset && !a->color == !b->color);
	assert_true(!a->material == !b->material);
	if (a->normal != NULL)
		assert_memory_equal(a->normal, b->normal, a->n_leaves * sizeof *a->normal);
	if (a->offset != NULL)
		assert_memory_equal(a->offset, b->offset, a->n_leaves);
	if (a->color != NULL)
		assert_memory_equal(a->color, b->color, a->n_leaves * sizeof *a->color);
	if (a->material != NULL)
		assert_memory_equal(a->material, b->material, a->n_leaves * sizeof *a->material);
}

#endif

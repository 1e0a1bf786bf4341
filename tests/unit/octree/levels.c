/* A walk tells each node's neighbours: looked up in grids of all nodes. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
#include <string.h>
#include "base/random.h"
#include "octree/levels.h"

#define HEIGHT 3  /* below the roots */
#define CUT 1     /* roots are octants of the whole */
#define SIDE 16   /* leaves of the whole, along an axis */
#define ABSENT UINT32_MAX

struct walked {
	uint32_t index[SIDE][SIDE][SIDE]; /* of the nodes of a depth, by place */
	int side, n;
};

static uint32_t node_at(const struct walked *w, const int at[3])
{
	for (int c = 0; c < 3; c++)
		if (at[c] < 0 || at[c] >= w->side)
			return ABSENT;
	return w->index[at[2]][at[1]][at[0]];
}

static void look(uint32_t node, uint64_t path, const struct octree_near *near, void *userdata)
{
	struct walked *w = userdata;
	uint32_t place[3];

	assert_int_equal(node, w->n++);
	octree_place(path, place);
	for (int k = 0; k < OCTREE_NEAR; k++) {
		const int at[3] = { (int)place[0] + k % 3 - 1, (int)place[1] + k / 3 % 3 - 1, (int)place[2] + k / 9 - 1 };
		const uint32_t other = node_at(w, at);

		assert_int_equal(near->there >> k & 1, other != ABSENT);
		assert_int_equal(near->before >> k & 1, other < node);
		if (other != ABSENT)
			assert_int_equal(octree_near_at(near, (unsigned)k), other);
	}
}

/* Numbers the nodes of a depth in Morton order; returns how many there are. */
static int number_nodes(struct walked *w, const uint8_t *is_leaf, int depth)
{
	const int below = 3 * (CUT + HEIGHT - depth);

	w->n = 0;
	w->side = 1 << depth;
	for (uint64_t path = 0; path < (uint64_t)1 << 3 * depth; path++) {
		uint32_t at[3];
		int is_there = 0;

		octree_place(path, at);
		for (uint64_t leaf = path << below; leaf < (path + 1) << below; leaf++)
			is_there |= is_leaf[leaf];
		w->index[at[2]][at[1]][at[0]] = is_there ? (uint32_t)w->n++ : ABSENT;
	}
	return w->n;
}

/* Puts the code of each node of a depth. */
static void put_codes(struct octree_level *level, const struct walked *finer, int depth)
{
	for (uint64_t path = 0; path < (uint64_t)1 << 3 * depth; path++) {
		unsigned code = 0;

		for (unsigned j = 0; j < 8; j++) {
			uint32_t at[3];

			octree_place(path << 3 | j, at);
			code |= (unsigned)(finer->index[at[2]][at[1]][at[0]] != ABSENT) << j;
		}
		if (code != 0)
			assert_true(octree_level_put(level, (uint8_t)code));
	}
}

static void neighbours_are_those_of_a_grid(void **state)
{
	static uint8_t is_leaf[SIDE * SIDE * SIDE];
	static struct walked w;
	uint64_t random = 5;

	(void)state;
	for (unsigned of_64 = 1; of_64 <= 64; of_64 *= 2) {
		struct octree_levels levels = { .height = HEIGHT };
		uint64_t root[1 << 3 * CUT];

		for (int i = 0; i < SIDE * SIDE * SIDE; i++)
			is_leaf[i] = random_below(&random, 64) < of_64;
		for (int level = 0; level < HEIGHT; level++) {
			number_nodes(&w, is_leaf, CUT + level + 1);
			put_codes(&levels.at[level], &w, CUT + level);
		}
		number_nodes(&w, is_leaf, CUT);
		for (uint64_t path = 0; path < 1 << 3 * CUT; path++) {
			uint32_t at[3];

			octree_place(path, at);
			if (w.index[at[2]][at[1]][at[0]] != ABSENT)
				root[levels.n_roots++] = path;
		}
		levels.root = root;
		for (int level = 0; level <= HEIGHT; level++) {
			const int n = number_nodes(&w, is_leaf, CUT + level);

			w.n = 0;
			octree_levels_walk(&levels, level, look, &w);
			assert_int_equal(w.n, n);
		}
		octree_levels_fini(&levels);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(neighbours_are_those_of_a_grid),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

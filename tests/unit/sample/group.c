#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "base/vec.h"
#include "psr/error.h"
#include "sample/levels/draft.h"
#include "meshes.h"

/* Three waved layers above each other, sampled by one projection at four levels. */
#define N_LEVELS 4
#define N_LAYERS 3
#define SIDE 64 /* blocks of level 0 a row and layer */
#define SPACING 0.0012f

static const struct psr_projection projection = { { { 0.6f, 0.8f, 0 }, { -0.8f, 0.6f, 0 }, { 0, 0, 1 } }, SPACING };

static float depth_at(double x, double y, int layer)
{
	return (float)(0.03 * layer + 0.02 * sin(9 * x + 2 * layer) * cos(7 * y));
}

static void add_layer(struct draft *draft, unsigned level, int layer)
{
	double spacing = (double)SPACING * (1u << level);

	for (int i = 0; i < SIDE * SIDE >> 2 * level; i++) {
		struct draft_block *block = &draft->block[draft->n_blocks++];

		*block = (struct draft_block){ .level = (uint8_t)level, .col = (int16_t)(8 * (i % (SIDE >> level))),
			                           .row = (int16_t)(8 * (i / (SIDE >> level))), .mask = UINT64_MAX, .part = UINT64_MAX,
			                           .first = draft->n_samples };
		for (int s = 0; s < 64; s++) {
			int row = block->row + s / 8, col = block->col + s % 8;

			draft->sample[draft->n_samples++].z = depth_at((col + (row & 1) / 2.0) * spacing,
			                                               row * 0.8660254 * spacing, layer);
		}
	}
}

static void make_layers(struct draft *draft)
{
	uint32_t most = 2 * N_LAYERS * SIDE * SIDE;

	*draft = (struct draft){ .n_levels = N_LEVELS, .projection = &projection, .ds = (double)SPACING,
		                     .block_capacity = most, .sample_capacity = 64 * most };
	draft->block = calloc(most, sizeof *draft->block);
	draft->sample = calloc(64 * most, sizeof *draft->sample);
	for (unsigned level = 0; level < N_LEVELS; level++)
		for (int layer = 0; layer < N_LAYERS; layer++)
			add_layer(draft, level, layer);
	assert_int_equal(draft_group(draft, NULL), PSR_OK);
	printf("# %u groups\n", draft->n_groups);
	assert_true(draft->n_groups > 1);
}

/* Of a sample among all. */
static uint32_t number_of(const struct draft *draft, const struct draft_block *block, unsigned s)
{
	return (uint32_t)(draft_sample(draft, block, s) - draft->sample);
}

static void fine_samples_are_in_one_group_each(void **state)
{
	struct draft draft;
	uint32_t n = 0;
	uint8_t *is_there;

	(void)state;
	make_layers(&draft);
	is_there = calloc(draft.n_samples, 1);
	for (uint32_t i = 0; i < draft.n_blocks; i++) {
		const struct draft_block *block = &draft.block[i];

		assert_true(block->group < draft.n_groups);
		assert_true(block->part != 0 && (block->part & ~block->mask) == 0);
		for (uint64_t left = block->level == 0 ? block->part : 0; left != 0; left &= left - 1, n++) {
			uint32_t k = number_of(&draft, block, (unsigned)__builtin_ctzll(left));

			assert_int_equal(is_there[k], 0);
			is_there[k] = 1;
		}
	}
	assert_int_equal(n, 64 * N_LAYERS * SIDE * SIDE);
	free(is_there);
	draft_fini(&draft);
}

/* Samples of a level by cells of half a pixel: number in `patch`, and one for each group that has it, in
 * `projection`. */
static void map_level(struct kept *map, const struct draft *draft, unsigned level)
{
	assert_int_equal(kept_init(map, draft->ds * (1u << level) / 2), PSR_OK);
	for (uint32_t i = 0; i < draft->n_blocks; i++) {
		const struct draft_block *block = &draft->block[i];

		if (block->level != level)
			continue;
		for (uint64_t left = block->part; left != 0; left &= left - 1) {
			unsigned s = (unsigned)__builtin_ctzll(left);
			struct kept_sample sample = { .patch = number_of(draft, block, s), .projection = block->group };

			draft_position(draft, block, s, sample.position);
			assert_int_equal(kept_add(map, &sample), PSR_OK);
		}
	}
}

/* What covers a place of a group at a coarse level is the group's own: the nearest sample of all, which is within
 * 0.58 spacings in the middle of a flat lattice triangle, or a little more where layers are steep. At two edges a
 * coarse layer ends early. */
static void groups_have_the_nearest_samples_of_each_level(void **state)
{
	struct draft draft;

	(void)state;
	make_layers(&draft);
	for (unsigned level = 1; level < N_LEVELS; level++) {
		float ds = (float)(draft.ds * (1u << level));
		uint32_t n_far = 0, n_fine = 0;
		struct kept map;

		map_level(&map, &draft, level);
		for (uint32_t i = 0; i < draft.n_blocks; i++) {
			const struct draft_block *block = &draft.block[i];

			for (uint64_t left = block->level == 0 ? block->part & 0x8020100804020180u : 0; left != 0;
			     left &= left - 1, n_fine++) {
				float p[3], d[3], all = INFINITY, own = INFINITY;
				uint32_t first[GRID_MOST_AROUND];
				int n_cells;

				draft_position(&draft, block, (unsigned)__builtin_ctzll(left), p);
				n_cells = grid_around(&map.grid, p, (double)ds, first);
				for (int c = 0; c < n_cells; c++) {
					for (uint32_t k = first[c]; k != GRID_NONE; k = map.sample[k].next) {
						v3f_sub(d, map.sample[k].position, p);
						all = fminf(all, v3f_length(d));
						if (map.sample[k].projection == block->group)
							own = fminf(own, v3f_length(d));
					}
				}
				n_far += all >= 0.74f * ds;
				if (all < 0.74f * ds)
					assert_true(own == all);
			}
		}
		/* A coarse spacing along two edges of the 512 fine ones. */
		assert_true((double)n_far / n_fine < 3.0 * (1u << level) / 512);
		kept_fini(&map);
	}
	draft_fini(&draft);
}

/* Groups of layers that do not touch share what is along the cuts: 4 coarse pixels a cut, as wide as it reaches on
 * both sides. */
static void coarse_levels_are_not_stored_many_times(void **state)
{
	struct draft draft;
	uint32_t n_stored[N_LEVELS] = { 0 };

	(void)state;
	make_layers(&draft);
	for (uint32_t i = 0; i < draft.n_blocks; i++)
		n_stored[draft.block[i].level] += (uint32_t)__builtin_popcountll(draft.block[i].part);
	for (unsigned level = 1; level < N_LEVELS; level++) {
		double all = 64 * N_LAYERS * (SIDE * SIDE >> 2 * level), width = 8 * (SIDE >> level);
		double cuts = ceil(log2((double)draft.n_groups));

		printf("# level %u: stored %.3f times\n", level, n_stored[level] / all);
		assert_true(n_stored[level] >= all);
		assert_true(n_stored[level] / all < 1 + (pow(2, cuts / 2) * 2 - 1) * 4 / width);
	}
	draft_fini(&draft);
}

/* A box full of samples, as needles fill it, in blocks that are twice as deep as wide and do not end at the same
 * depths. */
static void fill_box(struct draft *draft, int n_wide, int n_deep, uint64_t *seed)
{
	for (int i = 0; i < n_wide * n_wide * n_deep; i++) {
		double z = i / (n_wide * n_wide) + i % 7 / 7.0;

		draft->block[draft->n_blocks++] = (struct draft_block){ .col = (int16_t)(8 * (i % n_wide)), .mask = UINT64_MAX,
			.row = (int16_t)(8 * (i / n_wide % n_wide)), .part = UINT64_MAX, .first = draft->n_samples };
		for (int s = 0; s < 64; s++)
			draft->sample[draft->n_samples++].z = 16 * SPACING * (float)(z + meshes_random(seed));
	}
}

/* Of two groups one lies beyond the other along some axis: all of these blocks are cut where groups are. */
static void groups_do_not_reach_into_each_other(void **state)
{
	struct draft draft = { .n_levels = 1, .projection = &projection, .ds = (double)SPACING, .block_capacity = 6400,
		                   .sample_capacity = 64 * 6400 };
	float min[8][3], max[8][3];
	uint64_t seed = 17;

	(void)state;
	draft.block = calloc(draft.block_capacity, sizeof *draft.block);
	draft.sample = calloc(draft.sample_capacity, sizeof *draft.sample);
	fill_box(&draft, 20, 16, &seed);
	assert_int_equal(draft_group(&draft, NULL), PSR_OK);
	assert_in_range(draft.n_groups, 2, 8);
	for (uint32_t g = 0; g < draft.n_groups; g++) {
		v3f_set(min[g], INFINITY, INFINITY, INFINITY);
		v3f_set(max[g], -INFINITY, -INFINITY, -INFINITY);
	}
	for (uint32_t i = 0; i < draft.n_blocks; i++) {
		const struct draft_block *block = &draft.block[i];

		for (uint64_t left = block->part; left != 0; left &= left - 1) {
			float p[3];

			draft_position(&draft, block, (unsigned)__builtin_ctzll(left), p);
			for (int k = 0; k < 3; k++) {
				min[block->group][k] = fminf(min[block->group][k], p[k]);
				max[block->group][k] = fmaxf(max[block->group][k], p[k]);
			}
		}
	}
	for (uint32_t g = 0; g < draft.n_groups; g++) {
		for (uint32_t h = 0; h < g; h++) {
			float least = INFINITY;

			for (int k = 0; k < 3; k++)
				least = fminf(least, fminf(max[g][k] - min[h][k], max[h][k] - min[g][k]));
			assert_true(least < 1e-6f);
		}
	}
	draft_fini(&draft);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(fine_samples_are_in_one_group_each),
		cmocka_unit_test(groups_have_the_nearest_samples_of_each_level),
		cmocka_unit_test(coarse_levels_are_not_stored_many_times),
		cmocka_unit_test(groups_do_not_reach_into_each_other),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include "base/vec.h"
#include "psr/build.h"
#include "sample/pack/cone.h"
#include "sample/pack/visibility_mask.h"
#include "sample/pack/visibility_mask_table.h"
#include "meshes.h"

static const double zero[3];

/* A ball in another that is open above, so that cones do not say all; `blocks` has no masks yet, `mask` has all. */
struct object {
	struct psr_model *model;
	struct psr_blocks blocks;
	struct psr_run *run;
	uint64_t (*mask)[2];
	struct visibility_mask_table table;
};

static uint64_t next_random(uint64_t *state)
{
	*state ^= *state << 13;
	*state ^= *state >> 7;
	*state ^= *state << 17;
	return *state;
}

static void make_object(struct object *o)
{
	struct psr_mesh *mesh = meshes_sphere(48, zero, 1);
	struct psr_build_options options;

	psr_build_options_default(&options);
	options.resolution = 128;
	options.n_threads = 2;
	assert_int_equal(psr_model_build(&o->model, mesh, &options, NULL, NULL), PSR_OK);
	meshes_free(mesh);
	o->blocks = *psr_model_blocks(o->model);
	assert_true(psr_blocks_runs(&o->blocks) > 1);
	o->mask = calloc(o->blocks.n_blocks, sizeof *o->mask);
	o->run = calloc(psr_blocks_runs(&o->blocks), sizeof *o->run);
	memcpy(o->run, o->blocks.run, psr_blocks_runs(&o->blocks) * sizeof *o->run);
	o->blocks.run = o->run;
	memset(&o->table, 0, sizeof o->table);
}

static void share(struct object *o, struct psr_pool *pool)
{
	visibility_mask_table_fini(&o->table);
	assert_int_equal(visibility_mask_table_make(&o->table, &o->blocks, (const uint64_t(*)[2])o->mask, o->run, pool), PSR_OK);
	o->blocks.visibility_index = o->table.index;
	o->blocks.visibility_mask = (const uint64_t(*)[2])o->table.mask;
}

static const uint64_t *stored(const struct object *o, uint32_t block)
{
	uint32_t k = psr_blocks_visibility(&o->blocks, block);

	assert_in_range(k, 0, o->table.n_masks - 1);
	return o->blocks.visibility_mask[k];
}

static void drop_object(struct object *o)
{
	visibility_mask_table_fini(&o->table);
	psr_model_unref(o->model);
	free(o->mask);
	free(o->run);
}

static void stored_masks_have_all_bits_and_are_a_quarter_at_most(void **state)
{
	uint64_t random = 88172645463325252u;
	struct object o;

	(void)state;
	make_object(&o);
	for (uint32_t b = 0; b < o.blocks.n_blocks; b++)
		for (int w = 0; w < 2; w++)
			o.mask[b][w] = next_random(&random) | next_random(&random);
	share(&o, NULL);
	assert_true(o.table.n_masks <= o.blocks.n_blocks / 4 + psr_blocks_runs(&o.blocks));
	for (uint32_t r = 0; r < psr_blocks_runs(&o.blocks); r++) {
		uint32_t left = o.blocks.n_blocks - r * PSR_RUN_BLOCKS, n = left < PSR_RUN_BLOCKS ? left : PSR_RUN_BLOCKS;
		uint32_t end = r + 1 < psr_blocks_runs(&o.blocks) ? o.run[r + 1].visibility_first : o.table.n_masks;

		assert_in_range(end - o.run[r].visibility_first, 1, (n + 3) / 4);
	}
	for (uint32_t b = 0; b < o.blocks.n_blocks; b++)
		assert_true((o.mask[b][0] & ~stored(&o, b)[0]) == 0 && (o.mask[b][1] & ~stored(&o, b)[1]) == 0);
	drop_object(&o);
}

/* Of any eight groups after one, one is of its kind, so that joining costs nothing until there are six in a run. */
static void few_kinds_of_masks_are_stored_as_they_are(void **state)
{
	uint64_t random = 2463534242, kind[6][2];
	struct object o;

	(void)state;
	make_object(&o);
	for (int i = 0; i < 6; i++)
		for (int w = 0; w < 2; w++)
			kind[i][w] = next_random(&random);
	for (uint32_t b = 0; b < o.blocks.n_blocks; b++)
		memcpy(o.mask[b], kind[next_random(&random) % 6], sizeof *o.mask);
	o.blocks.cone_sine = NULL; /* every bit counts */
	share(&o, NULL);
	assert_int_equal(o.table.n_masks, 6 * psr_blocks_runs(&o.blocks));
	for (uint32_t b = 0; b < o.blocks.n_blocks; b++)
		assert_memory_equal(stored(&o, b), o.mask[b], sizeof *o.mask);
	drop_object(&o);
}

static void the_table_does_not_depend_on_threads(void **state)
{
	struct visibility_mask_table first;
	struct psr_pool *pool = NULL;
	struct object o;

	(void)state;
	make_object(&o);
	assert_int_equal(psr_pool_create(&pool, 2, NULL), PSR_OK);
	assert_int_equal(visibility_mask_make(&o.blocks, pool, o.mask), PSR_OK);
	assert_int_equal(visibility_mask_table_make(&first, &o.blocks, (const uint64_t(*)[2])o.mask, o.run, NULL), PSR_OK);
	share(&o, pool);
	assert_int_equal(o.table.n_masks, first.n_masks);
	assert_memory_equal(o.table.mask, first.mask, first.n_masks * sizeof *first.mask);
	assert_memory_equal(o.table.index, first.index, o.blocks.n_blocks);
	visibility_mask_table_fini(&first);
	psr_pool_destroy(pool);
	drop_object(&o);
}

/* What a ball hides of itself its cones tell, too: a mask shared by blocks all around it loses nothing as long as it
 * has the bits that the cone clears. So of the directions from which a block is culled by its mask or its cone, nearly all stay; of
 * those from which its mask culls it, a part goes. */
static void bits_that_a_cone_culls_are_given_away_first(void **state)
{
	uint64_t n_both = 0, n_both_stored = 0, n_mask = 0, n_mask_stored = 0;
	struct object o;

	(void)state;
	make_object(&o);
	assert_int_equal(visibility_mask_make(&o.blocks, NULL, o.mask), PSR_OK);
	share(&o, NULL);
	for (uint32_t b = 0; b < o.blocks.n_blocks; b++) {
		for (unsigned t = 0; t < PSR_MASK_TRIANGLES; t++) {
			double center[3];
			int by_mask = (o.mask[b][t >> 6] >> (t & 63) & 1) == 0, by_stored = (stored(&o, b)[t >> 6] >> (t & 63) & 1) == 0;
			int by_cone;

			psr_direction_center(2, t, center);
			by_cone = cone_culls(&o.blocks, b, (const float[3]){ (float)center[0], (float)center[1], (float)center[2] }, 0);
			assert_true(by_mask || !by_stored);
			n_mask += (uint64_t)by_mask;
			n_mask_stored += (uint64_t)by_stored;
			n_both += (uint64_t)(by_mask || by_cone);
			n_both_stored += (uint64_t)(by_stored || by_cone);
		}
	}
	printf("# masks alone cull %.4f of what they did, with cones %.4f\n", (double)n_mask_stored / (double)n_mask,
	       (double)n_both_stored / (double)n_both);
	assert_true(n_mask - n_mask_stored > 10 * (n_both - n_both_stored));
	drop_object(&o);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(stored_masks_have_all_bits_and_are_a_quarter_at_most),
		cmocka_unit_test(few_kinds_of_masks_are_stored_as_they_are),
		cmocka_unit_test(the_table_does_not_depend_on_threads),
		cmocka_unit_test(bits_that_a_cone_culls_are_given_away_first),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include "base/vec.h"
#include "sample/draft.h"
#include "sample_model.h"

#define RESOLUTION 256 /* levels of 256, 128 and 64 */

static const double zero[3];

static int compare_samples(const void *a, const void *b)
{
	const struct model_sample *x = a, *y = b;

	if (x->level != y->level)
		return x->level < y->level ? -1 : 1;
	if (x->projection != y->projection)
		return x->projection < y->projection ? -1 : 1;
	if (x->row != y->row)
		return x->row < y->row ? -1 : 1;
	if (x->col != y->col)
		return x->col < y->col ? -1 : 1;
	return x->p[2] != y->p[2] ? (x->p[2] < y->p[2] ? -1 : 1) : x->group < y->group ? -1 : x->group > y->group;
}

/* A body that folds over itself, so that groups of its sides share cells. */
static struct psr_mesh *peanut(void)
{
	struct psr_mesh *mesh = meshes_sphere(60, zero, 1);

	for (uint32_t i = 0; i < mesh->n_vertices; i++) {
		double *p = mesh->position[i], waist = 0.15 + 0.85 * p[0] * p[0];

		p[1] *= waist;
		p[2] *= 0.2;
		v3f_set(mesh->normal[i], 0, 0, 0);
	}
	return mesh;
}

static void every_group_has_a_cluster_of_each_level(void **state)
{
	const struct psr_blocks *b = psr_model_blocks(*state);
	uint32_t n_groups = b->n_clusters / b->n_levels;
	uint8_t *has = calloc(b->n_clusters, 1);

	assert_int_equal(b->n_levels, 3);
	assert_true(n_groups > 1);
	assert_int_equal(b->n_clusters, n_groups * b->n_levels);
	for (uint32_t c = 0; c < b->n_clusters; c++) {
		assert_true(b->cluster[c].group < n_groups);
		assert_int_equal(has[b->cluster[c].group] >> b->cluster[c].level & 1, 0);
		has[b->cluster[c].group] |= (uint8_t)(1 << b->cluster[c].level);
		if (b->cluster[c].level == 0)
			assert_in_range(b->cluster[c].n_blocks, 1, 1024);
	}
	free(has);
}

/* Lattice points have one hit a layer, and layers are further apart than the depths of one are off. */
static void fine_samples_are_in_one_group_each(void **state)
{
	const struct psr_blocks *b = psr_model_blocks(*state);
	struct model_sample *list = model_samples(b);

	qsort(list, b->n_samples, sizeof *list, compare_samples);
	for (uint64_t i = 1; i < b->n_samples && list[i].level == 0; i++) {
		const struct model_sample *x = &list[i - 1], *y = &list[i];
		float d[3];

		if (x->projection != y->projection || x->row != y->row || x->col != y->col)
			continue;
		v3f_sub(d, x->p, y->p);
		assert_true(v3f_length(d) > 1e-4f);
	}
	free(list);
}

/* What lies within a pixel of a group's fine samples is in the group, so the nearest coarse sample of all is the
 * nearest one of the group; and there is one, as the coarse level covers the surface (0.96 pixels: sample_dice.c).
 * Depths are those of pieces of blocks 24 steps deep, in 65,536ths. */
static void groups_have_what_is_near_at_each_level(void **state)
{
	const struct psr_blocks *b = psr_model_blocks(*state);
	struct model_sample *list = model_samples(b);

	for (unsigned level = 1; level < b->n_levels; level++) {
		double ds = 2.0 / RESOLUTION * (1u << level);
		struct cover map;

		model_map(&map, list, b->n_samples, level, ds);
		for (uint64_t i = 0; i < b->n_samples; i++) {
			if (list[i].level != 0)
				continue;
			float all = model_nearest(&map, list[i].p, UINT32_MAX), own = model_nearest(&map, list[i].p, list[i].group);

			assert_true((double)all < 0.97 * ds);
			assert_true(own < all + 0.002f * (float)ds);
		}
		cover_fini(&map);
	}
	free(list);
}

/* Nothing is lost or thinned out: the pieces of a coarse level hold more than it has by what they share alone, which
 * is along the borders of groups. */
static void coarse_levels_are_not_stored_many_times(void **state)
{
	const struct psr_blocks *b = psr_model_blocks(*state);
	struct model_sample *list = model_samples(b);

	qsort(list, b->n_samples, sizeof *list, compare_samples);
	for (unsigned level = 1; level < b->n_levels; level++) {
		uint64_t n = 0, n_unlike = 0;

		for (uint64_t i = 0; i < b->n_samples; i++) {
			if (list[i].level != level)
				continue;
			n++;
			n_unlike += i == 0 || list[i - 1].level != level || list[i].projection != list[i - 1].projection
			            || list[i].row != list[i - 1].row || list[i].col != list[i - 1].col
			            || fabsf(list[i].p[2] - list[i - 1].p[2]) > 1e-4f;
		}
		printf("# level %u: %llu samples, stored %.2f times\n", level, (unsigned long long)n_unlike,
		       (double)n / (double)n_unlike);
		assert_true((double)n < 1.5 * (double)n_unlike);
	}
	free(list);
}

static int open_model(void **state)
{
	struct psr_mesh *mesh = peanut();

	*state = model_build(mesh, RESOLUTION);
	meshes_free(mesh);
	return 0;
}

static int close_model(void **state)
{
	psr_model_unref(*state);
	return 0;
}

/* Five layers of 128x128 blocks with a sample each, which make 128 groups: most are near one block of level 7. */
static void a_block_is_shared_by_all_the_groups_around_it(void **state)
{
	static const struct psr_projection projection = { { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } }, 0.0004f };
	const uint32_t n_fine = 5 * 128 * 128;
	struct draft draft = { .n_levels = 8, .projection = &projection, .ds = 0.0004, .n_blocks = n_fine + 1,
		                   .block_capacity = n_fine + 1, .n_samples = n_fine + 64, .sample_capacity = n_fine + 64 };
	float coarse[64][3];
	uint64_t *part;
	uint32_t n_shared = 0;

	(void)state;
	draft.block = calloc(n_fine + 1, sizeof *draft.block);
	draft.sample = calloc(n_fine + 64, sizeof *draft.sample);
	for (uint32_t i = 0; i < n_fine; i++) {
		uint64_t bit = UINT64_C(1) << 36;

		draft.block[i] = (struct draft_block){ .col = (int16_t)(i % 128), .row = (int16_t)(i / 128 % 128), .first = i,
			                                   .mask = bit, .part = bit };
		draft.sample[i].z = 0.04f * (float)(i / (128 * 128)) - 0.08f;
	}
	draft.block[n_fine] = (struct draft_block){ .level = 7, .first = n_fine, .mask = UINT64_MAX, .part = UINT64_MAX };
	for (unsigned s = 0; s < 64; s++)
		draft_position(&draft, &draft.block[n_fine], s, coarse[s]);
	assert_int_equal(draft_group(&draft), PSR_OK);
	part = calloc(draft.n_groups, sizeof *part);
	for (uint32_t i = 0; i < draft.n_blocks; i++) {
		if (draft.block[i].level != 7)
			continue;
		assert_true(part[draft.block[i].group] == 0);
		part[draft.block[i].group] = draft.block[i].part;
	}
	for (uint32_t g = 0; g < draft.n_groups; g++)
		n_shared += part[g] != 0;
	for (uint32_t i = 0; i < draft.n_blocks; i++) {
		float p[3], d[3];

		if (draft.block[i].level != 0)
			continue;
		draft_position(&draft, &draft.block[i], 36, p);
		for (unsigned s = 0; s < 64; s++) {
			v3f_sub(d, coarse[s], p);
			if (v3f_length(d) < 0.999f * 128 * 0.0004f)
				assert_true((part[draft.block[i].group] >> s & 1) == 1);
		}
	}
	printf("# %u of %u groups\n", n_shared, draft.n_groups);
	assert_true(n_shared > 80);
	free(part);
	draft_fini(&draft);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_group_has_a_cluster_of_each_level),
		cmocka_unit_test(fine_samples_are_in_one_group_each),
		cmocka_unit_test(groups_have_what_is_near_at_each_level),
		cmocka_unit_test(coarse_levels_are_not_stored_many_times),
		cmocka_unit_test(a_block_is_shared_by_all_the_groups_around_it),
	};

	return cmocka_run_group_tests(tests, open_model, close_model);
}

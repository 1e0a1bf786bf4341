/* Models of differential points: in memory, in plain and packed files, and what is refused. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include <unistd.h>
#include "../lib/points.h"
#include "base/random.h"
#include "base/vec.h"
#include "fixture.h"
#include "sections.h"
#include "model/file.h"

static struct fixture fixture;
static struct dpoint_set set;    /* whose points have deltas of their own */
static struct dpoint_set shared; /* the same with a delta a group */
static struct dpoint_set leaning; /* the same whose last three groups lean */
static struct psr_model *alone, *with_blocks, *of_shared, *of_leaning;

static void make_shared(void)
{
	struct dpoint_group *group = malloc(set.n_groups * sizeof *group);

	shared = set;
	shared.delta = NULL;
	shared.group = memcpy(group, set.group, set.n_groups * sizeof *group);
	for (uint32_t i = 0; i < set.n_groups; i++)
		group[i].delta[0] = group[i].delta[1] = (uint8_t)(12 + i % 4);
	assert_int_equal(psr_model_create_of(&of_shared, &fixture.info, &(struct psr_model_parts){ .points = &shared }, NULL,
	                                     NULL), PSR_OK);
}

static void make_leaning(void)
{
	struct dpoint_group *group = malloc(shared.n_groups * sizeof *group);
	const struct dpoint_group *first = &shared.group[shared.n_groups - 3];
	struct dpoint_lean *lean;

	leaning = shared;
	leaning.n_lean = shared.n_points - first->first;
	leaning.group = memcpy(group, shared.group, shared.n_groups * sizeof *group);
	leaning.lean = lean = malloc(leaning.n_lean * sizeof *lean);
	for (uint32_t i = 0; i < 3; i++)
		group[shared.n_groups - 1 - i].flags |= DPOINT_LEANING;
	for (uint32_t i = 0; i < leaning.n_lean; i++)
		lean[i] = (struct dpoint_lean){ { (int16_t)(100 * i), (int16_t)(-7 * (int)i) },
			                            { { 0x3f80, 0xbf80 }, { 0, (uint16_t)(0x4000 + i) } } };
	assert_int_equal(psr_model_create_of(&of_leaning, &fixture.info, &(struct psr_model_parts){ .points = &leaning },
	                                     NULL, NULL), PSR_OK);
}

static int setup(void **state)
{
	struct revolved torus;

	(void)state;
	fixture_init(&fixture, 1);
	revolve(&torus, 0.6, 0.3, 0, 9);
	points_of_patch(&set, &torus.patch, 20, POINTS_GREY);
	assert_int_equal(psr_model_create_of(&alone, &fixture.info, &(struct psr_model_parts){ .points = &set },
	                                     &fixture.presets, NULL), PSR_OK);
	assert_int_equal(psr_model_create_of(&with_blocks, &fixture.info,
	                                     &(struct psr_model_parts){ .blocks = &fixture.blocks, .points = &set }, NULL,
	                                     NULL), PSR_OK);
	assert_non_null(set.delta);
	make_shared();
	make_leaning();
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	psr_model_unref(alone);
	psr_model_unref(with_blocks);
	psr_model_unref(of_shared);
	psr_model_unref(of_leaning);
	free((void *)(uintptr_t)shared.group);
	free((void *)(uintptr_t)leaning.group);
	free((void *)(uintptr_t)leaning.lean);
	dpoint_set_fini(&set);
	return 0;
}

static void assert_set(const struct dpoint_set *other, const struct dpoint_set *like)
{
	assert_int_equal(other->n_groups, like->n_groups);
	assert_int_equal(other->n_points, like->n_points);
	assert_true(other->sine == like->sine && other->height == like->height);
	assert_memory_equal(other->group, like->group, like->n_groups * sizeof *like->group);
	assert_memory_equal(other->word, like->word, like->n_points * sizeof *like->word);
	assert_int_equal(other->delta == NULL, like->delta == NULL);
	if (like->delta != NULL)
		assert_memory_equal(other->delta, like->delta, like->n_points * sizeof *like->delta);
	assert_int_equal(other->n_lean, like->n_lean);
	assert_int_equal(other->lean == NULL, like->lean == NULL);
	if (like->lean != NULL)
		assert_memory_equal(other->lean, like->lean, like->n_lean * sizeof *like->lean);
}

static void points_survive_file_map_and_packing(void **state)
{
	char folder[] = "/tmp/psr-model-XXXXXX", path[64];
	struct psr_model *const models[4] = { alone, with_blocks, of_shared, of_leaning };
	const struct dpoint_set *const sets[4] = { &set, &set, &shared, &leaning };

	(void)state;
	assert_non_null(mkdtemp(folder));
	snprintf(path, sizeof path, "%s/a.psr", folder);
	for (int i = 0; i < 4; i++)
		for (int way = 0; way < 4; way++) {
			struct psr_model *model = NULL;
			uint8_t id[16], other[16];
			uint64_t need = 0;

			if (way < 2)
				assert_int_equal(psr_model_write(models[i], path, NULL), PSR_OK);
			else
				assert_int_equal(psr_model_write_packed(models[i], path, NULL), PSR_OK);
			assert_int_equal(way % 2 ? psr_model_map(&model, path, NULL) : psr_model_read(&model, path, NULL), PSR_OK);
			assert_set(psr_model_point_set(model), sets[i]);
			assert_int_equal(psr_model_blocks(model) != NULL, i == 1);
			psr_model_content_id(models[i], id);
			psr_model_content_id(model, other);
			assert_memory_equal(id, other, sizeof id);
			assert_int_equal(psr_model_need(&need, path, 0, NULL), PSR_OK);
			assert_int_equal(need + psr_model_points(model)->n_bytes, psr_model_bytes(model));
			psr_model_unref(model);
			unlink(path);
		}
	rmdir(folder);
}

/* Half of what a step of the arrays is, and what rounding may add. */
static void check_bounds(const struct psr_model *model)
{
	const struct psr_points *points = psr_model_points(model);
	const struct dpoint_set *of = points->set;
	const struct psr_blocks *b = &points->groups;
	uint64_t seed = 5;

	assert_int_equal(b->n_blocks, of->n_groups);
	assert_int_equal(b->n_samples, of->n_points);
	for (uint32_t c = 0, next = 0; c < b->n_clusters; next += b->cluster[c++].n_blocks)
		assert_int_equal(b->cluster[c].first_block, next);
	for (uint32_t i = 0; i < b->n_blocks; i++) {
		const struct dpoint_group *g = &of->group[i];
		const struct psr_cluster *cluster = &b->cluster[i / POINTS_CLUSTER];
		float center[3], radius, axis[3] = { b->cone_x[i], b->cone_y[i], b->cone_z[i] };
		const float sine = b->cone_sine[i] == PSR_CONE_ANY ? 2 : (float)b->cone_sine[i] / 255;

		psr_blocks_sphere(b, i, center, &radius);
		v3f_normalize(axis, axis);
		assert_true(b->mask[i] == (g->n == 64 ? UINT64_MAX : (UINT64_C(1) << g->n) - 1));
		for (uint32_t k = 0; k < g->n; k++) {
			const struct dpoint_limit limit = dpoint_limit_of(of, g, k);
			struct dpoint p;
			float extent[2], v[3];

			dpoint_unpack(&p, &of->word[g->first + k], &g->box);
			dpoint_extent(extent, &p, &limit);
			v3f_cross(v, p.normal, p.u);
			for (int place = 0; place < 20; place++) {
				const float x = extent[0] * (float)random_in(&seed, -1, 1);
				const float y = extent[1] * (float)random_in(&seed, -1, 1);
				const float height = dpoint_quadric_at(p.lambda_u, p.rho, x, y);
				const float slope[3] = { -p.lambda_u * x, -p.lambda_u * p.rho * y, 1 };
				float at[3], away[3], normal[3];

				for (int c = 0; c < 3; c++) {
					at[c] = p.at[c] + x * p.u[c] + y * v[c] + height * p.normal[c];
					normal[c] = slope[0] * p.u[c] + slope[1] * v[c] + slope[2] * p.normal[c];
				}
				v3f_sub(away, at, center);
				assert_true(v3f_length(away) <= radius);
				v3f_sub(away, at, cluster->center);
				assert_true(v3f_length(away) <= cluster->radius);
				v3f_normalize(normal, normal);
				v3f_cross(away, normal, axis);
				assert_true(v3f_length(away) <= sine && (sine == 2 || v3f_dot(normal, axis) > 0));
			}
		}
	}
}

static void spheres_cones_and_clusters_hold_what_is_drawn(void **state)
{
	(void)state;
	check_bounds(alone);
	check_bounds(of_shared);
}

static void what_is_no_set_makes_no_model(void **state)
{
	struct psr_model *model = NULL;
	struct psr_error err;
	struct dpoint_set s = set;
	const struct psr_model_parts parts = { .points = &s }, none = { NULL, NULL, NULL };

	(void)state;
	assert_int_equal(psr_model_create_of(&model, &fixture.info, &none, NULL, &err), PSR_ERR_ARG);
	s.word = NULL;
	assert_int_equal(psr_model_create_of(&model, &fixture.info, &parts, NULL, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "section DWRD is missing"));
	s = set;
	s.n_groups = MODEL_MAX_BLOCKS + 1;
	assert_int_equal(psr_model_create_of(&model, &fixture.info, &parts, NULL, &err), PSR_ERR_FORMAT);
	s = set;
	s.sine = 1.5f;
	assert_int_equal(psr_model_create_of(&model, &fixture.info, &parts, NULL, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "section DPNT: the sine 1.5"));
	assert_null(model);
}

/* ---- files ---- */

struct edit {
	const char *section;
	int at, size;
	uint64_t value;
	const char *text;
};

static void check_edits(const struct psr_model *of, const struct edit *edit, size_t n_edits)
{
	for (size_t i = 0; i < n_edits; i++) {
		struct psr_model *model = NULL;
		struct psr_error err = { 0 };
		size_t n;
		uint8_t *copy = copy_of(of, &n);

		file_put(copy + file_get(entry_of(copy, edit[i].section) + ENTRY_OFFSET, 8) + edit[i].at, edit[i].size,
		         edit[i].value);
		file_seal(copy, n);
		assert_int_equal(psr_model_parse(&model, copy, n, &err), PSR_ERR_FORMAT);
		if (strstr(err.text, edit[i].text) == NULL)
			fail_msg("edit %zu: %s", i, err.text);
		free(copy);
	}
}

static void lies_are_refused(void **state)
{
	static const struct edit own[] = {
		{ "DPNT", 0, 4, 0, "section DPNT: 0 groups" },
		{ "DPNT", 0, 4, UINT32_MAX, "section DPNT: 4294967295 groups" },
		{ "DPNT", 0, 4, 1, "points do not fit 1 groups" },
		{ "DPNT", 4, 4, 1, "section DPNT: 1 points do not fit" },
		{ "DPNT", 8, 4, 0, "section DPNT: the sine 0" },
		{ "DPNT", 8, 4, 0x7fc00000, "section DPNT: the sine nan" },
		{ "DPNT", 8, 4, 0x40000000, "section DPNT: the sine 2" },
		{ "DPNT", 12, 4, 0x7f800000, "or the height inf" },
		{ "DPNT", 12, 4, 0xbf800000, "or the height -1" },
		{ "DGRP", 32 + 0, 4, 0x7fc00000, "section DGRP: the box of group 1 begins at nan" },
		{ "DGRP", 32 + 4, 4, 0x40400000, "section DGRP: the box of group 1 begins at 3" },
		{ "DGRP", 32 + 12, 4, 0xbf800000, "section DGRP: the box of group 1 begins at" },
		{ "DGRP", 32 + 16, 4, 0x3f800000, "section DGRP: the points of group 1 reach further than 2" },
		{ "DGRP", 24, 4, 1, "section DGRP: group 0 has" },
		{ "DGRP", 28, 1, 0, "section DGRP: group 0 has 0 points from 0 on" },
		{ "DGRP", 28, 1, 65, "section DGRP: group 0 has 65 points" },
		{ "DGRP", 29, 1, 63, "section DGRP: group 0 has deltas of classes 63 and 255" },
		{ "DGRP", 30, 1, 64, "section DGRP: group 0 has deltas of classes 255 and 64" },
		{ "DDLT", 0, 1, 64, "section DDLT: point 0 has deltas of classes 64" },
		{ "DDLT", 2 * 3 + 1, 1, 255, "section DDLT: point 3 has deltas of classes" },
		{ "DGRP", 31, 1, 4, "and flags 4" },
		{ "DGRP", 31, 1, 2, "section DGRP: group 0 of point 0 has flags 2; the last 0 of" },
		{ "DWRD", 16 * 3, 8, UINT64_MAX, "section DWRD: the curvatures of point 3" },
		{ "DWRD", 16 * 3, 8, (uint64_t)128 << 49, "section DWRD: the curvatures of point 3" },
	};
	static const struct edit of_groups[] = {
		{ "DGRP", 29, 1, 64, "section DGRP: group 0 has deltas of classes 64" },
		{ "DGRP", 30, 1, 255, "and 255, and flags 0" },
	};

	static const struct edit of_leans[] = {
		{ "DLEN", 4, 2, 0x7f80, "section DLEN: the lean of point 0 grows by inf" },
		{ "DLEN", 12 + 10, 2, 0x7fc0, "section DLEN: the lean of point 1 grows by nan" },
		{ "DLEN", 6, 2, 0xc981, "section DLEN: the lean of point 0 grows by -1.05677e+06" },
		{ "DGRP", 31, 1, 2, "section DGRP: group 0 of point 0 has flags 2; the last" },
	};
	const struct edit last = { "DGRP", 32 * (leaning.n_groups - 1) + 31, 1, 0, " has flags 0; the last" };

	(void)state;
	check_edits(alone, own, sizeof own / sizeof own[0]);
	check_edits(of_shared, of_groups, sizeof of_groups / sizeof of_groups[0]);
	check_edits(of_leaning, of_leans, sizeof of_leans / sizeof of_leans[0]);
	check_edits(of_leaning, &last, 1);
}

/* A section's name spoilt is a section that this build does not know. */
static void a_set_of_sections_is_whole(void **state)
{
	static const char types[3][5] = { "DPNT", "DGRP", "DWRD" };

	(void)state;
	for (int i = 0; i < 3; i++)
		for (int k = 0; k < 2; k++) {
			struct psr_model *model = NULL;
			struct psr_error err = { 0 };
			size_t n;
			uint8_t *copy = copy_of(k ? with_blocks : alone, &n);

			memcpy(entry_of(copy, types[i]), "GONE", 4);
			file_seal(copy, n);
			assert_int_equal(psr_model_parse(&model, copy, n, &err),
			                 i == 0 && k == 0 ? PSR_ERR_UNSUPPORTED : PSR_ERR_FORMAT);
			assert_non_null(strstr(err.text, types[i]));
			free(copy);
		}
}

/* What a psr of 6.4 does: it must not draw points as wide as some group's delta. */
static void points_without_their_deltas_are_refused(void **state)
{
	struct psr_model *model = NULL;
	struct psr_error err = { 0 };
	size_t n;
	uint8_t *copy = copy_of(alone, &n);

	(void)state;
	memcpy(entry_of(copy, "DDLT"), "ZZZ1", 4);
	file_seal(copy, n);
	assert_int_equal(psr_model_parse(&model, copy, n, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "section DGRP: group 0 has deltas of classes 255 and 255"));
	free(copy);
	copy = copy_of(with_blocks, &n);
	memcpy(entry_of(copy, "DPNT"), "ZZZ1", 4);
	memcpy(entry_of(copy, "DGRP"), "ZZZ2", 4);
	memcpy(entry_of(copy, "DWRD"), "ZZZ3", 4);
	file_seal(copy, n);
	assert_int_equal(psr_model_parse(&model, copy, n, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "section DDLT is there, and DPNT, which tells its length, is missing"));
	free(copy);
	copy = copy_of(of_shared, &n);
	assert_int_equal(file_get(copy + HEADER_MINOR, 2), FILE_MINOR_POINTS);
	free(copy);
}

/* What a psr of 6.7 does, but that it names the flags: faces would be shaded flat. */
static void leaning_points_without_their_leans_are_refused(void **state)
{
	struct psr_model *model = NULL;
	struct psr_error err = { 0 };
	size_t n;
	uint8_t *copy = copy_of(of_leaning, &n);

	(void)state;
	assert_int_equal(file_get(copy + HEADER_MINOR, 2), FILE_MINOR_POINT_LEAN);
	memcpy(entry_of(copy, "DLEN"), "ZZZ1", 4);
	file_seal(copy, n);
	assert_int_equal(psr_model_parse(&model, copy, n, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "has flags 2; the last 0 of"));
	free(copy);
	copy = copy_of(of_leaning, &n);
	file_put(entry_of(copy, "DLEN") + ENTRY_LENGTH, 8, 12 * (uint64_t)leaning.n_lean - 1);
	file_seal(copy, n);
	assert_int_equal(psr_model_parse(&model, copy, n, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "section DLEN"));
	free(copy);
}

/* An older psr, which knows none of these sections, reads the blocks. */
static void sections_of_points_are_not_required(void **state)
{
	struct psr_model *model = NULL;
	size_t n;
	uint8_t *copy = copy_of(with_blocks, &n);

	(void)state;
	assert_int_equal(file_get(copy + HEADER_MINOR, 2), FILE_MINOR_OFF);
	memcpy(entry_of(copy, "DPNT"), "ZZZ1", 4);
	memcpy(entry_of(copy, "DGRP"), "ZZZ2", 4);
	memcpy(entry_of(copy, "DWRD"), "ZZZ3", 4);
	memcpy(entry_of(copy, "DDLT"), "ZZZ4", 4);
	file_seal(copy, n);
	assert_int_equal(psr_model_parse(&model, copy, n, NULL), PSR_OK);
	assert_null(psr_model_points(model));
	assert_null(psr_model_point_set(model));
	assert_int_equal(psr_model_blocks(model)->n_blocks, FIXTURE_BLOCKS);
	psr_model_unref(model);
	free(copy);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(points_survive_file_map_and_packing),
		cmocka_unit_test(spheres_cones_and_clusters_hold_what_is_drawn),
		cmocka_unit_test(what_is_no_set_makes_no_model),
		cmocka_unit_test(lies_are_refused),
		cmocka_unit_test(a_set_of_sections_is_whole),
		cmocka_unit_test(points_without_their_deltas_are_refused),
		cmocka_unit_test(leaning_points_without_their_leans_are_refused),
		cmocka_unit_test(sections_of_points_are_not_required),
	};

	return cmocka_run_group_tests(tests, setup, teardown);
}

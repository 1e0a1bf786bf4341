/* Models of octrees: in memory, in plain files, and what is refused. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include <unistd.h>
#include "model/cubes.h"
#include "model/file.h"
#include "../octree/leaves.h"
#include "fixture.h"
#include "sections.h"
#include "tests/unit/lib/threads.h"

#define LEVELS 7

static struct fixture fixture;
static struct octree *tree;
static struct psr_model *alone, *both;

static int setup(void **state)
{
	struct leaves leaves = leaves_of_sphere(LEVELS);
	uint64_t random = 7;

	(void)state;
	fixture_init(&fixture, 1);
	tree = leaves_to_tree(&leaves, LEVELS);
	free(leaves.path);
	tree->low[0] = tree->low[1] = tree->low[2] = -1;
	tree->edge = 2;
	tree->is_one_sided = 1;
	tree->normal = malloc(tree->n_leaves * sizeof *tree->normal);
	tree->offset = malloc(tree->n_leaves);
	tree->color = malloc(tree->n_leaves * sizeof *tree->color);
	tree->material = malloc(tree->n_leaves * sizeof *tree->material);
	tree->scan.intensity = malloc(tree->n_leaves * sizeof *tree->scan.intensity);
	tree->scan.class = malloc(tree->n_leaves);
	tree->scan.returns = malloc(tree->n_leaves);
	tree->scan.time = malloc(tree->n_leaves * sizeof *tree->scan.time);
	tree->scan.time_scale = malloc(sizeof *tree->scan.time_scale);
	(*tree->scan.time_scale)[0] = 3e8;
	(*tree->scan.time_scale)[1] = 1e-5;
	tree->lean = malloc(OCTREE_LEAN_CELLS);
	for (int i = 0; i < OCTREE_LEAN_CELLS; i++)
		tree->lean[i] = (uint8_t)fixture_random(&random);
	for (uint64_t i = 0; i < tree->n_leaves; i++) {
		tree->normal[i] = (uint16_t)(fixture_random(&random) & 0x7fff);
		tree->offset[i] = (uint8_t)(fixture_random(&random) % OCTREE_OFFSETS);
		for (int c = 0; c < 3; c++)
			tree->color[i][c] = (uint8_t)fixture_random(&random);
		octree_put_material(tree->material[i], (uint32_t)fixture_random(&random));
		tree->scan.intensity[i] = (uint16_t)fixture_random(&random);
		tree->scan.class[i] = (uint8_t)fixture_random(&random);
		tree->scan.returns[i] = (uint8_t)fixture_random(&random);
		tree->scan.time[i] = (uint32_t)fixture_random(&random);
	}
	assert_int_equal(psr_model_create_octree(&alone, &fixture.info, tree, &fixture.presets, NULL), PSR_OK);
	assert_int_equal(psr_model_create_both(&both, &fixture.info, &fixture.blocks, tree, NULL, NULL), PSR_OK);
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	psr_model_unref(alone);
	psr_model_unref(both);
	octree_destroy(tree);
	return 0;
}

static void assert_tree(const struct octree *t)
{
	assert_int_equal(t->levels, tree->levels);
	assert_int_equal(t->is_one_sided, 1);
	assert_memory_equal(t->low, tree->low, sizeof tree->low);
	assert_memory_equal(&t->edge, &tree->edge, sizeof tree->edge);
	assert_int_equal(t->n_codes, tree->n_codes);
	assert_int_equal(t->n_leaves, tree->n_leaves);
	assert_int_equal(t->n_skips, tree->n_skips);
	assert_memory_equal(t->code, tree->code, tree->n_codes);
	assert_memory_equal(t->skip, tree->skip, tree->n_skips * sizeof *tree->skip);
	assert_memory_equal(t->normal, tree->normal, tree->n_leaves * sizeof *tree->normal);
	assert_memory_equal(t->offset, tree->offset, tree->n_leaves);
	assert_memory_equal(t->lean, tree->lean, OCTREE_LEAN_CELLS);
	assert_memory_equal(t->color, tree->color, tree->n_leaves * sizeof *tree->color);
	assert_memory_equal(t->material, tree->material, tree->n_leaves * sizeof *tree->material);
	assert_memory_equal(t->scan.intensity, tree->scan.intensity, tree->n_leaves * sizeof *tree->scan.intensity);
	assert_memory_equal(t->scan.class, tree->scan.class, tree->n_leaves);
	assert_memory_equal(t->scan.returns, tree->scan.returns, tree->n_leaves);
	assert_memory_equal(t->scan.time, tree->scan.time, tree->n_leaves * sizeof *tree->scan.time);
	assert_memory_equal(t->scan.time_scale, tree->scan.time_scale, sizeof *tree->scan.time_scale);
	assert_int_equal(octree_check(t, NULL, NULL), PSR_OK);
}

static void a_model_holds_blocks_or_an_octree_or_both(void **state)
{
	struct psr_model *blocks = NULL;

	(void)state;
	assert_int_equal(psr_model_create(&blocks, &fixture.info, &fixture.blocks, NULL, NULL), PSR_OK);
	assert_non_null(psr_model_blocks(blocks));
	assert_null(psr_model_octree(blocks));
	assert_null(psr_model_blocks(alone));
	assert_tree(psr_model_octree(alone));
	assert_int_equal(psr_model_presets(alone)->n_lights, 3);
	assert_tree(psr_model_octree(both));
	assert_int_equal(psr_model_blocks(both)->n_blocks, FIXTURE_BLOCKS);
	assert_memory_equal(psr_model_blocks(both)->attr, fixture.attr, sizeof fixture.attr);
	psr_model_unref(blocks);
}

static void octrees_survive_file_map_and_packing(void **state)
{
	char folder[] = "/tmp/psr-model-XXXXXX", path[64];
	struct psr_model *const models[2] = { alone, both };

	(void)state;
	assert_non_null(mkdtemp(folder));
	snprintf(path, sizeof path, "%s/a.psr", folder);
	for (int i = 0; i < 2; i++)
		for (int way = 0; way < 4; way++) {
			struct psr_model *model = NULL;
			uint8_t id[16], other[16];
			uint64_t need = 0;

			if (way < 2)
				assert_int_equal(psr_model_write(models[i], path, NULL), PSR_OK);
			else
				assert_int_equal(psr_model_write_packed(models[i], path, NULL), PSR_OK);
			assert_int_equal(way % 2 ? psr_model_map(&model, path, NULL) : psr_model_read(&model, path, NULL), PSR_OK);
			assert_tree(psr_model_octree(model));
			assert_int_equal(psr_model_blocks(model) != NULL, i == 1);
			psr_model_content_id(models[i], id);
			psr_model_content_id(model, other);
			assert_memory_equal(id, other, sizeof id);
			assert_int_equal(psr_model_need(&need, path, 0, NULL), PSR_OK);
			/* Nobody has drawn it yet. */
			assert_null(psr_model_cubes(model));
			const uint64_t opened = psr_model_bytes(model);
			assert_true(opened < need);
			assert_int_equal(psr_model_make_cubes(model, NULL), PSR_OK);
			assert_int_equal(psr_model_bytes(model), opened + psr_model_cubes(model)->n_bytes);
			assert_true(need > psr_model_bytes(model) * 9 / 10 && need < psr_model_bytes(model) * 11 / 10);
			psr_model_unref(model);
			unlink(path);
		}
	rmdir(folder);
}

static void ask_for_cubes(int i, void *userdata)
{
	const struct psr_cubes **found = userdata;

	assert_int_equal(psr_model_make_cubes(alone, NULL), PSR_OK);
	found[i] = psr_model_cubes(alone);
}

static void threads_that_ask_for_cubes_get_the_same(void **state)
{
	const struct psr_cubes *found[16] = { NULL };
	struct psr_pool *pool;

	(void)state;
	assert_int_equal(psr_pool_create(&pool, 4, NULL), PSR_OK);
	psr_pool_for(pool, 16, ask_for_cubes, found);
	for (int i = 0; i < 16; i++)
		assert_true(found[i] != NULL && found[i] == found[0]);
	psr_pool_destroy(pool);
	/* A model without an octree has none. */
	struct psr_model *blocks = NULL;
	assert_int_equal(psr_model_create(&blocks, &fixture.info, &fixture.blocks, NULL, NULL), PSR_OK);
	assert_int_equal(psr_model_make_cubes(blocks, NULL), PSR_OK);
	assert_null(psr_model_cubes(blocks));
	psr_model_unref(blocks);
}

static void attributes_may_be_missing(void **state)
{
	struct octree bare = *tree;
	struct psr_model *model = NULL;

	(void)state;
	bare.normal = NULL;
	bare.offset = NULL;
	bare.color = NULL;
	bare.material = NULL;
	bare.scan = (struct octree_scan){ NULL };
	assert_int_equal(psr_model_create_octree(&model, &fixture.info, &bare, NULL, NULL), PSR_OK);
	assert_null(psr_model_octree(model)->normal);
	assert_null(psr_model_octree(model)->offset);
	assert_null(psr_model_octree(model)->color);
	assert_null(psr_model_octree(model)->material);
	assert_int_equal(octree_material(psr_model_octree(model), 7), OCTREE_MATTE);
	assert_null(psr_model_octree(model)->scan.intensity);
	psr_model_unref(model);
}

/* It takes a section of three bytes, in plain files and packed ones. */
static void one_material_of_all_leaves_is_there_once(void **state)
{
	uint8_t material[1][3];
	struct octree t = *tree;
	struct psr_model *model = NULL, *bare = NULL, *again = NULL;
	struct psr_error err = { 0 };
	size_t n, n_bare;

	(void)state;
	octree_put_material(material[0], 0x1234bf);
	t.material = NULL;
	t.lean = NULL;
	t.scan = (struct octree_scan){ NULL };
	assert_int_equal(psr_model_create_octree(&bare, &fixture.info, &t, NULL, NULL), PSR_OK);
	t.one_material = material;
	assert_int_equal(psr_model_create_octree(&model, &fixture.info, &t, NULL, NULL), PSR_OK);
	model_image(bare, &n_bare);
	uint8_t *copy = copy_of(model, &n);
	/* The hashes of chunks may take up what a longer table would. */
	assert_in_range(n - n_bare, FILE_ALIGNMENT, 2 * FILE_ALIGNMENT);
	assert_int_equal(file_get(copy + HEADER_MINOR, 2), FILE_MINOR_MATERIAL);
	for (uint64_t i = 0; i < t.n_leaves; i += 100)
		assert_int_equal(octree_material(psr_model_octree(model), i), 0x1234bf);
	/* Packed, and its beginnings, too. */
	assert_int_equal(psr_model_write_packed(model, "/tmp/psr-one-material.psr", NULL), PSR_OK);
	assert_int_equal(psr_model_read(&again, "/tmp/psr-one-material.psr", NULL), PSR_OK);
	unlink("/tmp/psr-one-material.psr");
	assert_int_equal(octree_material(psr_model_octree(again), 5), 0x1234bf);
	psr_model_unref(again);
	again = NULL;
	/* A tree has one, or one of each. */
	t.material = tree->material;
	assert_int_equal(psr_model_create_octree(&again, &fixture.info, &t, NULL, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "section OMT1: it has one material of all leaves, and section OMAT one of each"));
	memcpy(entry_of(copy, "OCTR"), "GONE", 4);
	file_seal(copy, n);
	assert_true(psr_model_parse(&again, copy, n, &err) != PSR_OK);
	free(copy);
	psr_model_unref(model);
	psr_model_unref(bare);
}

static void what_is_no_octree_makes_no_model(void **state)
{
	struct psr_model *model = NULL;
	struct psr_error err;
	struct octree t = *tree;

	(void)state;
	assert_int_equal(psr_model_create_octree(&model, &fixture.info, NULL, NULL, &err), PSR_ERR_ARG);
	assert_int_equal(psr_model_create_both(&model, &fixture.info, NULL, NULL, NULL, &err), PSR_ERR_ARG);
	t.code = NULL;
	assert_int_equal(psr_model_create_octree(&model, &fixture.info, &t, NULL, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "section OCOD is missing"));
	t = *tree;
	t.skip = NULL;
	assert_int_equal(psr_model_create_octree(&model, &fixture.info, &t, NULL, &err), PSR_ERR_ARG);
	t = *tree;
	t.n_leaves = MODEL_MAX_LEAVES + 1;
	assert_int_equal(psr_model_create_octree(&model, &fixture.info, &t, NULL, &err), PSR_ERR_LIMIT);
	t = *tree;
	t.edge = 2000;
	assert_int_equal(psr_model_create_octree(&model, &fixture.info, &t, NULL, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "section OCTR: the cube at -1,-1,-1 of edge 2000 reaches beyond 1024"));
	assert_null(model);
}

/* ---- files ---- */

static void lies_in_sections_of_octrees_are_refused(void **state)
{
	static const struct {
		const char *section;
		int at, size;
		uint64_t value;
		int code;
		const char *text;
	} edits[] = {
		{ "OCTR", 0, 4, 1, PSR_ERR_FORMAT, "section OCTR: it says less than 2 levels" },
		{ "OCTR", 0, 4, UINT32_MAX, PSR_ERR_FORMAT, "section OCTR: it says more than 20 levels" },
		{ "OCTR", 0, 4, LEVELS + 1, PSR_ERR_FORMAT, "section OCOD: an octree's" },
		{ "OCTR", 4, 4, 4, PSR_ERR_FORMAT, "section OCTR: its flags" },
		{ "OCTR", 8, 8, 0x7ff8000000000000u, PSR_ERR_FORMAT, "section OCTR: the cube at nan" },
		{ "OCTR", 24, 8, 0xc0a0000000000000u, PSR_ERR_FORMAT, "section OCTR: the cube at -1,-1,-2048" },
		{ "OCTR", 32, 8, 0, PSR_ERR_FORMAT, "section OCTR: the cube's edge is 0" },
		{ "OCTR", 32, 8, 0x7ff0000000000000u, PSR_ERR_FORMAT, "section OCTR: the cube at" },
		{ "OCTR", 40, 8, 0, PSR_ERR_FORMAT, "section OCTR: 0 codes" },
		{ "OCTR", 40, 8, UINT64_MAX, PSR_ERR_FORMAT, "codes do not fit" },
		{ "OCTR", 40, 8, 1, PSR_ERR_FORMAT, "a skip index of" },
		{ "OCTR", 48, 8, 0, PSR_ERR_FORMAT, "section OCTR: 0 leaves" },
		{ "OCTR", 48, 8, UINT64_MAX, PSR_ERR_FORMAT, "leaves; it must be 1 to 4294967296" },
		{ "OCTR", 48, 8, 40000, PSR_ERR_FORMAT, "section ONRM at byte" },
		{ "OCTR", 56, 8, 0, PSR_ERR_FORMAT, "a skip index of 0 entries" },
		{ "OCTR", 56, 8, 1, PSR_ERR_FORMAT, "section OSKP at byte" },
		{ "OCOD", 0, 1, 0, PSR_ERR_FORMAT, "section OCOD: an octree's codes contain 0" },
		{ "OCOD", 300, 1, 0, PSR_ERR_FORMAT, "section OCOD: an octree's" },
		{ "OCOD", 300, 1, 255, PSR_ERR_FORMAT, "section OCOD: an octree's" },
		{ "OSKP", 0, 8, 1, PSR_ERR_FORMAT, "skip index does not fit its codes" },
		{ "OSKP", 32, 8, UINT64_MAX, PSR_ERR_FORMAT, "skip index does not fit its codes" },
		{ "ONRM", 20, 2, 32768, PSR_ERR_FORMAT, "section ONRM: the normal of leaf 10 is 32768" },
		{ "OOFF", 11, 1, OCTREE_OFFSETS, PSR_ERR_FORMAT, "section OOFF: the offset of leaf 11 is 4" },
		{ "OTSC", 0, 8, 0x7ff8000000000000u, PSR_ERR_FORMAT, "section OTSC: times from nan" },
		{ "OTSC", 8, 8, 0xbff0000000000000u, PSR_ERR_FORMAT, "section OTSC: times from 3e+08 in steps of -1" },
		{ "OTSC", 8, 8, 0x7fe0000000000000u, PSR_ERR_FORMAT, "section OTSC: times from" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof edits / sizeof edits[0]; i++) {
		struct psr_model *model = NULL;
		struct psr_error err = { 0 };
		size_t n;
		uint8_t *copy = copy_of(alone, &n);

		file_put(copy + file_get(entry_of(copy, edits[i].section) + ENTRY_OFFSET, 8) + edits[i].at, edits[i].size,
		         edits[i].value);
		file_seal(copy, n);
		assert_int_equal(psr_model_parse(&model, copy, n, &err), edits[i].code);
		if (strstr(err.text, edits[i].text) == NULL)
			fail_msg("edit %zu: %s", i, err.text);
		free(copy);
	}
}

static void a_set_of_sections_is_whole(void **state)
{
	static const char types[][5] = { "OCTR", "OSKP", "OCOD", "OTIM", "OTSC", "ONRM",
		                             "OOFF", "OCOL", "OMAT", "OINT", "OCLS", "ORET" };

	(void)state;
	for (int i = 0; i < (int)(sizeof types / sizeof *types); i++)
		for (int with_blocks = 0; with_blocks < 2; with_blocks++) {
			struct psr_model *model = NULL;
			struct psr_error err = { 0 };
			size_t n;
			uint8_t *copy = copy_of(with_blocks ? both : alone, &n);
			const int expected = i > 4 ? PSR_OK : i == 0 && !with_blocks ? PSR_ERR_UNSUPPORTED : PSR_ERR_FORMAT;

			memcpy(entry_of(copy, types[i]), "GONE", 4);
			file_seal(copy, n);
			assert_int_equal(psr_model_parse(&model, copy, n, &err), expected);
			if (i > 0 && i <= 4)
				assert_non_null(strstr(err.text, types[i]));
			else if (i == 0)
				assert_non_null(strstr(err.text, with_blocks ? "OCTR, which tells its length, is missing" : "none of the sections"));
			psr_model_unref(model);
			free(copy);
		}
}

/* An older psr, which knows none of these sections, reads the blocks. */
static void sections_of_octrees_are_not_required(void **state)
{
	size_t n;
	uint8_t *copy = copy_of(both, &n);

	(void)state;
	for (uint32_t i = 0; i < file_get(copy + HEADER_N_SECTIONS, 4); i++) {
		const uint8_t *entry = copy + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;

		if (entry[0] == 'O' && memcmp(entry, "OPAC", 4) != 0)
			assert_int_equal(file_get(entry + ENTRY_FLAGS, 2), 0);
	}
	assert_int_equal(file_get(copy + HEADER_MAJOR, 2), 6);
	assert_int_equal(file_get(copy + HEADER_MINOR, 2), FILE_MINOR_LEAN);
	free(copy);
}

static void a_file_cut_at_any_place_is_refused(void **state)
{
	size_t n;
	uint8_t *copy = copy_of(alone, &n);

	(void)state;
	for (size_t i = 0; i < n; i += i < 1024 || i + 512 > n ? 1 : 97) {
		struct psr_model *model = NULL;
		struct psr_error err = { 0 };

		assert_int_equal(psr_model_parse(&model, copy, i, &err), PSR_ERR_FORMAT);
		assert_true(err.text[0] != 0);
	}
	free(copy);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_model_holds_blocks_or_an_octree_or_both),
		cmocka_unit_test(octrees_survive_file_map_and_packing),
		cmocka_unit_test(threads_that_ask_for_cubes_get_the_same),
		cmocka_unit_test(attributes_may_be_missing),
		cmocka_unit_test(one_material_of_all_leaves_is_there_once),
		cmocka_unit_test(what_is_no_octree_makes_no_model),
		cmocka_unit_test(lies_in_sections_of_octrees_are_refused),
		cmocka_unit_test(a_set_of_sections_is_whole),
		cmocka_unit_test(sections_of_octrees_are_not_required),
		cmocka_unit_test(a_file_cut_at_any_place_is_refused),
	};

	only_threads_under_tsan();
	return cmocka_run_group_tests(tests, setup, teardown);
}

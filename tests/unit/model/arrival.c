/* Files as they arrive: what is checked when, and what is not believed. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/mem.h"
#include "base/random.h"
#include "model/arrival.h"
#include "model/pack.h"
#include "../octree/leaves.h"
#include "fixture.h"

#define LEVELS 7

static struct fixture fixture;
/* A plain file; one packed by zstd; one of an octree, packed; one of an octree with a scan. */
static struct {
	uint8_t *bytes;
	size_t n;
} files[4];

static void keep(int i, const uint8_t *bytes, size_t n)
{
	files[i].bytes = malloc(n);
	files[i].n = n;
	assert_non_null(files[i].bytes);
	memcpy(files[i].bytes, bytes, n);
}

static int setup(void **state)
{
	struct leaves leaves = leaves_of_sphere(LEVELS);
	struct octree *tree = leaves_to_tree(&leaves, LEVELS);
	struct psr_model *octree, *blocks;
	const uint8_t *image;
	uint8_t *bytes;
	size_t n, n_image, capacity;

	(void)state;
	free(leaves.path);
	fixture_init(&fixture, 1);
	assert_true(tree != NULL && leaves_dress(tree, 15));
	assert_int_equal(psr_model_create_octree(&octree, &fixture.info, tree, &fixture.presets, NULL), PSR_OK);
	assert_int_equal(psr_model_create(&blocks, &fixture.info, &fixture.blocks, NULL, NULL), PSR_OK);
	image = model_image(octree, &n_image);
	keep(0, image, n_image);
	assert_int_equal(pack_image(&bytes, &n, &capacity, image, n_image, NULL), PSR_OK);
	keep(2, bytes, n);
	psr_free_huge(bytes, capacity);
	psr_model_unref(octree);
	tree->scan.returns = calloc(tree->n_leaves, 1);
	assert_non_null(tree->scan.returns);
	for (uint64_t i = 0; i < tree->n_leaves; i++)
		tree->scan.returns[i] = (uint8_t)(i * i >> 5);
	assert_int_equal(psr_model_create_octree(&octree, &fixture.info, tree, &fixture.presets, NULL), PSR_OK);
	octree_destroy(tree);
	image = model_image(octree, &n_image);
	assert_int_equal(pack_image(&bytes, &n, &capacity, image, n_image, NULL), PSR_OK);
	keep(3, bytes, n);
	psr_free_huge(bytes, capacity);
	image = model_image(blocks, &n_image);
	assert_int_equal(pack_image(&bytes, &n, &capacity, image, n_image, NULL), PSR_OK);
	keep(1, bytes, n);
	psr_free_huge(bytes, capacity);
	psr_model_unref(octree);
	psr_model_unref(blocks);
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	for (int i = 0; i < 4; i++)
		free(files[i].bytes);
	return 0;
}

static struct arrival *make(void)
{
	struct arrival *arrival;

	assert_int_equal(arrival_create(&arrival), PSR_OK);
	return arrival;
}

static void a_file_is_checked_in_any_pieces(void **state)
{
	static const size_t most[] = { 1, 7, 1000, 100000, SIZE_MAX };
	uint64_t random = 5;

	(void)state;
	for (int i = 0; i < 4; i++)
		for (size_t k = 0; k < sizeof most / sizeof most[0]; k++) {
			struct arrival *arrival = make();
			const struct arrival_facts *facts = arrival_facts(arrival);

			for (size_t at = 0; at < files[i].n;) {
				const size_t left = files[i].n - at, some = most[k] == 1 ? 1 : 1 + (size_t)random_next(&random) % most[k];
				const size_t n = some < left ? some : left;

				assert_int_equal(arrival_take(arrival, files[i].bytes + at, n, NULL), PSR_OK);
				at += n;
				assert_int_equal(facts->n_taken, at);
				assert_true(facts->n_checked <= at);
			}
			assert_int_equal(facts->n_checked, files[i].n);
			assert_int_equal(facts->n_file, files[i].n);
			assert_int_equal(facts->hash, file_get(files[i].bytes + HEADER_HASH, 8));
			assert_int_equal(facts->has_steps, i >= 2);
			assert_int_equal(facts->n_steps > 0, i >= 2);
			assert_int_equal(arrival_take(arrival, files[i].bytes, 1, NULL), PSR_ERR_FORMAT);
			arrival_destroy(arrival);
		}
}

static void the_end_of_a_step_is_that_of_a_model(void **state)
{
	(void)state;
	for (int i = 2; i < 4; i++) {
		struct arrival *arrival = make();
		const struct arrival_facts *facts = arrival_facts(arrival);

		assert_int_equal(arrival_take(arrival, files[i].bytes, files[i].n, NULL), PSR_OK);
		assert_true(facts->n_steps > 1);
		assert_int_equal(facts->step[facts->n_steps - 1].end, files[i].n);
		for (int s = 0; s < facts->n_steps; s++) {
			struct psr_model_prefix prefix;
			struct psr_model *model;

			assert_int_equal(psr_model_parse(&model, files[i].bytes, facts->step[s].end, NULL), PSR_OK);
			assert_int_equal(psr_model_octree(model)->levels, facts->step[s].depth);
			assert_int_equal(psr_model_octree(model)->n_leaves, facts->step[s].n_leaves);
			assert_int_equal(psr_model_is_prefix(model, &prefix), s < facts->n_steps - 1);
			psr_model_unref(model);
		}
		arrival_destroy(arrival);
	}
}

/* Whatever byte is wrong: what is called checked is right, and after a rewind the right bytes go on. */
static void a_wrong_byte_is_noticed_and_the_right_one_taken(void **state)
{
	(void)state;
	for (int i = 0; i < 4; i++)
		for (size_t wrong = 0; wrong < files[i].n; wrong += wrong < 300 ? 1 : files[i].n / 97 + 1) {
			struct arrival *arrival = make();
			const struct arrival_facts *facts = arrival_facts(arrival);
			struct psr_error err = { .text = "" };
			uint64_t checked;
			int code;

			/* The header's length of what follows may become greater; then bytes are missing. */
			files[i].bytes[wrong] ^= 1;
			code = arrival_take(arrival, files[i].bytes, files[i].n, &err);
			assert_true((code != PSR_OK && err.text[0] != '\0') || facts->n_checked < files[i].n);
			files[i].bytes[wrong] ^= 1;
			arrival_rewind(arrival);
			checked = facts->n_checked;
			assert_true(checked <= wrong && facts->n_taken == checked);
			assert_int_equal(arrival_take(arrival, files[i].bytes + checked, files[i].n - checked, NULL), PSR_OK);
			assert_int_equal(facts->n_checked, files[i].n);
			arrival_destroy(arrival);
		}
}

static void what_is_no_model_is_refused_at_its_header(void **state)
{
	struct arrival *arrival = make();
	struct psr_error err = { .text = "" };
	uint8_t bytes[64] = "<html>";

	(void)state;
	assert_int_equal(arrival_take(arrival, bytes, 63, &err), PSR_OK);
	assert_int_equal(arrival_take(arrival, bytes, 1, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "not a .psr file"));
	arrival_destroy(arrival);
}

static void a_head_without_end_is_not_kept(void **state)
{
	struct arrival *arrival = make();
	struct psr_error err = { .text = "" };
	uint8_t header[64];

	(void)state;
	memcpy(header, files[2].bytes, sizeof header);
	file_put(header + HEADER_N_CHUNKS, 4, UINT32_MAX);
	assert_int_equal(arrival_take(arrival, header, sizeof header, &err), PSR_OK);
	assert_int_equal(arrival_take(arrival, header, 1, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "the limit is"));
	arrival_destroy(arrival);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_file_is_checked_in_any_pieces),
		cmocka_unit_test(the_end_of_a_step_is_that_of_a_model),
		cmocka_unit_test(a_wrong_byte_is_noticed_and_the_right_one_taken),
		cmocka_unit_test(what_is_no_model_is_refused_at_its_header),
		cmocka_unit_test(a_head_without_end_is_not_kept),
	};

	return cmocka_run_group_tests(tests, setup, teardown);
}

/* Packed .psr files with octrees. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/mem.h"
#include "model/pack.h"
#include "../octree/leaves.h"
#include "fixture.h"
#include "sections.h"

#define LEVELS 5

static struct fixture fixture;
static struct octree *tree;
static struct psr_model *models[2]; /* of an octree, and of both */
static uint8_t *packed;             /* models[1] */
static size_t n_packed;

static uint8_t *pack(const struct psr_model *model, size_t *n)
{
	size_t n_image, capacity;
	const uint8_t *image = model_image(model, &n_image);
	uint8_t *bytes, *copy;

	assert_int_equal(pack_image(&bytes, n, &capacity, image, n_image, NULL), PSR_OK);
	assert_true(*n <= capacity);
	copy = malloc(*n);
	memcpy(copy, bytes, *n);
	psr_free_huge(bytes, capacity);
	return copy;
}

static struct octree *make_tree(int levels, unsigned streams)
{
	struct leaves leaves = leaves_of_sphere(levels);
	struct octree *made = leaves_to_tree(&leaves, levels);

	free(leaves.path);
	assert_true(made != NULL && leaves_dress(made, streams));
	return made;
}

static int setup(void **state)
{
	(void)state;
	fixture_init(&fixture, 1);
	tree = make_tree(LEVELS, 15);
	assert_int_equal(psr_model_create_octree(&models[0], &fixture.info, tree, &fixture.presets, NULL), PSR_OK);
	assert_int_equal(psr_model_create_both(&models[1], &fixture.info, &fixture.blocks, tree, NULL, NULL), PSR_OK);
	packed = pack(models[1], &n_packed);
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	for (int i = 0; i < 2; i++)
		psr_model_unref(models[i]);
	octree_destroy(tree);
	free(packed);
	return 0;
}

static void assert_same_image(const struct psr_model *a, const struct psr_model *b)
{
	size_t n_a, n_b;
	const uint8_t *image_a = model_image(a, &n_a), *image_b = model_image(b, &n_b);

	assert_int_equal(n_a, n_b);
	assert_memory_equal(image_a, image_b, n_a);
}

static void it_unpacks_to_the_plain_file(void **state)
{
	(void)state;
	for (int i = 0; i < 2; i++) {
		struct octree_shares shares;
		struct psr_model *model;
		size_t n;
		uint8_t *bytes = pack(models[i], &n);

		assert_int_equal(file_get(bytes + HEADER_PACKING, 4), PACKING_OCTREE);
		assert_int_equal(parse_exact(&model, bytes, n, NULL), PSR_OK);
		assert_same_image(model, models[i]);
		assert_true(psr_model_octree_shares(model, &shares));
		assert_true(shares.codes > 0);
		for (int k = 0; k < OCTREE_STREAMS; k++)
			assert_true(shares.stream[k] > 0);
		assert_false(psr_model_octree_shares(models[i], &shares));
		psr_model_unref(model);
		free(bytes);
	}
}

/* Of 2^20 leaves, threads unpack several chunks, and of 2^20 bytes there are several pieces; of classes two chunks. */
static void many_chunks_and_pieces_come_back_with_threads(void **state)
{
	struct leaves leaves = leaves_at_random(8, 1300000);
	struct octree *large = leaves_to_tree(&leaves, 8);
	struct psr_model *model, *again;
	size_t n;
	uint8_t *bytes;

	(void)state;
	free(leaves.path);
	assert_true(large != NULL && large->n_leaves > OCTREE_CHUNK);
	large->scan.class = malloc(large->n_leaves);
	assert_non_null(large->scan.class);
	for (uint64_t i = 0; i < large->n_leaves; i++)
		large->scan.class[i] = (uint8_t)(i >> 16);
	assert_int_equal(psr_model_create_octree(&model, &fixture.info, large, NULL, NULL), PSR_OK);
	octree_destroy(large);
	bytes = pack(model, &n);
	assert_true(n / 4 > FILE_CHUNK_BYTES / 8);
	assert_int_equal(parse_exact(&again, bytes, n, NULL), PSR_OK);
	assert_same_image(again, model);
	psr_model_unref(model);
	psr_model_unref(again);
	free(bytes);
}

/* A full cube is codes of 255, some bytes packed; the reader accepts 64 to 1. */
static void what_packs_beyond_belief_is_stored(void **state)
{
	const uint64_t side = 64;
	struct octree_maker maker;
	struct octree *full;
	struct psr_model *model, *again;
	size_t n, n_image;
	uint8_t *bytes;

	(void)state;
	assert_int_equal(octree_maker_init(&maker, 6, NULL), PSR_OK);
	for (uint64_t i = 0; i < side * side * side; i++)
		assert_int_equal(octree_maker_put(&maker, i, NULL), PSR_OK);
	full = octree_maker_take(&maker);
	octree_maker_fini(&maker);
	full->color = calloc(full->n_leaves, sizeof *full->color);
	assert_int_equal(psr_model_create_octree(&model, &fixture.info, full, NULL, NULL), PSR_OK);
	octree_destroy(full);
	bytes = pack(model, &n);
	model_image(model, &n_image);
	assert_true(n_image <= pack_max_image(n));
	assert_int_equal(parse_exact(&again, bytes, n, NULL), PSR_OK);
	assert_same_image(again, model);
	psr_model_unref(model);
	psr_model_unref(again);
	free(bytes);
}

static void a_file_cut_at_any_length_is_refused(void **state)
{
	(void)state;
	for (size_t n = 1; n < n_packed; n += n < 1024 || n + 300 > n_packed ? 1 : 53) {
		struct psr_error err = { .text = "" };
		struct psr_model *model;

		assert_int_equal(parse_exact(&model, packed, n, &err), PSR_ERR_FORMAT);
		assert_true(err.text[0] != 0);
	}
}

static void flipped_bits_are_noticed_with_or_without_right_hashes(void **state)
{
	uint8_t *bytes = malloc(n_packed);

	(void)state;
	for (size_t at = FILE_HEADER_BYTES; at < n_packed; at += at < 2048 || at + 50 > n_packed ? 7 : 211) {
		struct psr_model *model;
		int code;

		memcpy(bytes, packed, n_packed);
		bytes[at] ^= 1 << at % 8;
		assert_int_equal(parse_exact(&model, bytes, n_packed, NULL), PSR_ERR_FORMAT);
		/* The plain file's hashes are there still. */
		pack_seal(bytes, n_packed);
		code = parse_exact(&model, bytes, n_packed, NULL);
		assert_true(code == PSR_OK || code == PSR_ERR_FORMAT || code == PSR_ERR_UNSUPPORTED || code == PSR_ERR_VERSION);
		if (code == PSR_OK && memcmp(bytes, packed, n_packed) != 0)
			fail_msg("bit %zu of byte %zu may have any value", at % 8, at);
		psr_model_unref(model);
	}
	free(bytes);
}

/* The entry of the octree in the directory. */
static uint8_t *octree_of(uint8_t *bytes)
{
	const uint64_t n_sections = file_get(bytes + HEADER_N_SECTIONS, 4);
	uint64_t n = 0;

	for (uint64_t i = 0; i < n_sections; i++) {
		const uint8_t *entry = bytes + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;

		if (pack_place(PACKING_OCTREE, entry) == PACK_BEFORE)
			n += pack_chunks(file_get(entry + ENTRY_LENGTH, 8));
	}
	return bytes + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * n_sections + 8 * file_get(bytes + HEADER_N_CHUNKS, 4)
	       + PACK_ENTRY_BYTES * n;
}

static void lies_are_refused_even_under_right_hashes(void **state)
{
	static const struct {
		const char *section; /* NULL: the octree's entries in the directory */
		int at, size;
		uint64_t value;
		const char *text;
	} lies[] = {
		{ NULL, 0, 8, 0, "the packed octree has 0 bytes" },
		{ NULL, 0, 8, UINT64_MAX, "the packed octree has 18446744073709551615 bytes" },
		{ NULL, 0, 8, 100, "is not one of 100 bytes as they are" },
		{ NULL, 8, 8, 1, "the packed octree has" },
		{ NULL, 16 + PACK_LENGTH, 4, 100, "of the packed octree, is not one of" },
		{ NULL, 16 + PACK_METHOD, 1, PACK_PLAIN, "of the packed octree, is not one of" },
		{ NULL, 16 + PACK_STRIDE, 1, 2, "of the packed octree, is not one of" },
		{ "OCOD", ENTRY_LENGTH, 8, 100, "begins at byte" },
		{ "ONRM", ENTRY_LENGTH, 8, UINT64_MAX, "has 18446744073709551615 of" },
		{ "OCOD", ENTRY_TYPE, 4, 0x454e4f47, "its sections OCTR, OSKP or OCOD are missing" },
		{ "OCTR", ENTRY_TYPE, 4, 0x454e4f47, "its sections OCTR, OSKP or OCOD are missing" },
		{ "OCTR", ENTRY_VERSION, 2, 2, "its sections OCTR, OSKP or OCOD are missing" },
		{ "OCOL", ENTRY_OFFSET, 8, 64, "begins at byte 64" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof lies / sizeof lies[0]; i++) {
		uint8_t *bytes = malloc(n_packed);
		struct psr_error err = { .text = "" };
		struct psr_model *model;

		memcpy(bytes, packed, n_packed);
		file_put((lies[i].section != NULL ? entry_of(bytes, lies[i].section) : octree_of(bytes)) + lies[i].at,
		         lies[i].size, lies[i].value);
		pack_seal(bytes, n_packed);
		assert_int_equal(parse_exact(&model, bytes, n_packed, &err), PSR_ERR_FORMAT);
		if (strstr(err.text, lies[i].text) == NULL && lies[i].at != ENTRY_TYPE && lies[i].at != ENTRY_VERSION)
			fail_msg("lie %zu: '%s' instead of '%s'", i, err.text, lies[i].text);
		free(bytes);
	}
}

/* A section of a known type twice, once of a version that is not read: its counts are not believed. */
static void counts_of_another_version_are_not_believed(void **state)
{
	uint8_t *bytes = malloc(n_packed);
	struct psr_model *model;

	(void)state;
	memcpy(bytes, packed, n_packed);
	memcpy(entry_of(bytes, "ONRM"), "OCTR", 4);
	file_put(entry_of(bytes, "OCTR") + ENTRY_VERSION, 2, 7);
	pack_seal(bytes, n_packed);
	assert_int_equal(parse_exact(&model, bytes, n_packed, NULL), PSR_ERR_FORMAT);
	free(bytes);
}

static void sealing_changes_nothing(void **state)
{
	uint8_t *copy = malloc(n_packed);

	(void)state;
	memcpy(copy, packed, n_packed);
	pack_seal(copy, n_packed);
	assert_memory_equal(copy, packed, n_packed);
	free(copy);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(it_unpacks_to_the_plain_file),
		cmocka_unit_test(many_chunks_and_pieces_come_back_with_threads),
		cmocka_unit_test(what_packs_beyond_belief_is_stored),
		cmocka_unit_test(a_file_cut_at_any_length_is_refused),
		cmocka_unit_test(flipped_bits_are_noticed_with_or_without_right_hashes),
		cmocka_unit_test(lies_are_refused_even_under_right_hashes),
		cmocka_unit_test(counts_of_another_version_are_not_believed),
		cmocka_unit_test(sealing_changes_nothing),
	};

	return cmocka_run_group_tests(tests, setup, teardown);
}

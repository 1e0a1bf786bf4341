/* Packed files of octrees that end early. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include <unistd.h>
#include "base/mem.h"
#include "model/pack.h"
#include "../octree/leaves.h"
#include "fixture.h"
#include "sections.h"

#define LEVELS 7

static struct fixture fixture;
enum { OCTREE, BOTH, SCAN, N_MODELS };
static struct psr_model *models[N_MODELS]; /* of an octree, of blocks beside it, and of an octree with a scan */
static uint8_t *packed[N_MODELS];
static size_t n_packed[N_MODELS];
static uint64_t octree_at[N_MODELS]; /* where the packed octree begins */
static struct octree_step step[OCTREE_MOST_STEPS];
static int n_steps;
static struct octree *coarser[OCTREE_MOST_STEPS]; /* the trees of the steps */

/* Returns where the packed octree begins: behind the directory, and the chunks before it. */
static uint64_t octree_begin(const uint8_t *bytes)
{
	const uint64_t n_sections = file_get(bytes + HEADER_N_SECTIONS, 4), packing = file_get(bytes + HEADER_PACKING, 4);
	const uint64_t directory = FILE_HEADER_BYTES + FILE_ENTRY_BYTES * n_sections + 8 * file_get(bytes + HEADER_N_CHUNKS, 4);
	uint64_t n = 0, n_behind = 0, at;

	for (uint64_t i = 0; i < n_sections; i++) {
		const uint8_t *entry = bytes + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i;

		n += pack_place(packing, entry) == PACK_BEFORE ? pack_chunks(file_get(entry + ENTRY_LENGTH, 8)) : 0;
		n_behind += pack_place(packing, entry) == PACK_BEHIND ? pack_chunks(file_get(entry + ENTRY_LENGTH, 8)) : 0;
	}
	at = directory + PACK_ENTRY_BYTES * (n + 1 + pack_pieces(file_get(bytes + directory + PACK_ENTRY_BYTES * n, 8)) + n_behind);
	for (uint64_t i = 0; i < n; i++)
		at += file_get(bytes + directory + PACK_ENTRY_BYTES * i + PACK_LENGTH, 4);
	return at;
}

static void add_scan(struct octree *tree)
{
	tree->scan.intensity = malloc(tree->n_leaves * sizeof *tree->scan.intensity);
	tree->scan.class = malloc(tree->n_leaves);
	assert_true(tree->scan.intensity != NULL && tree->scan.class != NULL);
	for (uint64_t i = 0; i < tree->n_leaves; i++) {
		tree->scan.intensity[i] = (uint16_t)(i * 7919);
		tree->scan.class[i] = (uint8_t)(i % 7);
	}
}

static int setup(void **state)
{
	struct leaves leaves = leaves_of_sphere(LEVELS);
	struct octree *tree = leaves_to_tree(&leaves, LEVELS);
	struct octree *at = tree;

	(void)state;
	free(leaves.path);
	fixture_init(&fixture, 1);
	assert_true(tree != NULL && leaves_dress(tree, 15));
	tree->is_one_sided = 1;
	tree->is_cloud = 1;
	assert_int_equal(psr_model_create_octree(&models[0], &fixture.info, tree, &fixture.presets, NULL), PSR_OK);
	assert_int_equal(psr_model_create_both(&models[1], &fixture.info, &fixture.blocks, tree, NULL, NULL), PSR_OK);
	add_scan(tree);
	assert_int_equal(psr_model_create_octree(&models[SCAN], &fixture.info, tree, &fixture.presets, NULL), PSR_OK);
	for (int i = 0; i < N_MODELS; i++) {
		size_t n_image, capacity;
		const uint8_t *image = model_image(models[i], &n_image);
		uint8_t *bytes;

		assert_int_equal(pack_image(&bytes, &n_packed[i], &capacity, image, n_image, NULL), PSR_OK);
		packed[i] = malloc(n_packed[i]);
		memcpy(packed[i], bytes, n_packed[i]);
		psr_free_huge(bytes, capacity);
		octree_at[i] = octree_begin(packed[i]);
	}
	n_steps = octree_packed_steps(step, packed[0] + octree_at[0], n_packed[0] - octree_at[0], NULL);
	assert_true(n_steps >= 2 && step[n_steps - 1].end > 2 * PACK_PIECE_BYTES);
	coarser[n_steps - 1] = tree;
	for (int s = n_steps - 2; s >= 0; s--) {
		struct octree *between = octree_coarser(at);

		at = coarser[s] = octree_coarser(between);
		octree_destroy(between);
	}
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	for (int i = 0; i < N_MODELS; i++) {
		psr_model_unref(models[i]);
		free(packed[i]);
	}
	for (int s = 0; s < n_steps; s++)
		octree_destroy(coarser[s]);
	return 0;
}

static void assert_tree(const struct octree *a, const struct octree *b)
{
	assert_int_equal(a->levels, b->levels);
	assert_int_equal(a->is_one_sided, 1);
	assert_int_equal(a->is_cloud, 1);
	assert_int_equal(a->n_codes, b->n_codes);
	assert_int_equal(a->n_leaves, b->n_leaves);
	assert_memory_equal(a->code, b->code, a->n_codes);
	assert_memory_equal(a->normal, b->normal, a->n_leaves * sizeof *a->normal);
	assert_memory_equal(a->offset, b->offset, a->n_leaves);
	assert_memory_equal(a->color, b->color, a->n_leaves * sizeof *a->color);
	assert_memory_equal(a->material, b->material, a->n_leaves * sizeof *a->material);
}

/* Returns how many steps a file of n bytes has whole. */
static int steps_in(size_t n, int model)
{
	const uint64_t there = n > octree_at[model] ? n - octree_at[model] : 0;
	int s = 0;

	while (s < n_steps && step[s].end <= (there < step[n_steps - 1].end ? there / PACK_PIECE_BYTES * PACK_PIECE_BYTES : there))
		s++;
	return s;
}

static void a_file_cut_at_any_length_is_its_coarser_model_or_refused(void **state)
{
	(void)state;
	for (int i = 0; i < N_MODELS; i++)
		for (size_t n = 1; n < n_packed[i]; n += n < 200 || (n + 2) % PACK_PIECE_BYTES < octree_at[i] % 7 + 4 ? 1 : 4999) {
			struct psr_error err = { .text = "" };
			struct psr_model_prefix prefix;
			struct psr_model *model;
			const int n_whole = steps_in(n, i), code = parse_exact(&model, packed[i], n, &err);

			if (code != (n_whole > 0 ? PSR_OK : PSR_ERR_FORMAT))
				fail_msg("%zu of %zu bytes, %d steps: %d, %s", n, n_packed[i], n_whole, code, err.text);
			assert_true((code == PSR_OK) == (err.text[0] == 0));
			if (n_whole == 0)
				continue;
			assert_true(psr_model_is_prefix(model, &prefix));
			assert_int_equal(prefix.levels, step[n_whole - 1].depth);
			assert_int_equal(prefix.of_levels, LEVELS);
			assert_int_equal(prefix.of_bytes, n_packed[i]);
			assert_tree(psr_model_octree(model), coarser[n_whole - 1]);
			assert_null(psr_model_octree(model)->scan.intensity);
			psr_model_unref(model);
		}
}

static void its_model_is_that_of_the_coarser_tree(void **state)
{
	(void)state;
	for (int i = 0; i < N_MODELS; i++) {
		const size_t n = octree_at[i] + pack_pieces(step[n_steps - 2].end) * PACK_PIECE_BYTES;
		struct psr_model_info info = fixture.info;
		struct psr_model *model, *made;
		struct octree tree = *coarser[n_steps - 2];
		struct psr_model_prefix prefix;
		const int missing = LEVELS - tree.levels;
		uint8_t id[16], other[16];

		assert_true(n < n_packed[i]);
		assert_int_equal(parse_exact(&model, packed[i], n, NULL), PSR_OK);
		if (i != BOTH) {
			info.spacing *= 1 << missing;
			info.resolution = info.resolution >> missing > 0 ? info.resolution >> missing : 1;
		}
		assert_int_equal(psr_model_create_both(&made, &info, i == BOTH ? &fixture.blocks : NULL, &tree,
		                                       i != BOTH ? &fixture.presets : NULL, NULL), PSR_OK);
		psr_model_content_id(model, id);
		psr_model_content_id(made, other);
		assert_memory_equal(id, other, sizeof id);
		assert_false(psr_model_is_prefix(made, &prefix));
		assert_int_equal(psr_model_blocks(model) != NULL, i == BOTH);
		psr_model_unref(model);
		psr_model_unref(made);
		assert_int_equal(parse_exact(&model, packed[i], n_packed[i], NULL), PSR_OK);
		assert_false(psr_model_is_prefix(model, &prefix));
		assert_int_equal(psr_model_octree(model)->scan.class != NULL, i == SCAN);
		psr_model_unref(model);
	}
}

/* What is behind the octree is not missed by a model of all of its levels. */
static void a_file_that_ends_within_its_scan_has_all_levels(void **state)
{
	const size_t end = octree_at[SCAN] + step[n_steps - 1].end;
	struct psr_model_prefix prefix;
	struct psr_model *model;
	uint8_t id[16], other[16];

	(void)state;
	assert_true(end < n_packed[SCAN]);
	psr_model_content_id(models[OCTREE], other);
	for (size_t n = end; n < n_packed[SCAN]; n += 1 + (n_packed[SCAN] - end) / 7) {
		assert_int_equal(parse_exact(&model, packed[SCAN], n, NULL), PSR_OK);
		assert_true(psr_model_is_prefix(model, &prefix));
		assert_int_equal(prefix.levels, LEVELS);
		psr_model_content_id(model, id);
		assert_memory_equal(id, other, sizeof id);
		psr_model_unref(model);
	}
}

static void a_cut_file_on_disk_needs_no_more_memory_than_it_says(void **state)
{
	char folder[] = "/tmp/psr-model-XXXXXX", path[64];
	const size_t n = octree_at[0] + PACK_PIECE_BYTES;
	struct psr_model *model;
	uint64_t need;
	FILE *file;

	(void)state;
	assert_non_null(mkdtemp(folder));
	snprintf(path, sizeof path, "%s/a.psr", folder);
	file = fopen(path, "wb");
	assert_non_null(file);
	assert_int_equal(fwrite(packed[0], 1, n, file), n);
	fclose(file);
	assert_int_equal(psr_model_need(&need, path, 0, NULL), PSR_OK);
	assert_int_equal(psr_model_read(&model, path, NULL), PSR_OK);
	size_t n_image;
	model_image(model, &n_image);
	assert_true(n_image <= need);
	psr_model_unref(model);
	unlink(path);
	rmdir(folder);
}

static void write_packed(char folder[], char path[64])
{
	FILE *file;

	assert_non_null(mkdtemp(folder));
	snprintf(path, 64, "%s/a.psr", folder);
	file = fopen(path, "wb");
	assert_non_null(file);
	assert_int_equal(fwrite(packed[0], 1, n_packed[0], file), n_packed[0]);
	fclose(file);
}

static void the_shortest_beginning_of_enough_levels_is_read(void **state)
{
	char folder[] = "/tmp/psr-model-XXXXXX", path[64];
	uint64_t before = 0;

	(void)state;
	write_packed(folder, path);
	for (uint32_t levels = 0; levels <= LEVELS + 1; levels++) {
		struct psr_model_prefix prefix;
		struct psr_model *model;
		uint64_t need;
		int s = 0;

		while (levels > 0 && s < n_steps - 1 && step[s].depth < (int)levels)
			s++;
		s = levels == 0 ? n_steps - 1 : s;
		assert_int_equal(psr_model_read_levels(&model, path, levels, NULL, NULL), PSR_OK);
		assert_int_equal(psr_model_octree(model)->levels, step[s].depth);
		assert_int_equal(psr_model_is_prefix(model, &prefix), s < n_steps - 1);
		assert_int_equal(psr_model_need(&need, path, levels, NULL), PSR_OK);
		assert_true(levels == 0 || need >= before);
		before = levels > 0 ? need : 0;
		/* Each beginning has as many leaves and codes as it says, and at most a third of its leaves' nodes in the skip
		 * index, 24 bytes each. */
		assert_true(psr_model_bytes(model) <= need + need / 2 + 24 * step[s].n_leaves / 3);
		psr_model_unref(model);
	}
	unlink(path);
	rmdir(folder);
}

static void beginnings_are_the_steps_but_the_last(void **state)
{
	char folder[] = "/tmp/psr-model-XXXXXX", path[64];
	uint32_t levels = 0;

	(void)state;
	write_packed(folder, path);
	for (int s = 0; s < n_steps - 1; s++)
		levels |= 1u << step[s].depth;
	assert_int_equal(psr_model_beginnings(path), levels);
	assert_int_equal(truncate(path, (off_t)n_packed[0] - 1), 0);
	assert_int_equal(psr_model_beginnings(path), 0);
	unlink(path);
	assert_int_equal(psr_model_beginnings(path), 0);
	rmdir(folder);
}

static int asked;
static int says_at(void *after)
{
	return asked++ >= *(const int *)after;
}

static void reading_ends_at_any_question(void **state)
{
	char folder[] = "/tmp/psr-model-XXXXXX", path[64];
	struct psr_model *model = NULL;
	int after = 0, code;

	(void)state;
	write_packed(folder, path);
	do {
		const struct psr_cancel cancel = { says_at, &after };
		struct psr_error err = { .text = "" };

		asked = 0;
		code = psr_model_read_levels(&model, path, 0, &cancel, &err);
		assert_true(code == PSR_OK || code == PSR_ERR_CANCELLED);
		assert_int_equal(code == PSR_OK, err.text[0] == '\0');
		after++;
	} while (code != PSR_OK && after < 1000);
	assert_int_equal(code, PSR_OK);
	assert_true(after > 2 * n_steps); /* each step of each chunk asked */
	psr_model_unref(model);
	unlink(path);
	rmdir(folder);
}

static void a_piece_that_is_damaged_is_named(void **state)
{
	const size_t n = octree_at[0] + 2 * PACK_PIECE_BYTES;
	struct psr_error err = { .text = "" };
	struct psr_model *model;

	(void)state;
	packed[0][n - 5] ^= 16;
	assert_int_equal(parse_exact(&model, packed[0], n, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "the packed octree is damaged at byte"));
	/* One byte less, and that piece is not there. */
	assert_int_equal(parse_exact(&model, packed[0], n - 1, &err), PSR_OK);
	psr_model_unref(model);
	packed[0][n - 5] ^= 16;
}

static void lies_are_refused_even_under_right_hashes(void **state)
{
	const uint64_t last = octree_at[0] + 16 + 32 * (uint64_t)(n_steps - 1), first = octree_at[0] + 16;
	const struct {
		uint64_t at;
		int size;
		uint64_t value;
		const char *text;
	} lies[] = {
		{ last + 8, 8, step[n_steps - 1].n_codes + 1, "it should be 7," },
		{ last + 16, 8, step[n_steps - 1].n_leaves + 1, "it should be 7," },
		{ last + 24, 8, step[n_steps - 1].end + 1, "it should be 7," },
		{ last, 8, 8, "goes from depth" },
		{ first, 8, 200, "goes from depth" },
		{ first + 8, 8, step[0].n_codes + 1, "do not add up" },
		{ first + 24, 8, 20, "is cut short" },
		{ first + 24, 8, step[n_steps - 1].end, "up to byte" },
		{ octree_at[0] + 8, 8, 0, "in 0 steps, is not known" },
		{ octree_at[0] + 3, 1, 2, "of streams 0x2" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof lies / sizeof lies[0]; i++) {
		const size_t n = octree_at[0] + pack_pieces(step[n_steps - 2].end) * PACK_PIECE_BYTES;
		uint8_t *bytes = malloc(n_packed[0]);
		struct psr_error err = { .text = "" };
		struct psr_model *model;

		memcpy(bytes, packed[0], n_packed[0]);
		file_put(bytes + lies[i].at, lies[i].size, lies[i].value);
		pack_seal(bytes, n_packed[0]);
		assert_int_equal(parse_exact(&model, bytes, n, &err), PSR_ERR_FORMAT);
		if (strstr(err.text, lies[i].text) == NULL)
			fail_msg("lie %zu: '%s' instead of '%s'", i, err.text, lies[i].text);
		free(bytes);
	}
}

/* A header of a small file that says it is the beginning of a huge one takes no memory. */
static void a_huge_rest_is_not_believed(void **state)
{
	uint8_t *bytes = malloc(n_packed[0]);
	struct psr_error err = { .text = "" };
	struct psr_model *model;

	(void)state;
	memcpy(bytes, packed[0], n_packed[0]);
	file_put(bytes + HEADER_PACKED_SIZE, 8, UINT64_MAX / 128);
	file_put(bytes + HEADER_N_CHUNKS, 4, UINT32_MAX);
	pack_seal(bytes, n_packed[0]);
	assert_int_equal(parse_exact(&model, bytes, n_packed[0] - 1, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "within its section table"));
	memcpy(bytes, packed[0], n_packed[0]);
	file_put(bytes + HEADER_PACKED_SIZE, 8, UINT64_MAX / 128);
	uint64_t table_end = FILE_HEADER_BYTES + FILE_ENTRY_BYTES * file_get(bytes + HEADER_N_SECTIONS, 4)
	                     + 8 * file_get(bytes + HEADER_N_CHUNKS, 4);
	while (file_get(bytes + table_end, 8) != n_packed[0] - octree_at[0])
		table_end += PACK_ENTRY_BYTES;
	file_put(bytes + table_end, 8, UINT64_MAX / 256);
	assert_int_equal(parse_exact(&model, bytes, n_packed[0] - 1, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "within its directory of chunks"));
	free(bytes);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_file_cut_at_any_length_is_its_coarser_model_or_refused),
		cmocka_unit_test(its_model_is_that_of_the_coarser_tree),
		cmocka_unit_test(a_file_that_ends_within_its_scan_has_all_levels),
		cmocka_unit_test(a_cut_file_on_disk_needs_no_more_memory_than_it_says),
		cmocka_unit_test(the_shortest_beginning_of_enough_levels_is_read),
		cmocka_unit_test(beginnings_are_the_steps_but_the_last),
		cmocka_unit_test(reading_ends_at_any_question),
		cmocka_unit_test(a_piece_that_is_damaged_is_named),
		cmocka_unit_test(lies_are_refused_even_under_right_hashes),
		cmocka_unit_test(a_huge_rest_is_not_believed),
	};

	return cmocka_run_group_tests(tests, setup, teardown);
}

/* Packed .psr files: what comes out is what went in, and whatever else stands in them is refused. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include <unistd.h>
#include <zstd.h>
#include "base/mem.h"
#include "model/pack.h"
#include "fixture.h"
#include "sections.h"

static struct psr_model *small; /* the fixture with everything */
static uint8_t *packed;
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

static int setup(void **state)
{
	struct fixture f;

	(void)state;
	fixture_init(&f, 1);
	assert_int_equal(psr_model_create(&small, &f.info, &f.blocks, &f.presets, NULL), PSR_OK);
	packed = pack(small, &n_packed);
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	psr_model_unref(small);
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

/* From an allocation of exactly that size, so that the address sanitizer sees every step beyond it. */
static int parse(const uint8_t *bytes, size_t n, struct psr_error *err)
{
	struct psr_model *model = NULL;
	uint8_t *exact = malloc(n);
	int code;

	memcpy(exact, bytes, n);
	code = psr_model_parse(&model, exact, n, err);
	assert_true((code == PSR_OK) == (model != NULL));
	psr_model_unref(model);
	free(exact);
	return code;
}

/* n blocks of one sample each: sections of more than a megabyte from 131,073 on. `noise` or all alike. */
static struct psr_model *many_blocks(uint32_t n, int noise)
{
	struct fixture f;
	struct psr_cluster cluster = { { 0, 0, 0 }, 1, 0, n, 0, 0, { 0 } };
	void *arrays[N_KNOWN_SECTIONS] = { NULL };
	struct psr_model *model = NULL;
	struct psr_run *run = calloc(n / PSR_RUN_BLOCKS + 1, sizeof *run);
	uint64_t state = 42;

	fixture_init(&f, 0);
	f.blocks.run = run;
	for (uint32_t i = 0; i < n; i += PSR_RUN_BLOCKS)
		run[i / PSR_RUN_BLOCKS].attr_first = i;
	f.blocks.n_blocks = n;
	f.blocks.n_samples = n;
	f.blocks.n_clusters = f.blocks.n_levels = 1;
	f.blocks.cluster = &cluster;
	for (int k = SECTION_FIRST_ARRAY; k < SECTION_OCTREE; k++) {
		const struct section_spec *spec = &section_table[k];

		if (spec->count < COUNT_BLOCKS || spec->flags == 0)
			continue;
		arrays[k] = calloc(n, spec->item_bytes);
		memcpy((char *)&f.blocks + spec->pointer - offsetof(struct content, blocks), &arrays[k], sizeof arrays[k]);
		for (uint32_t i = 0; i < n; i++) {
			if (memcmp(spec->type, "MASK", 4) == 0)
				((uint64_t *)arrays[k])[i] = 1;
			else if (memcmp(spec->type, "AOFF", 4) == 0)
				((uint16_t *)arrays[k])[i] = (uint16_t)(i % PSR_RUN_BLOCKS);
			else if (noise && memcmp(spec->type, "DPTH", 4) == 0)
				((uint16_t *)arrays[k])[i] = (uint16_t)(100 * i + (fixture_random(&state) & 7));
			else if (noise && memcmp(spec->type, "ATTR", 4) == 0)
				((uint64_t *)arrays[k])[i] = fixture_random(&state);
		}
	}
	assert_int_equal(psr_model_create(&model, &f.info, &f.blocks, NULL, NULL), PSR_OK);
	for (int k = 0; k < N_KNOWN_SECTIONS; k++)
		free(arrays[k]);
	free(run);
	return model;
}

static void either_way_of_opening_gives_the_same_model(void **state)
{
	char folder[] = "/tmp/psr-pack-XXXXXX", path[64];
	struct psr_model *models[3] = { psr_model_ref(small), many_blocks(300000, 1), many_blocks(300000, 0) };

	(void)state;
	assert_non_null(mkdtemp(folder));
	snprintf(path, sizeof path, "%s/a.psr", folder);
	for (int i = 0; i < 3; i++) {
		struct psr_model *opened[3] = { NULL, NULL, NULL };
		uint8_t id[16], other[16];
		size_t n, n_image;
		uint8_t *bytes = pack(models[i], &n);
		uint64_t need;
		int is_packed;

		model_image(models[i], &n_image);
		assert_true(n < n_image);
		assert_int_equal(psr_model_write_packed(models[i], path, NULL), PSR_OK);
		assert_int_equal(psr_model_read(&opened[0], path, NULL), PSR_OK);
		assert_int_equal(psr_model_map(&opened[1], path, NULL), PSR_OK);
		assert_int_equal(psr_model_parse(&opened[2], bytes, n, NULL), PSR_OK);
		psr_model_content_id(models[i], id);
		for (int k = 0; k < 3; k++) {
			assert_same_image(models[i], opened[k]);
			psr_model_content_id(opened[k], other);
			assert_memory_equal(id, other, sizeof id);
			assert_int_equal(psr_model_file_bytes(opened[k], &is_packed), n);
			assert_true(is_packed);
			assert_int_equal(psr_model_bytes(opened[k]), psr_model_bytes(models[i]));
			psr_model_unref(opened[k]);
		}
		assert_int_equal(psr_model_need(&need, path, 0, NULL), PSR_OK);
		assert_int_equal(need, psr_model_bytes(models[i]));
		/* And from packed to plain again. */
		assert_int_equal(psr_model_write(models[i], path, NULL), PSR_OK);
		assert_int_equal(psr_model_need(&need, path, 0, NULL), PSR_OK);
		assert_int_equal(need, psr_model_bytes(models[i]));
		assert_int_equal(psr_model_read(&opened[0], path, NULL), PSR_OK);
		assert_int_equal(psr_model_file_bytes(opened[0], &is_packed), n_image);
		assert_false(is_packed);
		psr_model_unref(opened[0]);
		psr_model_unref(models[i]);
		free(bytes);
	}
	unlink(path);
	assert_int_equal(rmdir(folder), 0);
}

static void what_repeats_itself_is_not_packed_beyond_belief(void **state)
{
	struct psr_model *model = many_blocks(300000, 0);
	size_t n, n_image;
	uint8_t *bytes = pack(model, &n);

	(void)state;
	model_image(model, &n_image);
	assert_true(n_image <= pack_max_image(n));
	assert_int_equal(parse(bytes, n, NULL), PSR_OK);
	free(bytes);
	psr_model_unref(model);
}

static void packing_twice_gives_the_same_bytes(void **state)
{
	struct psr_model *read = NULL;
	size_t n;
	uint8_t *again;

	(void)state;
	assert_int_equal(psr_model_parse(&read, packed, n_packed, NULL), PSR_OK);
	again = pack(read, &n);
	assert_int_equal(n, n_packed);
	assert_memory_equal(again, packed, n);
	free(again);
	psr_model_unref(read);
}

static void join_undoes_split(void **state)
{
	uint8_t chunk[1000], split[1000], joined[1000];
	uint64_t random = 7;

	(void)state;
	for (int i = 0; i < 1000; i++)
		chunk[i] = (uint8_t)fixture_random(&random);
	for (uint32_t stride = 1; stride <= 8; stride *= 2) {
		for (enum pack_method method = PACK_PLANES; method < PACK_N_METHODS; method++) {
			for (size_t n = 0; n <= 1000; n = n < 20 ? n + 1 : n + 97) {
				memset(joined, 0, sizeof joined);
				pack_split(split, chunk, n, stride, method);
				pack_join(joined, split, n, stride, method);
				assert_memory_equal(joined, chunk, n);
			}
		}
	}
}

static void planes_hold_one_byte_of_each_word(void **state)
{
	static const uint8_t chunk[7] = { 0x01, 0x02, 0x11, 0x12, 0x21, 0x22, 0x99 };
	uint8_t out[7];

	(void)state;
	pack_split(out, chunk, 7, 2, PACK_PLANES);
	assert_memory_equal(out, ((const uint8_t[]){ 0x01, 0x11, 0x21, 0x02, 0x12, 0x22, 0x99 }), 7);
	pack_split(out, chunk, 7, 2, PACK_DIFFERENCES);
	assert_memory_equal(out, ((const uint8_t[]){ 0x01, 0x10, 0x10, 0x02, 0x10, 0x10, 0x99 }), 7);
	pack_split(out, chunk, 7, 2, PACK_XOR);
	assert_memory_equal(out, ((const uint8_t[]){ 0x01, 0x10, 0x30, 0x02, 0x10, 0x30, 0x99 }), 7);
}

static void packed_file_cut_at_any_length_is_refused(void **state)
{
	struct psr_error err;

	(void)state;
	for (size_t n = 0; n < n_packed; n++) {
		assert_int_equal(parse(packed, n, &err), PSR_ERR_FORMAT);
		assert_true(n == 0 || strstr(err.text, "cut short") != NULL || n < 8);
	}
	assert_int_equal(parse(packed, n_packed, &err), PSR_OK);
}

static void bytes_after_a_packed_file_are_refused(void **state)
{
	uint8_t *longer = calloc(1, n_packed + 1);
	struct psr_error err;

	(void)state;
	memcpy(longer, packed, n_packed);
	assert_int_equal(parse(longer, n_packed + 1, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "1 bytes follow the end of the file's last chunk"));
	free(longer);
}

/* Every bit of the header, one of each byte after it. */
static void a_flipped_bit_of_a_packed_file_is_noticed(void **state)
{
	(void)state;
	for (size_t i = 0; i < n_packed; i++) {
		for (int bit = i < FILE_HEADER_BYTES ? 0 : (int)(i % 8); bit < 8; bit = i < FILE_HEADER_BYTES ? bit + 1 : 8) {
			struct psr_error err = { 0 };
			int code;

			packed[i] ^= (uint8_t)(1 << bit);
			code = parse(packed, n_packed, &err);
			assert_true(code == PSR_ERR_FORMAT ||
			            (code == PSR_ERR_VERSION && (i == HEADER_MAJOR || i == HEADER_MAJOR + 1 ||
			                                         (i >= HEADER_PACKING && i < HEADER_PACKING + 4))));
			packed[i] ^= (uint8_t)(1 << bit);
		}
	}
}

/* The small model has one chunk a section: its directory entry. */
static uint8_t *chunk_of(uint8_t *bytes, const char *type)
{
	uint64_t table_end = FILE_HEADER_BYTES + FILE_ENTRY_BYTES * file_get(bytes + HEADER_N_SECTIONS, 4);

	return bytes + table_end + PACK_ENTRY_BYTES * (uint64_t)(entry_of(bytes, type) - bytes - FILE_HEADER_BYTES)
	       / FILE_ENTRY_BYTES;
}

static void lies_are_refused_even_under_right_hashes(void **state)
{
	static const struct {
		const char *section; /* NULL: the header */
		int in_directory, at, size;
		uint64_t value;
		int code;
		const char *text;
	} lies[] = {
		{ NULL, 0, HEADER_PACKING, 4, 2, PSR_ERR_VERSION, "packed in way 2, and this build knows ways 1, 3 and 4" },
		{ NULL, 0, HEADER_PACKING, 4, 3, PSR_ERR_FORMAT, "the packed octree has" },
		{ NULL, 0, HEADER_PACKED_SIZE, 8, 100, PSR_ERR_FORMAT, "bytes follow the end of the file's last chunk" },
		{ NULL, 0, HEADER_PACKED_SIZE, 8, UINT64_MAX, PSR_ERR_FORMAT, "cut short" },
		{ NULL, 0, HEADER_FILE_SIZE, 8, UINT64_MAX, PSR_ERR_FORMAT, "the limit is 64 to 1" },
		{ NULL, 0, HEADER_FILE_SIZE, 8, (uint64_t)1 << 40, PSR_ERR_FORMAT, "the limit is 64 to 1" },
		{ NULL, 0, HEADER_FILE_SIZE, 8, 100000, PSR_ERR_FORMAT, "the header says 100000 bytes, and the sections have" },
		{ NULL, 0, HEADER_N_SECTIONS, 4, 257, PSR_ERR_FORMAT, "the header lists 257 sections, more than the 256" },
		{ NULL, 0, HEADER_N_SECTIONS, 4, 256, PSR_ERR_FORMAT, "the section table ends at byte" },
		{ NULL, 0, HEADER_N_CHUNKS, 4, UINT32_MAX, PSR_ERR_FORMAT, "the section table ends at byte" },
		{ "DPTH", 0, ENTRY_LENGTH, 8, UINT64_MAX, PSR_ERR_FORMAT, "has 18446744073709551615 of" },
		{ "CLUS", 0, ENTRY_LENGTH, 8, 97, PSR_ERR_FORMAT, "section CLUS has 97 bytes and should have 96" },
		{ "DPTH", 0, ENTRY_OFFSET, 8, UINT64_MAX - 63, PSR_ERR_FORMAT, "begins at byte" },
		{ "DPTH", 0, ENTRY_HASH, 8, 1, PSR_ERR_FORMAT, "section DPTH at byte" },
		{ "DPTH", 1, PACK_METHOD, 1, PACK_N_METHODS, PSR_ERR_FORMAT, "is packed by method 5 in words of" },
		{ "DPTH", 1, PACK_STRIDE, 1, 3, PSR_ERR_FORMAT, "in words of 3 bytes, which is unknown" },
		{ "DPTH", 1, PACK_STRIDE, 1, 0, PSR_ERR_FORMAT, "in words of 0 bytes, which is unknown" },
		{ "DPTH", 1, 6, 1, 1, PSR_ERR_FORMAT, "which is unknown" },
		{ "MASK", 1, PACK_LENGTH, 4, 0, PSR_ERR_FORMAT, "of 48 bytes is packed into 0" },
		{ "MASK", 1, PACK_LENGTH, 4, UINT32_MAX, PSR_ERR_FORMAT, "of 48 bytes is packed into 4294967295" },
		{ "INFO", 1, PACK_LENGTH, 4, 20, PSR_ERR_FORMAT, "the chunks end at byte" },
		{ "INFO", 1, PACK_METHOD, 1, PACK_STORED, PSR_ERR_FORMAT, "of 184 bytes is packed into" },
		{ "INFO", 1, PACK_METHOD, 1, PACK_XOR, PSR_ERR_FORMAT, "section INFO at byte" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof lies / sizeof lies[0]; i++) {
		uint8_t *bytes = malloc(n_packed), *at = bytes;
		struct psr_error err = { .text = "" };

		memcpy(bytes, packed, n_packed);
		if (lies[i].section != NULL)
			at = lies[i].in_directory ? chunk_of(bytes, lies[i].section) : entry_of(bytes, lies[i].section);
		file_put(at + lies[i].at, lies[i].size, lies[i].value);
		pack_seal(bytes, n_packed);
		assert_int_equal(parse(bytes, n_packed, &err), lies[i].code);
		if (strstr(err.text, lies[i].text) == NULL)
			fail_msg("lie %zu: '%s' instead of '%s'", i, err.text, lies[i].text);
		free(bytes);
	}
}

/* The counts are believed only as far as the sections agree with them, before memory is asked for. */
static void counts_that_disagree_with_lengths_are_refused(void **state)
{
	size_t n_image;
	uint8_t *image, *bytes;
	size_t n, capacity;
	struct psr_error err = { .text = "" };

	(void)state;
	model_image(small, &n_image);
	image = malloc(n_image);
	memcpy(image, model_image(small, &n_image), n_image);
	file_put(image + file_get(entry_of(image, "BLKS") + ENTRY_OFFSET, 8), 4, FIXTURE_BLOCKS + 1);
	file_seal(image, n_image);
	assert_int_equal(pack_image(&bytes, &n, &capacity, image, n_image, NULL), PSR_OK);
	assert_int_equal(parse(bytes, n, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "section SPHX has 12 bytes and should have 14"));
	psr_free_huge(bytes, capacity);
	free(image);
}

static void sealing_a_whole_packed_file_changes_nothing(void **state)
{
	uint8_t *copy = malloc(n_packed);

	(void)state;
	memcpy(copy, packed, n_packed);
	pack_seal(copy, n_packed);
	assert_memory_equal(copy, packed, n_packed);
	free(copy);
}

/* As a reader over a network would: the directory says where each chunk is and whether it is whole. */
static void a_prefix_can_be_verified_and_used(void **state)
{
	struct psr_model *model = many_blocks(300000, 1);
	size_t n, n_image;
	uint8_t *bytes = pack(model, &n), *unpacked = malloc(FILE_CHUNK_BYTES);
	const uint8_t *image = model_image(model, &n_image), *first;
	uint64_t table_end, n_chunks = 0, length;

	(void)state;
	table_end = FILE_HEADER_BYTES + FILE_ENTRY_BYTES * file_get(bytes + HEADER_N_SECTIONS, 4)
	            + 8 * file_get(bytes + HEADER_N_CHUNKS, 4);
	for (uint32_t i = 0; i < file_get(bytes + HEADER_N_SECTIONS, 4); i++)
		n_chunks += pack_chunks(file_get(bytes + FILE_HEADER_BYTES + FILE_ENTRY_BYTES * i + ENTRY_LENGTH, 8));
	assert_true(n_chunks > file_get(bytes + HEADER_N_SECTIONS, 4));
	first = bytes + table_end + PACK_ENTRY_BYTES * n_chunks;
	length = file_get(bytes + table_end + PACK_LENGTH, 4);
	/* The first chunk is INFO, of single bytes. */
	assert_int_equal(bytes[table_end + PACK_METHOD], PACK_PLAIN);
	assert_int_equal(ZSTD_decompress(unpacked, FILE_CHUNK_BYTES, first, length), INFO_BYTES);
	assert_memory_equal(unpacked, image + file_get(entry_of(bytes, "INFO") + ENTRY_OFFSET, 8), INFO_BYTES);
	free(bytes);
	free(unpacked);
	psr_model_unref(model);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(either_way_of_opening_gives_the_same_model),
		cmocka_unit_test(what_repeats_itself_is_not_packed_beyond_belief),
		cmocka_unit_test(packing_twice_gives_the_same_bytes),
		cmocka_unit_test(join_undoes_split),
		cmocka_unit_test(planes_hold_one_byte_of_each_word),
		cmocka_unit_test(packed_file_cut_at_any_length_is_refused),
		cmocka_unit_test(bytes_after_a_packed_file_are_refused),
		cmocka_unit_test(a_flipped_bit_of_a_packed_file_is_noticed),
		cmocka_unit_test(lies_are_refused_even_under_right_hashes),
		cmocka_unit_test(counts_that_disagree_with_lengths_are_refused),
		cmocka_unit_test(sealing_a_whole_packed_file_changes_nothing),
		cmocka_unit_test(a_prefix_can_be_verified_and_used),
	};

	return cmocka_run_group_tests(tests, setup, teardown);
}

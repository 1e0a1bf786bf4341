#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <pthread.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>
#include "model/file.h"
#include "fixture.h"
#include "sections.h"

static struct fixture fixture;
static uint8_t *image; /* of the fixture less its visibility, so that there is padding after the table too */
static size_t n_image;

static int setup(void **state)
{
	struct psr_model *model = NULL;
	const uint8_t *bytes;

	(void)state;
	fixture_init(&fixture, 1);
	fixture.blocks.n_masks = 0;
	fixture.blocks.visibility_index = NULL;
	fixture.blocks.visibility_mask = NULL;
	assert_int_equal(psr_model_create(&model, &fixture.info, &fixture.blocks, &fixture.presets, NULL), PSR_OK);
	bytes = model_image(model, &n_image);
	image = malloc(n_image);
	memcpy(image, bytes, n_image);
	psr_model_unref(model);
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	free(image);
	return 0;
}

/* Parses in place, in an allocation of exactly that size, so that the address sanitizer sees every step beyond it. */
static int parse(const uint8_t *bytes, size_t n_bytes, struct psr_error *err)
{
	struct content content;
	void *exact = NULL;
	int code;

	assert_int_equal(posix_memalign(&exact, FILE_ALIGNMENT, n_bytes), 0);
	memcpy(exact, bytes, n_bytes);
	code = file_parse(exact, n_bytes, NULL, "m.psr", &content, err);
	free(exact);
	return code;
}

static void assert_same(const struct psr_model *model, int with_optional)
{
	const struct content content = { .has_blocks = 1, .blocks = fixture.blocks };
	const struct psr_blocks *a = &fixture.blocks, *b = psr_model_blocks(model);
	const struct psr_presets *presets = psr_model_presets(model);
	const struct content *in = model_content(model);

	/* Up to its last field: what the compiler pads with is anything. */
	assert_memory_equal(psr_model_info(model), &fixture.info, offsetof(struct psr_model_info, builder) + 32);
	assert_int_equal(b->n_blocks, a->n_blocks);
	assert_int_equal(b->n_projections, a->n_projections);
	assert_int_equal(b->n_clusters, a->n_clusters);
	assert_int_equal(b->n_levels, a->n_levels);
	assert_int_equal(b->n_samples, a->n_samples);
	for (int k = SECTION_FIRST_ARRAY; k < SECTION_OCTREE; k++) {
		const struct section_spec *spec = &section_table[k];

		if (!with_optional && !(spec->flags & ENTRY_REQUIRED)) {
			assert_null(section_array(spec, in));
			continue;
		}
		assert_int_equal((uintptr_t)section_array(spec, in) % FILE_ALIGNMENT, 0);
		assert_ptr_not_equal(section_array(spec, in), section_array(spec, &content));
		assert_memory_equal(section_array(spec, in), section_array(spec, &content),
		                    spec->item_bytes * section_items(spec, &content));
	}
	assert_int_equal(presets->n_cameras, with_optional ? 2 : 0);
	assert_int_equal(presets->n_lights, with_optional ? 3 : 0);
	if (with_optional) {
		assert_memory_equal(presets->camera, fixture.camera, sizeof fixture.camera);
		assert_memory_equal(presets->light, fixture.light, sizeof fixture.light);
	}
}

static void model_survives_memory_file_and_map_bit_by_bit(void **state)
{
	char folder[] = "/tmp/psr-model-XXXXXX", path[64];
	uint8_t id[16], other[16];

	(void)state;
	assert_non_null(mkdtemp(folder));
	snprintf(path, sizeof path, "%s/a.psr", folder);
	for (int with_optional = 0; with_optional < 2; with_optional++) {
		struct psr_model *made = NULL, *read = NULL, *mapped = NULL, *parsed = NULL;
		const uint8_t *bytes;
		size_t n_bytes;

		fixture_init(&fixture, with_optional);
		assert_int_equal(psr_model_create(&made, &fixture.info, &fixture.blocks, &fixture.presets, NULL), PSR_OK);
		assert_same(made, with_optional);
		assert_int_equal(psr_model_write(made, path, NULL), PSR_OK);
		assert_int_equal(psr_model_read(&read, path, NULL), PSR_OK);
		assert_int_equal(psr_model_map(&mapped, path, NULL), PSR_OK);
		bytes = model_image(read, &n_bytes);
		assert_int_equal(psr_model_parse(&parsed, bytes, n_bytes, NULL), PSR_OK);
		assert_same(read, with_optional);
		assert_same(mapped, with_optional);
		assert_same(parsed, with_optional);
		assert_true(psr_model_bytes(mapped) > n_bytes);
		psr_model_content_id(made, id);
		psr_model_content_id(mapped, other);
		assert_memory_equal(id, other, sizeof id);
		psr_model_unref(made);
		psr_model_unref(read);
		psr_model_unref(mapped);
		psr_model_unref(parsed);
	}
	psr_model_unref(NULL);
	unlink(path);
	assert_int_equal(rmdir(folder), 0);
}

static void content_id_changes_with_any_content(void **state)
{
	struct psr_model *a = NULL, *b = NULL;
	uint8_t id_a[16], id_b[16];

	(void)state;
	assert_int_equal(psr_model_create(&a, &fixture.info, &fixture.blocks, NULL, NULL), PSR_OK);
	fixture.attr[FIXTURE_SAMPLES - 1] ^= 1;
	assert_int_equal(psr_model_create(&b, &fixture.info, &fixture.blocks, NULL, NULL), PSR_OK);
	fixture.attr[FIXTURE_SAMPLES - 1] ^= 1;
	psr_model_content_id(a, id_a);
	psr_model_content_id(b, id_b);
	assert_memory_not_equal(id_a, id_b, sizeof id_a);
	psr_model_unref(a);
	psr_model_unref(b);
}

static void file_cut_at_any_length_is_refused_with_the_place(void **state)
{
	struct psr_error err;

	(void)state;
	for (size_t n = 0; n < n_image; n++) {
		char place[64];

		assert_int_equal(parse(image, n, &err), PSR_ERR_FORMAT);
		snprintf(place, sizeof place, "ends at byte %zu, within", n);
		assert_non_null(strstr(err.text, place));
	}
	assert_int_equal(parse(image, n_image, &err), PSR_OK);
	assert_int_equal(parse(image, file_get(entry_of(image, "DPTH") + ENTRY_OFFSET, 8) + 7, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "section DPTH (bytes "));
}

static void bytes_after_the_end_are_refused(void **state)
{
	uint8_t *longer = calloc(1, n_image + 64);
	struct psr_error err;

	(void)state;
	memcpy(longer, image, n_image);
	for (size_t extra = 1; extra <= 64; extra++) {
		assert_int_equal(parse(longer, n_image + extra, &err), PSR_ERR_FORMAT);
		assert_non_null(strstr(err.text, "follow the end of the last section, OPAC at byte"));
	}
	free(longer);
}

static void any_flipped_bit_is_noticed(void **state)
{
	struct psr_model *model = NULL;

	(void)state;
	for (size_t i = 0; i < n_image; i++) {
		for (int bit = 0; bit < 8; bit++) {
			struct psr_error err = { 0 };

			image[i] ^= (uint8_t)(1 << bit);
			assert_int_not_equal(parse(image, n_image, &err), PSR_OK);
			assert_int_equal(err.code, i == HEADER_MAJOR || i == HEADER_MAJOR + 1 ? PSR_ERR_VERSION : PSR_ERR_FORMAT);
			image[i] ^= (uint8_t)(1 << bit);
		}
	}
	assert_int_equal(psr_model_parse(&model, image, n_image, NULL), PSR_OK);
	psr_model_unref(model);
}

static void long_sections_are_hashed_by_the_megabyte(void **state)
{
	/* MASK and ATTR: 2,400,000 bytes, three chunks each. One, which is not listed: the others, of 600,000 bytes at
	 * most. */
	const uint32_t n_blocks = 300000;
	struct psr_blocks blocks = fixture.blocks;
	struct psr_cluster cluster = { { 0, 0, 0 }, 1, 0, n_blocks, 0, 0, { 0 } };
	struct psr_model *model = NULL;
	struct psr_error err = { 0 };
	void *arrays[N_KNOWN_SECTIONS] = { NULL };
	struct psr_run *run = calloc(n_blocks / PSR_RUN_BLOCKS + 1, sizeof *run);
	const uint8_t *bytes;
	uint8_t *copy;
	size_t n_bytes, at;

	(void)state;
	blocks.n_blocks = n_blocks;
	blocks.n_clusters = 1;
	blocks.n_levels = 1;
	blocks.n_samples = n_blocks;
	blocks.n_masks = 0;
	blocks.cluster = &cluster;
	blocks.run = run;
	for (uint32_t i = 0; i < n_blocks; i += PSR_RUN_BLOCKS)
		run[i / PSR_RUN_BLOCKS].attr_first = i;
	for (int k = SECTION_FIRST_ARRAY; k < SECTION_OCTREE; k++) {
		const struct section_spec *spec = &section_table[k];
		const void *array;

		if (spec->count < COUNT_MASKS)
			continue;
		arrays[k] = spec->flags ? calloc(n_blocks, spec->item_bytes) : NULL;
		array = arrays[k];
		memcpy((char *)&blocks + spec->pointer - offsetof(struct content, blocks), &array, sizeof array);
		for (uint32_t i = 0; i < n_blocks && memcmp(spec->type, "MASK", 4) == 0; i++)
			((uint64_t *)arrays[k])[i] = 1;
		for (uint32_t i = 0; i < n_blocks && memcmp(spec->type, "AOFF", 4) == 0; i++)
			((uint16_t *)arrays[k])[i] = (uint16_t)(i % PSR_RUN_BLOCKS);
	}
	assert_int_equal(psr_model_create(&model, &fixture.info, &blocks, NULL, &err), PSR_OK);
	bytes = model_image(model, &n_bytes);
	copy = malloc(n_bytes);
	memcpy(copy, bytes, n_bytes);
	assert_int_equal(file_get(copy + HEADER_N_CHUNKS, 4), 2 * 3);
	at = file_get(entry_of(copy, "ATTR") + ENTRY_OFFSET, 8) + FILE_CHUNK_BYTES + 5;
	copy[at] ^= 1;
	assert_int_equal(parse(copy, n_bytes, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "section ATTR at byte"));
	assert_non_null(strstr(err.text, "the hash of its chunk 1 differs"));
	copy[at] ^= 1;
	assert_int_equal(parse(copy, n_bytes, NULL), PSR_OK);
	/* The hashes of the chunks are themselves under the section's and the header's hash. */
	copy[FILE_HEADER_BYTES + FILE_ENTRY_BYTES * file_get(copy + HEADER_N_SECTIONS, 4) + 8] ^= 1;
	assert_int_equal(parse(copy, n_bytes, NULL), PSR_ERR_FORMAT);
	free(copy);
	psr_model_unref(model);
	for (int k = 0; k < N_KNOWN_SECTIONS; k++)
		free(arrays[k]);
	free(run);
}

static void sealing_changes_nothing_in_a_whole_image(void **state)
{
	uint8_t *copy = malloc(n_image);

	(void)state;
	memcpy(copy, image, n_image);
	file_seal(copy, n_image);
	assert_memory_equal(copy, image, n_image);
	memset(copy + HEADER_CONTENT_ID, 0, 16);
	memset(entry_of(copy, "ATTR") + ENTRY_HASH, 0, 8);
	file_seal(copy, n_image);
	assert_memory_equal(copy, image, n_image);
	free(copy);
}

static void missing_files_folders_and_pipes_are_told_apart(void **state)
{
	char folder[] = "/tmp/psr-model-XXXXXX", path[64];
	struct psr_model *model = NULL;
	struct psr_error err;
	FILE *file;

	(void)state;
	assert_non_null(mkdtemp(folder));
	snprintf(path, sizeof path, "%s/a", folder);
	assert_int_equal(psr_model_read(&model, path, &err), PSR_ERR_NOT_FOUND);
	assert_non_null(strstr(err.text, path));
	assert_int_equal(psr_model_map(&model, path, &err), PSR_ERR_NOT_FOUND);
	assert_int_equal(psr_model_read(&model, folder, &err), PSR_ERR_IO);
	assert_int_equal(mkfifo(path, 0600), 0);
	assert_int_equal(psr_model_map(&model, path, &err), PSR_ERR_IO);
	unlink(path);
	file = fopen(path, "w");
	assert_non_null(file);
	assert_int_equal(psr_model_map(&model, path, &err), PSR_ERR_FORMAT);
	fwrite("solid teapot, and more than sixty-four bytes of what is no such file at all", 1, 75, file);
	fclose(file);
	assert_int_equal(psr_model_read(&model, path, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "not a .psr file"));
	assert_int_equal(psr_model_parse(&model, "", 0, &err), PSR_ERR_FORMAT);
	assert_null(model);
	unlink(path);
	rmdir(folder);
}

static void *ref_and_unref(void *userdata)
{
	for (int i = 0; i < 20000; i++) {
		struct psr_model *model = psr_model_ref(userdata);

		if (psr_model_blocks(model)->n_blocks != FIXTURE_BLOCKS)
			abort();
		psr_model_unref(model);
	}
	psr_model_unref(userdata);
	return NULL;
}

static void last_of_many_threads_frees_the_model(void **state)
{
	struct psr_model *model = NULL;
	pthread_t threads[4];

	(void)state;
	assert_int_equal(psr_model_parse(&model, image, n_image, NULL), PSR_OK);
	for (int i = 0; i < 4; i++)
		assert_int_equal(pthread_create(&threads[i], NULL, ref_and_unref, psr_model_ref(model)), 0);
	psr_model_unref(model);
	for (int i = 0; i < 4; i++)
		pthread_join(threads[i], NULL);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(model_survives_memory_file_and_map_bit_by_bit),
		cmocka_unit_test(content_id_changes_with_any_content),
		cmocka_unit_test(file_cut_at_any_length_is_refused_with_the_place),
		cmocka_unit_test(bytes_after_the_end_are_refused),
		cmocka_unit_test(any_flipped_bit_is_noticed),
		cmocka_unit_test(long_sections_are_hashed_by_the_megabyte),
		cmocka_unit_test(sealing_changes_nothing_in_a_whole_image),
		cmocka_unit_test(missing_files_folders_and_pipes_are_told_apart),
		cmocka_unit_test(last_of_many_threads_frees_the_model),
	};

	return cmocka_run_group_tests(tests, setup, teardown);
}

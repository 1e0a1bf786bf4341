#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "psr/frame.h"

static void a_frame_gets_the_planes_that_are_asked_for(void **state)
{
	struct psr_frame frame;

	(void)state;
	for (unsigned planes = 1; planes >> PSR_N_PLANES == 0; planes++) {
		assert_int_equal(psr_frame_alloc(&frame, 5, 3, planes, NULL), PSR_OK);
		assert_int_equal(frame.width, 5);
		assert_int_equal(frame.height, 3);
		for (unsigned plane = 0; plane < PSR_N_PLANES; plane++) {
			assert_int_equal(psr_frame_plane(&frame, plane) != NULL, planes >> plane & 1);
			if (planes >> plane & 1) /* the sanitizer watches the end */
				memset(psr_frame_plane(&frame, plane), 1, 15 * psr_plane_bytes(plane));
		}
		psr_frame_free(&frame);
		assert_null(frame.rgb);
	}
	psr_frame_free(&frame);
}

static void planes_are_their_members(void **state)
{
	struct psr_frame frame;

	(void)state;
	assert_int_equal(psr_frame_alloc(&frame, 1, 1, (1u << PSR_N_PLANES) - 1, NULL), PSR_OK);
	assert_ptr_equal(psr_frame_plane(&frame, PSR_PLANE_COLOR), frame.rgb);
	assert_ptr_equal(psr_frame_plane(&frame, PSR_PLANE_DEPTH), frame.depth);
	assert_ptr_equal(psr_frame_plane(&frame, PSR_PLANE_NORMAL), frame.normal);
	assert_ptr_equal(psr_frame_plane(&frame, PSR_PLANE_ID), frame.id);
	assert_ptr_equal(psr_frame_plane(&frame, PSR_PLANE_WEIGHT), frame.weight);
	assert_ptr_equal(psr_frame_plane(&frame, PSR_PLANE_WORDS), frame.words);
	assert_ptr_equal(psr_frame_plane(&frame, PSR_PLANE_BLOCK), frame.block);
	assert_ptr_equal(psr_frame_plane(&frame, PSR_PLANE_BOUND), frame.bound);
	psr_frame_free(&frame);
}

static void sizes_and_planes_that_cannot_be_are_refused(void **state)
{
	static const struct { uint32_t width, height; unsigned planes; int code; } rows[] = {
		{ 0, 1, 1, PSR_ERR_ARG }, { 1, 0, 1, PSR_ERR_ARG }, { 1, 1, 0, PSR_ERR_ARG },
		{ 1, 1, 1u << PSR_N_PLANES, PSR_ERR_ARG }, { PSR_MAX_SIDE + 1, 1, 1, PSR_ERR_LIMIT },
		{ 1, PSR_MAX_SIDE + 1, 1, PSR_ERR_LIMIT }, { PSR_MAX_SIDE, PSR_MAX_SIDE, 1, PSR_ERR_LIMIT },
	};

	(void)state;
	for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
		struct psr_frame frame = { .width = 7 };
		struct psr_error err = { 0, "" };

		assert_int_equal(psr_frame_alloc(&frame, rows[i].width, rows[i].height, rows[i].planes, &err), rows[i].code);
		assert_int_equal(err.code, rows[i].code);
		assert_int_equal(frame.width, 0);
	}
}

/* Made by another program, in Python from the text of XXH64. */
static void the_hash_is_that_of_the_strips(void **state)
{
	static const struct {
		uint32_t height;
		uint64_t hash;
	} rows[] = { { 300, UINT64_C(0x298c4d1b89110f4f) }, { 256, UINT64_C(0x25e10b563baf22a9) } };
	const struct psr_frame tiny = { .width = 1, .height = 1, .rgb = (uint8_t *)"abc" };
	uint8_t pixels[3 * 5 * 300];

	(void)state;
	assert_true(psr_frame_hash(&tiny, PSR_PLANE_COLOR) == UINT64_C(0xb32a991d315bd521));
	for (uint32_t i = 0; i < sizeof pixels; i++)
		pixels[i] = (uint8_t)(i * i + i / 7);
	for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
		const struct psr_frame frame = { .width = 5, .height = rows[i].height, .rgb = pixels };

		assert_true(psr_frame_hash(&frame, PSR_PLANE_COLOR) == rows[i].hash);
	}
}

static void an_image_reads_back(void **state)
{
	const char *folder = getenv("TMPDIR");
	char path[256];
	png_image image = { .version = PNG_IMAGE_VERSION };
	struct psr_frame frame;
	struct psr_error err;
	uint8_t back[3 * 7 * 5];

	(void)state;
	snprintf(path, sizeof path, "%.200s/psr-frame-%ld.png", folder != NULL ? folder : "/tmp", (long)getpid());
	assert_int_equal(psr_frame_alloc(&frame, 7, 5, 1 << PSR_PLANE_COLOR, NULL), PSR_OK);
	for (size_t i = 0; i < sizeof back; i++)
		frame.rgb[i] = (uint8_t)(i * 41 + 7);
	assert_int_equal(psr_image_write(&frame, path, &err), PSR_OK);
	assert_true(png_image_begin_read_from_file(&image, path));
	assert_int_equal(image.width, 7);
	assert_int_equal(image.height, 5);
	image.format = PNG_FORMAT_RGB;
	assert_true(png_image_finish_read(&image, NULL, back, 0, NULL));
	assert_memory_equal(back, frame.rgb, sizeof back);
	unlink(path);
	psr_frame_free(&frame);
}

static void images_without_colour_or_folder_are_refused(void **state)
{
	uint8_t rgb[3] = { 0 };
	float depth = 1;
	const struct psr_frame frame = { .width = 1, .height = 1, .rgb = rgb };
	const struct psr_frame colourless = { .width = 1, .height = 1, .depth = &depth };
	struct psr_error err;

	(void)state;
	assert_int_equal(psr_image_write(&colourless, "/tmp/a.png", &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "no colour"));
	assert_int_equal(psr_image_write(&frame, "/nowhere/at/all/a.png", &err), PSR_ERR_NOT_FOUND);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_frame_gets_the_planes_that_are_asked_for),
		cmocka_unit_test(planes_are_their_members),
		cmocka_unit_test(sizes_and_planes_that_cannot_be_are_refused),
		cmocka_unit_test(the_hash_is_that_of_the_strips),
		cmocka_unit_test(an_image_reads_back),
		cmocka_unit_test(images_without_colour_or_folder_are_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

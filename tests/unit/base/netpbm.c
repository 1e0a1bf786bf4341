#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "base/netpbm.h"
#include "tests/unit/lib/folder.h"

static uint32_t width, height;
static uint8_t *rgb;
static float *depth;

static int read_ppm(const void *bytes, size_t n)
{
	struct psr_error err;
	int code;

	write_file("f", bytes, n);
	rgb = NULL;
	code = ppm_read(&rgb, &width, &height, in_folder("f"), &err);
	assert_true((code == PSR_OK) == (rgb != NULL));
	return code;
}

static int read_pfm(const void *bytes, size_t n)
{
	struct psr_error err;
	int code;

	write_file("f", bytes, n);
	depth = NULL;
	code = pfm_read(&depth, &width, &height, in_folder("f"), &err);
	assert_true((code == PSR_OK) == (depth != NULL));
	return code;
}

static const char color[] = "P6\n2 1\n255\nabcdef";
/* 2x2: 1 and 2 above +inf and -0.5. */
static const char little[] = "Pf\n2 2\n-1.0\n\0\0\x80\x7f\0\0\0\xbf\0\0\x80\x3f\0\0\0\x40";
static const char big[] = "Pf\n2 2\n1.0\n\x7f\x80\0\0\xbf\0\0\0\x3f\x80\0\0\x40\0\0\0";

static void ppm_pixels_come_as_they_are(void **state)
{
	(void)state;
	assert_int_equal(read_ppm(color, sizeof color - 1), PSR_OK);
	assert_int_equal(width, 2);
	assert_int_equal(height, 1);
	assert_memory_equal(rgb, "abcdef", 6);
	free(rgb);
}

static void ppm_truncated_at_any_length_is_refused(void **state)
{
	(void)state;
	for (size_t n = 0; n < sizeof color - 1; n++)
		assert_int_equal(read_ppm(color, n), PSR_ERR_FORMAT);
}

static void ppm_of_other_kinds_and_lying_sizes_is_refused(void **state)
{
	static const char *const bad[] = { "P3\n1 1\n255\n1 2 3", "P6\n1 1\n65535\nabcdef", "Pf\n1 1\n-1\nabcd" };

	(void)state;
	for (int i = 0; i < 3; i++)
		assert_int_equal(read_ppm(bad[i], strlen(bad[i])), PSR_ERR_FORMAT);
	assert_int_equal(read_ppm("P6\n0 1\n255\n", 11), PSR_ERR_LIMIT);
	assert_int_equal(read_ppm("P6\n99999 99999\n255\n", 19), PSR_ERR_LIMIT);
	assert_int_equal(ppm_read(&rgb, &width, &height, "/nonexistent.ppm", NULL), PSR_ERR_NOT_FOUND);
}

static void assert_rows(const char *bytes, size_t n)
{
	assert_int_equal(read_pfm(bytes, n), PSR_OK);
	assert_int_equal(width, 2);
	assert_int_equal(height, 2);
	assert_true(depth[0] == 1 && depth[1] == 2 && isinf(depth[2]) && depth[3] == -0.5f);
	free(depth);
}

static void pfm_rows_come_from_the_top_in_either_byte_order(void **state)
{
	(void)state;
	assert_rows(little, sizeof little - 1);
	assert_rows(big, sizeof big - 1);
}

static void pfm_truncated_at_any_length_is_refused(void **state)
{
	(void)state;
	for (size_t n = 0; n < sizeof little - 1; n++)
		assert_int_equal(read_pfm(little, n), PSR_ERR_FORMAT);
	assert_int_equal(read_pfm(little, sizeof little), PSR_ERR_FORMAT); /* one byte more */
}

static void pfm_lies_in_the_header_are_refused(void **state)
{
	static const struct {
		const char *text;
		int code;
	} cases[] = {
		{ "PF\n2 2\n-1\n", PSR_ERR_FORMAT }, { "P5\n2 2\n-1\n", PSR_ERR_FORMAT }, { "Pf\n2 2\n0\n", PSR_ERR_FORMAT },
		{ "Pf\n0 2\n-1\n", PSR_ERR_LIMIT },  { "Pf\n2 100000\n-1\n", PSR_ERR_LIMIT },
		{ "Pf\n16384 16384\n-1\n", PSR_ERR_LIMIT },
	};

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
		assert_int_equal(read_pfm(cases[i].text, strlen(cases[i].text)), cases[i].code);
	assert_int_equal(pfm_read(&depth, &width, &height, "/nonexistent/frame.pfm", NULL), PSR_ERR_NOT_FOUND);
}

static void what_was_written_is_read_back(void **state)
{
	static uint8_t pixels[12] = { 0, 1, 2, 13, 10, 32, 255, 254, 253, 7, 8, 9 };
	static float depths[4] = { 1, INFINITY, -0.5f, 1e-30f };
	const struct psr_frame frame = { .width = 2, .height = 2, .rgb = pixels, .depth = depths };
	struct outfile file;

	(void)state;
	assert_int_equal(outfile_open(&file, in_folder("f"), OUTFILE_PLAIN, NULL), PSR_OK);
	assert_int_equal(ppm_write_frame(&file, &frame, NULL), PSR_OK);
	assert_int_equal(outfile_close(&file, PSR_OK, NULL), PSR_OK);
	assert_int_equal(ppm_read(&rgb, &width, &height, in_folder("f"), NULL), PSR_OK);
	assert_true(width == 2 && height == 2);
	assert_memory_equal(rgb, pixels, sizeof pixels);
	free(rgb);
	assert_int_equal(outfile_open(&file, in_folder("f"), OUTFILE_PLAIN, NULL), PSR_OK);
	assert_int_equal(pfm_write_frame(&file, &frame, NULL), PSR_OK);
	assert_int_equal(outfile_close(&file, PSR_OK, NULL), PSR_OK);
	assert_int_equal(pfm_read(&depth, &width, &height, in_folder("f"), NULL), PSR_OK);
	assert_true(width == 2 && height == 2);
	assert_memory_equal(depth, depths, sizeof depths);
	free(depth);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(ppm_pixels_come_as_they_are),
		cmocka_unit_test(ppm_truncated_at_any_length_is_refused),
		cmocka_unit_test(ppm_of_other_kinds_and_lying_sizes_is_refused),
		cmocka_unit_test(pfm_rows_come_from_the_top_in_either_byte_order),
		cmocka_unit_test(pfm_truncated_at_any_length_is_refused),
		cmocka_unit_test(pfm_lies_in_the_header_are_refused),
		cmocka_unit_test(what_was_written_is_read_back),
	};

	return cmocka_run_group_tests(tests, make_folder, remove_folder);
}

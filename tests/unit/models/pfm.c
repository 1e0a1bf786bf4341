#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "models/pfm.h"

static char path[] = "/tmp/psr-pfm-XXXXXX";

static int make_file(void **state)
{
	int fd = mkstemp(path);

	(void)state;
	return fd < 0 || close(fd) != 0;
}

static int remove_file(void **state)
{
	(void)state;
	return unlink(path);
}

static void write_file(const void *bytes, size_t n)
{
	FILE *file = fopen(path, "wb");

	assert_non_null(file);
	assert_int_equal(fwrite(bytes, 1, n, file), n);
	assert_int_equal(fclose(file), 0);
}

static int read_file(float **depth, uint32_t *width, uint32_t *height)
{
	struct psr_error err;

	*depth = NULL;
	return pfm_read(depth, width, height, path, &err);
}

/* 2x2: 1 and 2 above +inf and -0.5. */
static const char little[] = "Pf\n2 2\n-1.0\n\0\0\x80\x7f\0\0\0\xbf\0\0\x80\x3f\0\0\0\x40";
static const char big[] = "Pf\n2 2\n1.0\n\x7f\x80\0\0\xbf\0\0\0\x3f\x80\0\0\x40\0\0\0";

static void assert_rows(const char *bytes, size_t n)
{
	uint32_t width, height;
	float *depth;

	write_file(bytes, n);
	assert_int_equal(read_file(&depth, &width, &height), PSR_OK);
	assert_int_equal(width, 2);
	assert_int_equal(height, 2);
	assert_true(depth[0] == 1 && depth[1] == 2 && isinf(depth[2]) && depth[3] == -0.5f);
	free(depth);
}

static void rows_come_from_the_top_in_either_byte_order(void **state)
{
	(void)state;
	assert_rows(little, sizeof little - 1);
	assert_rows(big, sizeof big - 1);
}

static void every_truncation_is_refused(void **state)
{
	(void)state;
	for (size_t n = 0; n < sizeof little - 1; n++) {
		uint32_t width, height;
		float *depth;

		write_file(little, n);
		assert_int_equal(read_file(&depth, &width, &height), PSR_ERR_FORMAT);
		assert_null(depth);
	}
	write_file(little, sizeof little); /* and one byte more */
	uint32_t width, height;
	float *depth;

	assert_int_equal(read_file(&depth, &width, &height), PSR_ERR_FORMAT);
}

static void lies_in_the_header_are_refused(void **state)
{
	static const struct {
		const char *text;
		int code;
	} cases[] = {
		{ "PF\n2 2\n-1\n", PSR_ERR_FORMAT }, { "P5\n2 2\n-1\n", PSR_ERR_FORMAT }, { "Pf\n2 2\n0\n", PSR_ERR_FORMAT },
		{ "Pf\n0 2\n-1\n", PSR_ERR_LIMIT },  { "Pf\n2 100000\n-1\n", PSR_ERR_LIMIT },
		{ "Pf\n16384 16384\n-1\n", PSR_ERR_LIMIT },
	};
	uint32_t width, height;
	float *depth;

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		write_file(cases[i].text, strlen(cases[i].text));
		assert_int_equal(read_file(&depth, &width, &height), cases[i].code);
		assert_null(depth);
	}
	assert_int_equal(pfm_read(&depth, &width, &height, "/nonexistent/frame.pfm", NULL), PSR_ERR_NOT_FOUND);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(rows_come_from_the_top_in_either_byte_order),
		cmocka_unit_test(every_truncation_is_refused),
		cmocka_unit_test(lies_in_the_header_are_refused),
	};

	return cmocka_run_group_tests(tests, make_file, remove_file);
}

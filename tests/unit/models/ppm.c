#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "models/ppm.h"

static int read_bytes(const char *bytes, size_t n, uint8_t **rgb, uint32_t *width, uint32_t *height)
{
	char path[] = "/tmp/psr-ppm-XXXXXX";
	int fd = mkstemp(path), code;
	struct psr_error err;

	assert_true(fd >= 0);
	assert_int_equal(write(fd, bytes, n), (ssize_t)n);
	close(fd);
	*rgb = NULL;
	code = ppm_read(rgb, width, height, path, &err);
	unlink(path);
	return code;
}

static const char good[] = "P6\n2 1\n255\nabcdef";

static void pixels_come_as_they_are(void **state)
{
	uint32_t width, height;
	uint8_t *rgb;

	(void)state;
	assert_int_equal(read_bytes(good, sizeof good - 1, &rgb, &width, &height), PSR_OK);
	assert_int_equal(width, 2);
	assert_int_equal(height, 1);
	assert_memory_equal(rgb, "abcdef", 6);
	free(rgb);
}

static void truncation_at_every_length_is_an_error(void **state)
{
	uint32_t width, height;
	uint8_t *rgb;

	(void)state;
	for (size_t n = 0; n < sizeof good - 1; n++)
		assert_int_equal(read_bytes(good, n, &rgb, &width, &height), PSR_ERR_FORMAT);
}

static void other_kinds_and_lying_sizes_are_refused(void **state)
{
	static const char *const bad[] = { "P3\n1 1\n255\n1 2 3", "P6\n1 1\n65535\nabcdef", "Pf\n1 1\n-1\nabcd" };
	uint32_t width, height;
	uint8_t *rgb;

	(void)state;
	for (int i = 0; i < 3; i++)
		assert_int_equal(read_bytes(bad[i], strlen(bad[i]), &rgb, &width, &height), PSR_ERR_FORMAT);
	assert_int_equal(read_bytes("P6\n0 1\n255\n", 11, &rgb, &width, &height), PSR_ERR_LIMIT);
	assert_int_equal(read_bytes("P6\n99999 99999\n255\n", 19, &rgb, &width, &height), PSR_ERR_LIMIT);
	assert_int_equal(ppm_read(&rgb, &width, &height, "/nonexistent.ppm", NULL), PSR_ERR_NOT_FOUND);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(pixels_come_as_they_are),
		cmocka_unit_test(truncation_at_every_length_is_an_error),
		cmocka_unit_test(other_kinds_and_lying_sizes_are_refused),
	};
	return cmocka_run_group_tests(tests, NULL, NULL);
}

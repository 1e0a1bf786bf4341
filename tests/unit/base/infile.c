#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "base/infile.h"

static char path[] = "/tmp/psr-infile-XXXXXX";
static struct psr_error err;

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

static void write_bytes(const void *bytes, size_t n)
{
	FILE *file = fopen(path, "wb");

	assert_non_null(file);
	assert_int_equal(fwrite(bytes, 1, n, file), n);
	assert_int_equal(fclose(file), 0);
}

static void bytes_of_any_value_come_whole(void **state)
{
	uint8_t *bytes;
	size_t n;

	(void)state;
	write_bytes("a\0b", 3);
	assert_int_equal(infile_read(&bytes, &n, path, 3, NULL), PSR_OK);
	assert_int_equal(n, 3);
	assert_memory_equal(bytes, "a\0b", 3);
	free(bytes);
	write_bytes("", 0);
	assert_int_equal(infile_read(&bytes, &n, path, 0, NULL), PSR_OK);
	assert_int_equal(n, 0);
	free(bytes);
}

/* Lengths about those at which the memory grows. */
static void text_comes_from_pipes_of_any_length(void **state)
{
	char command[128], *text;

	(void)state;
	for (int n = 4095; n <= 8193; n += n == 4097 ? 4094 : 1) {
		int fd;
		FILE *pipe;

		snprintf(command, sizeof command, "head -c %d /dev/zero | tr '\\0' x", n);
		pipe = popen(command, "r");
		assert_non_null(pipe);
		fd = fileno(pipe);
		snprintf(command, sizeof command, "/dev/fd/%d", fd);
		assert_int_equal(infile_read_text(&text, command, 8193, NULL), PSR_OK);
		assert_int_equal(strlen(text), n);
		assert_int_equal(strspn(text, "x"), n);
		free(text);
		pclose(pipe);
	}
}

static void other_files_are_refused(void **state)
{
	uint8_t *bytes = NULL;
	char *text = NULL;
	size_t n;

	(void)state;
	assert_int_equal(infile_read(&bytes, &n, "/nonexistent", 9, &err), PSR_ERR_NOT_FOUND);
	assert_non_null(strstr(err.text, "/nonexistent: No such file"));
	assert_int_equal(infile_read_text(&text, "/nonexistent", 9, &err), PSR_ERR_NOT_FOUND);
	assert_int_equal(infile_read(&bytes, &n, "/dev/zero", 9, &err), PSR_ERR_IO);
	assert_int_equal(infile_read(&bytes, &n, "/tmp", 9, &err), PSR_ERR_IO);
	assert_int_equal(infile_read_text(&text, "/tmp", 9, &err), PSR_ERR_IO);
	write_bytes("12345\0", 6);
	assert_int_equal(infile_read(&bytes, &n, path, 5, &err), PSR_ERR_LIMIT);
	assert_int_equal(infile_read_text(&text, path, 5, &err), PSR_ERR_LIMIT);
	assert_int_equal(infile_read_text(&text, path, 6, &err), PSR_ERR_FORMAT);
	assert_non_null(strstr(err.text, "byte 5 is 0"));
	assert_null(bytes);
	assert_null(text);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(bytes_of_any_value_come_whole),
		cmocka_unit_test(text_comes_from_pipes_of_any_length),
		cmocka_unit_test(other_files_are_refused),
	};

	return cmocka_run_group_tests(tests, make_file, remove_file);
}

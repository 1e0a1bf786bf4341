#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/infile.h"
#include "tests/unit/lib/folder.h"

static struct psr_error err;

static void bytes_of_any_value_come_whole(void **state)
{
	uint8_t *bytes;
	size_t n;

	(void)state;
	write_file("f", "a\0b", 3);
	assert_int_equal(infile_read(&bytes, &n, in_folder("f"), 3, NULL), PSR_OK);
	assert_int_equal(n, 3);
	assert_memory_equal(bytes, "a\0b", 3);
	free(bytes);
	write_file("f", "", 0);
	assert_int_equal(infile_read(&bytes, &n, in_folder("f"), 0, NULL), PSR_OK);
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
	write_file("f", "12345\0", 6);
	assert_int_equal(infile_read(&bytes, &n, in_folder("f"), 5, &err), PSR_ERR_LIMIT);
	assert_int_equal(infile_read_text(&text, in_folder("f"), 5, &err), PSR_ERR_LIMIT);
	assert_int_equal(infile_read_text(&text, in_folder("f"), 6, &err), PSR_ERR_FORMAT);
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

	return cmocka_run_group_tests(tests, make_folder, remove_folder);
}

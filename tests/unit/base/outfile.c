#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <sys/stat.h>
#include "base/outfile.h"
#include "tests/unit/lib/folder.h"

static const uint8_t bytes[5] = { 1, 2, 3, 4, 5 };
static const enum outfile_kind kinds[] = { OUTFILE_PLAIN, OUTFILE_DURABLE };
static const char *path;

static void assert_holds_bytes(const char *name)
{
	uint8_t back[8];

	assert_int_equal(read_file(name, back, sizeof back), sizeof bytes);
	assert_memory_equal(back, bytes, sizeof bytes);
}

static void written_file_has_the_bytes_and_usual_permissions(void **state)
{
	struct stat info;

	(void)state;
	for (int i = 0; i < 2; i++) {
		mode_t mask = umask(027);

		assert_int_equal(outfile_save(path = in_folder("out"), kinds[i], bytes, sizeof bytes, NULL), PSR_OK);
		umask(mask);
		assert_int_equal(stat(path, &info), 0);
		assert_int_equal(info.st_mode & 0777, 0640);
		assert_holds_bytes("out");
		assert_int_equal(count_files(), 1);
		unlink(path);
	}
}

static void unwritable_output_is_an_error_and_leaves_nothing(void **state)
{
	struct psr_error err = { 0 };

	(void)state;
	assert_int_equal(mkdir(in_folder("taken"), 0700), 0);
	for (int i = 0; i < 2; i++) {
		path = in_folder("no/such/folder");
		assert_int_equal(outfile_save(path, kinds[i], bytes, sizeof bytes, &err), PSR_ERR_NOT_FOUND);
		assert_int_equal(err.code, PSR_ERR_NOT_FOUND);
		assert_non_null(strstr(err.text, path));
		/* a folder cannot be replaced by a file */
		assert_int_equal(outfile_save(in_folder("taken"), kinds[i], bytes, sizeof bytes, &err), PSR_ERR_IO);
		assert_int_equal(count_files(), 1);
	}
}

static void failed_content_leaves_the_old_file(void **state)
{
	struct outfile file;

	(void)state;
	for (int i = 0; i < 2; i++) {
		assert_int_equal(outfile_save(path = in_folder("kept"), kinds[i], bytes, sizeof bytes, NULL), PSR_OK);
		assert_int_equal(outfile_open(&file, path, kinds[i], NULL), PSR_OK);
		outfile_write(&file, "other", 5);
		assert_int_equal(outfile_close(&file, PSR_ERR_FORMAT, NULL), PSR_ERR_FORMAT);
		assert_holds_bytes("kept");
		assert_int_equal(count_files(), 1);
	}
}

static void link_to_a_file_stays_a_link(void **state)
{
	struct stat info;

	(void)state;
	write_file("real", "", 0);
	assert_int_equal(symlink("real", in_folder("link")), 0);
	for (int i = 0; i < 2; i++) {
		assert_int_equal(outfile_save(path = in_folder("link"), kinds[i], bytes, sizeof bytes, NULL), PSR_OK);
		assert_int_equal(lstat(path, &info), 0);
		assert_true(S_ISLNK(info.st_mode));
		assert_holds_bytes("real");
	}
}

static void a_name_as_long_as_names_may_be_can_be_written(void **state)
{
	char name[NAME_MAX + 1];

	(void)state;
	memset(name, 'n', NAME_MAX);
	name[NAME_MAX] = '\0';
	assert_int_equal(outfile_save(in_folder(name), OUTFILE_PLAIN, bytes, sizeof bytes, NULL), PSR_OK);
	assert_holds_bytes(name);
}

static void remains_of_one_process_are_removed(void **state)
{
	struct outfile first, second;

	(void)state;
	write_file(".psr-1-0.psr", "", 0);
	write_file("m.psr", "", 0);
	path = in_folder("m.psr");
	assert_int_equal(outfile_open(&first, path, OUTFILE_DURABLE, NULL), PSR_OK);
	assert_int_equal(outfile_open(&second, path, OUTFILE_DURABLE, NULL), PSR_OK);
	assert_int_equal(count_files(), 4);
	outfile_remove_remains(path, getpid());
	assert_int_equal(count_files(), 2);
	assert_int_equal(outfile_close(&first, PSR_ERR_CANCELLED, NULL), PSR_ERR_CANCELLED);
	assert_int_equal(outfile_close(&second, PSR_ERR_CANCELLED, NULL), PSR_ERR_CANCELLED);
	assert_int_equal(access(path, F_OK), 0);
}

static void the_ending_is_that_of_the_name(void **state)
{
	(void)state;
	assert_string_equal(outfile_ending("a.b/c.tar.gz"), "gz");
	assert_string_equal(outfile_ending("a.b/c"), "");
	assert_string_equal(outfile_ending("a/.png"), "");
	assert_string_equal(outfile_ending("c."), "");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(written_file_has_the_bytes_and_usual_permissions, make_folder, remove_folder),
		cmocka_unit_test_setup_teardown(unwritable_output_is_an_error_and_leaves_nothing, make_folder, remove_folder),
		cmocka_unit_test_setup_teardown(failed_content_leaves_the_old_file, make_folder, remove_folder),
		cmocka_unit_test_setup_teardown(link_to_a_file_stays_a_link, make_folder, remove_folder),
		cmocka_unit_test_setup_teardown(a_name_as_long_as_names_may_be_can_be_written, make_folder, remove_folder),
		cmocka_unit_test_setup_teardown(remains_of_one_process_are_removed, make_folder, remove_folder),
		cmocka_unit_test(the_ending_is_that_of_the_name),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

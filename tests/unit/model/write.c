#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#include "fixture.h"
#include "tests/unit/lib/folder.h"

static char path[64];

static int (*const writers[])(const struct psr_model *, const char *, struct psr_error *) = {
	psr_model_write, psr_model_write_packed,
};
static struct psr_model *one, *two; /* of different content */

static int setup(void **state)
{
	struct fixture f;

	assert_int_equal(make_folder(state), 0);
	snprintf(path, sizeof path, "%s/m.psr", folder);
	fixture_init(&f, 0);
	assert_int_equal(psr_model_create(&one, &f.info, &f.blocks, NULL, NULL), PSR_OK);
	fixture_init(&f, 1);
	assert_int_equal(psr_model_create(&two, &f.info, &f.blocks, NULL, NULL), PSR_OK);
	return 0;
}

static int teardown(void **state)
{
	(void)state;
	psr_model_unref(one);
	psr_model_unref(two);
	unlink(path);
	return rmdir(folder);
}

static void assert_holds(const struct psr_model *model)
{
	struct psr_model *read = NULL;
	uint8_t a[16], b[16];

	assert_int_equal(psr_model_read(&read, path, NULL), PSR_OK);
	psr_model_content_id(model, a);
	psr_model_content_id(read, b);
	assert_memory_equal(a, b, sizeof a);
	psr_model_unref(read);
}

static void written_twice_gives_the_same_bytes(void **state)
{
	static uint8_t a[65536], b[65536];
	struct psr_model *read = NULL;
	size_t n;

	(void)state;
	assert_int_equal(psr_model_write(one, path, NULL), PSR_OK);
	n = read_file("m.psr", a, sizeof a);
	assert_true(n > 64 && n < sizeof a);
	assert_int_equal(psr_model_read(&read, path, NULL), PSR_OK);
	assert_int_equal(psr_model_write(read, path, NULL), PSR_OK);
	psr_model_unref(read);
	assert_int_equal(read_file("m.psr", b, sizeof b), n);
	assert_memory_equal(a, b, n);
	assert_int_equal(count_files(), 1);
}

static void writing_replaces_the_whole_file_even_under_its_own_map(void **state)
{
	struct psr_model *mapped = NULL;

	(void)state;
	assert_int_equal(psr_model_write(one, path, NULL), PSR_OK);
	assert_int_equal(psr_model_map(&mapped, path, NULL), PSR_OK);
	assert_int_equal(psr_model_write(two, path, NULL), PSR_OK);
	assert_holds(two);
	assert_int_equal(psr_model_write(mapped, path, NULL), PSR_OK);
	assert_holds(one);
	psr_model_unref(mapped);
}

static void full_disk_leaves_the_old_file_and_nothing_else(void **state)
{
	struct rlimit limit, low;
	struct psr_error err;

	(void)state;
	for (int i = 0; i < 2; i++) {
		int code;

		assert_int_equal(psr_model_write(one, path, NULL), PSR_OK);
		assert_int_equal(getrlimit(RLIMIT_FSIZE, &limit), 0);
		signal(SIGXFSZ, SIG_IGN);
		low = (struct rlimit){ .rlim_cur = 1000, .rlim_max = limit.rlim_max };
		assert_int_equal(setrlimit(RLIMIT_FSIZE, &low), 0);
		code = writers[i](two, path, &err);
		assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
		signal(SIGXFSZ, SIG_DFL);
		assert_int_equal(code, PSR_ERR_IO);
		assert_non_null(strstr(err.text, "m.psr: File too large"));
		assert_holds(one);
		assert_int_equal(count_files(), 1);
	}
}

static void devices_and_folders_are_never_replaced(void **state)
{
	struct psr_error err;
	struct stat st;

	(void)state;
	for (int i = 0; i < 2; i++) {
		assert_int_equal(writers[i](one, "/dev/full", &err), PSR_ERR_IO);
		assert_int_equal(stat("/dev/full", &st), 0);
		assert_true(S_ISCHR(st.st_mode));
		assert_int_equal(writers[i](one, folder, &err), PSR_ERR_IO);
		assert_non_null(strstr(err.text, "is not a regular file"));
	}
}

static void missing_folder_is_an_error_with_the_path(void **state)
{
	char nowhere[96];
	struct psr_error err;

	(void)state;
	snprintf(nowhere, sizeof nowhere, "%s/none/m.psr", folder);
	for (int i = 0; i < 2; i++) {
		assert_int_equal(writers[i](one, nowhere, &err), PSR_ERR_NOT_FOUND);
		assert_non_null(strstr(err.text, nowhere));
		assert_non_null(strstr(err.text, "No such file or directory"));
	}
}

static void new_files_have_the_permissions_of_the_umask(void **state)
{
	mode_t before = umask(027);
	struct stat st;

	(void)state;
	unlink(path);
	assert_int_equal(psr_model_write(one, path, NULL), PSR_OK);
	umask(before);
	assert_int_equal(stat(path, &st), 0);
	assert_int_equal(st.st_mode & 0777, 0640);
}

static void path_without_a_folder_is_in_the_working_one(void **state)
{
	int back = open(".", O_RDONLY | O_DIRECTORY);

	(void)state;
	assert_true(back >= 0);
	assert_int_equal(chdir(folder), 0);
	assert_int_equal(psr_model_write(two, "m.psr", NULL), PSR_OK);
	assert_int_equal(fchdir(back), 0);
	close(back);
	assert_holds(two);
}

static void *write_often(void *model)
{
	for (int i = 0; i < 30; i++)
		if (psr_model_write(model, path, NULL) != PSR_OK)
			return NULL;
	return model;
}

static void writers_and_readers_at_once_see_whole_files(void **state)
{
	pthread_t threads[2];
	void *result[2];
	struct psr_model *read;

	(void)state;
	assert_int_equal(psr_model_write(one, path, NULL), PSR_OK);
	assert_int_equal(pthread_create(&threads[0], NULL, write_often, one), 0);
	assert_int_equal(pthread_create(&threads[1], NULL, write_often, two), 0);
	for (int i = 0; i < 100; i++) {
		assert_int_equal(psr_model_read(&read, path, NULL), PSR_OK);
		psr_model_unref(read);
	}
	pthread_join(threads[0], &result[0]);
	pthread_join(threads[1], &result[1]);
	assert_true(result[0] != NULL && result[1] != NULL);
	assert_int_equal(count_files(), 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(written_twice_gives_the_same_bytes),
		cmocka_unit_test(writing_replaces_the_whole_file_even_under_its_own_map),
		cmocka_unit_test(full_disk_leaves_the_old_file_and_nothing_else),
		cmocka_unit_test(devices_and_folders_are_never_replaced),
		cmocka_unit_test(missing_folder_is_an_error_with_the_path),
		cmocka_unit_test(new_files_have_the_permissions_of_the_umask),
		cmocka_unit_test(path_without_a_folder_is_in_the_working_one),
		cmocka_unit_test(writers_and_readers_at_once_see_whole_files),
	};

	return cmocka_run_group_tests(tests, setup, teardown);
}

/* The cache of built models: its size, who may write to it; and texts for clients. */
#define _GNU_SOURCE
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include "server/models/cache.h"
#include "server/models/hide.h"
#include "fixture.h"

#define KEY_A "0123456789abcdef0123456789abcdef"
#define KEY_B "1123456789abcdef0123456789abcdef"
#define KEY_C "2123456789abcdef0123456789abcdef"

static char folder[PATH_MAX];

static int set_up(void **state)
{
	(void)state;
	folder_make(folder);
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	folder_remove(folder);
	return 0;
}

/* A file of 1,000 bytes that was used so many seconds ago. */
static void make(const char *name, time_t age)
{
	static const char bytes[1000];
	struct timespec times[2];
	char path[2 * PATH_MAX];

	file_write(folder, name, bytes, sizeof bytes);
	snprintf(path, sizeof path, "%s/%s", folder, name);
	clock_gettime(CLOCK_REALTIME, &times[0]);
	times[0].tv_sec -= age;
	times[1] = times[0];
	assert_int_equal(utimensat(AT_FDCWD, path, times, 0), 0);
}

static void expect(const char *name, int is_there)
{
	char path[2 * PATH_MAX];

	snprintf(path, sizeof path, "%s/%s", folder, name);
	if ((access(path, F_OK) == 0) != is_there)
		fail_msg("%s is %s", name, is_there ? "gone" : "still there");
}

static void the_longest_unused_go_first_and_those_in_use_stay(void **state)
{
	static const char keys[1][CATALOGUE_KEY] = { KEY_A };
	char path[2 * PATH_MAX];

	(void)state;
	make(KEY_A "-768.psr", 500);
	make(KEY_B "-768.psr", 400);
	make(KEY_B "-1536.psr", 300);
	make(KEY_C "-768.psr", 200);
	snprintf(path, sizeof path, "%s/" KEY_B "-768.psr", folder);
	cache_touch(path);
	cache_trim(folder, 4000, keys, 1);
	expect(KEY_B "-1536.psr", 1);
	cache_trim(folder, 3999, keys, 1);
	expect(KEY_A "-768.psr", 1);   /* in use */
	expect(KEY_B "-1536.psr", 0);
	expect(KEY_C "-768.psr", 1);
	cache_trim(folder, 1, NULL, 0);
	expect(KEY_A "-768.psr", 0);
	expect(KEY_B "-768.psr", 0);
	expect(KEY_C "-768.psr", 0);
}

static void a_limit_of_0_is_none(void **state)
{
	(void)state;
	make(KEY_A "-768.psr", 500);
	cache_trim(folder, 0, NULL, 0);
	expect(KEY_A "-768.psr", 1);
}

static void files_of_others_stay(void **state)
{
	static const char *const names[] = {
		"thesis.psr", KEY_A ".psr", KEY_A "-768.psr~", "0123-768.psr", KEY_A "x-768.psr", KEY_A "-76a.psr", ".psr-notes",
	};

	(void)state;
	for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
		make(names[i], 1000000);
	cache_trim(folder, 1, NULL, 0);
	for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
		expect(names[i], 1);
}

static void what_killed_builds_left_goes_after_a_day(void **state)
{
	(void)state;
	make(".psr-123-0.tmp", 90000);
	make(".built-123-45.tmp", 90000);
	make(".psr-124-0.tmp", 80000);
	make(".built-124-45.tmp", 80000);
	cache_trim(folder, 0, NULL, 0);
	expect(".psr-123-0.tmp", 0);
	expect(".built-123-45.tmp", 0);
	expect(".psr-124-0.tmp", 1);
	expect(".built-124-45.tmp", 1);
}

static void a_folder_that_others_can_write_is_refused(void **state)
{
	static const mode_t bad[] = { 0777, 0770, 0702, 01777 };
	struct psr_error error;

	(void)state;
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		assert_int_equal(chmod(folder, bad[i]), 0);
		assert_int_equal(cache_check(folder, &error), PSR_ERR_IO);
		assert_non_null(strstr(error.text, folder));
		assert_non_null(strstr(error.text, "chmod go-w"));
	}
	assert_int_equal(chmod(folder, 0755), 0);
	assert_int_equal(cache_check(folder, &error), PSR_OK);
}

static void a_folder_of_another_user_is_refused(void **state)
{
	struct psr_error error;

	(void)state;
	if (geteuid() != 0)
		assert_int_equal(cache_check("/", &error), PSR_ERR_IO);
	else if (chown(folder, 1234, (gid_t)-1) == 0)
		assert_int_equal(cache_check(folder, &error), PSR_ERR_IO);
	else
		skip();
	assert_non_null(strstr(error.text, "belongs to user"));
}

static void links_are_no_built_models(void **state)
{
	char path[2 * PATH_MAX];
	uint64_t bytes;

	(void)state;
	make("other", 0);
	snprintf(path, sizeof path, "%s/" KEY_A "-768.psr", folder);
	assert_int_equal(symlink("other", path), 0);
	assert_false(cache_find(&bytes, path));
	make(KEY_B "-768.psr", 0);
	snprintf(path, sizeof path, "%s/" KEY_B "-768.psr", folder);
	assert_true(cache_find(&bytes, path));
	assert_int_equal(bytes, 1000);
}

static void expect_hidden(const char *text, const char *hidden)
{
	static const char *const folders[] = { "/srv/my models/", "models", "/var/cache/psr" };
	char bytes[PSR_ERROR_TEXT];

	snprintf(bytes, sizeof bytes, "%s", text);
	hide_paths(bytes, folders, 3);
	assert_string_equal(bytes, hidden);
}

static void texts_lose_the_folders_of_paths(void **state)
{
	(void)state;
	expect_hidden("", "");
	expect_hidden("/", "/");
	expect_hidden("a / b, 1/2 and/or 3", "a / b, 1/2 and/or 3");
	expect_hidden("/srv/my models/broken.stl: no triangles", "broken.stl: no triangles");
	expect_hidden("/srv/my models//a b/c.png, /srv/my models/d.png", "a b/c.png, d.png");
	expect_hidden("cannot read models/x/y.bin: gone", "cannot read x/y.bin: gone");
	expect_hidden("models of submodels/x", "models of submodels/x");
	expect_hidden("cannot write '/var/cache/psr/k-1.psr': full", "cannot write 'k-1.psr': full");
	expect_hidden("/usr/lib/psr/psr-model cannot be started", "psr-model cannot be started");
	expect_hidden("(/etc/passwd) \"/root/.x\" /tmp/", "(passwd) \".x\" ");
	expect_hidden("see https://example.org/a/b", "see https://example.org/a/b");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(the_longest_unused_go_first_and_those_in_use_stay, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_limit_of_0_is_none, set_up, tear_down),
		cmocka_unit_test_setup_teardown(files_of_others_stay, set_up, tear_down),
		cmocka_unit_test_setup_teardown(what_killed_builds_left_goes_after_a_day, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_folder_that_others_can_write_is_refused, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_folder_of_another_user_is_refused, set_up, tear_down),
		cmocka_unit_test_setup_teardown(links_are_no_built_models, set_up, tear_down),
		cmocka_unit_test(texts_lose_the_folders_of_paths),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

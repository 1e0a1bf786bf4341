/* A private psrd for a file. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "client/home/home.h"
#include "daemon.h"

static char own[PATH_MAX]; /* for the cache */

static int make_files(void **state)
{
	char bin[PATH_MAX], path[2 * PATH_MAX];

	(void)state;
	folder_make(folder);
	folder_make(own);
	daemon_path(bin, "psrd");
	*strrchr(bin, '/') = '\0';
	snprintf(path, sizeof path, "%s:%.2000s", bin, getenv("PATH"));
	setenv("PATH", path, 1);
	plate_write(folder, "scan.psr", 0x2040c0);
	file_write(folder, "notes.txt", "x", 1);
	file_write(folder, "broken.ply", "ply\nbroken\n", 11);
	setenv("XDG_CACHE_HOME", own, 1);
	return 0;
}

static int remove_files(void **state)
{
	(void)state;
	folder_remove(folder);
	folder_remove(own);
	return 0;
}

static const char *path_of(const char *name)
{
	static char path[2 * PATH_MAX];

	snprintf(path, sizeof path, "%s/%s", folder, name);
	return path;
}

static struct home *open_home(const char *name)
{
	struct psr_error err;
	struct home *home;

	if (home_open(&home, path_of(name), &err) != PSR_OK)
		fail_msg("%s", err.text);
	return home;
}

static void socket_folder(char path[PATH_MAX], const struct home *home)
{
	snprintf(path, PATH_MAX, "%s", home_address(home) + strlen("unix:"));
	*strrchr(path, '/') = '\0';
}

static int is_gone_soon(const char *path)
{
	for (int64_t end = clock_ms() + PATIENCE_MS; clock_ms() < end; usleep(5000))
		if (access(path, F_OK) != 0)
			return 1;
	return 0;
}

static void a_file_is_viewed_by_a_psrd_of_its_own_which_ends(void **state)
{
	struct home *home = open_home("scan.psr");
	struct link_instance instance;
	struct link_wish wish;
	struct stat status;
	char path[PATH_MAX];

	(void)state;
	socket_folder(path, home);
	assert_int_equal(stat(path, &status), 0);
	assert_int_equal(status.st_mode & 0777, 0700);
	open_link(home_address(home));
	wish_default(&wish, &instance, home_model(home));
	wish.coarse_pixels = HOME_COARSE_PIXELS;
	wish.pixels = 320;
	say_wish(&wish);
	link_release(wait_sharp());
	link_close(link_);
	home_close(home);
	assert_int_not_equal(access(path, F_OK), 0);
}

static void it_ends_when_its_viewer_is_killed(void **state)
{
	char path[PATH_MAX] = "";
	int to[2], status;
	pid_t viewer;

	(void)state;
	assert_int_equal(pipe(to), 0);
	viewer = fork();
	if (viewer == 0) {
		struct home *home = NULL;

		if (home_open(&home, path_of("scan.psr"), NULL) == PSR_OK)
			socket_folder(path, home);
		if (write(to[1], path, sizeof path) < 0)
			_exit(1);
		pause();
	}
	assert_int_equal(read(to[0], path, sizeof path), sizeof path);
	assert_int_equal(access(path, F_OK), 0);
	kill(viewer, SIGKILL);
	waitpid(viewer, &status, 0);
	close(to[0]);
	close(to[1]);
	assert_true(is_gone_soon(path));
}

static void a_build_that_fails_says_why(void **state)
{
	struct home *home = open_home("broken.ply");
	struct link_instance instance;
	struct link_wish wish;
	struct link_state at;

	(void)state;
	open_link(home_address(home));
	wish_default(&wish, &instance, home_model(home));
	say_wish(&wish);
	wait_phase(LINK_REFUSED, &at);
	assert_true(strlen(at.error.text) > 20);
	link_close(link_);
	home_close(home);
}

static void assert_refused(const char *name, int code, const char *word)
{
	struct psr_error err = { 0 };
	struct home *home = NULL;

	assert_int_equal(home_open(&home, path_of(name), &err), code);
	if (strstr(err.text, word) == NULL)
		fail_msg("'%s' is not in: %s", word, err.text);
}

static void what_is_no_model_is_refused_with_a_sentence(void **state)
{
	(void)state;
	assert_refused("nothing.ply", PSR_ERR_NOT_FOUND, "nothing.ply");
	assert_refused("notes.txt", PSR_ERR_FORMAT, "notes.txt");
	assert_refused(".", PSR_ERR_ARG, "no file");
	file_write(folder, "scan.obj", "v 0 0 0\n", 8);
	assert_refused("scan.obj", PSR_ERR_ARG, "scan.psr");
	file_write(folder, "two.obj", "v 0 0 0\n", 8);
	file_write(folder, "two.glb", "glTF", 4);
	assert_refused("two.obj", PSR_ERR_UNSUPPORTED, "two.glb");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_file_is_viewed_by_a_psrd_of_its_own_which_ends),
		cmocka_unit_test(it_ends_when_its_viewer_is_killed),
		cmocka_unit_test(a_build_that_fails_says_why),
		cmocka_unit_test(what_is_no_model_is_refused_with_a_sentence),
	};

	return cmocka_run_group_tests(tests, make_files, remove_files);
}

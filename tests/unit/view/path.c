/* Ways of cameras: what was recorded is played, also from a file, and a broken file is refused. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "base/outfile.h"
#include "client/view/path.h"

static char file[] = "/tmp/psr-path-XXXXXX";

static struct hand_pose pose_at(double x)
{
	return (struct hand_pose){ .eye = { x, 1.0 / 3, 3 }, .target = { 0, x / 7, 0 }, .up = { 0, 1, 0 }, .fov = 35 };
}

/* One pose a second, then a rest. */
static void record(struct path *path)
{
	*path = (struct path){ NULL, 0 };
	for (int k = 0; k < 10; k++) {
		const struct hand_pose pose = pose_at(k < 5 ? k : 4);

		assert_int_equal(path_add(path, k, &pose, NULL), PSR_OK);
	}
}

static void a_rest_takes_two_poses(void **unused)
{
	struct path path;

	(void)unused;
	record(&path);
	assert_int_equal(path.n, 6);
	assert_true(path_seconds(&path) == 9);
	path_fini(&path);
}

static void it_is_played_in_its_time(void **unused)
{
	struct hand_pose pose;
	struct path path;

	(void)unused;
	record(&path);
	for (int k = 0; k < 80; k++) { /* eighths of a second are exact */
		path_at(&path, k / 8.0, &pose);
		assert_true(pose.eye[0] == (k / 8.0 < 4 ? k / 8.0 : 4));
	}
	path_at(&path, -1, &pose);
	assert_true(pose.eye[0] == 0);
	path_at(&path, 100, &pose);
	assert_true(pose.eye[0] == 4);
	path_fini(&path);
}

static void a_file_keeps_each_bit(void **unused)
{
	struct path path, again;

	(void)unused;
	record(&path);
	path.pose[2].pose.fov = 0;
	path.pose[2].pose.ortho_height = 0.1;
	assert_int_equal(path_write(&path, file, NULL), PSR_OK);
	assert_int_equal(path_read(&again, file, NULL), PSR_OK);
	assert_int_equal(again.n, path.n);
	assert_memory_equal(again.pose, path.pose, path.n * sizeof *path.pose);
	path_fini(&path);
	path_fini(&again);
}

static void a_broken_file_says_where(void **unused)
{
	static const char head[] = "{\"poses\": [{\"seconds\": 1, \"eye\": [1,2,3], \"target\": [0,0,0], \"up\": [0,1,0], ";
	static const struct { const char *text, *says; } broken[] = {
		{ "", "no JSON" }, { "{\"poses\": []}", "no \"poses\"" }, { "[1]", "no \"poses\"" },
		{ "\"fov\": 35}, {\"seconds\": 0.5}]}", "pose 2 has no usable \"seconds\"" },
		{ "\"fov\": 35}, {\"seconds\": 2, \"eye\": [1,2]}]}", "pose 2 has no usable \"eye\"" },
		{ "\"fov\": 180}]}", "pose 1 has no usable \"fov\"" }, { "\"ortho\": 0}]}", "pose 1 has no usable \"ortho\"" },
		{ "\"fov\": \"35\"}]}", "pose 1 has no usable \"fov\"" },
	};

	(void)unused;
	for (size_t i = 0; i < sizeof broken / sizeof broken[0]; i++) {
		struct psr_error err;
		struct path path;
		char text[400];

		snprintf(text, sizeof text, "%s%s", i < 3 ? "" : head, broken[i].text);
		assert_int_equal(outfile_save(file, OUTFILE_PLAIN, text, strlen(text), NULL), PSR_OK);
		assert_int_equal(path_read(&path, file, &err), PSR_ERR_FORMAT);
		assert_non_null(strstr(err.text, broken[i].says));
		assert_null(path.pose);
	}
}

static int remove_file(void **unused)
{
	(void)unused;
	return unlink(file);
}

static int make_file(void **unused)
{
	const int fd = mkstemp(file);

	(void)unused;
	return fd < 0 ? -1 : close(fd);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_rest_takes_two_poses),
		cmocka_unit_test(it_is_played_in_its_time),
		cmocka_unit_test(a_file_keeps_each_bit),
		cmocka_unit_test(a_broken_file_says_where),
	};

	return cmocka_run_group_tests(tests, make_file, remove_file);
}

/* The models of a link: unknown ones, further ones, coarse ones before fine ones; the list. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "daemon.h"
#include "tests/unit/server/cloud.h"

static struct link_instance instance;
static struct link_wish wish;

/* Writes a file that lacks the last byte of another one. */
static void write_cut(const char *name, const char *of)
{
	char path[2 * PATH_MAX], command[5 * PATH_MAX];

	snprintf(path, sizeof path, "%s/%s", folder, name);
	snprintf(command, sizeof command, "head -c -1 '%s/%s' >'%s'", folder, of, path);
	assert_int_equal(system(command), 0);
}

/* Beginnings of 7 and 9 of its 11 levels. */
static int set_up_cloud(void **state)
{
	set_up(state);
	daemon_stop(&psrd);
	cloud_write(folder, "cloud.psr", 11, 6000);
	write_cut("cut.psr", "cloud.psr");
	start_psrd(NULL);
	return 0;
}

static void an_unknown_model_is_refused_and_another_wish_is_served(void **state)
{
	struct link_state at;

	(void)state;
	open_link(address);
	wish_default(&wish, &instance, "pot");
	say_wish(&wish);
	wait_phase(LINK_REFUSED, &at);
	assert_int_equal(at.error.code, PSR_ERR_NOT_FOUND);
	assert_non_null(strstr(at.error.text, "pot"));
	strcpy(instance.model, "teapot");
	say_wish(&wish);
	assert_last_is_shown(&wish);
	link_state(link_, &at);
	assert_int_equal(at.phase, LINK_LIVE);
	assert_int_equal(at.error.code, PSR_OK);
	link_close(link_);
}

static void a_model_is_added_while_another_one_turns(void **state)
{
	struct link_instance two[2];
	struct link_picture *picture;
	struct link_scene *scene;
	uint32_t n_teapot = 0, n_plate = 0;

	(void)state;
	open_link(address);
	wish_default(&wish, &two[0], "teapot");
	say_wish(&wish);
	link_release(wait_sharp());
	scene = link_scene_take(link_);
	assert_non_null(scene);
	assert_int_equal(scene->n_models, 1);
	link_scene_free(scene);
	two[1] = two[0];
	strcpy(two[1].model, "plate");
	two[1].translation[1] = 4;
	wish.n_instances = 2;
	wish.planes |= 1u << PSR_PLANE_ID;
	say_wish(&wish);
	for (int64_t end = clock_ms() + PATIENCE_MS; n_plate == 0 && clock_ms() < end;) {
		wait_news(20);
		picture = link_take(link_);
		for (uint32_t i = 0; picture != NULL && picture->frame.id != NULL && i < wish.width * wish.height; i++) {
			n_teapot += picture->frame.id[i] == 0;
			n_plate += picture->frame.id[i] == 1;
		}
		link_release(picture);
	}
	assert_true(n_teapot > 0 && n_plate > 0);
	scene = link_scene_take(link_);
	assert_non_null(scene);
	assert_int_equal(scene->n_models, 2);
	assert_true(scene->box_max[1] > 3.9);
	assert_string_equal(scene->model[1].name, "plate");
	assert_true(scene->model[1].n_presets > 0);
	link_scene_free(scene);
	link_close(link_);
}

static void a_list_comes_beside_pictures(void **state)
{
	struct psr_msg_list_entry *list = NULL;
	uint32_t n = 0;

	(void)state;
	open_link(address);
	wish_default(&wish, &instance, "teapot");
	wish.pass_limit = 4;
	wish.width = wish.height = 512;
	say_wish(&wish);
	link_release(wait_sharp());
	link_list_ask(link_);
	for (int64_t end = clock_ms() + PATIENCE_MS; list == NULL && clock_ms() < end;) {
		wait_news(20);
		list = link_list_take(link_, &n);
	}
	assert_int_equal(n, 4);
	assert_string_equal(list[2].name, "plate");
	free(list);
	link_close(link_);
}

static int middle_green(const struct link_picture *picture)
{
	const size_t middle = (size_t)picture->frame.width * (picture->frame.height / 2) + picture->frame.width / 2;

	return picture->frame.rgb[3 * middle + 1];
}

/* The first build is the coarse one, of 128 pixels, and takes no time; the second is held up by a file. */
static void a_coarse_model_is_shown_until_the_fine_one_is_built(void **state)
{
	static const char script[] = "#!/bin/sh\n"
	                             "while [ $# -gt 0 ]; do case $1 in -o) out=$2;; -r) r=$2;; esac; shift; done\n"
	                             "here=$(dirname \"$0\")\n"
	                             "echo $r >>\"$here/built\"\n"
	                             "while [ $r != 128 ] && [ ! -e \"$here/go\" ]; do sleep 0.02; done\n"
	                             "[ $r = 128 ] && cp \"$here/ready.psr\" \"$out\" || cp \"$here/fine.psr\" \"$out\"\n";
	char bin[PATH_MAX], path[2 * PATH_MAX];
	const char *argv[] = { path, "--listen", address, "--models", bin, "--cache", folder, "--resolution", "128",
		                   "--max-resolution", "1024", NULL };
	struct link_picture *picture;
	struct link_state at;
	int was, green, is_coarse = 1;

	(void)state;
	builder_make(bin, script);
	plate_write(bin, "fine.psr", 0x20c0c0);
	file_write(bin, "thing.ply", "ply\n", 4);
	snprintf(path, sizeof path, "%.200s/psrd", bin);
	snprintf(address, sizeof address, "unix:%.200s/socket2", folder);
	struct daemon other = psrd;
	daemon_spawn(&psrd, argv);
	daemon_wait_ready(&psrd);
	open_link(address);
	wish_default(&wish, &instance, "thing");
	wish.camera.eye[1] = wish.camera.target[1] = 0;
	wish.camera.eye[2] = 2;
	wish.pixels = 1000;
	wish.coarse_pixels = 64;
	say_wish(&wish);
	picture = wait_sharp();
	was = middle_green(picture);
	assert_true(was > 0x24 + 8);
	assert_true(picture->is_coarse);
	link_release(picture);
	for (int i = 0; i < 500; i++) {
		link_state(link_, &at);
		if (at.is_refining)
			break;
		wait_news(10);
	}
	assert_true(at.is_refining);
	assert_string_equal(at.model, "thing");
	turn_camera(&wish, 0.1, 2); /* goes on meanwhile */
	say_wish(&wish);
	picture = wait_sharp();
	assert_int_equal(middle_green(picture), was);
	assert_true(picture->is_coarse);
	link_release(picture);
	green = was;
	file_write(bin, "go", "", 0);
	for (int64_t end = clock_ms() + PATIENCE_MS; green == was && clock_ms() < end;) {
		wait_news(20);
		picture = link_take(link_);
		if (picture != NULL) {
			green = middle_green(picture);
			is_coarse = picture->is_coarse;
			assert_true(is_coarse == (green == was));
		}
		link_release(picture);
	}
	assert_true(green > was + 8 && !is_coarse);
	link_close(link_);
	daemon_stop(&psrd);
	psrd = other;
	snprintf(address, sizeof address, "unix:%.200s/socket", folder);
	folder_remove(bin);
}

/* Returns the levels that the picture's octree lacks. */
static uint64_t missing_levels(const struct link_picture *picture)
{
	for (unsigned i = 0; i < picture->end.n_entries; i++)
		if (picture->end.entry[i].id == PSR_WIRE_REPORT_LEVELS)
			return (picture->end.entry[i].count >> 8) - (picture->end.entry[i].count & 0xff);
	return 0;
}

static void a_packed_octree_is_shown_a_step_after_the_other(void **state)
{
	struct link_picture *picture;
	unsigned seen = 0; /* bit k: pictures that lacked k levels */
	int is_coarse = 1;

	(void)state;
	open_link(address);
	wish_default(&wish, &instance, "cloud");
	say_wish(&wish);
	for (int64_t end = clock_ms() + PATIENCE_MS; is_coarse && clock_ms() < end;) {
		wait_news(20);
		picture = link_take(link_);
		if (picture != NULL) {
			assert_int_equal(seen & ((1u << missing_levels(picture)) - 1), 0); /* never coarser again */
			seen |= 1u << missing_levels(picture);
			is_coarse = picture->is_coarse;
			assert_int_equal(is_coarse, missing_levels(picture) > 0);
		}
		link_release(picture);
	}
	assert_false(is_coarse);
	assert_int_equal(seen, 1 << 4 | 1 << 2 | 1);
	link_close(link_);
}

/* Nobody asks again for what is not there. */
static void a_file_that_ends_early_is_shown_as_far_as_it_goes(void **state)
{
	struct link_picture *picture;
	int is_coarse = 1;

	(void)state;
	open_link(address);
	wish_default(&wish, &instance, "cut");
	say_wish(&wish);
	for (int64_t end = clock_ms() + PATIENCE_MS; is_coarse && clock_ms() < end;) {
		wait_news(20);
		picture = link_take(link_);
		if (picture != NULL) {
			is_coarse = picture->is_coarse;
			assert_true(is_coarse || missing_levels(picture) == 2);
		}
		link_release(picture);
	}
	assert_false(is_coarse);
	link_close(link_);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_unknown_model_is_refused_and_another_wish_is_served),
		cmocka_unit_test(a_model_is_added_while_another_one_turns),
		cmocka_unit_test(a_list_comes_beside_pictures),
		cmocka_unit_test(a_coarse_model_is_shown_until_the_fine_one_is_built),
		cmocka_unit_test(a_packed_octree_is_shown_a_step_after_the_other),
		cmocka_unit_test(a_file_that_ends_early_is_shown_as_far_as_it_goes),
	};

	return cmocka_run_group_tests(tests, set_up_cloud, tear_down);
}

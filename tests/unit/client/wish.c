/* What people write on command lines of psr and in its files: instances, cameras, names of files and of models. */
#define _GNU_SOURCE
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
#include "client/scene/instance.h"
#include "client/output/notes.h"
#include "client/output/output.h"
#include "client/scene/quality.h"
#include "client/scene/suggest.h"
#include "client/scene/view.h"

static char path[256];

static void write_file(const char *text)
{
	FILE *file = fopen(path, "w");

	assert_non_null(file);
	fputs(text, file);
	assert_int_equal(fclose(file), 0);
}

static int set_up(void **state)
{
	const char *root = getenv("TMPDIR");
	int fd;

	(void)state;
	snprintf(path, sizeof path, "%s/psr-wish-XXXXXX", root != NULL ? root : "/tmp");
	fd = mkstemp(path);
	return fd < 0 || close(fd) != 0;
}

static int tear_down(void **state)
{
	(void)state;
	return unlink(path);
}

/* ---- instances ---- */

static void an_instance_is_turned_scaled_and_put_somewhere(void **state)
{
	static const double point[3] = { 1, 2, 3 };
	struct instance_wish wish;
	double p[3];

	(void)state;
	assert_int_equal(instance_parse(&wish, "my, scan,at=10,20,30,rotate=Y:90,scale=2", NULL), PSR_OK);
	assert_string_equal(wish.model, "my, scan");
	instance_apply(p, &wish.place, point); /* z comes to x, x to -z: 3, 2, -1, twice as large */
	assert_true(fabs(p[0] - 16) < 1e-14 && fabs(p[1] - 24) < 1e-14 && fabs(p[2] - 28) < 1e-14);
}

static void rotations_happen_in_their_order_about_any_axis(void **state)
{
	static const double x[3] = { 1, 0, 0 };
	struct instance_wish wish;
	double p[3];

	(void)state;
	assert_int_equal(instance_parse(&wish, "a,rotate=z:90,rotate=x:90", NULL), PSR_OK);
	instance_rotate(p, &wish.place, x); /* to y, then to z */
	assert_true(fabs(p[0]) < 1e-15 && fabs(p[1]) < 1e-15 && fabs(p[2] - 1) < 1e-15);
	assert_int_equal(instance_parse(&wish, "a,rotate=1,1,1:120", NULL), PSR_OK);
	instance_rotate(p, &wish.place, x); /* the axes change places */
	assert_true(fabs(p[0]) < 1e-15 && fabs(p[1] - 1) < 1e-15 && fabs(p[2]) < 1e-15);
}

static void a_name_alone_stands_where_its_file_puts_it_to_the_bit(void **state)
{
	static const double point[3] = { 0.1, -1e-30, 7e20 };
	struct instance_wish wish;
	double p[3];

	(void)state;
	assert_int_equal(instance_parse(&wish, "a", NULL), PSR_OK);
	instance_apply(p, &wish.place, point);
	assert_true(p[0] == point[0] && p[1] == point[1] && p[2] == point[2]);
}

static void an_instance_may_name_its_representation(void **state)
{
	struct instance_wish wish;

	(void)state;
	assert_int_equal(instance_parse(&wish, "a", NULL), PSR_OK);
	assert_int_equal(wish.place.representation, PSR_WIRE_REP_AUTO);
	assert_int_equal(instance_parse(&wish, "a,as=octree,scale=2", NULL), PSR_OK);
	assert_int_equal(wish.place.representation, PSR_WIRE_REP_OCTREE);
	assert_string_equal(wish.model, "a");
	assert_int_equal(instance_parse(&wish, "a,scale=2,as=blocks", NULL), PSR_OK);
	assert_int_equal(wish.place.representation, PSR_WIRE_REP_BLOCKS);
	assert_int_equal(instance_parse(&wish, "a,as=dpoints", NULL), PSR_OK);
	assert_int_equal(wish.place.representation, PSR_WIRE_REP_DPOINT);
}

static void bad_instances_are_refused_with_a_sentence(void **state)
{
	static const struct {
		const char *text, *says;
	} bad[] = {
		{ "", "has 1 to 255 bytes" },
		{ ",at=1,2,3", "has 1 to 255 bytes" },
		{ "a,at=1,2", "three finite numbers" },
		{ "a,at=1e31,0,0", "beyond 1e30" },
		{ "a,scale=0", "scale is a number above 0, not '0'" },
		{ "a,scale=-1", "scale is a number above 0" },
		{ "a,scal=2", "unknown part 'scal=2'" },
		{ "a,as=octrees", "as is blocks, octree or dpoints, not 'octrees'" },
		{ "a,as=,scale=2", "as is blocks, octree or dpoints" },
		{ "a,rotate=Y", "behind the axis" },
		{ "a,rotate=Y:", "behind the axis" },
		{ "a,rotate=W:90", "rotate is AXIS:DEG" },
		{ "a,rotate=0,0,0:90", "has no direction" },
		{ "a,at=1,2,3x", "'x' does not belong" },
		{ "a,at=1,2,3,", "unknown part ''" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		struct instance_wish wish;
		struct psr_error err = { 0, "" };

		if (instance_parse(&wish, bad[i].text, &err) != PSR_ERR_ARG || strstr(err.text, bad[i].says) == NULL)
			fail_msg("'%s': '%s'", bad[i].text, err.text);
	}
}

/* ---- names ---- */

static void a_misspelt_name_finds_its_like(void **state)
{
	static const char names[][16] = { "bunny", "dragon", "engine", "teapot", "top", "ab" };
	static const struct {
		const char *name, *near;
	} cases[] = {
		{ "teapto", "teapot" }, { "Teapot", "teapot" }, { "teapot.glb", "teapot" }, { "dragn", "dragon" },
		{ "bunnny", "bunny" },  { "tip", "top" },       { "helmet", NULL },         { "x", NULL },
		{ "", NULL },           { "ENGINE.GLB", "engine" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		const char *near = suggest_name(cases[i].name, names[0], 6, sizeof names[0]);

		if (near == NULL || cases[i].near == NULL ? near != cases[i].near : strcmp(near, cases[i].near) != 0)
			fail_msg("'%s' found '%s'", cases[i].name, near != NULL ? near : "nothing");
	}
	assert_null(suggest_name("a", names[0], 0, sizeof names[0]));
}

static void files_are_numbered(void **state)
{
	char name[PATH_MAX];
	int is_numbered;

	(void)state;
	assert_int_equal(output_is_numbered(&is_numbered, "a_%03d.png", NULL), PSR_OK);
	assert_true(is_numbered);
	output_name(name, "a_%03d.png", 7, NULL);
	assert_string_equal(name, "a_007.png");
	output_name(name, "%d%%", 1234, NULL);
	assert_string_equal(name, "1234%");
	assert_int_equal(output_is_numbered(&is_numbered, "100%%.png", NULL), PSR_OK);
	assert_false(is_numbered);
	assert_int_equal(output_is_numbered(&is_numbered, "a%s.png", NULL), PSR_ERR_ARG);
	assert_int_equal(output_is_numbered(&is_numbered, "a%d_%d.png", NULL), PSR_ERR_ARG);
	assert_int_equal(output_is_numbered(&is_numbered, "a%", NULL), PSR_ERR_ARG);
}

static void a_sheet_puts_pictures_row_by_row_on_the_background(void **state)
{
	static const uint8_t background[3] = { 9, 8, 7 };
	uint8_t rgb[2 * 1 * 3];
	const struct psr_frame picture = { .width = 2, .height = 1, .rgb = rgb };
	struct sheet sheet = { .columns = 2, .rows = 2 };

	(void)state;
	for (uint32_t k = 0; k < 3; k++) {
		memset(rgb, 10 * ((int)k + 1), sizeof rgb);
		assert_int_equal(sheet_add(&sheet, k, &picture, background, NULL), PSR_OK);
	}
	assert_true(sheet.picture.width == 4 && sheet.picture.height == 2);
	assert_int_equal(sheet.picture.rgb[0], 10);
	assert_int_equal(sheet.picture.rgb[3 * 2], 20);
	assert_int_equal(sheet.picture.rgb[3 * 4], 30);
	assert_memory_equal(sheet.picture.rgb + 3 * 6, background, 3);
	sheet_fini(&sheet);
	assert_int_equal(sheet_check(&sheet, 5, 2, 1, NULL), PSR_ERR_ARG);
	assert_int_equal(sheet_check(&sheet, 4, 16384, 16384, NULL), PSR_ERR_LIMIT);
}

/* ---- cameras ---- */

static int make_views(struct views *views, const char *text, struct psr_error *err)
{
	struct view_wish wish;

	view_wish_init(&wish);
	write_file(text);
	return views_make(views, &wish, path, err);
}

static void a_camera_file_has_a_camera_a_line(void **state)
{
	struct views views;

	(void)state;
	assert_int_equal(make_views(&views, "# two\n\n  azimuth=30 zoom=2\t# one\r\nview=top fov=20\n", NULL), PSR_OK);
	assert_int_equal(views.n, 2);
	assert_true(views.wish[0].camera.azimuth == 30 && views.wish[0].camera.zoom == 2 && views.wish[0].fov == 35);
	assert_true(views.wish[1].camera.elevation == 90 && views.wish[1].camera.zoom == 1 && views.wish[1].fov == 20);
	views_fini(&views);
	assert_int_equal(make_views(&views, "camera=\"the \"front eye=1,2,3", NULL), PSR_ERR_ARG);
	views_fini(&views);
	assert_int_equal(make_views(&views, "camera=\"the front\"", NULL), PSR_OK);
	assert_string_equal(views.wish[0].preset, "the front");
	views_fini(&views);
}

static void errors_of_files_name_line_and_column(void **state)
{
	static const struct {
		const char *text, *says;
	} bad[] = {
		{ "azimuth=30\nelevation=20 zoom=x\n", ":2:14: --zoom: 'x'" },
		{ "\n\n azimut=30", ":3:2: unknown option azimut; did you mean azimuth?" },
		{ "view=top eye=1,2,3", ":1:1: --view excludes" },
		{ "zoom", ":1:1: zoom needs a value: zoom=FACTOR" },
		{ "camera=\"a", ":1:1: a \" is not closed" },
		{ "# nothing\n", "has no camera" },
		{ "view=side", "not 'side'" },
		{ "elevation=91", "--elevation: '91' is out of range; it takes -90 to 90" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		struct psr_error err = { 0, "" };
		struct views views;

		if (make_views(&views, bad[i].text, &err) != PSR_ERR_ARG || strstr(err.text, bad[i].says) == NULL)
			fail_msg("'%s': '%s'", bad[i].text, err.text);
		views_fini(&views);
	}
}

static void a_list_of_views_is_a_picture_each(void **state)
{
	struct view_wish wish;
	struct views views;

	(void)state;
	view_wish_init(&wish);
	wish.view = "front,left,iso";
	assert_int_equal(views_make(&views, &wish, NULL, NULL), PSR_OK);
	assert_int_equal(views.n, 3);
	assert_true(views.wish[1].camera.azimuth == 270 && views.wish[2].camera.azimuth == 45);
	views_fini(&views);
}

/* ---- quality ---- */

static void what_is_said_wins_over_the_quality(void **state)
{
	struct quality_wish wish;
	struct psr_msg_frame frame;
	struct psr_error err;

	(void)state;
	quality_wish_init(&wish, 8, 8, "good", "lossless");
	assert_int_equal(quality_apply(&frame, &wish, NULL), PSR_OK);
	assert_true(frame.settings.smooth == 1 && frame.settings.spacing_px == 1 && frame.pass_limit == 0);
	wish.name = "draft";
	assert_int_equal(quality_apply(&frame, &wish, NULL), PSR_OK);
	assert_true(frame.settings.smooth == 0 && frame.settings.spacing_px == 2);
	wish.is_smooth = 1;
	assert_int_equal(quality_apply(&frame, &wish, NULL), PSR_OK);
	assert_true(frame.settings.smooth == 1 && frame.settings.spacing_px == 2);
	wish.name = "best";
	wish.has_passes = 1;
	wish.passes = 1;
	assert_int_equal(quality_apply(&frame, &wish, NULL), PSR_OK);
	assert_int_equal(frame.pass_limit, 1);
	assert_int_equal(frame.settings.splats, 0);
	wish.with_splats = 1;
	assert_int_equal(quality_apply(&frame, &wish, NULL), PSR_OK);
	assert_int_equal(frame.settings.splats, 1);
	wish.is_plain = 1;
	assert_int_equal(quality_apply(&frame, &wish, &err), PSR_ERR_ARG);
	wish.name = "worst";
	assert_int_equal(quality_apply(&frame, &wish, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "draft, good, fine or best, not 'worst'"));
}

static void a_budget_is_a_time_an_error_or_a_likeness_and_says_all_detail(void **state)
{
	static const char *const bad[] = { "", "12", "ms", "0ms", "-1ms", "nanms", "12s", "1e9ms", "12ms ", "0px", "infpx",
		                               "0dB", "100dB", "30db", "nandB" };
	struct psr_msg_frame frame;
	struct quality_wish wish;
	struct psr_error err;
	char text[QUALITY_BUDGET_TEXT];

	(void)state;
	quality_wish_init(&wish, 8, 8, "good", "lossless");
	assert_false(quality_is_said(&wish));
	wish.budget = "12.5ms";
	assert_true(quality_is_said(&wish));
	frame = (struct psr_msg_frame){ 0 };
	assert_int_equal(quality_apply(&frame, &wish, NULL), PSR_OK);
	assert_int_equal(frame.budget, PSR_WIRE_BUDGET_TIME);
	assert_int_equal(frame.time_budget_us, 12500);
	assert_int_equal(frame.settings.scale, 0);
	assert_string_equal(quality_budget_text(text, &frame), "12.5ms");
	wish.budget = "0.5px";
	frame = (struct psr_msg_frame){ 0 };
	assert_int_equal(quality_apply(&frame, &wish, NULL), PSR_OK);
	assert_int_equal(frame.budget, PSR_WIRE_BUDGET_ERROR);
	assert_true(frame.error_bound == 0.5);
	assert_int_equal(frame.pass_limit, 0);
	assert_string_equal(quality_budget_text(text, &frame), "0.5px");
	wish.budget = "40dB"; /* 255 / 100 */
	frame = (struct psr_msg_frame){ 0 };
	assert_int_equal(quality_apply(&frame, &wish, NULL), PSR_OK);
	assert_int_equal(frame.budget, PSR_WIRE_BUDGET_RMSE);
	assert_true(fabs(frame.error_bound - 2.55) < 1e-12);
	assert_string_equal(quality_budget_text(text, &frame), "40dB");
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		assert_int_equal(quality_parse_budget(&frame, bad[i], &err), PSR_ERR_ARG);
	wish.is_plain = 1;
	assert_int_equal(quality_apply(&frame, &wish, &err), PSR_ERR_ARG);
	assert_non_null(strstr(err.text, "--no-smooth"));
}

/* ---- notes ---- */

static void samples_are_as_far_apart_as_the_nearest_part_of_the_box_in_the_picture_shows_them(void **state)
{
	static struct scene scene;
	struct scene_model model = { .opened = { .box_min = { -1, -1, -1 }, .box_max = { 1, 1, 1 }, .spacing = 0.01 } };
	uint32_t model_of = 0;
	struct psr_camera camera = { .kind = PSR_CAMERA_PERSPECTIVE, .eye = { 0, 0, 5 }, .up = { 0, 1, 0 },
		                             .fov_y = 2 * atan(0.5), .near_z = 0.1 };
	double apart;

	(void)state;
	scene.model = &model;
	scene.model_of = &model_of;
	scene.n_models = scene.msg.n_instances = 1;
	scene.msg.instance[0] = (struct psr_msg_instance){ .rotation = { 0, 0, 0, 1 }, .scale = 2 };
	/* Twice as large, its face is 3 away, where 100 pixels show 3 units: 0.02 are two thirds of a pixel. */
	apart = notes_magnification(&scene, 0, &camera, 100, 100);
	assert_true(fabs(apart - 2.0 / 3) < 1e-12);
	camera.eye[2] = -5; /* the other face */
	assert_true(fabs(notes_magnification(&scene, 0, &camera, 100, 100) - apart) < 1e-12);
	camera.target[2] = -9; /* away from it */
	assert_true(notes_magnification(&scene, 0, &camera, 100, 100) == 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_instance_is_turned_scaled_and_put_somewhere),
		cmocka_unit_test(rotations_happen_in_their_order_about_any_axis),
		cmocka_unit_test(a_name_alone_stands_where_its_file_puts_it_to_the_bit),
		cmocka_unit_test(an_instance_may_name_its_representation),
		cmocka_unit_test(bad_instances_are_refused_with_a_sentence),
		cmocka_unit_test(a_misspelt_name_finds_its_like),
		cmocka_unit_test(files_are_numbered),
		cmocka_unit_test(a_sheet_puts_pictures_row_by_row_on_the_background),
		cmocka_unit_test(a_camera_file_has_a_camera_a_line),
		cmocka_unit_test(errors_of_files_name_line_and_column),
		cmocka_unit_test(a_list_of_views_is_a_picture_each),
		cmocka_unit_test(what_is_said_wins_over_the_quality),
		cmocka_unit_test(a_budget_is_a_time_an_error_or_a_likeness_and_says_all_detail),
		cmocka_unit_test(samples_are_as_far_apart_as_the_nearest_part_of_the_box_in_the_picture_shows_them),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}

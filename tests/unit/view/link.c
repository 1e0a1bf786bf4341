/* A link against a running psrd. */
#define _GNU_SOURCE
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include "base/random.h"
#include "daemon.h"

static struct link_instance instance;
static struct link_wish wish;

static void sleep_ms(double ms)
{
	usleep((useconds_t)(ms * 1000));
}

/* Sizes, cameras, light and settings at random; some wishes last, others are gone at once. */
static void wish_at_random(uint64_t *random)
{
	static const uint32_t widths[] = { 320, 333, 160, 257, 322 }, heights[] = { 240, 191, 120, 144 };

	turn_camera(&wish, random_in(random, -3, 3), random_in(random, 6, 20));
	if (random_below(random, 10) == 0)
		wish.width = widths[random_below(random, 5)];
	if (random_below(random, 10) == 0)
		wish.height = heights[random_below(random, 4)];
	if (random_below(random, 10) == 0)
		wish.ambient = random_in(random, 0, 1);
	if (random_below(random, 10) == 0)
		wish.is_smooth = !wish.is_smooth;
	if (random_below(random, 10) == 0)
		wish.spacing_px = random_below(random, 2) ? 1 : 2;
	wish.is_rest = random_below(random, 8) == 0;
	say_wish(&wish);
}

static void of_a_hundred_random_wishes_the_last_is_shown_sharp(void **state)
{
	uint64_t random = 3;

	(void)state;
	open_link(address);
	wish_default(&wish, &instance, "teapot");
	wish.overscan = 1.25;
	for (int part = 0; part < 4; part++) {
		for (int i = 0; i < 25; i++) {
			wish_at_random(&random);
			link_release(link_take(link_));
			sleep_ms(random_below(&random, 4) == 0 ? random_in(&random, 0, 60) : random_in(&random, 0, 8));
		}
		assert_last_is_shown(&wish);
	}
	link_close(link_);
}

static void pictures_of_a_movement_have_a_wider_camera_and_the_size_of_a_pixel(void **state)
{
	struct link_picture *picture = NULL;

	(void)state;
	open_link(address);
	wish_default(&wish, &instance, "teapot");
	wish.overscan = 1.25;
	for (int i = 0; i < 1000 && (picture == NULL || picture->frame.width == wish.width); i++) {
		link_release(picture);
		turn_camera(&wish, 0.01 * i, 12);
		say_wish(&wish);
		sleep_ms(10);
		picture = link_take(link_);
	}
	assert_non_null(picture);
	assert_int_equal(picture->frame.width, 400);
	assert_int_equal(picture->frame.height, 300);
	assert_false(picture->is_sharp);
	assert_int_equal(picture->width, 320);
	assert_true(fabs(tan(picture->camera.fov_y / 2) / 300 - tan(wish.camera.fov_y / 2) / 240) < 1e-12);
	link_close(link_);
	assert_in_range(picture->frame.rgb[0], 0x20 - 8, 0x20 + 8); /* held beyond the link's end; JPEG */
	link_release(picture);
}

static void refined_pictures_follow_the_sharp_one(void **state)
{
	struct link_picture *picture;

	(void)state;
	open_link(address);
	wish_default(&wish, &instance, "teapot");
	wish.pass_limit = 2;
	wish.is_rest = 1;
	say_wish(&wish);
	picture = wait_sharp();
	while (!picture->is_final) {
		assert_true(picture->begin.refine < 2);
		link_release(picture);
		picture = wait_sharp();
	}
	assert_int_equal(picture->begin.refine, 2);
	link_release(picture);
	link_close(link_);
}

static void a_psrd_that_dies_in_a_movement_and_comes_back_shows_the_last_wish(void **state)
{
	struct link_state at;
	uint64_t random = 5;

	(void)state;
	open_link(address);
	wish_default(&wish, &instance, "teapot");
	for (int i = 0; i < 60; i++) {
		wish_at_random(&random);
		if (i == 20)
			kill_psrd();
		if (i == 40)
			start_psrd(NULL);
		sleep_ms(5);
	}
	assert_last_is_shown(&wish);
	link_state(link_, &at);
	assert_int_equal(at.phase, LINK_LIVE);
	assert_true(at.n_connected >= 2);
	link_close(link_);
}

static void what_is_lost_says_why_and_when_it_tries_again(void **state)
{
	struct link_state at;

	(void)state;
	open_link(address);
	wish_default(&wish, &instance, "teapot");
	say_wish(&wish);
	link_release(wait_sharp());
	kill_psrd();
	wait_phase(LINK_LOST, &at);
	assert_true(strlen(at.error.text) > 10);
	assert_true(at.retry_ns > 0);
	wish.ambient = 0.5; /* nobody draws it yet */
	say_wish(&wish);
	start_psrd(NULL);
	assert_last_is_shown(&wish);
	link_close(link_);
}

/* ---- a slow and far server ---- */

static struct daemon relay;

static void start_relay(const char *delay, const char *rate)
{
	const char *argv[] = { NULL, "--to", psrd.ready, "--delay", delay, "--rate-down", rate, NULL };
	char path[PATH_MAX];

	daemon_path(path, "../tests/tools/relay");
	argv[0] = path;
	daemon_spawn(&relay, argv);
	daemon_wait_ready(&relay);
}

static void far_and_slow_the_last_wish_is_shown_sharp(void **state)
{
	struct link_state at;

	(void)state;
	start_relay("50", "10"); /* 50 ms each way, 10 Mbit/s */
	open_link(relay.ready);
	wish_default(&wish, &instance, "teapot");
	wish.width = 640;
	wish.height = 480;
	say_wish(&wish);
	wait_phase(LINK_LIVE, &at);
	for (int i = 0; i < 100; i++) {
		turn_camera(&wish, 0.02 * i, 9);
		say_wish(&wish);
		sleep_ms(8);
	}
	assert_last_is_shown(&wish);
	link_state(link_, &at);
	assert_true(at.round_s >= 0.1);
	assert_int_equal(at.n_connected, 1);
	link_close(link_);
	daemon_stop(&relay);
}

/* ---- ends ---- */

static void a_link_to_nobody_closes_at_once(void **state)
{
	struct link_state at;
	int64_t start;

	(void)state;
	open_link("unix:/nowhere/at/all");
	wish_default(&wish, &instance, "teapot");
	say_wish(&wish);
	wait_phase(LINK_LOST, &at);
	start = clock_ms();
	link_close(link_);
	assert_true(clock_ms() - start < 1000);
	assert_int_equal(link_open(&link_, "tls://x:1", "test", NULL), PSR_ERR_UNSUPPORTED);
}

static void wishes_out_of_range_change_nothing(void **state)
{
	(void)state;
	open_link(address);
	wish_default(&wish, &instance, "teapot");
	say_wish(&wish);
	assert_int_equal(link_wish(link_, &wish), last_wish);
	wish.overscan = 3;
	assert_int_equal(link_wish(link_, &wish), 0);
	wish.overscan = 1;
	wish.most_scale = 3;
	assert_int_equal(link_wish(link_, &wish), 0);
	wish.most_scale = 4;
	wish.height = 0;
	assert_int_equal(link_wish(link_, &wish), 0);
	wish.height = 240;
	assert_last_is_shown(&wish);
	link_close(link_);
}

/* A server that is not there any more says nothing: it stands still here, and its socket stays open. */
static void a_server_that_says_nothing_is_given_up_and_comes_back(void **state)
{
	struct link_state now;

	(void)state;
	open_link(address);
	wish_default(&wish, &instance, "teapot");
	say_wish(&wish);
	assert_last_is_shown(&wish);
	kill(psrd.pid, SIGSTOP);
	wait_phase(LINK_LOST, &now);
	assert_non_null(strstr(now.error.text, "the server has not answered for 7 s"));
	kill(psrd.pid, SIGCONT);
	wait_phase(LINK_LIVE, &now);
	turn_camera(&wish, 1, 9);
	say_wish(&wish);
	assert_last_is_shown(&wish);
	link_close(link_);
}

/* The refusal of an earlier wish may still stand when the picture of a later one is there. */
static int is_refused(const char *text)
{
	const int64_t end = clock_ms() + PATIENCE_MS;
	struct link_state now;

	do {
		wait_phase(LINK_REFUSED, &now);
		if (strstr(now.error.text, text) != NULL)
			return 1;
		wait_news(20);
	} while (clock_ms() < end);
	return 0;
}

static void colours_that_tell_a_number_come_with_the_picture(void **state)
{
	struct link_picture *own, *heights;
	struct link_state now;

	(void)state;
	open_link(address);
	wish_default(&wish, &instance, "teapot");
	wish.is_rest = 1;
	say_wish(&wish);
	own = wait_sharp();
	assert_int_equal(own->color_by, PSR_WIRE_COLOR_OWN);
	instance.color_by = PSR_WIRE_COLOR_HEIGHT;
	say_wish(&wish);
	heights = wait_sharp();
	assert_int_equal(heights->color_by, PSR_WIRE_COLOR_HEIGHT);
	assert_memory_not_equal(own->frame.rgb, heights->frame.rgb, 3 * 320 * 240);
	link_release(heights);
	instance.color_by = PSR_WIRE_COLOR_CLASS;
	say_wish(&wish);
	assert_true(is_refused("no classes of a scan"));
	instance.color_by = PSR_WIRE_COLOR_RETURN + 1;
	assert_int_equal(link_wish(link_, &wish), 0);
	instance.color_by = PSR_WIRE_COLOR_OWN;
	say_wish(&wish);
	link_release(wait_sharp());
	instance.representation = PSR_WIRE_REP_OCTREE;
	say_wish(&wish);
	assert_true(is_refused("asks for representation 2"));
	instance.representation = PSR_WIRE_REP_BLOCKS;
	say_wish(&wish);
	wait_phase(LINK_LIVE, &now);
	heights = wait_sharp();
	assert_memory_equal(own->frame.rgb, heights->frame.rgb, 3 * 320 * 240);
	link_release(heights);
	link_release(own);
	link_close(link_);
}

static void octrees_are_splats_where_it_is_wished(void **state)
{
	struct link_picture *points, *splats;
	struct psr_model *knot;
	char path[PATH_MAX + 16];

	(void)state;
	snprintf(path, sizeof path, "%s/knot.psr", folder);
	assert_int_equal(psr_model_read(&knot, "tests/golden/knot.psr", NULL), PSR_OK);
	assert_int_equal(psr_model_write(knot, path, NULL), PSR_OK);
	psr_model_unref(knot);
	kill_psrd(); /* so that the next one lists it */
	start_psrd(NULL);
	open_link(address);
	wish_default(&wish, &instance, "knot");
	wish.with_splats = 1;
	say_wish(&wish);
	splats = wait_sharp();
	assert_drawn_as_wished(splats, &wish);
	assert_true(splats->begin.settings.splats);
	wish.with_splats = 0;
	say_wish(&wish);
	points = wait_sharp();
	assert_drawn_as_wished(points, &wish);
	assert_memory_not_equal(points->frame.rgb, splats->frame.rgb, 3 * 320 * 240);
	link_release(points);
	link_release(splats);
	link_close(link_);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(of_a_hundred_random_wishes_the_last_is_shown_sharp),
		cmocka_unit_test(pictures_of_a_movement_have_a_wider_camera_and_the_size_of_a_pixel),
		cmocka_unit_test(refined_pictures_follow_the_sharp_one),
		cmocka_unit_test(a_psrd_that_dies_in_a_movement_and_comes_back_shows_the_last_wish),
		cmocka_unit_test(what_is_lost_says_why_and_when_it_tries_again),
		cmocka_unit_test(far_and_slow_the_last_wish_is_shown_sharp),
		cmocka_unit_test(a_link_to_nobody_closes_at_once),
		cmocka_unit_test(wishes_out_of_range_change_nothing),
		cmocka_unit_test(colours_that_tell_a_number_come_with_the_picture),
		cmocka_unit_test(octrees_are_splats_where_it_is_wished),
		cmocka_unit_test(a_server_that_says_nothing_is_given_up_and_comes_back),
	};

	return cmocka_run_group_tests(tests, set_up, tear_down);
}

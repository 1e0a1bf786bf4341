/* What SDL's events do to the hand: wheels and touchpads, two fingers, and windows with more pixels than points. Each
 * claim compares a viewer that got events with a hand that was told the same in pixels. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "client/view/window/viewer.h"

#define WIDTH 1600
#define HEIGHT 1200
#define SCALE 2 /* pixels a point */
/* Coordinates are below 100, and a dozen operations round each: 100 * 12 * 2^-53, times a hundred. */
#define CLOSE 1e-11

static struct viewer viewer;

static double distance(const double a[3], const double b[3])
{
	return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

static int set_up(void **state)
{
	static const double low[3] = { -1, -2, -1 }, high[3] = { 1, 2, 3 }, up[3] = { 0, 1, 0 };

	(void)state;
	memset(&viewer, 0, sizeof viewer);
	assert_int_equal(view_show_create(&viewer.show, 1, NULL), PSR_OK);
	assert_int_equal(hand_init(&viewer.hand, low, high, up, 35, NULL), PSR_OK);
	hand_set_size(&viewer.hand, WIDTH, HEIGHT);
	hand_look_from(&viewer.hand, 30, 20);
	viewer.has_hand = 1;
	viewer.scale = SCALE;
	viewer.picked = -1;
	return 0;
}

static int tear_down(void **state)
{
	(void)state;
	view_show_destroy(viewer.show);
	return 0;
}

static void assert_same_pose(const struct hand *a, const struct hand *b)
{
	for (int i = 0; i < 3; i++) {
		assert_true(fabs(a->pose.eye[i] - b->pose.eye[i]) < CLOSE);
		assert_true(fabs(a->pose.target[i] - b->pose.target[i]) < CLOSE);
		assert_true(fabs(a->pose.up[i] - b->pose.up[i]) < CLOSE);
	}
}

static void wheel(float precise, Uint32 direction)
{
	const SDL_Event event = { .wheel = { .type = SDL_MOUSEWHEEL, .y = (Sint32)precise, .preciseY = precise,
		                                 .direction = direction } };

	input_event(&viewer, &event);
}

/* A touchpad sends many small steps, of which the whole number is 0. */
static void a_touchpads_small_steps_add_up_to_a_wheels(void **state)
{
	struct hand told = viewer.hand;
	const struct hand before = viewer.hand;

	(void)state;
	hand_zoom(&told, (struct hand_cursor){ 0.5 * SCALE, 0.5 * SCALE }, INFINITY, 1);
	for (int i = 0; i < 8; i++)
		wheel(0.125f, SDL_MOUSEWHEEL_NORMAL);
	assert_same_pose(&viewer.hand, &told);
	assert_true(distance(viewer.hand.pose.eye, viewer.hand.pivot) < distance(before.pose.eye, before.pivot));
	wheel(1, SDL_MOUSEWHEEL_FLIPPED); /* scrolls the other way on some desktops */
	assert_same_pose(&viewer.hand, &before);
}

static void pinch(float distance, float angle)
{
	const SDL_Event event = { .mgesture = { .type = SDL_MULTIGESTURE, .dDist = distance, .dTheta = angle, .x = 0.75f,
		                                    .y = 0.25f, .numFingers = 2 } };

	input_event(&viewer, &event);
}

static void two_fingers_zoom_about_their_middle(void **state)
{
	const struct hand_cursor at = { 0.75 * WIDTH, 0.25 * HEIGHT };
	const double before = distance(viewer.hand.pose.eye, viewer.hand.pivot);
	struct hand_cursor now;
	double point[3], depth;

	(void)state;
	assert_true(hand_project(&viewer.hand, viewer.hand.pivot, &now, &depth));
	hand_point(&viewer.hand, at, depth, point);
	pinch(0.1f, 0);
	assert_true(distance(viewer.hand.pose.eye, viewer.hand.pivot) < before);
	assert_true(hand_project(&viewer.hand, point, &now, NULL));
	assert_true(fabs(now.x - at.x) < 1e-6 && fabs(now.y - at.y) < 1e-6);
}

/* SDL's angles grow clockwise on a screen, whose y points down. The picture turns with the fingers: the camera against
 * them. */
static void two_fingers_turn_the_picture(void **state)
{
	struct hand told = viewer.hand;

	(void)state;
	hand_roll(&told, -90);
	for (int i = 0; i < 10; i++)
		pinch(0, (float)M_PI / 20);
	for (int i = 0; i < 3; i++) /* ten floats of pi/20 are off by less than 1e-6 of a turn */
		assert_true(fabs(viewer.hand.pose.up[i] - told.pose.up[i]) < 1e-5);
}

static void button(Uint32 type, int x, int y, Uint8 clicks)
{
	const SDL_Event event = { .button = { .type = type, .button = SDL_BUTTON_LEFT, .clicks = clicks, .x = x, .y = y } };

	input_event(&viewer, &event);
}

static void move(int x, int y)
{
	const SDL_Event event = { .motion = { .type = SDL_MOUSEMOTION, .x = x, .y = y } };

	input_event(&viewer, &event);
}

/* Half a turn is a picture's height, in pixels; events count points. */
static void a_drag_of_points_turns_by_their_pixels(void **state)
{
	struct hand told = viewer.hand;

	(void)state;
	hand_grab(&told, HAND_ORBIT, (struct hand_cursor){ 100.5 * SCALE, 80.5 * SCALE }, INFINITY, 1);
	hand_drag(&told, (struct hand_cursor){ 220.5 * SCALE, 50.5 * SCALE }, 2);
	button(SDL_MOUSEBUTTONDOWN, 100, 80, 1);
	move(220, 50);
	assert_same_pose(&viewer.hand, &told);
	button(SDL_MOUSEBUTTONUP, 220, 50, 1);
	assert_false(viewer.is_pressed);
}

/* A hand shakes by some points, however many pixels these are. */
static void three_points_are_still_a_click(void **state)
{
	const struct hand before = viewer.hand;

	(void)state;
	button(SDL_MOUSEBUTTONDOWN, 100, 80, 1);
	move(103, 80);
	assert_true(viewer.is_click);
	assert_same_pose(&viewer.hand, &before);
	move(104, 80);
	assert_false(viewer.is_click);
	button(SDL_MOUSEBUTTONUP, 104, 80, 1);
}

static void without_a_scene_nothing_moves(void **state)
{
	const struct hand before = viewer.hand;

	(void)state;
	viewer.has_hand = 0;
	wheel(1, SDL_MOUSEWHEEL_NORMAL);
	pinch(0.1f, 1);
	button(SDL_MOUSEBUTTONDOWN, 100, 80, 1);
	move(220, 50);
	assert_memory_equal(&viewer.hand, &before, sizeof before);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(a_touchpads_small_steps_add_up_to_a_wheels, set_up, tear_down),
		cmocka_unit_test_setup_teardown(two_fingers_zoom_about_their_middle, set_up, tear_down),
		cmocka_unit_test_setup_teardown(two_fingers_turn_the_picture, set_up, tear_down),
		cmocka_unit_test_setup_teardown(a_drag_of_points_turns_by_their_pixels, set_up, tear_down),
		cmocka_unit_test_setup_teardown(three_points_are_still_a_click, set_up, tear_down),
		cmocka_unit_test_setup_teardown(without_a_scene_nothing_moves, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

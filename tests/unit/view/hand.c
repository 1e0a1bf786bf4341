/* What the hand does to a camera: each claim for many random models, cameras and places of the cursor. */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <string.h>
#include "base/random.h"
#include "base/vec.h"
#include "client/view/hand.h"

#define N 500
#define SECOND UINT64_C(1000000000)
#define WIDTH 640
#define HEIGHT 480
/* Places are compared in pixels. A step rounds coordinates of up to 100 with 2^-53 of them, a pixel is above 1e-6 of a
 * world unit here, and an operation takes some dozens of roundings. */
#define CLOSE 1e-5

static uint64_t state;

static double within(double low, double high)
{
	return random_in(&state, low, high);
}

static struct hand_cursor somewhere(void)
{
	return (struct hand_cursor){ within(0, WIDTH), within(0, HEIGHT) };
}

/* A hand on a model of any size, place and way up, that looks from anywhere. */
static void random_hand(struct hand *hand, double fov)
{
	double box_min[3], box_max[3], up[3];

	for (int i = 0; i < 3; i++) {
		const double middle = within(-50, 50), half = pow(10, within(-2, 1));

		box_min[i] = middle - half;
		box_max[i] = middle + half;
	}
	do
		for (int i = 0; i < 3; i++)
			up[i] = within(-1, 1);
	while (v3d_length(up) < 0.1);
	assert_int_equal(hand_init(hand, box_min, box_max, up, fov, NULL), PSR_OK);
	hand_set_size(hand, WIDTH, HEIGHT);
	hand_look_from(hand, within(0, 360), within(-80, 80));
}

/* A depth at which something of the model may be. */
static double some_depth(const struct hand *hand)
{
	double depth;
	struct hand_cursor at;

	assert_true(hand_project(hand, hand->pivot, &at, &depth));
	return depth * within(0.7, 1.5);
}

static void assert_at(const struct hand *hand, const double point[3], struct hand_cursor at)
{
	struct hand_cursor is;

	assert_true(hand_project(hand, point, &is, NULL));
	assert_true(fabs(is.x - at.x) < CLOSE && fabs(is.y - at.y) < CLOSE);
}

static void arm_of(double arm[3], const struct hand *hand)
{
	v3d_sub(arm, hand->camera.target, hand->camera.eye);
	v3d_normalize(arm, arm);
}

/* How far the model's way up leans to the right in the picture, as a sine. */
static double lean(const struct hand *hand)
{
	double forward[3], right[3];

	arm_of(forward, hand);
	v3d_cross(right, forward, hand->camera.up);
	v3d_normalize(right, right);
	return v3d_dot(right, hand->up);
}

static void drag(struct hand *hand, enum hand_grip grip, struct hand_cursor from, struct hand_cursor to, double depth)
{
	hand_grab(hand, grip, from, depth, SECOND);
	for (int k = 1; k <= 11; k++)
		hand_drag(hand, (struct hand_cursor){ from.x + (to.x - from.x) * k / 11, from.y + (to.y - from.y) * k / 11 },
		          SECOND + (uint64_t)k * SECOND / 110);
}

static void orbit_keeps_the_way_up_and_the_pivot(void **unused)
{
	(void)unused;
	state = 1;
	for (int n = 0; n < N; n++) {
		struct hand hand;
		struct hand_cursor pivot;
		double before[3], after[3];

		random_hand(&hand, n % 4 == 0 ? 0 : within(5, 120));
		hand_set_pivot(&hand, somewhere(), some_depth(&hand));
		assert_true(hand_project(&hand, hand.pivot, &pivot, NULL));
		v3d_sub(before, hand.camera.eye, hand.pivot);
		drag(&hand, HAND_ORBIT, somewhere(), somewhere(), INFINITY);
		v3d_sub(after, hand.camera.eye, hand.pivot);
		assert_true(fabs(lean(&hand)) < 1e-9);
		assert_true(fabs(v3d_length(after) / v3d_length(before) - 1) < 1e-9);
		assert_at(&hand, hand.pivot, pivot);
	}
}

static void orbit_stops_straight_above_and_comes_back(void **unused)
{
	struct hand hand;
	double forward[3];

	(void)unused;
	state = 2;
	random_hand(&hand, 35);
	hand_look_from(&hand, 30, 20);
	drag(&hand, HAND_ORBIT, (struct hand_cursor){ 300, 0 }, (struct hand_cursor){ 300, 2000 }, INFINITY);
	arm_of(forward, &hand);
	assert_true(v3d_dot(forward, hand.up) < -1 + 1e-9);
	drag(&hand, HAND_ORBIT, (struct hand_cursor){ 300, 480 }, (struct hand_cursor){ 300, 240 }, INFINITY);
	arm_of(forward, &hand);
	assert_true(fabs(v3d_dot(forward, hand.up)) < 1e-9); /* half a height is a quarter of a turn: level */
	assert_true(fabs(lean(&hand)) < 1e-9);
}

static void a_drag_to_the_right_turns_the_model_to_the_right(void **unused)
{
	struct hand hand;
	struct hand_cursor was, is;
	double point[3];

	(void)unused;
	state = 3;
	for (int n = 0; n < N; n++) {
		random_hand(&hand, 35);
		hand_point(&hand, (struct hand_cursor){ WIDTH / 2.0, HEIGHT / 2.0 }, 0.9 * some_depth(&hand) / 1.5, point);
		assert_true(hand_project(&hand, point, &was, NULL));
		drag(&hand, n % 2 ? HAND_ORBIT : HAND_TRACKBALL, (struct hand_cursor){ 300, 200 },
		     (struct hand_cursor){ 310, 200 }, INFINITY);
		assert_true(hand_project(&hand, point, &is, NULL)); /* it is nearer than the pivot, and so goes with the hand */
		assert_true(is.x > was.x);
	}
}

static void pan_moves_the_point_below_the_cursor_with_it(void **unused)
{
	(void)unused;
	state = 4;
	for (int n = 0; n < N; n++) {
		struct hand hand;
		struct hand_cursor from = somewhere(), to = somewhere();
		double point[3], depth, forward[3], after[3];

		random_hand(&hand, n % 4 == 0 ? 0 : within(5, 120));
		depth = some_depth(&hand);
		hand_point(&hand, from, depth, point);
		arm_of(forward, &hand);
		drag(&hand, HAND_PAN, from, to, depth);
		arm_of(after, &hand);
		assert_at(&hand, point, to);
		assert_true(v3d_dot(forward, after) > 1 - 1e-12);
	}
}

static void zoom_keeps_the_point_below_the_cursor(void **unused)
{
	(void)unused;
	state = 5;
	for (int n = 0; n < N; n++) {
		const double steps = within(-16, 16);
		struct hand hand;
		struct hand_cursor at = somewhere(), beside = at, is;
		double point[3], other[3], depth, pixels;

		random_hand(&hand, n % 4 == 0 ? 0 : within(5, 120));
		depth = some_depth(&hand);
		beside.x += 10;
		hand_point(&hand, at, depth, point);
		hand_point(&hand, beside, depth, other);
		hand_zoom(&hand, at, depth, steps);
		assert_at(&hand, point, at);
		assert_true(hand_project(&hand, other, &is, NULL));
		pixels = is.x - at.x;
		assert_true(fabs(pixels / (10 * exp2(steps / 8)) - 1) < 1e-6);
	}
}

static void look_and_roll_keep_the_eye(void **unused)
{
	(void)unused;
	state = 6;
	for (int n = 0; n < N; n++) {
		struct hand hand;
		double eye[3], moved[3];

		random_hand(&hand, within(5, 120));
		memcpy(eye, hand.camera.eye, sizeof eye);
		drag(&hand, HAND_LOOK, somewhere(), somewhere(), INFINITY);
		assert_true(fabs(lean(&hand)) < 1e-9);
		hand_roll(&hand, 30);
		v3d_sub(moved, hand.camera.eye, eye);
		assert_true(v3d_length(moved) < 1e-10);
	}
}

static void roll_turns_the_camera_clockwise(void **unused)
{
	struct hand hand;

	(void)unused;
	state = 7;
	random_hand(&hand, 35);
	hand_look_from(&hand, 10, 0);
	hand_roll(&hand, 30);
	assert_true(fabs(lean(&hand) + 0.5) < 1e-9); /* the model leans to the left by 30 degrees */
	hand_look_from(&hand, 10, 0);
	/* The hand goes from above the middle to its right: the picture turns clockwise by a quarter. */
	drag(&hand, HAND_ROLL, (struct hand_cursor){ 320, 100 }, (struct hand_cursor){ 460, 240 }, INFINITY);
	assert_true(fabs(lean(&hand) - 1) < 1e-9);
}

static void six_sides_and_home(void **unused)
{
	static const double sides[6][2] = { { 0, 0 }, { 90, 0 }, { 180, 0 }, { 270, 0 }, { 0, 90 }, { 0, -90 } };
	static const double box_min[3] = { -1, -2, -3 }, box_max[3] = { 3, 2, 1 }, up[3] = { 0, 2, 0 };
	static const double from[6][3] = { { 0, 0, 1 }, { 1, 0, 0 }, { 0, 0, -1 }, { -1, 0, 0 }, { 0, 1, 0 }, { 0, -1, 0 } };
	struct psr_camera home;
	struct hand hand;

	(void)unused;
	state = 8;
	assert_int_equal(hand_init(&hand, box_min, box_max, up, 35, NULL), PSR_OK);
	hand_set_size(&hand, WIDTH, HEIGHT);
	hand_home(&hand);
	home = hand.camera;
	for (int k = 0; k < 6; k++) {
		double forward[3];

		drag(&hand, HAND_TRACKBALL, somewhere(), somewhere(), INFINITY);
		hand_look_from(&hand, sides[k][0], sides[k][1]);
		arm_of(forward, &hand);
		assert_true(v3d_dot(forward, from[k]) < -1 + 1e-12);
		for (int corner = 0; corner < 8; corner++) { /* all of it is in the picture */
			const double point[3] = { corner & 1 ? 3 : -1, corner & 2 ? 2 : -2, corner & 4 ? 1 : -3 };
			struct hand_cursor at;

			assert_true(hand_project(&hand, point, &at, NULL));
			assert_true(at.x > 0 && at.x < WIDTH && at.y > 0 && at.y < HEIGHT);
		}
	}
	hand_home(&hand);
	assert_memory_equal(&home, &hand.camera, sizeof home);
}

static void inertia_decays_and_can_be_off(void **unused)
{
	(void)unused;
	state = 9;
	for (int is_on = 0; is_on < 2; is_on++) {
		uint64_t now = SECOND + SECOND / 10;
		struct hand hand, coarse;
		double last = INFINITY;
		int n = 0;

		random_hand(&hand, 35);
		hand.has_inertia = is_on;
		drag(&hand, HAND_ORBIT, (struct hand_cursor){ 300, 240 }, (struct hand_cursor){ 400, 240 }, INFINITY);
		hand_release(&hand, now);
		coarse = hand;
		assert_int_equal(hand_is_moving(&hand), is_on);
		while (hand_is_moving(&hand) && n < 1000) {
			double before[3], after[3], way[3];

			memcpy(before, hand.camera.eye, sizeof before);
			assert_int_equal(hand_tick(&hand, now += SECOND / 60), 1);
			memcpy(after, hand.camera.eye, sizeof after);
			v3d_sub(way, after, before);
			assert_true(v3d_length(way) < last);
			last = v3d_length(way);
			n++;
		}
		assert_int_equal(hand_tick(&hand, now + SECOND), 0);
		if (is_on) { /* one long step goes as far as many short ones, but for what is too slow to be seen */
			struct hand_cursor a, b;

			assert_true(n > 20 && n < 240);
			hand_tick(&coarse, now);
			assert_true(hand_project(&hand, hand.box_max, &a, NULL) && hand_project(&coarse, hand.box_max, &b, NULL));
			assert_true(hypot(a.x - b.x, a.y - b.y) < 1e-3);
		} else {
			assert_int_equal(n, 0);
		}
	}
}

static void a_hand_that_stands_still_lets_go_without_inertia(void **unused)
{
	struct hand hand;

	(void)unused;
	state = 10;
	random_hand(&hand, 35);
	drag(&hand, HAND_PAN, (struct hand_cursor){ 300, 240 }, (struct hand_cursor){ 400, 240 }, INFINITY);
	hand_release(&hand, SECOND + SECOND / 10 + SECOND / 5);
	assert_int_equal(hand_is_moving(&hand), 0);
}

static void a_hand_that_only_holds_is_at_rest(void **unused)
{
	const struct hand_cursor at = { 300, 240 };
	struct hand hand, before;

	(void)unused;
	state = 12;
	random_hand(&hand, 35);
	drag(&hand, HAND_ORBIT, at, (struct hand_cursor){ 400, 240 }, INFINITY);
	assert_true(hand_is_moving(&hand));
	hand_release(&hand, SECOND + SECOND / 10);
	assert_true(hand_is_moving(&hand));
	before = hand;
	hand_grab(&hand, HAND_ORBIT, at, INFINITY, 2 * SECOND); /* catches what glides */
	assert_false(hand_is_moving(&hand));
	assert_int_equal(hand_tick(&hand, 3 * SECOND), 0);
	assert_memory_equal(&hand.pose, &before.pose, sizeof hand.pose);
	hand_drag(&hand, at, 3 * SECOND);
	assert_true(hand_is_moving(&hand));
	hand_release(&hand, 4 * SECOND);
	assert_false(hand_is_moving(&hand));
}

static void flight_crosses_the_box_in_four_seconds(void **unused)
{
	static const double forwards[3] = { 0, 0, 1 }, rest[3] = { 0, 0, 0 };
	double before[3], way[3], sides[3], forward[3];
	uint64_t now = SECOND;
	struct hand hand;

	(void)unused;
	state = 11;
	random_hand(&hand, 35);
	memcpy(before, hand.camera.eye, sizeof before);
	arm_of(forward, &hand);
	hand_tick(&hand, now);
	now += 10 * SECOND; /* a pause before it begins flies nowhere */
	hand_fly(&hand, forwards);
	assert_true(hand_is_moving(&hand));
	hand_tick(&hand, now);
	for (int k = 0; k < 240; k++)
		assert_int_equal(hand_tick(&hand, now += SECOND / 60), 1);
	v3d_sub(way, hand.camera.eye, before);
	v3d_sub(sides, hand.box_max, hand.box_min);
	assert_true(fabs(v3d_dot(way, forward) / v3d_length(sides) - 1) < 1e-6);
	hand_fly(&hand, rest);
	assert_int_equal(hand_tick(&hand, now + SECOND), 0);
}

static void the_pivot_comes_from_the_depth_below_the_cursor(void **unused)
{
	(void)unused;
	state = 12;
	for (int n = 0; n < N; n++) {
		const struct hand_cursor at = somewhere();
		struct hand hand;
		double depth, is, before[3];

		random_hand(&hand, within(5, 120));
		memcpy(before, hand.pivot, sizeof before);
		hand_set_pivot(&hand, at, INFINITY);
		hand_set_pivot(&hand, at, NAN);
		assert_memory_equal(before, hand.pivot, sizeof before);
		depth = some_depth(&hand);
		hand_set_pivot(&hand, at, depth);
		assert_at(&hand, hand.pivot, at);
		assert_true(hand_project(&hand, hand.pivot, &(struct hand_cursor){ 0 }, &is));
		assert_true(fabs(is / depth - 1) < 1e-9);
	}
}

static void ortho_and_back_keeps_the_pivots_plane(void **unused)
{
	(void)unused;
	state = 13;
	for (int n = 0; n < N; n++) {
		const struct hand_cursor at = somewhere();
		struct hand hand;
		double depth, point[3];

		random_hand(&hand, within(5, 120));
		assert_true(hand_project(&hand, hand.pivot, &(struct hand_cursor){ 0 }, &depth));
		hand_point(&hand, at, depth, point);
		hand_toggle_ortho(&hand);
		assert_int_equal(hand.camera.kind, PSR_CAMERA_ORTHOGRAPHIC);
		assert_at(&hand, point, at);
		hand_toggle_ortho(&hand);
		assert_int_equal(hand.camera.kind, PSR_CAMERA_PERSPECTIVE);
		assert_at(&hand, point, at);
	}
}

static void a_pose_makes_the_same_camera_again(void **unused)
{
	(void)unused;
	state = 14;
	for (int n = 0; n < N; n++) {
		struct hand hand, other;

		random_hand(&hand, n % 4 == 0 ? 0 : within(5, 120));
		other = hand;
		drag(&hand, HAND_TRACKBALL, somewhere(), somewhere(), INFINITY);
		drag(&hand, HAND_PAN, somewhere(), somewhere(), INFINITY);
		hand_set_pose(&other, &hand.pose);
		assert_memory_equal(&hand.camera, &other.camera, sizeof hand.camera);
	}
}

static void no_hand_makes_a_bad_camera(void **unused)
{
	struct hand hand;

	(void)unused;
	state = 15;
	random_hand(&hand, 35);
	for (int n = 0; n < 100 * N; n++) {
		const struct hand_cursor from = { within(-1e4, 1e4), within(-1e4, 1e4) }, to = somewhere();
		const double depth = n % 3 == 0 ? INFINITY : pow(10, within(-20, 20));

		if (n % 5 == 0)
			hand_zoom(&hand, from, depth, within(-100, 100));
		else if (n % 17 == 0)
			hand_toggle_ortho(&hand);
		else if (n % 1001 == 0)
			hand_home(&hand);
		else
			drag(&hand, (enum hand_grip)(1 + n % 5), from, to, depth);
		for (int i = 0; i < 3; i++)
			assert_true(fabs(hand.camera.eye[i]) < 1e30 && fabs(hand.camera.target[i]) < 1e30
			            && fabs(hand.camera.up[i]) <= 1.0000001);
		assert_true(hand.pose.fov > 0 ? hand.camera.near_z > 0 : hand.camera.ortho_height > 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(orbit_keeps_the_way_up_and_the_pivot),
		cmocka_unit_test(orbit_stops_straight_above_and_comes_back),
		cmocka_unit_test(a_drag_to_the_right_turns_the_model_to_the_right),
		cmocka_unit_test(pan_moves_the_point_below_the_cursor_with_it),
		cmocka_unit_test(zoom_keeps_the_point_below_the_cursor),
		cmocka_unit_test(look_and_roll_keep_the_eye),
		cmocka_unit_test(roll_turns_the_camera_clockwise),
		cmocka_unit_test(six_sides_and_home),
		cmocka_unit_test(inertia_decays_and_can_be_off),
		cmocka_unit_test(a_hand_that_stands_still_lets_go_without_inertia),
		cmocka_unit_test(a_hand_that_only_holds_is_at_rest),
		cmocka_unit_test(flight_crosses_the_box_in_four_seconds),
		cmocka_unit_test(the_pivot_comes_from_the_depth_below_the_cursor),
		cmocka_unit_test(ortho_and_back_keeps_the_pivots_plane),
		cmocka_unit_test(a_pose_makes_the_same_camera_again),
		cmocka_unit_test(no_hand_makes_a_bad_camera),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}

/* What takes time: drags, inertia, flight. */
#include "hand_pose.h"
#include <math.h>
#include <string.h>
#include "base/vec.h"

#define GLIDE_SECONDS 0.3   /* in which inertia loses all but 1 / e of its speed */
#define SLOWEST 4           /* pixels a second: below, inertia ends */
#define STILL_NS 60000000   /* a cursor that stood still for so long before it lets go has no speed */
#define FLIGHT_SECONDS 4    /* through the box */
#define LONGEST_STEP 0.1    /* seconds of flight at once, after a pause of the program */

static void trackball(struct hand *hand, double dx, double dy)
{
	const double length = hypot(dx, dy);
	struct hand_frame frame;
	double axis[3];

	if (!(length > 0))
		return;
	hand_frame_of(&frame, &hand->pose);
	v3d_scale(axis, frame.up, -dx / length);
	v3d_add_scaled(axis, axis, -dy / length, frame.right);
	hand_turn_about(hand, hand->pivot, axis, PI * length / hand->height);
}

static void pan_to(struct hand *hand, struct hand_cursor at)
{
	struct hand_cursor now;
	double depth, by[3], pixel;
	struct hand_frame frame;

	if (!hand_project(hand, hand->held, &now, &depth))
		return;
	pixel = hand_pixel_at(hand, depth);
	hand_frame_of(&frame, &hand->pose);
	v3d_scale(by, frame.right, (now.x - at.x) * pixel);
	v3d_add_scaled(by, by, (at.y - now.y) * pixel, frame.up);
	hand_move(hand, by);
}

static void roll_to(struct hand *hand, struct hand_cursor from, struct hand_cursor to)
{
	const double x = hand->width / 2.0, y = hand->height / 2.0;
	double angle = atan2(to.y - y, to.x - x) - atan2(from.y - y, from.x - x);

	if (angle > PI)
		angle -= 2 * PI;
	else if (angle < -PI)
		angle += 2 * PI;
	hand_roll(hand, -angle / PSR_DEGREE);
}

static void drag(struct hand *hand, enum hand_grip grip, struct hand_cursor to)
{
	const double dx = to.x - hand->at.x, dy = to.y - hand->at.y, angle = PI / hand->height;
	const double look = hand->pose.fov > 0 ? hand->pose.fov * PSR_DEGREE / hand->height : angle / 4;

	if (grip == HAND_ORBIT)
		hand_orbit(hand, hand->pivot, -dx * angle, dy * angle);
	else if (grip == HAND_TRACKBALL)
		trackball(hand, dx, dy);
	else if (grip == HAND_PAN)
		pan_to(hand, to);
	else if (grip == HAND_ROLL)
		roll_to(hand, hand->at, to);
	else if (grip == HAND_LOOK)
		hand_orbit(hand, hand->pose.eye, dx * look, -dy * look);
	hand->at = to;
}

/* ---- dragging ---- */

void hand_stop(struct hand *hand)
{
	hand->grip = hand->glide = HAND_NONE;
	memset(hand->fly, 0, sizeof hand->fly);
}

void hand_grab(struct hand *hand, enum hand_grip grip, struct hand_cursor at, double depth, uint64_t now_ns)
{
	hand->glide = HAND_NONE;
	hand->grip = grip;
	hand->has_dragged = 0;
	hand->at = at;
	hand->speed = (struct hand_cursor){ 0, 0 };
	hand->moved_ns = now_ns;
	hand_point(hand, at, depth, hand->held);
}

/* The speed is a mean of the last drags, of which late ones weigh more. */
void hand_drag(struct hand *hand, struct hand_cursor at, uint64_t now_ns)
{
	const double seconds = (double)(now_ns - hand->moved_ns) * 1e-9;

	if (hand->grip == HAND_NONE)
		return;
	if (seconds > 0) {
		const double part = 1 - exp(-seconds / 0.03);

		hand->speed.x += part * ((at.x - hand->at.x) / seconds - hand->speed.x);
		hand->speed.y += part * ((at.y - hand->at.y) / seconds - hand->speed.y);
	}
	hand->moved_ns = now_ns;
	hand->has_dragged = 1;
	drag(hand, hand->grip, at);
}

void hand_release(struct hand *hand, uint64_t now_ns)
{
	const double speed = hypot(hand->speed.x, hand->speed.y);

	if (hand->grip != HAND_ROLL && hand->has_inertia && now_ns - hand->moved_ns < STILL_NS && speed > SLOWEST) {
		hand->glide = hand->grip;
		hand->moved_ns = now_ns;
	}
	hand->grip = HAND_NONE;
}

/* Speed falls as exp(-t / GLIDE_SECONDS), so a step covers the same way however it is divided. */
static int glide(struct hand *hand, uint64_t now_ns)
{
	const double rest = exp(-(double)(now_ns - hand->moved_ns) * 1e-9 / GLIDE_SECONDS);
	const struct hand_cursor to = { hand->at.x + hand->speed.x * GLIDE_SECONDS * (1 - rest),
		                            hand->at.y + hand->speed.y * GLIDE_SECONDS * (1 - rest) };

	if (hand->glide == HAND_NONE || now_ns <= hand->moved_ns)
		return 0;
	drag(hand, hand->glide, to);
	hand->moved_ns = now_ns;
	hand->speed.x *= rest;
	hand->speed.y *= rest;
	if (!hand->has_inertia || hypot(hand->speed.x, hand->speed.y) < SLOWEST)
		hand->glide = HAND_NONE;
	return 1;
}

/* ---- with the time ---- */

static int is_flying(const struct hand *hand)
{
	return hand->fly[0] != 0 || hand->fly[1] != 0 || hand->fly[2] != 0;
}

void hand_fly(struct hand *hand, const double direction[3])
{
	if (!is_flying(hand))
		hand->flown_ns = 0;
	memcpy(hand->fly, direction, sizeof hand->fly);
}

/* Where parallel lines stay so, forwards is larger. */
static int fly(struct hand *hand, uint64_t now_ns)
{
	const double since = hand->flown_ns != 0 ? (double)(now_ns - hand->flown_ns) * 1e-9 : 0;
	const double seconds = fmin(since, LONGEST_STEP);
	const double way = seconds * hand_box_size(hand) / FLIGHT_SECONDS;
	struct hand_frame frame;
	double by[3];

	hand->flown_ns = now_ns;
	if (!is_flying(hand))
		return 0;
	hand_frame_of(&frame, &hand->pose);
	v3d_scale(by, frame.right, way * hand->fly[0]);
	v3d_add_scaled(by, by, way * hand->fly[1], frame.up);
	if (hand->pose.fov > 0) {
		v3d_add_scaled(by, by, way * hand->fly[2], frame.forward);
		hand_move(hand, by);
	} else {
		struct hand_pose pose = hand->pose;

		hand_move(hand, by);
		pose = hand->pose;
		pose.ortho_height *= exp(-seconds * hand->fly[2]);
		hand_take(hand, &pose, NULL);
	}
	return 1;
}

int hand_tick(struct hand *hand, uint64_t now_ns)
{
	const int has_flown = fly(hand, now_ns), has_glided = glide(hand, now_ns);

	return has_flown || has_glided;
}

int hand_is_moving(const struct hand *hand)
{
	return (hand->grip != HAND_NONE && hand->has_dragged) || hand->glide != HAND_NONE || is_flying(hand);
}
